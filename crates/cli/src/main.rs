//! The `marathon` command: trains, evaluates, benchmarks and shows agents.
//!
//! What a person reads goes to stdout, progress and errors to stderr. With `--json`, stdout carries exactly one JSON
//! object. The exit code is 0 on success, 1 on failure, 2 on a command line that makes no sense, 130 after Ctrl-C.

mod args;
mod commands;
mod config;
mod console;
mod error;
mod folder;
mod interrupt;
mod report;
mod text;

use args::{Args, Command};
use clap::Parser;
use error::CliError;
use std::process::ExitCode;

fn main() -> ExitCode {
    let args = Args::parse();
    match dispatch(&args) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            console::note(format!("error: {error}"));
            // an interrupted run has printed its summary already
            if args.json && !matches!(error, CliError::Interrupted(_)) {
                console::print_json(&serde_json::json!({ "error": error.to_string() }));
            }
            ExitCode::from(error.exit_code())
        }
    }
}

fn dispatch(args: &Args) -> Result<(), CliError> {
    match &args.command {
        Command::Train(train) => commands::train::run(train, args.json),
        Command::Eval(eval) => commands::eval::run(eval, args.json),
        Command::Render(render) => commands::render::run(render, args.json),
        Command::List => commands::list::run(args.json),
        Command::Bench(bench) => commands::bench::run(bench, args.json),
    }
}
