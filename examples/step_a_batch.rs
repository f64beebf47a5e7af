//! The physics alone: sixty-four hoppers under random torques.
//!
//! A [`Model`] is compiled from an MJCF file and never changes. A [`Batch`] holds the state of any number of agents of
//! that model and steps them together, as many at a time as a vector register of this processor has lanes. States and
//! controls go in and out in MuJoCo's layout (`qpos`, `qvel`, `ctrl`), agent by agent, so nothing here speaks of lanes.
//!
//! The example runs two seconds of simulated time, reads sensors and bodies, and then goes back to a snapshot taken
//! halfway and runs the second half again: the same bits come out. That is a promise of the engine, not an accident of
//! this program, and it also holds for another number of threads, agents or lanes.
//!
//! ```sh
//! cargo run --release -p marathon-examples --bin step_a_batch
//! ```

use marathon_rl::physics::{Batch, BatchOptions, Model};
use std::error::Error;
use std::path::Path;

const AGENTS: usize = 64;
/// Physics steps for which a control is held, as in the hopper's task: 50 decisions per second.
const SUBSTEPS: usize = 4;
/// One second.
const DECISIONS: u64 = 50;

fn main() -> Result<(), Box<dyn Error>> {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../assets/agents/hopper.xml");
    let model = Model::from_xml_file(&file)?;
    println!("{}: nq {}, nv {}, nu {}, {} bodies", model.name, model.nq, model.nv, model.nu, model.bodies.len());

    let mut batch = Batch::new(&model, &BatchOptions { agents: AGENTS, threads: 2, ..Default::default() })?;
    // the pose that the file calls "spawn"; without it agents start in `qpos0`
    let spawn = model.keyframes.iter().find(|key| key.name == "spawn").ok_or("the model has no keyframe 'spawn'")?;
    for agent in 0..AGENTS {
        batch.reset(agent, &spawn.qpos, &spawn.qvel);
    }

    run(&mut batch, 0..DECISIONS);
    let halfway = batch.snapshot();
    run(&mut batch, DECISIONS..2 * DECISIONS);

    // sensors, in the model's order: the hopper has one, the force on its foot
    let foot: Vec<f64> = (0..AGENTS).map(|agent| batch.sensors(agent)[0]).collect();
    println!("{} of {AGENTS} feet on the floor", foot.iter().filter(|force| **force > 0.0).count());
    // bodies: pose, velocity and contacts in world axes
    let torso = batch.bodies(0)[1];
    println!("torso of agent 0: at {:.2?} m, moving with {:.2?} m/s", torso.pos, torso.velocity);

    // the same second once more
    let first: Vec<Vec<f64>> = (0..AGENTS).map(|agent| batch.qpos(agent)).collect();
    batch.restore(&halfway);
    run(&mut batch, DECISIONS..2 * DECISIONS);
    let again: Vec<Vec<f64>> = (0..AGENTS).map(|agent| batch.qpos(agent)).collect();
    assert!(first == again, "a restored batch repeats itself bit for bit");
    println!("restored and run again on {}: the same bits", batch.isa().name());
    println!("{} states stopped being finite", batch.quarantined());
    Ok(())
}

/// Steps all agents under torques that depend on the time and the agent alone.
fn run(batch: &mut Batch, decisions: std::ops::Range<u64>) {
    let nu = batch.model().nu;
    let mut ctrl = vec![0.0; AGENTS * nu];
    for decision in decisions {
        for (i, u) in ctrl.iter_mut().enumerate() {
            *u = noise(decision * (AGENTS * nu) as u64 + i as u64);
        }
        batch.step(&ctrl, SUBSTEPS);
    }
}

/// A number in [-1, 1) from a counter (SplitMix64).
fn noise(counter: u64) -> f64 {
    let mut z = counter.wrapping_mul(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
}
