//! A run that a caller steps iteration by iteration equals the run of `train`: the same numbers, policies and
//! checkpoints. The caller may stop at any moment.

use crate::common::{PuckTask, silent, small_config, small_of};
use marathon_learn::{Control, IterationStats, Snapshot, TrainLoop, train};
use marathon_physics::lanes::Isa;

/// The values that do not depend on time.
fn numbers(stats: &IterationStats) -> IterationStats {
    IterationStats { wall_seconds: 0.0, cpu_seconds: 0.0, env_share: 0.0, update_share: 0.0, ..stats.clone() }
}

#[test]
fn steps_are_those_of_train() {
    for config in [small_config(), small_of("sac")] {
        for threads in [1, 3] {
            let config = config.clone().with(|config| config.run.threads = threads);
            let (mut seen, mut policies) = (Vec::new(), Vec::new());
            let mut observer = |stats: &IterationStats, snapshot: &Snapshot<'_>| {
                seen.push(numbers(stats));
                policies.push(snapshot.policy());
                Control::Continue
            };
            let task = PuckTask::with_limit(20);
            let output = train(&task, Isa::best(), &config, None, &mut observer).unwrap();
            let mut trainer = TrainLoop::new(&task, Isa::best(), &config).unwrap();
            assert_eq!(trainer.config(), &config);
            let mut made = Vec::new();
            for policy in &policies {
                assert!(!trainer.is_done());
                made.push(numbers(&trainer.iterate().unwrap()));
                assert_eq!(trainer.policy(), *policy);
            }
            assert!(trainer.is_done());
            assert_eq!(made, seen);
            assert_eq!(trainer.policy(), output.policy);
        }
    }
}

/// The other threads end with the value, even before the run has started.
#[test]
fn a_run_may_be_left() {
    let config = small_config().with(|config| config.run.threads = 3);
    drop(TrainLoop::new(&PuckTask::new(), Isa::best(), &config).unwrap());
    let mut trainer = TrainLoop::new(&PuckTask::new(), Isa::best(), &config).unwrap();
    trainer.iterate().unwrap();
    let checkpoint = trainer.checkpoint();
    drop(trainer);
    let mut resumed = TrainLoop::resume(&PuckTask::new(), Isa::best(), &config, checkpoint).unwrap();
    while !resumed.is_done() {
        resumed.iterate().unwrap();
    }
    let whole = train(&PuckTask::new(), Isa::best(), &config, None, &mut silent).unwrap();
    assert_eq!(resumed.policy(), whole.policy);
}
