//! Contract: the output of [`Batch::gather`] for all agents equals the readings of each agent, for any number of
//! threads and any lane width. Contacts are those of the last step.

use crate::common;
use marathon_physics::{Batch, BatchOptions, Isa, Model, Quantity};

const AGENTS: usize = 21;
const ALL: [Quantity; 12] = [
    Quantity::Qpos,
    Quantity::Qvel,
    Quantity::BodyPos,
    Quantity::BodyAxes,
    Quantity::BodyVelocity,
    Quantity::BodyAngularVelocity,
    Quantity::GeomPos,
    Quantity::GeomVelocity,
    Quantity::Touching,
    Quantity::Touched,
    Quantity::NormalForce,
    Quantity::Sensors,
];

fn model(file: &str) -> Model {
    Model::from_xml_file(common::workspace().join(file)).unwrap_or_else(|e| panic!("{e}"))
}

fn stepped(model: &Model, threads: usize, isa: Isa) -> Batch {
    let options = BatchOptions { agents: AGENTS, threads, isa, ..Default::default() };
    let mut batch = Batch::new(model, &options).expect("supported");
    for t in 0..12 {
        let ctrl: Vec<f64> =
            (0..AGENTS * model.nu).map(|i| ((i * 7919 + t * 104_729) % 200) as f64 / 100.0 - 1.0).collect();
        assert!(batch.step(&ctrl, 5).is_empty());
    }
    batch
}

fn gather(batch: &mut Batch, wanted: &[Quantity]) -> Vec<Vec<f64>> {
    let agents = batch.agents();
    let mut rows: Vec<Vec<f64>> = wanted.iter().map(|q| vec![-1.0; agents * q.width(batch.model())]).collect();
    batch.gather(&mut wanted.iter().copied().zip(rows.iter_mut().map(Vec::as_mut_slice)).collect::<Vec<_>>());
    rows
}

#[test]
fn rows_are_what_is_read_of_one_agent() {
    for file in ["assets/agents/humanoid.xml", "crates/physics/tests/models/full/pile.xml"] {
        let model = model(file);
        for threads in [1, 2] {
            let mut batch = stepped(&model, threads, Isa::best());
            let rows = gather(&mut batch, &ALL);
            let row = |quantity: Quantity, agent: usize| {
                let (i, width) = (ALL.iter().position(|q| *q == quantity).unwrap(), quantity.width(&model));
                &rows[i][agent * width..(agent + 1) * width]
            };
            for agent in 0..AGENTS {
                assert_eq!(row(Quantity::Qpos, agent), batch.qpos(agent), "{file}");
                assert_eq!(row(Quantity::Qvel, agent), batch.qvel(agent), "{file}");
                assert_eq!(row(Quantity::Sensors, agent), batch.sensors(agent), "{file}");
                for (b, body) in batch.bodies(agent).iter().enumerate() {
                    assert_eq!(row(Quantity::BodyPos, agent)[3 * b..3 * b + 3], body.pos, "{file}");
                    assert_eq!(row(Quantity::BodyVelocity, agent)[3 * b..3 * b + 3], body.velocity, "{file}");
                    assert_eq!(row(Quantity::BodyAxes, agent)[9 * b..9 * b + 9], *body.axes.as_flattened(), "{file}");
                    let spin = &row(Quantity::BodyAngularVelocity, agent)[3 * b..3 * b + 3];
                    assert_eq!(spin, body.angular_velocity, "{file}");
                }
            }
        }
    }
}

#[test]
fn they_do_not_depend_on_threads_widths_or_what_else_is_read() {
    let model = model("assets/agents/humanoid.xml");
    let single = gather(&mut stepped(&model, 1, Isa::F32), &ALL);
    let mut wide = stepped(&model, 3, Isa::best());
    assert_eq!(gather(&mut wide, &ALL), single);
    for (quantity, rows) in ALL.iter().zip(&single) {
        assert_eq!(gather(&mut wide, &[*quantity]), std::slice::from_ref(rows), "{quantity:?}");
    }
}

/// A hopper lands on its foot: the foot touches, and resetting the agent clears that.
#[test]
fn contacts_are_those_of_the_last_step() {
    let model = model("assets/agents/hopper.xml");
    let mut batch = stepped(&model, 1, Isa::best());
    let contacts = [Quantity::Touching, Quantity::Touched, Quantity::NormalForce];
    let before = gather(&mut batch, &contacts);
    let foot = model.geoms.iter().position(|g| g.name == "foot").expect("it has one");
    let geoms = model.geoms.len();
    let standing: Vec<usize> = (0..AGENTS).filter(|a| before[0][a * geoms + foot] == 1.0).collect();
    assert!(!standing.is_empty(), "some stand on their foot");
    for agent in 0..AGENTS {
        for g in 0..geoms {
            let [touching, touched, force] = [0, 1, 2].map(|i| before[i][agent * geoms + g]);
            assert!(touching <= touched, "what touches has touched");
            assert!(force == 0.0 || touching == 1.0, "a force comes from a contact");
        }
    }
    batch.reset(standing[0], &model.qpos0, &vec![0.0; model.nv]);
    let after = gather(&mut batch, &contacts);
    for agent in 0..AGENTS {
        for (before, after) in before.iter().zip(&after) {
            let row = agent * geoms..(agent + 1) * geoms;
            let expected = if agent == standing[0] { vec![0.0; geoms] } else { before[row.clone()].to_vec() };
            assert_eq!(after[row], expected, "agent {agent}");
        }
    }
    // a state of another model is detected
    let humanoid = self::model("assets/agents/humanoid.xml");
    assert!(batch.agent_state(0).fits(&model) && !batch.agent_state(0).fits(&humanoid));
}
