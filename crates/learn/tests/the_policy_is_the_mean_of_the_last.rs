//! A run with `policy_average` returns the mean of the policies of its last part, for any interruptions and number of
//! threads. The learned parameters stay the same to the bit.

use crate::common::{PuckTask, silent, small_config};
use marathon_learn::{Checkpoint, Control, IterationStats, Policy, Snapshot, TrainConfig, TrainOutput, train};
use marathon_physics::lanes::Isa;

const ITERATIONS: u64 = 8;
const PART: f64 = 0.25;

fn config(part: f64) -> TrainConfig {
    small_config().with(|c| (c.run.total_steps, c.run.policy_average) = (ITERATIONS * c.run.rollout_steps(), part))
}

fn run(config: &TrainConfig, resume: Option<Checkpoint>) -> TrainOutput {
    train(&PuckTask::new(), Isa::best(), config, resume, &mut silent).unwrap()
}

/// The policies after every iteration.
fn policies(config: &TrainConfig) -> Vec<Policy> {
    let mut policies = Vec::new();
    let mut keep = |_: &IterationStats, snapshot: &Snapshot<'_>| {
        policies.push(snapshot.policy());
        Control::Continue
    };
    train(&PuckTask::new(), Isa::best(), config, None, &mut keep).unwrap();
    policies
}

fn numbers(policy: &Policy) -> Vec<f32> {
    let normalizer = policy.normalizer();
    [policy.params(), normalizer.mean(), normalizer.std(), policy.log_std()].concat()
}

/// The largest difference between numbers.
fn apart(a: &[f32], b: &[f32]) -> f32 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
}

#[test]
fn it_is_the_weighted_mean_of_the_policies_so_far() {
    let (last, mean) = (policies(&config(0.0)), policies(&config(PART)));
    let mut expected: Vec<f64> = Vec::new();
    for (i, (last, mean)) in last.iter().zip(&mean).enumerate() {
        let numbers_of_last = numbers(last);
        // the mean over the first quarter of nothing is the policy itself
        let weight = (1.0 / (PART * (i + 1) as f64)).min(1.0);
        expected.resize(numbers_of_last.len(), 0.0);
        expected.iter_mut().zip(&numbers_of_last).for_each(|(mean, x)| *mean += weight * (f64::from(*x) - *mean));
        let expected: Vec<f32> = expected.iter().map(|x| *x as f32).collect();
        assert!(apart(&numbers(mean), &expected) < 1e-6, "after iteration {i}");
        assert_eq!(numbers(mean) == numbers_of_last, weight == 1.0, "after iteration {i}");
    }
    assert_eq!(mean.len() as u64, ITERATIONS);
}

#[test]
fn learning_does_not_notice() {
    let [plain, mean] = [0.0, PART].map(|part| run(&config(part), None));
    let [plain, mean] = [plain, mean].map(|output| output.last.unwrap().learned);
    assert_eq!(plain.return_mean.map(f64::to_bits), mean.return_mean.map(f64::to_bits));
    assert_eq!([plain.kl.to_bits(), plain.value_loss.to_bits()], [mean.kl.to_bits(), mean.value_loss.to_bits()]);
}

#[test]
fn interruptions_and_threads_change_nothing() {
    let folder = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).unwrap();
    let whole = run(&config(PART), None).policy;
    let mut stop = |stats: &IterationStats, _: &Snapshot<'_>| match stats.iteration {
        0..5 => Control::Continue,
        _ => Control::Stop,
    };
    let part = train(&PuckTask::new(), Isa::best(), &config(PART), None, &mut stop).unwrap();
    part.checkpoint.save(folder.path()).unwrap();
    let checkpoint = Checkpoint::load(folder.path()).unwrap();
    let resumed = run(&config(PART).with(|c| c.run.threads = 2), Some(checkpoint));
    assert_eq!(resumed.policy, whole);
    // nothing left to do, and the same policy
    assert_eq!(run(&config(PART), Some(resumed.checkpoint.clone())).policy, whole);
    // without averaging, the run returns the last policy
    let last = run(&config(0.0), Some(resumed.checkpoint)).policy;
    assert_eq!(numbers(&last), numbers(policies(&config(0.0)).last().unwrap()));
}

#[test]
fn a_part_is_less_than_the_whole() {
    for part in [-0.1, 1.0, f64::NAN] {
        let error = train(&PuckTask::new(), Isa::best(), &config(part), None, &mut silent).unwrap_err().to_string();
        assert!(error.contains("policy_average") && error.contains("from 0 to below 1"), "{error}");
    }
}
