//! Configuration files on disk.

use crate::error::RunError;
use crate::task_config::{TaskConfig, TaskOptions};
use marathon_config::{Loaded, default_for, default_of, parse, set};
use marathon_envs::options::Value;
use marathon_envs::registry;
use marathon_physics::budget;
use marathon_physics::hint::{did_you_mean, nearest};
use std::path::Path;

/// Reads what a file says about a task, which may go by any of its names; what it leaves out, the task's preset says.
///
/// # Errors
/// If the file cannot be read, or is not a configuration for the agent; see [`parse`].
pub fn load(path: &Path, agent: &str) -> Result<Loaded, RunError> {
    let loaded = parse(path, &read(path)?, agent)?;
    check_options(path, "options", agent, &loaded.options)?;
    Ok(loaded)
}

/// Refuses options that a task does not take. `section`: where the file has them.
///
/// # Errors
/// Names the option and the nearest.
pub(crate) fn check_options(
    path: &Path,
    section: &str,
    agent: &str,
    options: &[(String, Value)],
) -> Result<(), RunError> {
    // tasks of a front end are not registered and take no options
    let Ok(agent) = registry::agent(agent) else { return Ok(()) };
    let known: Vec<&str> = agent.options().iter().map(|option| option.name).collect();
    match options.iter().find(|(name, _)| !known.contains(&name.as_str())) {
        Some((name, value)) => {
            let near = did_you_mean(nearest(name, known.iter().copied()));
            let id = agent.facts().id;
            let expected = match known.is_empty() {
                true => format!("no option, because {id} has none"),
                false => format!("an option of {id}: {}{near}", known.join(", ")),
            };
            Err(RunError::file(path, format!("{section}.{name}"), value, expected))
        }
        None => Ok(()),
    }
}

/// The configuration of a new run: that of a file, the settings that an algorithm starts from, or the preset of the task; with
/// settings `KEY=VALUE` over it.
///
/// # Errors
/// If the file or a setting is not usable.
pub fn of(task: &str, file: Option<&Path>, algorithm: Option<&str>, settings: &[String]) -> Result<Loaded, RunError> {
    let loaded = match (file, algorithm) {
        (Some(path), _) => load(path, task)?,
        (None, Some(name)) => default_of(name),
        (None, None) => default_for(task),
    };
    with(loaded, settings)
}

/// Value of the options that add roles to a task.
const ADVERSARY: &str = "adversary";

/// Refuses options and roles that a task does not have. Unlike a run, it allows roles that the task has only with an option of the
/// command line.
///
/// # Errors
/// Names the option or role and the nearest.
pub fn check(loaded: &Loaded, task: TaskConfig) -> Result<(), RunError> {
    let task = task.with(&TaskOptions { given: loaded.options.clone() })?;
    let agent = registry::global().agent_with(&task.agent, &task.options)?;
    let mut names: Vec<String> = agent.facts().roles.into_iter().map(|role| role.name).collect();
    for info in agent.options() {
        let value = Value::from(ADVERSARY);
        if info.takes(&value) {
            let mut options = task.options.clone();
            options.set(info.name, value);
            let with = registry::global().agent_with(&task.agent, &options)?;
            names.extend(with.facts().roles.into_iter().map(|role| role.name));
        }
    }
    names.dedup();
    Ok(loaded.config.check_role_names(&names.iter().map(String::as_str).collect::<Vec<_>>())?)
}

/// A configuration with settings `KEY=VALUE` over it.
///
/// # Errors
/// If a setting is not usable.
pub fn with(loaded: Loaded, settings: &[String]) -> Result<Loaded, RunError> {
    Ok(settings.iter().try_fold(loaded, |loaded, text| set(loaded, text))?)
}

fn read(path: &Path) -> Result<Vec<u8>, RunError> {
    budget::read(path, &budget::CONFIG_FILE).map_err(RunError::io(path, "read"))
}
