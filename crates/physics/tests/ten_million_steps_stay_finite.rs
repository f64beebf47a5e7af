//! Promise: states stay finite and bounded over ten million steps of each of Marathon's agents, and two million of each
//! model of Gymnasium's and dm_control's tasks. Random torques make them fall and thrash on the floor and on themselves
//! for minutes of simulated time. All contacts are on, as in the environments.
//!
//! The variable MARATHON_TEST_LONG asks for all of it, as `tests/long.sh soak` does. Without it, a tenth is run.

use crate::common;
use marathon_physics::lanes::Isa;
use marathon_physics::workload::{HOLD, Workload};
use marathon_physics::{Model, SimOptions};
use std::path::Path;

const AGENTS: usize = 256;

/// Speed of a joint or root (rad/s or m/s) that only a solver error can cause.
const RUNAWAY: f64 = 500.0;

/// Runs some million steps of a model, or a tenth of them.
fn soak(path: &Path, million: usize) {
    let name = path.display();
    let least = if std::env::var_os("MARATHON_TEST_LONG").is_some() { million * 1_000_000 } else { million * 100_000 };
    let model = Model::from_xml_file(path).expect("a shipped model loads");
    let steps = least.div_ceil(AGENTS).next_multiple_of(HOLD);
    let workload =
        Workload { isa: Isa::best(), agents: AGENTS, warmup: 0, steps, seed: 11, sim: SimOptions::default() };
    let report = workload.run(&model, &|| 0.0).expect("a shipped model can be simulated");
    let share = report.stats.unconverged as f64 / report.stats.solves as f64;
    println!(
        "{name}: velocity {:.0}, contacts {}, unconverged {share:.0e}",
        report.max_velocity, report.stats.contacts
    );
    assert!(report.agents * steps >= least);
    assert_eq!(report.non_finite, 0, "{name}: agents whose state is not finite");
    assert!(report.max_velocity < RUNAWAY, "{name}: largest velocity {}", report.max_velocity);
    let collides = !["pendulum", "swimmer", "reacher"].iter().any(|free| name.to_string().contains(free));
    assert!(report.stats.contacts > 0 || !collides, "{name}: something was touched");
    assert!(share < 1e-3, "{name}: the solver gave up in {share} of the steps");
}

/// The models of a folder.
fn soak_all(folder: &str, million: usize) {
    let paths: Vec<_> =
        common::shipped().into_iter().filter(|p| p.parent().is_some_and(|p| p.ends_with(folder))).collect();
    assert!(paths.len() >= 4);
    paths.iter().for_each(|path| soak(path, million));
}

#[test]
fn agents() {
    soak_all("assets/agents", 10);
}

#[test]
fn gymnasium() {
    soak_all("assets/gymnasium", 2);
}

#[test]
fn dm_control() {
    soak_all("assets/dm_control", 2);
}
