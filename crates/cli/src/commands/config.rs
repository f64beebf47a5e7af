//! `marathon config`: the settings of a run, and files of ML-Agents in Marathon's own form.

use crate::args::{ConfigCommand, ConvertArgs, ShowArgs};
use crate::error::CliError;
use marathon_config::convert;
use marathon_learn::write_atomic;
use marathon_physics::budget;
use marathon_runs::terminal::{self, print_json, say};
use marathon_runs::text::path_word;
use marathon_runs::{RunError, TaskConfig, configuration, output};

/// Shows or converts.
///
/// # Errors
/// If there is no such task or file, the settings are not usable, or the result cannot be written.
pub fn run(command: &ConfigCommand, json: bool) -> Result<(), CliError> {
    match command {
        ConfigCommand::Show(args) => show(args, json),
        ConfigCommand::Convert(args) => converted(args, json),
    }
}

/// Prints what a run would be trained with.
fn show(args: &ShowArgs, json: bool) -> Result<(), CliError> {
    let ShowArgs { task, config, algo, set } = args;
    let task = TaskConfig::named(task)?;
    let loaded = configuration::of(&task.agent, config.as_deref(), algo.as_deref(), set)?;
    configuration::check(&loaded, task)?;
    terminal::notes(loaded.notes.clone());
    match json {
        true => print_json(&loaded.document()),
        false => say(loaded.to_yaml().trim_end()),
    }
    Ok(())
}

/// Writes a file of ML-Agents in Marathon's form.
fn converted(args: &ConvertArgs, json: bool) -> Result<(), CliError> {
    let ConvertArgs { file, out } = args;
    let bytes = budget::read(file, &budget::CONFIG_FILE).map_err(RunError::io(file, "read"))?;
    let (text, notes) = convert(file, &bytes)?;
    terminal::notes(notes.clone());
    match out {
        Some(out) => {
            output::check(out, &["yaml", "yml"], &[file])?;
            write_atomic(out, text.as_bytes())?;
            if !json {
                say(format!("wrote {}", path_word(out)));
            }
        }
        None if !json => say(text.trim_end()),
        None => {}
    }
    if json {
        print_json(&serde_json::json!({ "out": out, "yaml": text, "notes": notes }));
    }
    Ok(())
}
