//! `marathon completions`: a completion script for a shell.

use crate::args::Args;
use clap::CommandFactory;
use clap_complete::{Shell, generate};
use std::io::Write;

/// Prints the script.
pub fn run(shell: Shell) {
    let mut script = Vec::new();
    generate(shell, &mut Args::command(), "marathon", &mut script);
    // the reader of a pipe may have closed it
    let _ = std::io::stdout().write_all(&script);
}
