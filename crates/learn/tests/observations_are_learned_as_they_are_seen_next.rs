//! A rollout changes the statistics that normalize observations. With `renormalize`, it is learned from with the changed
//! ones, which the next policy acts with and is saved with; without, with those that its agents saw. What both networks
//! make of the observations then differs from what they made of them while acting, by the change alone.

mod common;

use common::{PuckTask, silent, small_config, small_of};
use marathon_learn::{Control, IterationStats, PpoConfig, Schedule, Snapshot, train};
use marathon_physics::lanes::Isa;

/// A run of three rollouts whose updates move no parameter by as much as a bit.
fn still() -> PpoConfig {
    let base = PpoConfig { schedule: Schedule::Constant, lr: 1e-30, value_lr: 1e-30, ..small_config() };
    PpoConfig { init_log_std: -1.5, total_steps: 3 * base.rollout_steps(), ..base }
}

/// Divergence from the policy that acted, of each update.
fn divergence(config: &PpoConfig) -> Vec<f64> {
    let mut kl = Vec::new();
    let mut observer = |stats: &IterationStats, _: &Snapshot<'_>| {
        kl.push(stats.kl);
        Control::Continue
    };
    train(&PuckTask::new(), Isa::best(), config, None, &mut observer).unwrap();
    // the first rollout has no update
    kl.split_off(1)
}

#[test]
fn the_change_of_the_statistics_shows_before_anything_is_learned() {
    // larger weights at the start, or the policy would hardly look at what it sees
    let still = PpoConfig { initialization: marathon_learn::Init::MlAgents, ..still() };
    let kept = divergence(&still);
    assert!(kept.iter().all(|kl| kl.abs() < 1e-9), "{kept:?}");
    let changed = divergence(&PpoConfig { renormalize: true, ..still.clone() });
    assert!(changed.iter().all(|kl| *kl > 1e-7), "{changed:?}");
    // the more rollouts, the less one of them changes
    assert!(changed[1] < changed[0], "{changed:?}");
    let raw = divergence(&PpoConfig { renormalize: true, normalize_observations: false, ..still });
    assert!(raw.iter().all(|kl| kl.abs() < 1e-9), "{raw:?}");
}

#[test]
fn every_algorithm_and_number_of_threads_gives_the_same_bits() {
    for algorithm in ["ppo", "a2c", "acktr"] {
        let base = PpoConfig { schedule: Schedule::Linear, agents: 64, ..small_of(algorithm) };
        let params = |renormalize, threads| {
            let config = PpoConfig { renormalize, threads, ..base.clone() };
            train(&PuckTask::new(), Isa::best(), &config, None, &mut silent).unwrap().policy.params().to_vec()
        };
        let one = params(true, 1);
        assert_eq!(one, params(true, 3), "{algorithm}");
        assert_ne!(one, params(false, 1), "{algorithm}");
    }
}

#[test]
fn the_adaptive_rate_would_follow_the_statistics_and_is_refused() {
    let config = PpoConfig { renormalize: true, schedule: Schedule::Adaptive, ..small_config() };
    let error = config.validate().unwrap_err().to_string();
    assert!(error.contains("renormalize is true, expected false with the schedule 'adaptive'"), "{error}");
}
