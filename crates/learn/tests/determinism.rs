//! The same seed gives the same policy for any number of threads and any vector width.

use crate::common::{PuckTask, ppo, silent, small_config, small_of};
use marathon_learn::{Activation, LrSchedule, TrainConfig, TrainOutput, train};
use marathon_physics::lanes::Isa;

fn run(config: &TrainConfig, isa: Isa) -> TrainOutput {
    train(&PuckTask::with_limit(20), isa, config, None, &mut silent).unwrap()
}

fn bits(output: &TrainOutput) -> Vec<u32> {
    let policy = &output.policy;
    let numbers = policy.params().iter().chain(policy.log_std()).chain(policy.normalizer().mean());
    numbers.chain(policy.normalizer().std()).map(|x| x.to_bits()).collect()
}

#[test]
fn threads_do_not_change_the_policy() {
    // five blocks: unequal shares for the threads, and fewer groups than threads are possible
    for config in [
        small_config(),
        small_config().with(|c| {
            ppo(c).minibatches = 1;
            c.run.horizon = 40;
            ppo(c).value_clip = Some(0.2);
        }),
        small_config().with(|c| {
            ppo(c).minibatches = 17;
            ppo(c).lr_schedule = LrSchedule::Linear;
            c.network.activation = Activation::Elu;
        }),
        small_of("a2c"),
        small_of("acktr"),
        small_of("sac"),
    ] {
        let one = run(&config, Isa::best());
        for threads in [2, 3, 5, 9] {
            let many = run(&config.clone().with(|c| c.run.threads = threads), Isa::best());
            assert_eq!(bits(&one), bits(&many), "{threads} threads");
            let (a, b) = (one.last.as_ref().unwrap(), many.last.as_ref().unwrap());
            assert_eq!(a.learned, b.learned);
        }
    }
}

#[test]
fn vector_width_does_not_change_the_policy() {
    for activation in Activation::ALL {
        let config = small_config().with(|c| {
            c.network.activation = activation;
            c.run.total_steps = 3 * 80 * 24;
        });
        let want = run(&config, Isa::F32);
        for isa in [Isa::X4, Isa::X8, Isa::X16].into_iter().filter(|isa| isa.supported()) {
            assert_eq!(bits(&want), bits(&run(&config, isa)), "{} {}", activation.name(), isa.name());
        }
    }
    for algorithm in ["a2c", "acktr", "sac"] {
        let want = run(&small_of(algorithm), Isa::F32);
        for isa in [Isa::X4, Isa::X8, Isa::X16].into_iter().filter(|isa| isa.supported()) {
            assert_eq!(bits(&want), bits(&run(&small_of(algorithm), isa)), "{algorithm} {}", isa.name());
        }
    }
}

#[test]
fn seed_changes_the_policy() {
    let other = small_config().with(|c| c.run.seed = 2);
    assert_ne!(bits(&run(&small_config(), Isa::best())), bits(&run(&other, Isa::best())));
}
