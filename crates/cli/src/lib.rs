//! The `marathon` command: trains, evaluates, benchmarks and shows agents.
//!
//! What a person reads goes to stdout, progress and errors to stderr. With `--json`, stdout carries exactly one JSON
//! object. The exit code is 0 on success, 1 on failure, 2 on a command line that makes no sense, 130 after Ctrl-C. What
//! stdout does not take is a failure, but for a reader that has left.
//!
//! What makes a run is in `marathon-runs`, which the game and the Python package use, too.

mod args;
mod bench;
mod commands;
mod console;
mod error;
mod film;
mod interrupt;
mod motion;
mod program;
mod python;
mod study;

use args::{Args, Command};
use clap::Parser;
use error::CliError;
use std::ffi::OsString;

/// Runs the command with the words of a command line, the first being the program's own name, and returns its exit code.
///
/// It is a function because the Python package brings the command along; nothing else uses this library. It belongs at the
/// end of a process: commands that take long replace the handler of Ctrl-C.
pub fn main(words: impl IntoIterator<Item = OsString>) -> u8 {
    let words: Vec<OsString> = words.into_iter().collect();
    program::set_name(words.first());
    let code = match Args::try_parse_from(&words) {
        Ok(args) => match dispatch(&args) {
            Ok(()) => 0,
            Err(error) => {
                console::note(format!("error: {error}"));
                // an interrupted run has printed its summary already, a check its report
                if args.json && !matches!(error, CliError::Interrupted(_) | CliError::Found(_)) {
                    console::print_json(&serde_json::json!({ "error": error.to_string() }));
                }
                error.exit_code()
            }
        },
        // help goes to stdout with code 0, a wrong command line to stderr with code 2
        Err(answer) => {
            let printed = answer.print();
            if !answer.use_stderr() {
                console::written(printed);
            } else if words.iter().any(|word| word == "--json") {
                let text = answer.render().to_string();
                let text = text.trim().trim_start_matches("error: ");
                console::print_json(&serde_json::json!({ "error": text }));
            }
            answer.exit_code() as u8
        }
    };
    match console::finish() {
        Ok(()) => code,
        Err(error) => {
            console::note(format!("error: {error}"));
            if code == 0 { error.exit_code() } else { code }
        }
    }
}

fn dispatch(args: &Args) -> Result<(), CliError> {
    match &args.command {
        Command::Train(train) => commands::train::run(train, args.json),
        Command::Distill(distill) => commands::distill::run(distill, args.json),
        Command::Eval(eval) => commands::eval::run(eval, args.json),
        Command::Render(render) => commands::render::run(render, args.json),
        Command::Average(average) => commands::average::run(average, args.json),
        Command::Export(export) => commands::convert::export(export, args.json),
        Command::Import(import) => commands::convert::import(import, args.json),
        Command::RecordDemo(record) => commands::record_demo::run(record, args.json),
        Command::Play(play) => commands::play::run(play),
        Command::List { agent } => commands::list::run(agent.as_deref(), args.json),
        Command::Bench(bench) => bench::run(bench, args.json),
        Command::RolloutWorker => commands::rollout_worker::run(),
        Command::Motion(what) => motion::run(what, args.json),
        Command::Study(study) => study::run(study, args.json),
    }
}
