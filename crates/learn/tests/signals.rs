//! Rewards for novelty: their gradients equal finite differences in double precision, and they fade where the networks
//! have learned. Runs stay deterministic and resumable, and still learn the task.

use crate::common::numbers::{noise, worst};
use crate::common::{PuckTask, learning_config, silent, small_config};
use marathon_learn::rewards::Step;
use marathon_learn::rewards::curiosity::Curiosity;
use marathon_learn::rewards::rnd::Rnd;
use marathon_learn::{
    BLOCK, Checkpoint, Control, IterationStats, Novelty, RewardConfig, RewardKind, Snapshot, TrainConfig, evaluate,
    train,
};
use marathon_physics::lanes::Isa;

const BLOCKS: usize = 2;

/// Steps of 5 numbers with 3 actions; some actions are out of bounds.
fn data() -> Vec<[Vec<f64>; 3]> {
    let row = |n, salt, scale: f64| noise(n * BLOCK, salt).iter().map(|x| x * scale).collect::<Vec<_>>();
    (0..BLOCKS as u64).map(|b| [row(5, b, 1.0), row(3, 10 + b, 1.5), row(5, 20 + b, 1.0)]).collect()
}

fn steps(data: &[[Vec<f64>; 3]]) -> Vec<Step<'_, f64>> {
    data.iter().map(|[obs, action, next]| Step { obs, action, next }).collect()
}

#[test]
fn gradient_of_curiosity_equals_finite_differences() {
    let nets = Curiosity::new(5, 3, &[9, 6]);
    let (data, mut space) = (data(), nets.space::<f64>());
    let steps = steps(&data);
    let params: Vec<f64> = noise(nets.count(), 3).iter().map(|x| 0.4 * x).collect();
    let mut loss = |params: &[f64], gradient: Option<&mut [f64]>| {
        nets.losses::<f64>(params, &steps, &mut space);
        let total = (0..BLOCKS * BLOCK).map(|i| nets.loss(&space, i)).sum::<f64>();
        if let Some(gradient) = gradient {
            nets.gradient::<f64>(params, BLOCKS, &mut space, gradient);
        }
        total
    };
    let mut gradient = vec![0.0; nets.count()];
    loss(&params, Some(&mut gradient));
    let error = worst(&gradient, &params, |p| loss(p, None));
    assert!(error < 1e-7, "{error}");
}

#[test]
fn gradient_of_distillation_equals_finite_differences() {
    let nets = Rnd::seeded(5, &[9, 6], 4);
    let (data, mut space) = (data(), nets.space::<f64>());
    let steps = steps(&data);
    let params: Vec<f64> = noise(nets.count(), 3).iter().map(|x| 0.4 * x).collect();
    let mut loss = |params: &[f64], gradient: Option<&mut [f64]>| {
        nets.losses::<f64>(params, &steps, &mut space);
        // the loss is half the squared error
        let total = (0..BLOCKS * BLOCK).map(|i| 2.0 * nets.loss(&space, i)).sum::<f64>();
        if let Some(gradient) = gradient {
            nets.gradient::<f64>(params, BLOCKS, &mut space, gradient);
        }
        total
    };
    let mut gradient = vec![0.0; nets.count()];
    loss(&params, Some(&mut gradient));
    let error = worst(&gradient, &params, |p| loss(p, None));
    assert!(error < 1e-7, "{error}");
}

fn signals() -> Vec<RewardConfig> {
    [RewardKind::Curiosity, RewardKind::Rnd]
        .map(|kind| kind(Novelty { hidden: vec![11, 7], ..Default::default() }))
        .map(|kind| RewardConfig { kind, strength: 0.1, gamma: 0.95 })
        .into()
}

fn bits(config: &TrainConfig, isa: Isa) -> Vec<u32> {
    let output = train(&PuckTask::with_limit(20), isa, config, None, &mut silent).unwrap();
    output.policy.params().iter().chain(output.policy.log_std()).map(|x| x.to_bits()).collect()
}

#[test]
fn neither_threads_nor_vector_width_change_the_policy() {
    let config = small_config().with(|c| c.rewards.extend(signals()));
    let want = bits(&config, Isa::best());
    assert_ne!(want, bits(&small_config(), Isa::best()), "signals do something");
    for threads in [2, 5] {
        assert_eq!(want, bits(&config.clone().with(|c| c.run.threads = threads), Isa::best()), "{threads} threads");
    }
    for isa in [Isa::F32, Isa::X4, Isa::X8, Isa::X16].into_iter().filter(|isa| isa.supported()) {
        assert_eq!(want, bits(&config, isa), "{}", isa.name());
    }
}

#[test]
fn resumed_run_has_the_bits_of_an_uninterrupted_one() {
    let config = small_config().with(|c| c.rewards.extend(signals()));
    let run = |resume: Option<Checkpoint>, stop_at: u64| {
        let mut observer = |stats: &IterationStats, _: &Snapshot<'_>| match stats.iteration == stop_at {
            true => Control::Stop,
            false => Control::Continue,
        };
        train(&PuckTask::with_limit(30), Isa::best(), &config, resume, &mut observer).unwrap()
    };
    let whole = run(None, 0);
    let half = run(None, 2).checkpoint;
    let dir = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).unwrap();
    half.save(dir.path()).unwrap();
    let resumed = run(Some(Checkpoint::load(dir.path()).unwrap()), 0);
    assert_eq!(resumed.policy.params(), whole.policy.params());
    let other = config.clone().with(|c| c.rewards.truncate(1));
    let error = train(&PuckTask::with_limit(30), Isa::best(), &other, Some(half), &mut silent).err().unwrap();
    assert!(error.to_string().contains("checkpoint: rewards is for task, curiosity [11, 7], rnd [11, 7]"), "{error}");
}

/// Both rewards fade while their networks learn, and the task is learned at the same time.
#[test]
fn novelty_fades_and_the_task_is_solved() {
    for kind in [RewardKind::Curiosity, RewardKind::Rnd] {
        let kind = kind(Novelty { hidden: vec![32, 32], lr: 1e-3 });
        let reward = RewardConfig { strength: 0.01, ..RewardConfig::new(kind.clone()) };
        let config = learning_config().with(|c| c.rewards.push(reward));
        let mut rewards = Vec::new();
        let mut observer = |stats: &IterationStats, _: &Snapshot<'_>| {
            assert_eq!(stats.learned.signal_rewards[0].0, kind.name());
            rewards.push(stats.learned.signal_rewards[0].1);
            Control::Continue
        };
        let output = train(&PuckTask::new(), Isa::best(), &config, None, &mut observer).unwrap();
        let (first, last) = (rewards[1], rewards[rewards.len() - 1]);
        let result = evaluate(&PuckTask::new(), Isa::best(), &output.policy, &Default::default()).unwrap();
        println!("{}: {first} {last} {}", kind.name(), result.return_mean);
        assert!(first > 0.0 && last < 0.2 * first, "{}: {first} {last}", kind.name());
        assert!(result.return_mean > 52.0, "{}: {result:?}", kind.name());
    }
}

#[test]
fn a_signal_twice_is_refused() {
    let twice = vec![RewardConfig::new(RewardKind::Rnd(Novelty::default())); 2];
    let config = small_config().with(|c| c.rewards.extend(twice));
    assert!(config.validate().unwrap_err().to_string().contains("rewards is rnd after rnd, expected each kind once"));
}
