//! What a run needs of memory, looked at before it begins: an allocation that fails later ends the whole program.

use crate::algorithms::parameters::Layout;
use crate::error::Error;
use crate::lanes::BLOCK;
use crate::optim::kfac::Kfac;
use crate::trainer::config::Algorithm;
use crate::trainer::config::PpoConfig;
use crate::trainer::workers::group_count;
use marathon_envs::Spec;
use std::hint::black_box;

/// What environments, checkpoints being written and the rest take for every byte of the large arrays, at the most seen.
const REST: f64 = 0.3;

/// Refuses a run that does not fit into memory.
///
/// # Errors
/// Names what the run needs, and what would need less.
pub fn check(spec: &Spec, config: &PpoConfig) -> Result<(), Error> {
    let bytes = bytes(spec, config);
    let mut probe: Vec<u8> = Vec::new();
    let fits = usize::try_from(bytes).is_ok_and(|bytes| probe.try_reserve_exact(bytes).is_ok());
    // without this the compiler sees that nobody needs it, and takes it as given
    black_box(&probe);
    match fits {
        true => Ok(()),
        false => Err(Error::Memory { gigabytes: bytes as f64 / 1e9, less: less(config) }),
    }
}

/// What a run with less memory has smaller.
fn less(config: &PpoConfig) -> String {
    let replay = match &config.algorithm {
        Algorithm::Sac(sac) => format!(", a smaller replay (now {})", sac.replay),
        _ => String::new(),
    };
    format!(
        "fewer agents (now {}), a shorter horizon (now {}), narrower networks (now {:?} and {:?}){replay} or fewer threads \
         (now {})",
        config.agents,
        config.horizon,
        config.actor_hidden,
        config.critic_hidden,
        config.worker_count()
    )
}

/// Bytes that a run needs. Its large arrays are those of [`Run`](crate::trainer::Run), [`Learner`](crate::algorithms::parameters::Learner),
/// [`Rollout`](crate::rollout::collect::Rollout) and [`Replay`](crate::rollout::replay::Replay).
fn bytes(spec: &Spec, config: &PpoConfig) -> u64 {
    let layout = Layout::new(spec, config);
    let (obs, act, items) = (spec.obs as u64, spec.act as u64, (config.blocks() * config.horizon) as u64);
    let (streams, workers, params) = (layout.streams() as u64, config.worker_count() as u64, layout.len as u64);
    let next = if streams > 1 || layout.twin.is_some() { obs } else { 0 };
    let rollouts = items * BLOCK as u64 * (obs + act + next + layout.ratio.rows(spec.act) as u64 + 1 + 3 * streams);

    let (samples, replay, moments) = match &config.algorithm {
        Algorithm::Sac(sac) => (sac.batch / BLOCK, sac.replay as u64 * (2 * obs + act + 1), 0),
        Algorithm::Acktr(_) => (config.blocks() * config.horizon, 0, Kfac::moments_of(&layout) as u64),
        _ => ((config.blocks() * config.horizon).div_ceil(config.minibatches), 0, 0),
    };
    let groups = group_count(samples) as u64;
    // parameters and two moments of every replica, a gradient of every group and worker, and the sum
    let learners = params.saturating_mul(3 * (workers + 1) + groups + workers + 1);
    let moments = moments.saturating_mul(groups + workers);
    let floats = [rollouts, replay, learners, moments].into_iter().map(|n| n as f64).sum::<f64>();
    (floats * size_of::<f32>() as f64 * (1.0 + REST)) as u64
}
