//! Training as a library call, without a command line and without files until you save the policy.
//!
//! [`Trainer`] starts from the tuned settings of a task. [`Trainer::set`] changes one, and the function of
//! [`Trainer::on_iteration`] sees the numbers of each iteration and can stop the run. Here it prints a line now and then, and
//! stops the run early once the walker is fast and rarely falls.
//!
//! The command `marathon train` adds a progress bar and Ctrl-C. With [`Trainer::folder`] the run writes the same files.
//!
//! ```sh
//! cargo run --release -p marathon-examples --bin train_a_policy                       # about ten seconds
//! cargo run --release -p marathon-examples --bin train_a_policy -- 100000 walker.safetensors
//! ```

use marathon_rl::prelude::*;
use std::path::PathBuf;

/// Mean speed (m/s) and fraction of episodes that end in a fall at which the run stops early.
const GOOD_ENOUGH: (f64, f64) = (3.0, 0.1);

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut args = std::env::args().skip(1);
    let total_steps: u64 = args.next().map_or(Ok(6_000_000), |steps| steps.parse())?;
    let path = PathBuf::from(args.next().unwrap_or_else(|| "walker2d.safetensors".into()));

    let watch = |stats: &IterationStats| {
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
    // a shorter horizon of reward than the task's own 0.985: this walker learns sooner, and falls a little more often
    let trainer = Trainer::new("walker2d")?.steps(total_steps).seed(1).set("rewards.task.gamma", 0.98);
    let mut policy = trainer.on_iteration(watch).run()?.policy;

    // the policy's best actions, without exploration noise
    let result = evaluate(&policy, &EvalOptions { episodes: 32, ..Default::default() })?;
    println!(
        "{} episodes: {:.2} m/s, return {:.0} ± {:.0}, {} falls",
        result.episodes, result.speed_mean, result.return_mean, result.return_std, result.falls
    );
    policy.set_evaluation(result);
    policy.save(&path)?;
    println!("wrote {}", path.display());
    Ok(())
}
