//! Measures of a policy by name: what `marathon eval` and `marathon bench controller` report. Recipes choose seeds and end
//! stages by them.

use crate::controller;
use crate::error::RunError;
use crate::policy_file;
use crate::task_config::{TaskConfig, TaskOptions};
use marathon_envs::CommandRange;
use marathon_learn::{EvalOptions, Policy, evaluate_roles};
use marathon_physics::hint::{did_you_mean, nearest};
use marathon_physics::lanes::Isa;
use serde_json::Value;
use std::path::Path;

/// Agent-steps done, a measure that needs no evaluation.
pub const STEPS: &str = "steps";

/// Measures of `marathon eval`, by their keys in its JSON. The task's own metrics are measures, too.
const OF_EVALUATION: [&str; 5] = ["return_mean", "length_mean", "distance_mean", "speed_mean", "falls"];

/// Measures of `marathon bench controller`, by their paths in its JSON.
const OF_COMMANDS: [&str; 11] = [
    "minutes.without_fall",
    "minutes.falls_per_minute",
    "minutes.velocity_error",
    "minutes.settled_error",
    "minutes.slide",
    "stand.still",
    "stand.falls",
    "jumps.0.prompt",
    "jumps.0.falls",
    "backflip.landed",
    "rise.prompt",
];

/// The expected names in place of one that is no measure of a task, with the nearest. `None` for a measure.
///
/// # Errors
/// If the task cannot be created.
pub fn unknown(name: &str, task: &TaskConfig) -> Result<Option<String>, RunError> {
    let names = names(task)?;
    if names.iter().any(|known| known == name) {
        return Ok(None);
    }
    let near = did_you_mean(nearest(name, names.iter().map(String::as_str)));
    Ok(Some(format!("one of {}{near}", names.join(", "))))
}

/// Names of the measures of a task.
fn names(task: &TaskConfig) -> Result<Vec<String>, RunError> {
    let spec = task.factory()?.spec().clone();
    let mut names: Vec<String> = [&[STEPS], &OF_EVALUATION[..]].concat().into_iter().map(String::from).collect();
    names.extend(spec.metrics.iter().map(|metric| metric.name.clone()));
    if spec.command.iter().any(CommandRange::is_speed) {
        names.extend(OF_COMMANDS.map(String::from));
    }
    Ok(names)
}

/// Measures the policy in a file or in the folder of a run. `None` if the number is not finite, or the task has nothing to
/// measure under this name.
///
/// # Errors
/// If there is no policy, or its task cannot be created.
pub fn measure(name: &str, path: &Path, options: &EvalOptions) -> Result<Option<f64>, RunError> {
    let (policies, factory) = policy_file::load_all(path, None, &TaskOptions::default())?;
    if OF_COMMANDS.contains(&name) {
        let tracking = controller::measure(&policies[0], options)?;
        return Ok(at(&serde_json::to_value(tracking).unwrap_or_default(), name));
    }
    let all: Vec<&Policy> = policies.iter().collect();
    let Some(evaluation) = evaluate_roles(&*factory, Isa::best(), &all, options)?.into_iter().next() else {
        return Ok(None);
    };
    let of_task = evaluation.metrics.iter().find(|(known, _)| known == name).map(|(_, x)| *x);
    let found = of_task.or_else(|| at(&serde_json::to_value(&evaluation).unwrap_or_default(), name));
    Ok(found.filter(|x| x.is_finite()))
}

/// The number at a path of a document.
fn at(document: &Value, path: &str) -> Option<f64> {
    document.pointer(&format!("/{}", path.replace('.', "/")))?.as_f64().filter(|x| x.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn measures_are_those_of_the_task() {
        let task = |name: &str| TaskConfig::named(name).unwrap();
        let unknown = |name: &str, of: &str| unknown(name, &task(of)).unwrap();
        assert_eq!(unknown("minutes.falls_per_minute", "WalkerController"), None);
        assert_eq!(unknown("velocity_error", "MarathonManSteer"), None);
        assert_eq!(unknown("falls", "hopper"), None);
        let expected = unknown("fals", "hopper").unwrap();
        assert!(expected.ends_with("did you mean 'falls'?"), "{expected}");
        let expected = unknown("stand.still", "hopper").unwrap();
        assert!(expected.starts_with("one of steps, return_mean"), "{expected}");
    }
}
