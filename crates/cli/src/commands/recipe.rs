//! `marathon train` for a task with a recipe, or for a file with stages.

use crate::args::TrainArgs;
use crate::commands::render;
use crate::error::CliError;
use crate::program;
use marathon_config::Recipe;
use marathon_runs::recipe::{self, End, Front, Listed, RecipeOptions, RecipeRun, RecipeSummary};
use marathon_runs::report::summary::{EPISODES, evaluation_table};
use marathon_runs::terminal::{interrupt, note, print_json, say};
use marathon_runs::{RunError, TaskOptions, policy_file, text};
use std::io::IsTerminal;
use std::path::Path;

/// The recipe that a command line names, with its options. `None` for a single run.
///
/// # Errors
/// If the file has no stages, or an option of a single run stands beside it.
pub fn of(args: &TrainArgs) -> Result<Option<(Recipe, RecipeOptions)>, CliError> {
    let run = &args.run;
    let options = RecipeOptions {
        out: run.out.clone(),
        seed: run.learn.seed,
        threads: run.learn.threads,
        redo: args.redo.clone(),
    };
    let of_recipe = if args.list_stages { Some("list_stages") } else { (!args.redo.is_empty()).then_some("redo") };
    let single = of_single_run(args);
    let refused = |name, problem: &str| Err(RunError::option(name, problem).into());
    let single_name = |file: &str| format!("is for a single run, not for the stages of {file}");
    if let Some(folder) = &run.resume {
        let Some((recipe, seed)) = recipe::of_folder(folder)? else {
            return match of_recipe {
                Some(name) => refused(name, "is for recipes, and the folder holds a single run"),
                None => Ok(None),
            };
        };
        if let Some(name) = single {
            return refused(name, &single_name(&folder.display().to_string()));
        }
        for (name, given) in [("out", run.out.is_some()), ("seed", run.learn.seed.is_some())] {
            if given {
                return Err(RunError::NewRunOnly { name }.into());
            }
        }
        return Ok(Some((recipe, RecipeOptions { out: Some(folder.clone()), seed: Some(seed), ..options })));
    }
    let Some(name) = args.agent.as_deref() else { return Ok(None) };
    if recipe::is_file(name) {
        let recipe = recipe::read(Path::new(name))?;
        return match single {
            Some(single) => refused(single, &single_name(name)),
            None => Ok(Some((recipe, options))),
        };
    }
    match (recipe::of_task(name), single, of_recipe) {
        (Some(recipe), None, _) => Ok(Some((recipe, options))),
        (Some(recipe), Some(single), None) => {
            let single = program::spelled(|flags| flags.option(single));
            note(format!("note: {single} trains a single run, without the stages of the recipe of {}", recipe.task));
            Ok(None)
        }
        (Some(_), Some(single), Some(_)) => refused(single, &single_name(name)),
        (None, _, Some(of_recipe)) => refused(of_recipe, &format!("is for recipes, and {name} has none")),
        (None, _, None) => Ok(None),
    }
}

/// The first option that is for a single run.
fn of_single_run(args: &TrainArgs) -> Option<&'static str> {
    let run = &args.run;
    let options = [
        ("config", run.learn.config.is_some()),
        ("algo", run.learn.algo.is_some()),
        ("set", !run.learn.set.is_empty()),
        ("steps", run.learn.steps.is_some()),
        ("option", !run.task.given.is_empty()),
        ("agents", run.agents.is_some()),
        ("processes", run.processes > 0),
        ("initialize_from", run.initialize_from.is_some()),
    ];
    options.into_iter().find(|(_, given)| *given).map(|(name, _)| name)
}

/// Runs the stages, or lists them.
///
/// # Errors
/// If a stage is wrong, has changed or fails; [`CliError::Interrupted`] after Ctrl-C.
pub fn run((recipe, options): (Recipe, RecipeOptions), args: &TrainArgs, json: bool) -> Result<(), CliError> {
    let run = RecipeRun::new(recipe, &options)?;
    if args.list_stages {
        list(&run.list()?, json);
        return Ok(());
    }
    interrupt::install("finishing this iteration and writing the results")?;
    let mut front = Front { note: &mut |text| note(text), stop: &interrupt::requested, show: true };
    let summary = match run.carry_out(&mut front)? {
        End::Complete(summary) => summary,
        End::Stopped { number, of, stage } => {
            if json {
                let (folder, interrupted) = (run.folder().to_string_lossy(), true);
                print_json(&serde_json::json!({ "folder": folder, "interrupted": interrupted, "stage": stage }));
            }
            let resume = program::resume_command(run.folder());
            let text =
                format!("stage {number} of {of}, {stage}, is not done; its state is saved; continue with {resume}");
            return Err(CliError::Interrupted(text));
        }
    };
    if json {
        print_json(&summary);
        return Ok(());
    }
    report(&summary)?;
    let (program, path) = (program::name(), text::path_word(&summary.folder));
    let name = format!("{}.gif", text::short_name(&summary.agent));
    if args.video || (!args.no_video && std::io::stdout().is_terminal()) {
        say(format!("video        {}", render::preview(&summary.folder, &summary.folder.join(name))?));
    } else {
        say(format!("watch it:    {program} render {path} --out {name}"));
    }
    Ok(())
}

/// Prints the results.
fn report(summary: &RecipeSummary) -> Result<(), CliError> {
    let (steps, seconds) = (text::thousands(summary.steps), text::duration(summary.cpu_seconds));
    say(format!("{}: {steps} steps in {} stages ({seconds} of processor time)", summary.agent, summary.stages.len()));
    for stage in &summary.stages {
        let values = stage.measured.iter().map(|(seed, value)| {
            format!("seed {seed}: {}", value.map_or("no value".into(), |value| value.to_string()))
        });
        let values: Vec<String> = values.collect();
        let values = if values.is_empty() { String::new() } else { format!(" ({})", values.join(", ")) };
        say(format!("  {}{values}", text::ancestor(&stage.ancestor)));
    }
    let path = summary.folder.join("policy.safetensors");
    if let Some(eval) = &summary.eval {
        let (_, factory) = policy_file::load(&path, None, &TaskOptions::default())?;
        let spec = factory.spec();
        say(format!("\nits best actions over {EPISODES} episodes:"));
        say(evaluation_table(eval, spec.max_episode_steps, spec.dt));
    }
    say(format!("\nwritten to {}: policy.safetensors, summary.json", text::path_word(&summary.folder)));
    Ok(())
}

/// Prints the stages.
fn list(stages: &[Listed], json: bool) {
    if json {
        return print_json(&serde_json::json!({ "stages": stages }));
    }
    for stage in stages {
        let Listed { number, stage: name, kind, agent, state, .. } = stage;
        let steps = stage
            .steps
            .filter(|steps| *steps > 0)
            .map_or(String::new(), |steps| format!(", {} steps", text::thousands(steps)));
        let seconds = stage
            .cpu_seconds
            .filter(|seconds| *seconds > 0.0)
            .map_or(String::new(), |seconds| format!(", {}", text::duration(seconds)));
        say(format!("{number:>2} of {}  {name}: {kind} {agent}, {state}{steps}{seconds}", stages.len()));
        stage.commands.iter().for_each(|command| say(format!("          {command}")));
    }
}
