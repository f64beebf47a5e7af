//! An evaluation has the requested number of episodes, the same ones for all threads and widths.

use crate::common::{PuckTask, silent, small_config};
use marathon_envs::{BLOCK, BlockStep, ShardFactory};
use marathon_learn::{BlockPolicy, EvalOptions, Policy, evaluate, train};
use marathon_physics::lanes::Isa;

/// A bad policy, so that episodes differ in length.
fn policy() -> Policy {
    let config = small_config().with(|c| c.run.total_steps = 1);
    train(&PuckTask::new(), Isa::best(), &config, None, &mut silent).unwrap().policy
}

#[test]
fn result_does_not_depend_on_threads_and_widths() {
    let policy = policy();
    for episodes in [1, 5, 16, 50, 1500] {
        let options = EvalOptions { episodes, seed: 3, threads: 1 };
        let want = evaluate(&PuckTask::new(), Isa::best(), &policy, &options).unwrap();
        assert_eq!(want.episodes, episodes as u64);
        let runs = [(Isa::best(), 2), (Isa::best(), 3), (Isa::F32, 1), (Isa::X4, 7)];
        for (isa, threads) in runs.into_iter().filter(|(isa, _)| isa.supported()) {
            let options = EvalOptions { threads, ..options };
            assert_eq!(evaluate(&PuckTask::new(), isa, &policy, &options).unwrap(), want, "{} {threads}", isa.name());
        }
    }
}

#[test]
fn result_equals_a_plain_count() {
    let (task, policy) = (PuckTask::new(), policy());
    let options = EvalOptions { episodes: 16, seed: 8, threads: 1 };
    let got = evaluate(&task, Isa::best(), &policy, &options).unwrap();

    // one episode of each of sixteen agents, by hand
    let (mut shard, mut pilot) = (task.shard(0, 1, 8), BlockPolicy::new(&policy, Isa::F32));
    let (mut obs, mut action, mut out) = (vec![0.0; 6 * BLOCK], vec![0.0; 2 * BLOCK], BlockStep::default());
    shard.reset(0, !0, &mut obs);
    let (mut playing, mut falls) = (!0u16, 0);
    let (mut returns, mut lengths, mut distances) = ([0f64; BLOCK], [0f64; BLOCK], [0f64; BLOCK]);
    while playing != 0 {
        pilot.act(&obs, &mut action);
        shard.step(0, &action, &mut obs, &mut out);
        for i in (0..BLOCK).filter(|i| playing >> i & 1 == 1) {
            returns[i] += out.reward[i] as f64;
            distances[i] += out.forward[i] as f64;
            lengths[i] += 1.0;
        }
        falls += (out.terminated & playing).count_ones() as u64;
        playing &= !(out.terminated | out.truncated);
    }
    let mean = |x: &[f64]| x.iter().sum::<f64>() / x.len() as f64;
    let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-9 * (1.0 + b.abs()), "{a} {b}");
    close(got.return_mean, mean(&returns));
    close(got.length_mean, mean(&lengths));
    close(got.distance_mean, mean(&distances));
    let speeds: Vec<f64> = (0..BLOCK).map(|i| distances[i] / (lengths[i] * 0.05)).collect();
    close(got.speed_mean, mean(&speeds));
    close(got.return_min, returns.iter().copied().fold(f64::INFINITY, f64::min));
    close(got.return_max, returns.iter().copied().fold(f64::NEG_INFINITY, f64::max));
    let var = mean(&returns.map(|r| (r - mean(&returns)).powi(2)));
    close(got.return_std, var.sqrt());
    assert!(got.falls == falls && falls > 0 && got.diverged == 0, "{got:?}");
}

#[test]
fn no_episodes_is_an_error() {
    let options = EvalOptions { episodes: 0, ..Default::default() };
    let error = evaluate(&PuckTask::new(), Isa::best(), &policy(), &options).err().unwrap();
    assert_eq!(error.to_string(), "configuration: episodes is 0, expected at least 1");
}
