//! `marathon train`: from a configuration to a folder with a policy.

use crate::args::TrainArgs;
use crate::config;
use crate::console::{self, say};
use crate::error::CliError;
use crate::folder::{RunFile, RunFolder, write_json};
use crate::report::csv::History;
use crate::report::summary::{EPISODES, Summary, evaluation_table};
use crate::report::{Reporter, curve, print_json, save};
use crate::{interrupt, text};
use marathon_envs::{ShardFactory, registry};
use marathon_learn::{Checkpoint, EvalOptions, TrainOutput, evaluate, train};
use marathon_physics::lanes::Isa;
use std::path::Path;
use std::sync::Arc;

/// A run about to begin or to go on.
struct Start {
    folder: RunFolder,
    run: RunFile,
    factory: Arc<dyn ShardFactory>,
    checkpoint: Option<Checkpoint>,
}

/// Trains, evaluates, writes everything.
///
/// # Errors
/// If the command line, the configuration or the run to go on with is not usable, or files cannot be written;
/// [`CliError::Interrupted`] after Ctrl-C.
pub fn run(args: &TrainArgs, json: bool) -> Result<(), CliError> {
    let start = match &args.resume {
        None => begin(args)?,
        Some(folder) => resume(args, folder)?,
    };
    let Start { folder, run, factory, checkpoint } = start;
    let spec = factory.spec().clone();
    let done = checkpoint.as_ref().map_or(0, Checkpoint::steps);
    interrupt::install("finishing this iteration and writing the results")?;
    announce(&folder, &run, done);

    let mut reporter = Reporter::new(&folder, &run, &spec.reward_terms, checkpoint.as_ref())?;
    let result = train(&*factory, Isa::best(), &run.config, checkpoint, &mut reporter);
    reporter.finish();
    let error = reporter.error.take();
    let TrainOutput { mut policy, checkpoint, .. } = result?;

    // what was learned is safe before anything else happens
    let saved = save(&folder, &policy, &checkpoint);
    let steps = checkpoint.steps();
    if let Some(cause) = error {
        return Err(stopped(&folder, cause, saved.is_ok(), steps));
    }
    saved.map_err(|cause| stopped(&folder, cause, false, steps))?;

    let (history, drawn) = match History::read(&folder.progress()) {
        Ok(history) => {
            let drawn = curve::draw(&folder, &run, &history);
            (history, drawn)
        }
        Err(error) => (History::default(), Err(error)),
    };
    if steps < run.config.total_steps {
        let summary = Summary::new(folder.path().into(), &policy, &history, true, None);
        note_broken(&summary);
        write_json(&folder.summary(), &summary)?;
        drawn?;
        if json {
            print_json(&summary);
        }
        return Err(CliError::Interrupted(format!(
            "{} of {} steps are done and saved; go on by `{}`",
            text::thousands(steps),
            text::thousands(run.config.total_steps),
            resume_command(folder.path())
        )));
    }

    let options = EvalOptions { episodes: EPISODES, threads: run.config.threads, ..Default::default() };
    let eval = evaluate(&*factory, Isa::best(), &policy, &options)?;
    policy.set_evaluation(eval);
    policy.save(&folder.policy())?;
    let summary = Summary::new(folder.path().into(), &policy, &history, false, Some(eval));
    note_broken(&summary);
    write_json(&folder.summary(), &summary)?;
    drawn?;
    if json {
        print_json(&summary);
        return Ok(());
    }
    let (program, path) = (text::program(), text::path_word(folder.path()));
    say(summary.training_line());
    say(format!("\nits best actions over {EPISODES} episodes:"));
    say(evaluation_table(&eval, spec.max_episode_steps, spec.dt));
    say(format!("\nwritten to {path}: policy.safetensors, summary.json, progress.csv, curve.png, TensorBoard events"));
    say(format!("see it by    {program} render {path} --out {}.gif", text::short_name(&run.agent)));
    Ok(())
}

/// A new run, its folder made and its configuration written there.
fn begin(args: &TrainArgs) -> Result<Start, CliError> {
    // the command line requires it unless resuming
    let name = args.agent.as_deref().unwrap_or_default();
    let factory = registry::factory(name, Isa::best())?;
    let agent = factory.spec().id.clone();
    let mut loaded = match &args.config {
        Some(path) => config::load(path, &agent)?,
        None => config::default_for(&agent),
    };
    let ppo = &mut loaded.ppo;
    ppo.agents = args.agents.unwrap_or(ppo.agents);
    ppo.total_steps = args.steps.unwrap_or(ppo.total_steps);
    ppo.seed = args.seed.unwrap_or(ppo.seed);
    ppo.threads = args.threads.unwrap_or(ppo.threads);
    ppo.validate()?;
    loaded.summary_freq = loaded.summary_freq.max(1);
    loaded.checkpoint_interval = loaded.checkpoint_interval.max(1);
    for note in &loaded.notes {
        console::note(format!("note: {note}"));
    }
    let run = RunFile::new(&agent, &loaded);
    let folder = RunFolder::create(args.out.as_deref(), &agent)?;
    folder.write_run(&run)?;
    Ok(Start { folder, run, factory, checkpoint: None })
}

/// The run in a folder, from its last checkpoint.
fn resume(args: &TrainArgs, path: &Path) -> Result<Start, CliError> {
    let (folder, mut run) = RunFolder::open(path)?;
    let factory = registry::factory(&run.agent, Isa::best())?;
    if let Some(name) = &args.agent {
        let asked = registry::agent(name)?.facts().id;
        if asked != run.agent {
            return Err(CliError::file(path, "agent", &run.agent, asked));
        }
    }
    // a run that ended before its first checkpoint begins again, which gives the same bits
    let has_checkpoint = folder.checkpoint().join("checkpoint.json").exists();
    let checkpoint = if has_checkpoint { Some(Checkpoint::load(&folder.checkpoint())?) } else { None };
    let done = checkpoint.as_ref().map_or(0, Checkpoint::steps);

    if let Some(steps) = args.steps {
        if steps < done {
            let done = text::thousands(done);
            return Err(CliError::Usage(format!("--steps is {}, but {done} steps are done", text::thousands(steps))));
        }
        run.config.total_steps = steps;
    }
    if done >= run.config.total_steps && folder.summary().exists() && is_finished(&folder)? {
        let (done, more) = (text::thousands(done), text::thousands(done * 2));
        return Err(CliError::Usage(format!(
            "{}: the run is complete with {done} steps; to let it learn on, give it more, such as --steps {more}",
            path.display()
        )));
    }
    run.config.threads = args.threads.unwrap_or(run.config.threads);
    folder.write_run(&run)?;
    Ok(Start { folder, run, factory, checkpoint })
}

/// Whether the summary has an evaluation, the last thing that a run does.
fn is_finished(folder: &RunFolder) -> Result<bool, CliError> {
    let path = folder.summary();
    let text = std::fs::read_to_string(&path).map_err(CliError::io(&path, "read"))?;
    Ok(serde_json::from_str::<Summary>(&text).is_ok_and(|s| s.eval.is_some()))
}

fn announce(folder: &RunFolder, run: &RunFile, done: u64) {
    let config = &run.config;
    let (verb, from) = match done {
        0 => ("training", String::new()),
        _ => ("going on with", format!(" from step {}", text::thousands(done))),
    };
    console::note(format!(
        "{verb} {}{from} to {}: {} agents, {} thread{}, {}, seed {}; results in {}",
        run.agent,
        text::thousands(config.total_steps),
        config.agents,
        config.worker_count(),
        if config.worker_count() == 1 { "" } else { "s" },
        Isa::best().name(),
        config.seed,
        folder.path().display()
    ));
}

/// Says so if agents broke down on the way.
fn note_broken(summary: &Summary) {
    if let Some(line) = text::broken(summary.diverged) {
        console::note(format!("{line}; see the column `diverged` of progress.csv"));
    }
}

/// The error of a run whose files could no longer be written.
fn stopped(folder: &RunFolder, cause: CliError, saved: bool, steps: u64) -> CliError {
    let command = resume_command(folder.path());
    let advice = if saved {
        format!("training stopped; its {} steps are saved: mend that and go on by `{command}`", text::thousands(steps))
    } else {
        match Checkpoint::load(&folder.checkpoint()) {
            Ok(old) => format!(
                "training stopped; the last whole checkpoint has {} of {} steps: mend that and go on by `{command}`",
                text::thousands(old.steps()),
                text::thousands(steps)
            ),
            Err(_) => format!("training stopped before its first checkpoint: mend that and start again by `{command}`"),
        }
    };
    CliError::Stopped { cause: Box::new(cause), advice }
}

fn resume_command(folder: &Path) -> String {
    format!("{} train --resume {}", text::program(), text::path_word(folder))
}
