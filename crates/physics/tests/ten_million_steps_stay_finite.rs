//! Promise: ten million steps of every shipped model under random torques, falling and thrashing on the floor for
//! minutes of simulated time, leave no state that is not finite, and none that has run away.

mod common;

use marathon_physics::lanes::Isa;
use marathon_physics::workload::Workload;
use marathon_physics::{Model, SimOptions};

const AGENTS: usize = 256;
const STEPS: usize = 39_064; // with 256 agents, ten million and a few

/// A joint or root faster than this (rad/s or m/s) has been thrown by the solver, not by its motors.
const RUNAWAY: f64 = 500.0;

fn soak(name: &str) {
    let path = common::workspace().join("assets/agents").join(name);
    let model = Model::from_xml_file(&path).expect("a shipped model loads");
    let workload = Workload {
        isa: Isa::best(),
        agents: AGENTS,
        warmup: 0,
        steps: STEPS,
        seed: 11,
        sim: SimOptions { ground_contacts_only: true, ..Default::default() },
    };
    let report = workload.run(&model, &|| 0.0).expect("a shipped model can be simulated");
    assert!(report.agents * STEPS >= 10_000_000);
    assert_eq!(report.non_finite, 0, "{name}: agents whose state is not finite");
    assert!(report.max_velocity < RUNAWAY, "{name}: largest velocity {}", report.max_velocity);
    assert!(report.stats.contacts > 0, "{name}: the floor was touched");
    let share = report.stats.unconverged as f64 / report.stats.solves as f64;
    assert!(share < 1e-3, "{name}: the solver gave up in {share} of the steps");
}

#[test]
fn hopper() {
    soak("hopper.xml");
}

#[test]
fn walker2d() {
    soak("walker2d.xml");
}

#[test]
fn ant() {
    soak("ant.xml");
}

#[test]
fn humanoid() {
    soak("humanoid.xml");
}
