//! A rollout changes the statistics that normalize observations. With `follow_statistics`, the first layers of the
//! networks change with them, so the policy acts as before. Without it, the policy acts differently although it learned
//! nothing.

use crate::common::numbers::noise_f32 as noise;
use crate::common::{PuckTask, ppo, silent, small_config, small_of};
use marathon_learn::nets::mlp::Mlp;
use marathon_learn::{Activation, Control, Init, IterationStats, LrSchedule, Normalizer, Snapshot, train};
use marathon_physics::lanes::Isa;

/// Actions for a row of raw observations after each of four rollouts, whose updates change no parameter by even a bit.
fn actions(follow_statistics: bool) -> Vec<Vec<f32>> {
    let base = small_config();
    let config = base.with(|c| {
        c.statistics.follow_statistics = follow_statistics;
        ppo(c).lr_schedule = LrSchedule::Constant;
        ppo(c).lr = 1e-30;
        ppo(c).value_lr = 1e-30;
        c.network.initialization = Init::MlAgents;
    });
    let mut all = Vec::new();
    let mut observer = |_: &IterationStats, snapshot: &Snapshot<'_>| {
        all.push(snapshot.policy().act(&[12.0, 20.0, 3.0, -9.0, 40.0, -30.0]));
        Control::Continue
    };
    train(&PuckTask::new(), Isa::best(), &config, None, &mut observer).unwrap();
    all
}

fn furthest(a: &[f32], b: &[f32]) -> f32 {
    a.iter()
        .zip(b)
        .map(|(a, b)| (a - b).abs())
        .fold(0.0, |worst, x| if x.is_nan() { f32::INFINITY } else { x.max(worst) })
}

#[test]
fn a_policy_does_what_it_did_when_the_statistics_have_moved() {
    let (followed, left) = (actions(true), actions(false));
    assert_eq!(followed.len(), 4);
    // the initial weights are meant for the statistics of the first rollout
    assert_eq!(followed[0], left[0]);
    for later in 1..4 {
        assert!(furthest(&followed[later], &followed[0]) < 1e-6, "{followed:?}");
        assert!(furthest(&left[later], &left[0]) > 1e-4, "{left:?}");
    }
}

/// Output of a network for raw inputs, in double precision.
fn output(net: &Mlp, params: &[f32], normalizer: &Normalizer, raw: &[f32]) -> Vec<f64> {
    let mut x: Vec<f64> = normalizer.row(raw).into_iter().map(f64::from).collect();
    let last = net.layers().count() - 1;
    for (i, (weights, biases)) in net.layers().enumerate() {
        let rows = params[weights].chunks_exact(x.len()).zip(&params[biases]);
        let sums = rows.map(|(row, bias)| *bias as f64 + row.iter().zip(&x).map(|(w, x)| *w as f64 * x).sum::<f64>());
        x = sums.map(|y| if i < last { y.tanh() } else { y }).collect();
    }
    x
}

#[test]
fn the_first_layer_undoes_a_move() {
    let net = Mlp::new(&[5, 9, 3], Activation::Tanh);
    let before = Normalizer::new(vec![1.0, -3.0, 0.0, 200.0, 0.5], vec![1.0, 0.2, 5.0, 40.0, 2.0], 10.0);
    let after = Normalizer::new(vec![1.4, -3.1, -1.0, 220.0, 0.5], vec![0.8, 0.3, 9.0, 41.0, 2.0], 10.0);
    let old = noise_params(&net);
    let mut new = old.clone();
    net.follow(&mut new, &before, &after);
    assert_ne!(old, new);
    for i in 0..20 {
        let raw: Vec<f32> =
            noise(5, 90 + i).iter().zip(before.mean()).zip(before.std()).map(|((x, m), s)| m + 2.0 * x * s).collect();
        let (was, is) = (output(&net, &old, &before, &raw), output(&net, &new, &after, &raw));
        assert!(was.iter().zip(&is).all(|(a, b)| (a - b).abs() < 1e-5), "{was:?} {is:?}");
        assert!(output(&net, &old, &after, &raw).iter().zip(&was).any(|(a, b)| (a - b).abs() > 1e-2));
    }
    // constant inputs do not change
    let mut same = old.clone();
    net.follow(&mut same, &before, &before);
    assert_eq!(same, old);
}

/// An input that never moved has the smallest possible deviation. Its weights are then arbitrary.
#[test]
fn an_input_that_wakes_up_is_not_blown_up() {
    let net = Mlp::new(&[2, 4, 1], Activation::Tanh);
    let before = Normalizer::new(vec![0.0, 0.0], vec![1.0, 1e-4], 5.0);
    let after = Normalizer::new(vec![0.0, 0.02], vec![1.0, 0.1], 5.0);
    let old = noise_params(&net);
    let mut new = old.clone();
    net.follow(&mut new, &before, &after);
    for (old, new) in old[..8].chunks_exact(2).zip(new[..8].chunks_exact(2)) {
        assert_eq!((new[0], new[1]), (old[0], 2.0 * old[1]));
    }
    // while constant it has no effect
    let (was, is) = (output(&net, &old, &before, &[0.3, 0.0]), output(&net, &new, &after, &[0.3, 0.0]));
    assert!((was[0] - is[0]).abs() < 1e-6, "{was:?} {is:?}");
}

fn noise_params(net: &Mlp) -> Vec<f32> {
    noise(net.len(), 7).iter().map(|x| 0.7 * x).collect()
}

#[test]
fn every_algorithm_and_number_of_threads_gives_the_same_bits() {
    for algorithm in ["ppo", "a2c", "acktr"] {
        let base = small_of(algorithm).with(|c| c.run.agents = 64);
        let params = |follow_statistics, threads| {
            let config = base.clone().with(|c| {
                c.statistics.follow_statistics = follow_statistics;
                c.run.threads = threads;
            });
            train(&PuckTask::new(), Isa::best(), &config, None, &mut silent).unwrap().policy.params().to_vec()
        };
        let one = params(true, 1);
        assert_eq!(one, params(true, 3), "{algorithm}");
        assert_ne!(one, params(false, 1), "{algorithm}");
        // without normalization nothing changes
        let raw = |follow_statistics| {
            let config = base.clone().with(|c| {
                c.statistics.follow_statistics = follow_statistics;
                c.statistics.normalize_observations = false;
            });
            train(&PuckTask::new(), Isa::best(), &config, None, &mut silent).unwrap().policy.params().to_vec()
        };
        assert_eq!(raw(true), raw(false), "{algorithm}");
    }
}

#[test]
fn sac_refuses() {
    let error = small_of("sac").with(|c| c.statistics.follow_statistics = true).validate().unwrap_err().to_string();
    assert!(error.contains("follow_statistics is true, expected false with sac"), "{error}");
}
