//! `marathon eval`: how good a policy is.

use crate::args::EvalArgs;
use crate::console::{print_json, say};
use crate::error::CliError;
use marathon_learn::{EvalOptions, evaluate};
use marathon_physics::lanes::Isa;
use marathon_runs::report::summary;

/// Plays whole episodes and reports on them.
///
/// # Errors
/// If there is no such policy, or it is for another agent.
pub fn run(args: &EvalArgs, json: bool) -> Result<(), CliError> {
    let (policy, factory) = args.source.load()?;
    let options = EvalOptions { episodes: args.episodes as usize, seed: args.seed, threads: args.threads };
    let result = evaluate(&*factory, Isa::best(), &policy, &options)?;
    if json {
        print_json(&result);
    } else {
        let spec = factory.spec();
        say(format!("{} ({})", spec.id, args.source.policy.display()));
        say(summary::evaluation_table(&result, spec.max_episode_steps, spec.dt));
    }
    Ok(())
}
