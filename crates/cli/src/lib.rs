//! The `marathon` command: trains, evaluates, benchmarks and shows agents.
//!
//! Results go to stdout, progress and errors to stderr. With `--json`, stdout carries exactly one JSON object. The exit code is
//! 0 on success, 1 on failure, 2 for a wrong command line, 130 after Ctrl-C. If stdout loses output, the command fails, unless
//! the reader has closed the pipe.
//!
//! Training runs are in `marathon-runs`, which the game and the Python package use, too.

mod args;
mod bench;
mod commands;
mod error;
mod motion;
mod number;
mod program;
mod video;

use args::{Args, Command};
use clap::FromArgMatches;
use clap::error::{ContextKind, ContextValue};
use error::CliError;
use marathon_physics::budget;
use marathon_physics::lanes::Isa;
use marathon_runs::terminal;
use std::ffi::OsString;

/// Advice for the former command `marathon study`.
const STUDIES: &str = "the studies are in marathon-studies: `cargo run --release -p marathon-studies -- --help`";

/// Runs the command with the words of a command line, the first of which is the program's name. Returns its exit code.
///
/// The Python package, which includes the command, calls this function. Call it at the end of a process: long commands
/// replace the handler of Ctrl-C.
pub fn main(words: impl IntoIterator<Item = OsString>) -> u8 {
    let words: Vec<OsString> = words.into_iter().collect();
    program::set_name(words.first());
    let code = match parse(&words) {
        Ok(args) => match dispatch(&args) {
            Ok(()) => 0,
            Err(error) => {
                // an interrupted run has already printed its summary, and a check its report
                let json = args.json && !matches!(error, CliError::Interrupted(_) | CliError::Found(_));
                terminal::failed(&error, json);
                error.exit_code()
            }
        },
        Err(answer) => terminal::refused(&with_advice(answer), words.iter().any(|word| word == "--json")),
    };
    terminal::finish(code)
}

/// Reads the words of a command line.
fn parse(words: &[OsString]) -> Result<Args, clap::Error> {
    let mut command = args::command();
    let found = command.try_get_matches_from_mut(words)?;
    Args::from_arg_matches(&found).map_err(|error| error.format(&mut command))
}

/// Adds the new place of the studies to the error of `marathon study`, and leaves hidden commands out of lists.
fn with_advice(mut answer: clap::Error) -> clap::Error {
    if answer.get(ContextKind::InvalidSubcommand) == Some(&ContextValue::String("study".into())) {
        answer.insert(ContextKind::Suggested, ContextValue::StyledStrs(vec![STUDIES.into()]));
    }
    if let Some(ContextValue::Strings(names)) = answer.get(ContextKind::ValidSubcommand) {
        let command = args::command();
        let hidden = |name: &str| command.find_subcommand(name).is_some_and(clap::Command::is_hide_set);
        let shown = names.iter().filter(|name| !hidden(name)).cloned().collect();
        answer.insert(ContextKind::ValidSubcommand, ContextValue::Strings(shown));
    }
    answer
}

fn dispatch(args: &Args) -> Result<(), CliError> {
    if let Some(obstacle) = Isa::best().obstacle() {
        return Err(CliError::Processor(obstacle));
    }
    // any limit reads the whole variable
    budget::MEMORY.most().map_err(|error| CliError::Usage(error.to_string()))?;
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
        Command::Serve(serve) => commands::serve::run(serve, args.json),
        Command::List { agent, task } => commands::list::run(agent.as_deref(), task, args.json),
        Command::Bench(bench) => bench::run(bench, args.json),
        Command::Config(command) => commands::config::run(command, args.json),
        Command::RolloutWorker => commands::rollout_worker::run(),
        Command::Motion(what) => motion::run(what, args.json),
        Command::Skin(skin) => commands::skin::run(skin, args.json),
        Command::Doctor => commands::doctor::run(args.json),
        Command::Completions { shell } => commands::completions::run(*shell),
    }
}
