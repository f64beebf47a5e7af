//! `marathon rollout-worker`: plays rollouts for `marathon train --processes`.

use crate::error::CliError;
use marathon_runs::processes;
use marathon_runs::terminal::interrupt;

/// Plays rollouts for the learner until it closes the connection.
///
/// # Errors
/// If a request is invalid.
pub fn run() -> Result<(), CliError> {
    // the learner handles Ctrl-C and finishes its iteration
    interrupt::listen(|| {})?;
    Ok(processes::serve()?)
}
