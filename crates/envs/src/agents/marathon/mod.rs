//! The Marathon Environments.
//!
//! `-v0` follows the paper's text and its code at release (31, 41, 88, 53 observations). `-v1` follows the paper's
//! Table 1, which is the code four months later (31, 43, 92, 54 observations, rewards between 0 and 1).

pub mod ant;
pub mod controller;
mod fall_replay;
mod heading;
pub mod hopper;
pub mod humanoid;
mod idle;
mod imitation;
pub mod in_style;
pub mod marathon_man;
pub mod terrain;
pub mod walker2d;

use std::sync::Arc;

use crate::any_agent::AnyAgent;

/// All agents of this module, in the order of listings.
pub fn all() -> Vec<Arc<dyn AnyAgent>> {
    let mut out: Vec<Arc<dyn AnyAgent>> = vec![
        Arc::new(hopper::HopperV0),
        Arc::new(hopper::HopperV1),
        Arc::new(walker2d::Walker2dV0),
        Arc::new(walker2d::Walker2dV1),
        Arc::new(humanoid::HumanoidV0),
        Arc::new(humanoid::HumanoidV1),
        Arc::new(ant::AntV0),
        Arc::new(ant::AntV1),
        Arc::new(controller::HopperController::default()),
        Arc::new(controller::WalkerController::default()),
        Arc::new(controller::AntController),
        Arc::new(terrain::TerrainHopper::default()),
        Arc::new(terrain::TerrainWalker2d::default()),
        Arc::new(terrain::TerrainAnt::default()),
        Arc::new(marathon_man::TerrainMarathonMan::default()),
    ];
    out.extend(marathon_man::all());
    out.extend(in_style::all());
    out
}

/// The agents that web pages have: those of the paper with their controllers and the assault course, and Marathon Man.
pub fn core() -> Vec<Arc<dyn AnyAgent>> {
    let mut out: Vec<Arc<dyn AnyAgent>> = vec![
        Arc::new(hopper::HopperV0),
        Arc::new(walker2d::Walker2dV0),
        Arc::new(humanoid::HumanoidV0),
        Arc::new(ant::AntV0),
        Arc::new(controller::HopperController::default()),
        Arc::new(controller::WalkerController::default()),
        Arc::new(controller::AntController),
        Arc::new(terrain::TerrainWalker2d::default()),
    ];
    out.extend(marathon_man::core());
    out
}

/// Extra names of tasks, `(alias, id)`. Each id without its version is a name already.
pub const ALIASES: [(&str, &str); 3] =
    [("walker", "Walker2d-v0"), ("walker-v0", "Walker2d-v0"), ("walker-v1", "Walker2d-v1")];

/// Speed at which the speed term of the `-v1` rewards is 1, m/s: the original's track length divided by its episode
/// duration.
const FASTEST: f64 = 8.0;
