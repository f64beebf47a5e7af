//! `marathon completions`: a completion script for a shell.

use crate::args;
use crate::error::CliError;
use clap::Command;
use clap_complete::{Shell, generate};
use marathon_runs::terminal::say;

/// Prints the script, without the commands that help does not show.
///
/// # Errors
/// None today; all commands return a result.
pub fn run(shell: Shell) -> Result<(), CliError> {
    let whole = args::command();
    let shown = whole.get_subcommands().filter(|command| !command.is_hide_set()).cloned();
    let mut command = Command::new("marathon")
        .version(env!("CARGO_PKG_VERSION"))
        .args(whole.get_arguments().cloned())
        .subcommands(shown);
    let mut script = Vec::new();
    generate(shell, &mut command, "marathon", &mut script);
    say(String::from_utf8_lossy(&script).trim_end());
    Ok(())
}
