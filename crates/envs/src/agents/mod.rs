//! The agents of this crate: Marathon's own, the tasks of Gymnasium and dm_control, and a task for any robot.

pub mod dm_control;
pub mod gymnasium;
pub mod marathon;
pub mod robot;

use std::sync::Arc;

use marathon_physics::lanes::Real;

use crate::agent::{Obs, Senses};
use crate::any_agent::AnyAgent;

/// All agents, in the order of listings. Without the feature `suite`, those of [`marathon::core`].
pub fn all() -> Vec<Arc<dyn AnyAgent>> {
    #[cfg(feature = "suite")]
    return [marathon::all(), gymnasium::all(), dm_control::all(), vec![Arc::new(robot::AnyRobot::default())]].concat();
    #[cfg(not(feature = "suite"))]
    marathon::core()
}

/// Extra names of tasks, `(alias, id)`. Each id without its version is a name already.
pub fn aliases() -> impl Iterator<Item = (&'static str, &'static str)> {
    marathon::ALIASES.into_iter().chain(dm_control::ALIASES)
}

/// Writes the coordinates from `skip` on.
#[inline(always)]
fn observe_positions<T: Real>(s: &Senses<T>, out: &mut Obs<T>, skip: usize) {
    for i in skip..s.readings().sim.model().nq {
        out.scalar(s.readings().qpos(i));
    }
}

/// Writes all velocities.
#[inline(always)]
fn observe_velocities<T: Real>(s: &Senses<T>, out: &mut Obs<T>) {
    for i in 0..s.readings().sim.model().nv {
        out.scalar(s.readings().qvel(i));
    }
}
