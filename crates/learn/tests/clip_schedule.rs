//! The clip range moves linearly from `clip.from` to `clip.to` over the run's steps, also across an interruption.

use crate::common::{PuckTask, ppo, silent, small_config};
use marathon_learn::{Checkpoint, Control, IterationStats, Schedule, Snapshot, TrainConfig, train};
use marathon_physics::lanes::Isa;

fn parameters(config: &TrainConfig, resume: Option<Checkpoint>) -> Vec<f32> {
    let output = train(&PuckTask::new(), Isa::best(), config, resume, &mut silent).unwrap();
    let dir = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).unwrap();
    let file = dir.path().join("policy.safetensors");
    output.policy.save(&file).unwrap();
    // only the tensors: the headers have different configurations
    let bytes = std::fs::read(&file).unwrap();
    let header = u64::from_le_bytes(*bytes.first_chunk().unwrap()) as usize;
    bytes[8 + header..].chunks_exact(4).map(|c| f32::from_le_bytes(*c.first_chunk().unwrap())).collect()
}

/// A run of `rollouts` rollouts. The first has no update, so update `i` happens at the fraction `i / rollouts`. The
/// rate is high, so that ratios reach the clip range.
fn config(rollouts: u64, clip: f64, final_clip: Option<f64>) -> TrainConfig {
    let base = small_config().with(|c| {
        ppo(c).lr = 1e-2;
        ppo(c).lr_range = [1e-2, 1e-2];
    });
    base.with(|c| {
        c.run.total_steps = rollouts * c.run.rollout_steps();
        ppo(c).clip = Schedule { from: clip, to: final_clip.unwrap_or(clip) };
    })
}

#[test]
fn halfway_the_range_is_the_mean() {
    let mean = parameters(&config(2, 0.1875, None), None);
    assert_eq!(parameters(&config(2, 0.25, Some(0.125)), None), mean);
    assert_ne!(parameters(&config(2, 0.25, None), None), mean);
    assert_ne!(parameters(&config(2, 0.125, None), None), mean);
}

#[test]
fn without_an_end_the_range_stays() {
    assert_eq!(parameters(&config(4, 0.2, None), None), parameters(&config(4, 0.2, Some(0.2)), None));
}

#[test]
fn an_interruption_does_not_move_the_range() {
    let config = config(4, 0.3, Some(0.05));
    let mut half = None;
    let mut observer = |stats: &IterationStats, snapshot: &Snapshot<'_>| {
        half = (stats.iteration == 2).then(|| snapshot.checkpoint());
        if half.is_some() { Control::Stop } else { Control::Continue }
    };
    train(&PuckTask::new(), Isa::best(), &config, None, &mut observer).unwrap();
    assert_eq!(parameters(&config, half), parameters(&config, None));
}

#[test]
fn the_end_must_be_positive() {
    for bad in [0.0, -0.1, f64::NAN, f64::INFINITY] {
        let error = config(2, 0.2, Some(bad)).validate().unwrap_err().to_string();
        assert!(error.contains("ppo.clip.to is") && error.contains("expected a positive number"), "{error}");
    }
    config(2, 0.2, Some(0.1)).validate().unwrap();
}
