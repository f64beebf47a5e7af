//! `marathon average`: the mean of policies.

use crate::args::AverageArgs;
use crate::commands::convert::{save, tell};
use crate::error::CliError;
use marathon_runs::average::average;
use marathon_runs::{output, policy_file};
use std::path::{Path, PathBuf};

/// Averages policies and writes the mean.
///
/// # Errors
/// If a file is not a policy, the policies do not match, or the mean cannot be written.
pub fn run(args: &AverageArgs, json: bool) -> Result<(), CliError> {
    output::check(&args.out, &policy_file::ENDINGS, &args.policies)?;
    let (policy, paths) = average(&args.policies, &args.task)?;
    let inputs: Vec<&Path> = paths.iter().map(PathBuf::as_path).collect();
    save(&policy, &inputs, &args.out)?;
    tell(&policy, &args.out, json);
    Ok(())
}
