//! `marathon eval`: how good a policy is.

use crate::args::EvalArgs;
use crate::console::{print_json, say};
use crate::error::CliError;
use marathon_learn::{EvalOptions, Evaluation, evaluate};
use marathon_physics::lanes::Isa;
use marathon_runs::report::summary;
use marathon_runs::{Imitation, imitation};
use serde::Serialize;

/// What `eval --json` prints.
#[derive(Serialize)]
struct Report<'a> {
    #[serde(flatten)]
    eval: &'a Evaluation,
    #[serde(skip_serializing_if = "<[_]>::is_empty")]
    imitation: &'a [Imitation],
}

/// Plays whole episodes and reports on them.
///
/// # Errors
/// If there is no such policy, or it is for another agent.
pub fn run(args: &EvalArgs, json: bool) -> Result<(), CliError> {
    let (policy, factory) = args.source.load()?;
    let options = EvalOptions { episodes: args.episodes as usize, seed: args.seed, threads: args.threads };
    let result = evaluate(&*factory, Isa::best(), &policy, &options)?;
    let imitation = imitation::measure(&policy, &options)?;
    if json {
        print_json(&Report { eval: &result, imitation: &imitation });
    } else {
        let spec = factory.spec();
        say(format!("{} ({})", spec.id, args.source.policy.display()));
        say(summary::evaluation_table(&result, spec.max_episode_steps, spec.dt));
        imitation.iter().for_each(|clip| say(clip.table()));
    }
    Ok(())
}
