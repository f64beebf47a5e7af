//! `marathon rollout-worker`: plays for `marathon train --processes`.

use crate::error::CliError;
use marathon_runs::processes;
use marathon_runs::terminal::interrupt;

/// Plays what the learner asks for, until it hangs up.
///
/// # Errors
/// If what is asked for makes no sense.
pub fn run() -> Result<(), CliError> {
    // Ctrl-C is for the learner, which finishes its iteration
    interrupt::listen(|| {})?;
    Ok(processes::serve()?)
}
