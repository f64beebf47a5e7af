//! For all calls of a batch and all numbers: nothing panics, states after a step are finite, snapshots are exact, and
//! the lane width does not change a bit.

#![no_main]

use libfuzzer_sys::arbitrary::{self, Arbitrary};
use libfuzzer_sys::fuzz_target;
use marathon_physics::{Batch, BatchOptions, Isa, Model, SimOptions, Snapshot, Variation};
use std::sync::OnceLock;

/// Name, text, and whether only the ground collides.
const MODELS: [(&str, &str, bool); 6] = [
    ("arm", include_str!("../../crates/physics/tests/models/arm.xml"), true),
    ("tumbler", include_str!("../../crates/physics/tests/models/tumbler.xml"), true),
    ("hopper", include_str!("../../assets/agents/hopper.xml"), true),
    ("ant", include_str!("../../assets/agents/ant.xml"), true),
    ("pile", include_str!("../models/pile.xml"), false),
    ("terrain", include_str!("../../crates/physics/tests/models/full/terrain.xml"), false),
];

const MOST_AGENTS: u8 = 20;
const MOST_OPERATIONS: usize = 24;
const MOST_SUBSTEPS: u8 = 5;

/// A number as users get them wrong.
#[derive(Arbitrary, Clone, Copy, Debug)]
enum Number {
    /// Thousandths.
    Usual(i16),
    Special(Special),
    Bits(u64),
}

#[derive(Arbitrary, Clone, Copy, Debug)]
enum Special {
    NotANumber,
    Infinite,
    MinusInfinite,
    LargestSingle,
    LargestDouble,
    Huge,
    Tiny,
    MinusZero,
}

impl Number {
    fn value(self) -> f64 {
        match self {
            Number::Usual(x) => f64::from(x) * 1e-3,
            Number::Bits(bits) => f64::from_bits(bits),
            Number::Special(s) => match s {
                Special::NotANumber => f64::NAN,
                Special::Infinite => f64::INFINITY,
                Special::MinusInfinite => f64::NEG_INFINITY,
                Special::LargestSingle => f64::from(f32::MAX),
                Special::LargestDouble => f64::MAX,
                Special::Huge => 1e18,
                Special::Tiny => 1e-310,
                Special::MinusZero => -0.0,
            },
        }
    }
}

#[derive(Arbitrary, Debug)]
enum Operation {
    Step {
        ctrl: Vec<Number>,
        substeps: u8,
    },
    Reset {
        agent: u8,
        qpos: Vec<Number>,
        qvel: Vec<Number>,
    },
    ResetHome {
        agent: u8,
    },
    SetHome {
        qpos: Vec<i16>,
    },
    Save,
    Restore,
    /// Step, go back, step again.
    Replay {
        ctrl: Vec<Number>,
        substeps: u8,
    },
    Bodies {
        agent: u8,
    },
    Sensors {
        agent: u8,
    },
    Push {
        agent: u8,
        body: u8,
        wrench: [Number; 6],
    },
    Vary {
        agent: u8,
        mass: Vec<Number>,
        friction: Number,
        strength: Vec<Number>,
        gravity: [Number; 3],
    },
    SetGround {
        agent: u8,
        elevations: Vec<Number>,
    },
}

#[derive(Arbitrary, Debug)]
struct Script {
    model: u8,
    agents: u8,
    threads: u8,
    double: bool,
    operations: Vec<Operation>,
}

fn models() -> &'static [Model] {
    static MODELS_READ: OnceLock<Vec<Model>> = OnceLock::new();
    MODELS_READ.get_or_init(|| {
        let read = |(name, text, _): &(&str, &str, bool)| Model::from_xml_str(text, name).expect("a model of ours");
        MODELS.iter().map(read).collect()
    })
}

/// `n` numbers: those of the input, then `rest`.
fn fill(numbers: &[Number], rest: &[f64]) -> Vec<f64> {
    rest.iter().enumerate().map(|(i, x)| numbers.get(i).map_or(*x, |n| n.value())).collect()
}

/// Steps, and checks what must hold after any step.
fn step(batch: &mut Batch, ctrl: &[f64], substeps: usize) {
    let before = batch.quarantined();
    let broken = batch.step(ctrl, substeps);
    assert_eq!(batch.quarantined(), before + broken.len() as u64, "each broken agent is counted once");
    for agent in 0..batch.agents() {
        let finite = batch.qpos(agent).iter().chain(&batch.qvel(agent)).all(|x| x.is_finite());
        assert!(finite, "agent {agent} is finite after a step");
    }
    for agent in broken {
        assert!(agent < batch.agents(), "broken agents exist");
        assert!(batch.qvel(agent).iter().all(|x| *x == 0.0), "a broken agent is at rest");
    }
}

/// NaN is not equal to itself: such snapshots cannot be compared.
fn same(a: &Snapshot, b: &Snapshot) -> bool {
    a == b || a != &a.clone()
}

fuzz_target!(|script: Script| {
    let which = usize::from(script.model) % MODELS.len();
    let model = &models()[which];
    let agents = usize::from(script.agents % MOST_AGENTS) + 1;
    let sim = SimOptions { ground_contacts_only: MODELS[which].2, ..Default::default() };
    let isa = if script.double { Isa::F64 } else { Isa::best() };
    let twin_isa = if script.double { Isa::F64 } else { Isa::F32 };
    let threads = usize::from(script.threads % 3) + 1;
    let options = BatchOptions { agents, threads, isa, sim: sim.clone(), ..Default::default() };
    let mut batch = Batch::new(model, &options).expect("supported");
    // the same agents, one per group, on one thread
    let mut twin = Batch::new(model, &BatchOptions { agents, threads: 1, isa: twin_isa, sim, ..Default::default() })
        .expect("supported");
    let mut saved = batch.snapshot();

    for operation in script.operations.iter().take(MOST_OPERATIONS) {
        let controls = |ctrl: &[Number]| -> Vec<f64> {
            (0..agents * model.nu).map(|i| if ctrl.is_empty() { 0.0 } else { ctrl[i % ctrl.len()].value() }).collect()
        };
        match operation {
            Operation::Step { ctrl, substeps } => {
                let (ctrl, n) = (controls(ctrl), usize::from(substeps % MOST_SUBSTEPS));
                step(&mut batch, &ctrl, n);
                step(&mut twin, &ctrl, n);
            }
            Operation::Replay { ctrl, substeps } => {
                let (ctrl, n) = (controls(ctrl), usize::from(substeps % MOST_SUBSTEPS));
                let start = batch.snapshot();
                step(&mut batch, &ctrl, n);
                step(&mut twin, &ctrl, n);
                let end = batch.snapshot();
                batch.restore(&start);
                assert!(same(&start, &batch.snapshot()), "a restored snapshot is itself");
                step(&mut batch, &ctrl, n);
                assert!(same(&end, &batch.snapshot()), "the same start has the same end");
            }
            Operation::Reset { agent, qpos, qvel } => {
                let agent = usize::from(*agent) % agents;
                let (qpos, qvel) = (fill(qpos, &model.qpos0), fill(qvel, &vec![0.0; model.nv]));
                batch.reset(agent, &qpos, &qvel);
                twin.reset(agent, &qpos, &qvel);
            }
            Operation::ResetHome { agent } => {
                let agent = usize::from(*agent) % agents;
                batch.reset(agent, &model.qpos0, &vec![0.0; model.nv]);
                twin.reset(agent, &model.qpos0, &vec![0.0; model.nv]);
            }
            Operation::SetHome { qpos } => {
                let numbers: Vec<Number> = qpos.iter().map(|x| Number::Usual(*x)).collect();
                let qpos = fill(&numbers, &model.qpos0);
                batch.set_home(&qpos);
                twin.set_home(&qpos);
            }
            Operation::Save => saved = batch.snapshot(),
            Operation::Restore => {
                batch.restore(&saved);
                twin.restore(&saved);
            }
            Operation::Bodies { agent } => {
                let _ = batch.bodies(usize::from(*agent) % agents);
            }
            Operation::Sensors { agent } => {
                let agent = usize::from(*agent) % agents;
                let values: usize = model.sensors.iter().map(|s| s.dim).sum();
                assert_eq!(batch.sensors(agent).len(), values, "one number per component");
            }
            Operation::Push { agent, body, wrench } => {
                let (agent, body) = (usize::from(*agent) % agents, usize::from(*body) % model.bodies.len());
                let [fx, fy, fz, tx, ty, tz] = wrench.map(Number::value);
                batch.push(agent, body, [fx, fy, fz], [tx, ty, tz]);
                twin.push(agent, body, [fx, fy, fz], [tx, ty, tz]);
            }
            Operation::Vary { agent, mass, friction, strength, gravity } => {
                let own = Variation {
                    mass: fill(mass, &vec![1.0; model.bodies.len()]),
                    friction: friction.value(),
                    strength: fill(strength, &vec![1.0; model.nu]),
                    gravity: gravity.map(Number::value),
                };
                let agent = usize::from(*agent) % agents;
                batch.vary(agent, &own);
                twin.vary(agent, &own);
            }
            Operation::SetGround { agent, elevations } => {
                let agent = usize::from(*agent) % agents;
                if let Some(field) = model.hfields.first() {
                    let rest = vec![0.0; field.nrow * field.ncol];
                    let ground: Vec<f32> = fill(elevations, &rest).into_iter().map(|x| x as f32).collect();
                    batch.set_ground(agent, 0, &ground);
                    twin.set_ground(agent, 0, &ground);
                }
            }
        }
        assert!(same(&batch.snapshot(), &twin.snapshot()), "lane width and threads do not change a bit");
    }
});
