//! `bench controller`: how well policies track commands.

use super::options::Head;
use crate::error::CliError;
use crate::number::count;
use marathon_learn::EvalOptions;
use marathon_runs::terminal::{print_json, say};
use marathon_runs::{CommandTracking, PolicySource, controller, output};
use serde::Serialize;
use std::path::PathBuf;

/// Options of `bench controller`.
#[derive(Debug, clap::Args)]
pub struct ControllerArgs {
    #[command(flatten)]
    pub source: PolicySource,
    /// Agents of each trial.
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = count::<u64>(1..=100_000))]
    pub episodes: u64,
    /// Seed of the environments.
    #[arg(long, value_name = "S", default_value_t = EvalOptions::default().seed)]
    pub seed: u64,
    /// Threads; 0 means one per processor. The result does not depend on it.
    #[arg(long, value_name = "T", default_value_t = 0)]
    pub threads: usize,
    /// Picture of the responses to draw.
    #[arg(long, value_name = "F.png")]
    pub out: Option<PathBuf>,
}

/// Output of `--json`.
#[derive(Serialize)]
struct Document<'a> {
    #[serde(flatten)]
    head: Head,
    #[serde(flatten)]
    obedience: &'a CommandTracking,
}

/// Runs the trials.
///
/// # Errors
/// If there is no such policy, its task has no speed command, or the picture cannot be written.
pub fn run(args: &ControllerArgs, json: bool) -> Result<(), CliError> {
    if let Some(out) = &args.out {
        output::check(out, &["png"], &[&args.source.policy])?;
    }
    let (policy, _) = args.source.load()?;
    let options = EvalOptions { episodes: args.episodes as usize, seed: args.seed, threads: args.threads };
    let obedience = controller::measure(&policy, &options)?;
    if let Some(path) = &args.out {
        obedience.draw(path)?;
    }
    if json {
        print_json(&Document { head: Head::new("controller", args.threads), obedience: &obedience });
    } else {
        say(format!("{} ({}), {} agents", obedience.task, args.source.policy.display(), args.episodes));
        say(obedience.table());
    }
    Ok(())
}
