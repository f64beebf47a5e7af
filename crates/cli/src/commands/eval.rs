//! `marathon eval`: evaluates a policy.

use crate::args::EvalArgs;
use crate::error::CliError;
use marathon_learn::{EvalOptions, Evaluation, Policy, evaluate_roles};
use marathon_physics::lanes::Isa;
use marathon_runs::report::summary;
use marathon_runs::terminal::{self, print_json, say};
use marathon_runs::{Imitation, imitation, text};
use serde::Serialize;
use std::collections::BTreeMap;

/// Output of `eval --json`.
#[derive(Serialize)]
struct Report<'a> {
    #[serde(flatten)]
    eval: &'a Evaluation,
    /// Results of the task's other roles.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    roles: BTreeMap<&'a str, &'a Evaluation>,
    #[serde(skip_serializing_if = "<[_]>::is_empty")]
    imitation: &'a [Imitation],
}

/// Plays whole episodes and prints the results.
///
/// # Errors
/// If there is no such policy, or it is for another agent.
pub fn run(args: &EvalArgs, json: bool) -> Result<(), CliError> {
    let (policies, factory) = args.source.load_all()?;
    terminal::notes(args.source.note());
    let options = EvalOptions { episodes: args.episodes as usize, seed: args.seed, threads: args.threads };
    let all: Vec<&Policy> = policies.iter().collect();
    let results = evaluate_roles(&*factory, Isa::best(), &all, &options)?;
    let imitation = imitation::measure(&policies[0], &options)?;
    let spec = factory.spec();
    let roles = spec.roles.iter().map(|role| role.name.as_str()).zip(&results).skip(1);
    if json {
        print_json(&Report { eval: &results[0], roles: roles.collect(), imitation: &imitation });
    } else {
        say(format!("{} ({})", spec.id, args.source.policy.display()));
        policies[0].meta().lineage.iter().for_each(|stage| say(format!("  stage     {}", text::ancestor(stage))));
        say(summary::evaluation_table(&results[0], spec.max_episode_steps, spec.dt));
        for (name, Evaluation { return_mean, return_std, .. }) in roles {
            say(format!("  {name:<9} return {return_mean:.1} \u{b1} {return_std:.1}"));
        }
        imitation.iter().for_each(|clip| say(clip.table()));
    }
    Ok(())
}
