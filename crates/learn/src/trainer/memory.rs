//! Memory that a run needs, checked before it begins: an allocation that fails later ends the whole program.

use super::config::TrainConfig;
use super::roles::RoleParts;
use crate::algorithms::{Algorithm, MemoryPlan, Setup, group_count};
use crate::error::Error;
use crate::lanes::BLOCK;
use marathon_physics::lanes::Isa;
use std::hint::black_box;

/// Bytes of everything else, such as environments and checkpoints in writing, per byte of the large arrays: the most
/// measured.
const REST: f64 = 0.3;

/// Refuses a run that does not fit into memory.
///
/// # Errors
/// Names what the run needs, and what would need less.
pub fn check(roles: &[RoleParts], isa: Isa, config: &TrainConfig) -> Result<(), Error> {
    let bytes = roles.iter().map(|role| bytes(&role.setup(isa), &role.config)).fold(0, u64::saturating_add);
    match can_be_had(bytes) {
        true => Ok(()),
        false => Err(Error::Memory { gigabytes: bytes as f64 / 1e9, less: less(config) }),
    }
}

/// Whether one allocation of this many bytes succeeds.
pub fn can_be_had(bytes: u64) -> bool {
    let mut probe: Vec<u8> = Vec::new();
    let fits = usize::try_from(bytes).is_ok_and(|bytes| probe.try_reserve_exact(bytes).is_ok());
    // without this the compiler removes the unused allocation and assumes that it succeeds
    black_box(&probe);
    fits
}

/// Settings to reduce for a run that needs less memory.
fn less(config: &TrainConfig) -> String {
    let replay = match &config.algorithm {
        Algorithm::Sac(sac) => format!(", a smaller replay (now {})", sac.replay),
        _ => String::new(),
    };
    format!(
        "fewer agents (now {}), a shorter horizon (now {}), narrower networks (now {:?} and {:?}){replay} or fewer threads \
         (now {})",
        config.run.agents,
        config.run.horizon,
        config.network.hidden,
        config.network.critic(),
        config.run.worker_count()
    )
}

/// Bytes that a role of a run needs. Its large arrays are those of [`Crew`](super::workers::Crew), of each worker's
/// [`Learner`](crate::algorithms::Learner), of [`Rollout`](crate::rollout::data::Rollout), and what the algorithm keeps.
fn bytes(setup: &Setup<'_>, config: &TrainConfig) -> u64 {
    let MemoryPlan { parameters, moments, items, shape, replay } = config.algorithm.memory_plan(setup);
    let (params, workers) = (parameters as u64, config.run.worker_count() as u64);
    let rollouts = (setup.common.items() * BLOCK) as u64 * shape.numbers() as u64;
    let groups = group_count(items) as u64;
    // parameters and two moments of every replica, a gradient of every group and worker, and the sum
    let learners = params.saturating_mul(3 * workers + groups + workers + 1);
    let moments = (moments as u64).saturating_mul(groups + workers);
    let floats = [rollouts, replay, learners, moments].into_iter().map(|n| n as f64).sum::<f64>();
    (floats * size_of::<f32>() as f64 * (1.0 + REST)) as u64
}
