//! `marathon-studies`: the experiments of the paper and of this project. Each study writes a table (`.csv` and `.md`) and a
//! picture (`.png`) with the command, the version and the processor, so that other people can repeat it.

mod agreement;
mod args;
mod assault_course;
mod concurrency;
mod decision_period;
mod error;
mod fresh_courses;
mod headless;
mod kept;
mod multi_env;
mod obstacles;
mod peers;
mod record;
mod reproduce;
mod statistics;
mod style_transfer;
mod table1;
mod table2;
mod table3;
mod training;

use args::{Args, Command, Study};
use clap::Parser;
use error::StudyError;
use marathon_runs::processes;
use marathon_runs::terminal::{self, interrupt, print_json, say};
use std::ffi::OsString;
use std::process::ExitCode;

fn main() -> ExitCode {
    let words: Vec<OsString> = std::env::args_os().collect();
    let code = match Args::try_parse_from(&words) {
        Ok(args) => match run(&args) {
            Ok(()) => 0,
            Err(error) => {
                terminal::failed(&error, args.json && !matches!(error, StudyError::Interrupted(_)));
                error.exit_code()
            }
        },
        Err(answer) => terminal::refused(&answer, words.iter().any(|word| word == "--json")),
    };
    terminal::finish(code).into()
}

fn run(args: &Args) -> Result<(), StudyError> {
    let study = match &args.command {
        Command::Study(study) => study,
        Command::Reproduce(options) => return reproduce::run(options, args.json),
        Command::RolloutWorker => {
            // the learner handles Ctrl-C and finishes its iteration
            interrupt::listen(|| {})?;
            return Ok(processes::serve()?);
        }
    };
    let options = study.options();
    options.check_out()?;
    let record = match study {
        Study::Table1 { peers, .. } => table1::run(options, peers),
        Study::Table2(_) => table2::run(options),
        Study::Table3 { peers, .. } => table3::run(options, peers),
        Study::MlagentsAgreement(_) => agreement::run(options),
        Study::Concurrency(_) => concurrency::run(options),
        Study::DecisionPeriod(_) => decision_period::run(options),
        Study::Headless(_) => headless::run(options),
        Study::MultiEnv(_) => multi_env::run(options),
        Study::StyleTransfer { clips, kept_only, .. } => style_transfer::run(options, clips, *kept_only),
        Study::Obstacles { policies, .. } => obstacles::run(options, policies),
        Study::FreshCourses { policies, fresh, .. } => fresh_courses::run(options, policies, (*fresh).max(1)),
        Study::AssaultCourse { tasks, grounds, sights, kept_only, no_adversary, fresh, .. } => {
            let evaluations =
                assault_course::Evaluations { kept_only: *kept_only, adversary: !no_adversary, fresh: *fresh };
            assault_course::run(options, [tasks, grounds, sights], evaluations)
        }
    }?;
    let page = record.save(options)?;
    if args.json {
        print_json(&record)
    } else {
        say(page)
    }
    Ok(())
}
