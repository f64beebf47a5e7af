//! The agents of the Marathon Environments, one file each, and the tasks of others.
//!
//! `-v0` is the paper's text and its code at release (31, 41, 88, 53 observations); `-v1` is the paper's Table 1, the
//! code four months later (31, 43, 92, 54 observations, rewards between 0 and 1).

pub mod ant;
pub mod dm_control;
pub mod gymnasium;
pub mod hopper;
pub mod humanoid;
pub mod walker2d;

use std::sync::Arc;

use marathon_physics::lanes::Real;

use crate::agent::AnyAgent;
use crate::senses::Senses;
use crate::write::Obs;

/// All agents that come with the crate, in the order of listings.
pub fn all() -> Vec<Arc<dyn AnyAgent>> {
    let mut agents: Vec<Arc<dyn AnyAgent>> = vec![
        Arc::new(hopper::HopperV0),
        Arc::new(hopper::HopperV1),
        Arc::new(walker2d::Walker2dV0),
        Arc::new(walker2d::Walker2dV1),
        Arc::new(humanoid::HumanoidV0),
        Arc::new(humanoid::HumanoidV1),
        Arc::new(ant::AntV0),
        Arc::new(ant::AntV1),
    ];
    agents.extend(gymnasium::all());
    agents.extend(dm_control::all());
    agents
}

/// Names besides the registered ones, which are the ids without their version. `(alias, id)`.
pub const ALIASES: [(&str, &str); 3] =
    [("walker", "Walker2d-v0"), ("walker-v0", "Walker2d-v0"), ("walker-v1", "Walker2d-v1")];

/// Speed that the `-v1` rewards call 1, m/s: the track's length over the episode's duration in the original.
const FASTEST: f64 = 8.0;

/// Coordinates from `skip` on.
#[inline(always)]
fn observe_positions<T: Real>(s: &Senses<T>, out: &mut Obs<T>, skip: usize) {
    for i in skip..s.readings().sim.model().nq {
        out.scalar(s.readings().qpos(i));
    }
}

/// All velocities.
#[inline(always)]
fn observe_velocities<T: Real>(s: &Senses<T>, out: &mut Obs<T>) {
    for i in 0..s.readings().sim.model().nv {
        out.scalar(s.readings().qvel(i));
    }
}
