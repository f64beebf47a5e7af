//! `marathon train`: from a configuration to a folder with a policy.

use crate::args::TrainArgs;
use crate::commands::{recipe, render};
use crate::error::CliError;
use crate::program::{self, resume_command};
use marathon_learn::{Control, IterationStats, Players};
use marathon_runs::processes::Processes;
use marathon_runs::report::summary::{EPISODES, evaluation_table};
use marathon_runs::terminal::{self, interrupt, print_json, say};
use marathon_runs::{Session, Task, text};
use std::io::IsTerminal;

/// Trains, evaluates, writes everything.
///
/// # Errors
/// If the command line, the configuration or the run to go on with is not usable, or files cannot be written;
/// [`CliError::Interrupted`] after Ctrl-C.
pub fn run(args: &TrainArgs, json: bool) -> Result<(), CliError> {
    if let Some(recipe) = recipe::of(args)? {
        return recipe::run(recipe, args, json);
    }
    let task = args.agent.as_deref().map(Task::named).transpose()?;
    let (session, notes) = Session::open(task, &args.run, None, false)?;
    terminal::notes(notes);
    let spec = session.factory.spec().clone();
    let (total_steps, agent) = (session.run.config.run.total_steps, session.run.agent.clone());
    interrupt::install("finishing this iteration and writing the results")?;
    session.announcement().into_iter().for_each(terminal::note);
    let stop = |_: &IterationStats| if interrupt::requested() { Control::Stop } else { Control::Continue };
    let mut processes = match args.run.processes {
        0 => None,
        n => match Processes::start(&program::file(), &session.task_config, &session.run.config, n) {
            Ok(processes) => Some(processes),
            Err(error) => {
                session.abandon();
                return Err(error.into());
            }
        },
    };
    let players = processes.as_mut().map(|processes| processes as &mut dyn Players);
    let outcome = session.carry_out_with(players, true, &mut { stop })?;
    if let Some(cause) = processes.and_then(|mut processes| processes.error.take()) {
        let advice = format!("what is done is saved; continue with {}", resume_command(&outcome.summary.folder));
        return Err(CliError::Lost { cause, advice });
    }
    if let Some(line) = text::broken(outcome.summary.diverged) {
        terminal::note(format!("{line}; see the column `diverged` of progress.csv"));
    }
    if let Some(line) = text::skipped(outcome.summary.skipped_minibatches) {
        terminal::note(line);
    }
    if json {
        print_json(&outcome.summary);
    }
    let path = &outcome.summary.folder;
    let Some(eval) = outcome.evaluation else {
        return Err(CliError::Interrupted(format!(
            "{} of {} steps are done and saved; continue with {}",
            text::thousands(outcome.steps),
            text::thousands(total_steps),
            resume_command(path)
        )));
    };
    if json {
        return Ok(());
    }
    let (program, path) = (program::name(), text::path_word(path));
    say(outcome.summary.training_line());
    say(format!("\nits best actions over {EPISODES} episodes:"));
    say(evaluation_table(&eval, spec.max_episode_steps, spec.dt));
    outcome.summary.imitation.iter().for_each(|clip| say(clip.table()));
    say(format!("\nwritten to {path}: policy.safetensors, summary.json, progress.csv, curve.png, TensorBoard events"));
    let name = format!("{}.gif", text::short_name(&agent));
    if args.video || (!args.no_video && std::io::stdout().is_terminal()) {
        let video = outcome.summary.folder.join(name);
        say(format!("video        {}", render::preview(&outcome.summary.folder, &video)?));
    } else {
        say(format!("watch it:    {program} render {path} --out {name}"));
    }
    Ok(())
}
