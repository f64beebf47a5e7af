//! Promise: within a call of `Batch::step`, data from the previous evaluation of the forces (pairs that are too far
//! apart to touch, pushing rows) saves work and changes nothing. Agents end where they end when every step is a
//! separate call, which starts without that data. Contacts agree exactly. States have the same bits in all but a few
//! calls, in which the solver takes another path to the same forces, up to rounding.

mod common;

use marathon_physics::workload::Uniform;
use marathon_physics::{Batch, BatchOptions, Isa, Model};

const AGENTS: usize = 16;
/// Steps in a call.
const STEPS: usize = 5;
/// Calls: a second of falling and thrashing.
const CALLS: usize = 60;
/// Largest difference that rounding causes in a call: of velocities in contact, m/s and rad/s.
const ROUNDING: f64 = 2e-3;

/// Largest difference between the states of two batches.
fn difference(a: &Batch, b: &Batch) -> f64 {
    let mut most = 0.0f64;
    for agent in 0..AGENTS {
        let of = |batch: &Batch| [batch.qpos(agent), batch.qvel(agent)].concat();
        for (x, y) in of(a).iter().zip(of(b)) {
            most = most.max((x - y).abs());
        }
    }
    most
}

/// Runs a model both ways from the same states.
fn compare(model: &Model, name: &str, isa: Isa) {
    let batch = || Batch::new(model, &BatchOptions { agents: AGENTS, isa, ..Default::default() }).expect("supported");
    let (mut at_once, mut singly) = (batch(), batch());
    let mut random = Uniform(3);
    for agent in 0..AGENTS {
        let qpos: Vec<f64> = model.qpos0.iter().map(|q| q + 0.1 * random.next()).collect();
        let qvel: Vec<f64> = (0..model.nv).map(|_| random.next()).collect();
        at_once.reset(agent, &qpos, &qvel);
    }
    let mut same = 0;
    for call in 0..CALLS {
        let ctrl: Vec<f64> = (0..AGENTS * model.nu).map(|_| random.next()).collect();
        singly.restore(&at_once.snapshot());
        let contacts = |batches: [&Batch; 2]| batches.map(|b| b.stats().contacts);
        let before = contacts([&at_once, &singly]);
        at_once.step(&ctrl, STEPS);
        for _ in 0..STEPS {
            singly.step(&ctrl, 1);
        }
        let after = contacts([&at_once, &singly]);
        let off = difference(&at_once, &singly);
        assert!(off < ROUNDING, "{name} on {isa:?}: call {call} ends {off} apart");
        if off == 0.0 {
            same += 1;
            let [found, expected] = [after[0] - before[0], after[1] - before[1]];
            assert_eq!(found, expected, "{name} on {isa:?}: contacts in call {call}");
        }
    }
    assert!(same * 10 >= CALLS * 9, "{name} on {isa:?}: only {same} of {CALLS} calls end with the same bits");
    let stats = [at_once.stats(), singly.stats()];
    assert!(stats[0].contacts > 0, "{name} on {isa:?}: nothing touched anything");
    assert!(stats[0].newton < stats[1].newton, "{name} on {isa:?}: nothing was gained");
}

fn every_width(file: &str) {
    let model = Model::from_xml_file(common::workspace().join("assets").join(file)).expect("a shipped model loads");
    for isa in [Isa::F64, Isa::F32, Isa::best()] {
        compare(&model, file, isa);
    }
}

#[test]
fn humanoid_with_runge_kutta() {
    every_width("gymnasium/humanoid.xml");
}

#[test]
fn humanoid_with_friction_everywhere() {
    every_width("dm_control/humanoid.xml");
}

#[test]
fn ant() {
    every_width("gymnasium/ant.xml");
}

#[test]
fn hopper() {
    every_width("agents/hopper.xml");
}
