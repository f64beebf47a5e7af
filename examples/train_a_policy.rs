//! Training as a library call: no command line, no files until one asks for them.
//!
//! [`train`] takes a task (a [`ShardFactory`](marathon_envs::ShardFactory), by name from the registry), an instruction
//! set, a [`TrainConfig`] and an observer, and returns a [`Policy`](marathon_learn::Policy) and a checkpoint. The observer
//! is called once per iteration with its numbers; it may look at the policy as it is, and it may stop the run. Here it
//! prints a line and stops early, once the walker is fast and hardly ever falls.
//!
//! What the command `marathon train` adds on top is configuration files, a run folder and Ctrl-C.
//!
//! ```sh
//! cargo run --release -p marathon-examples --bin train_a_policy                       # about ten seconds
//! cargo run --release -p marathon-examples --bin train_a_policy -- 100000 walker.safetensors
//! ```

use marathon_learn::{
    ActionStd, Activation, Algorithm, Control, EvalOptions, IterationStats, Ppo, Schedule, Snapshot, TrainConfig,
    evaluate, train,
};
use marathon_physics::Isa;
use std::error::Error;
use std::path::PathBuf;

/// Mean speed of the episodes and part of them that end in a fall at which the run ends early, m/s.
const GOOD_ENOUGH: (f64, f64) = (3.0, 0.1);

fn main() -> Result<(), Box<dyn Error>> {
    let mut args = std::env::args().skip(1);
    let total_steps: u64 = args.next().map_or(Ok(6_000_000), |steps| steps.parse())?;
    let path = PathBuf::from(args.next().unwrap_or_else(|| "walker2d.safetensors".into()));

    let factory = marathon_envs::factory("walker2d", Isa::best())?;
    // the rest of the settings has defaults; every field is explained in `TrainConfig`
    let ppo = Ppo {
        entropy_coef: Schedule::constant(0.0),
        action_std: ActionStd {
            init_log: -0.7,
            // it looks for ways at the start and settles on one at the end
            min: Schedule { from: 0.35, to: 0.05 },
            ..Default::default()
        },
        ..Default::default()
    };
    let config = TrainConfig::default().with(|config| {
        (config.run.total_steps, config.run.seed) = (total_steps, 1);
        config.network.hidden = vec![32, 32];
        config.network.activation = Activation::Tanh;
        config.rewards[0].gamma = 0.98;
        config.algorithm = Algorithm::Ppo(ppo);
    });

    let mut observer = |stats: &IterationStats, _: &Snapshot<'_>| {
        let (speed, falls) = (stats.speed_mean.unwrap_or(0.0), stats.fall_fraction.unwrap_or(1.0));
        if stats.iteration % 16 == 1 {
            println!(
                "{:9} steps  return {:7.1}  {speed:5.2} m/s  falls {:3.0}%  std {:.2}",
                stats.steps,
                stats.learned.return_mean.unwrap_or(f64::NAN),
                falls * 100.0,
                stats.learned.std_mean
            );
        }
        if speed > GOOD_ENOUGH.0 && falls < GOOD_ENOUGH.1 { Control::Stop } else { Control::Continue }
    };
    let output = train(&*factory, Isa::best(), &config, None, &mut observer)?;

    // the policy's best actions, without exploration noise
    let mut policy = output.policy;
    let result = evaluate(&*factory, Isa::best(), &policy, &EvalOptions { episodes: 32, ..Default::default() })?;
    println!(
        "{} episodes: {:.2} m/s, return {:.0} ± {:.0}, {} falls",
        result.episodes, result.speed_mean, result.return_mean, result.return_std, result.falls
    );
    policy.set_evaluation(result);
    policy.save(&path)?;
    println!("wrote {}", path.display());
    Ok(())
}
