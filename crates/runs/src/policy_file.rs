//! Policy files: Marathon's own, and ONNX.

use crate::error::RunError;
use crate::folder::{policy_of_role, policy_path};
use crate::task_config::{TaskConfig, TaskOptions};
use crate::text;
use marathon_envs::{ShardFactory, Spec};
use marathon_learn::{Error, Policy, PolicyMeta, write_atomic};
use marathon_physics::budget;
use std::path::Path;
use std::sync::Arc;

/// Reads a policy and its task from a `.safetensors` or `.onnx` file, or from a run's folder. The user's task and
/// options have precedence over those of the file. The returned policy notes the resulting options.
///
/// # Errors
/// If there is no such file, it is not a policy, it is for another agent, or the agent does not take the options.
pub fn load(
    given: &Path,
    agent: Option<&str>,
    options: &TaskOptions,
) -> Result<(Policy, Arc<dyn ShardFactory>), RunError> {
    load_with(given, agent, options, Policy::load)
}

/// Like [`load`], for a file that may lack a checksum.
///
/// # Errors
/// Like [`load`].
pub fn load_unsealed(given: &Path, agent: Option<&str>, options: &TaskOptions) -> Result<Policy, RunError> {
    Ok(load_with(given, agent, options, Policy::load_unsealed)?.0)
}

/// A function that reads one of Marathon's policy files.
type Load = fn(&Path) -> Result<Policy, Error>;

fn load_with(
    given: &Path,
    agent: Option<&str>,
    options: &TaskOptions,
    load: Load,
) -> Result<(Policy, Arc<dyn ShardFactory>), RunError> {
    let task_config = task_config(given, agent, options, load)?;
    let factory = task_config.factory()?;
    let mut policy = read_with(given, Some(factory.spec()), load)?;
    policy.set_options(factory.spec().options.clone());
    Ok((policy, factory))
}

/// Like [`load`], with the policies of all roles of the task, in their order. Those of the other roles lie next to the
/// first one, where training writes them: `policy.safetensors`, `policy-builder.safetensors`.
///
/// # Errors
/// Like [`load`], and if a policy is missing or is for another role.
pub fn load_all(
    given: &Path,
    agent: Option<&str>,
    options: &TaskOptions,
) -> Result<(Vec<Policy>, Arc<dyn ShardFactory>), RunError> {
    let task_config = task_config(given, agent, options, Policy::load)?;
    let factory = task_config.factory()?;
    let (path, spec) = (policy_path(given)?, factory.spec());
    let mut policies = Vec::new();
    for role in spec.deciders() {
        let own = if policies.is_empty() { path.clone() } else { policy_of_role(&path, &role.name) };
        if !own.exists() {
            let expected = format!("that of the role '{}' beside {}", role.name, text::path_word(&path));
            return Err(RunError::file(&own, "policy", "no such file", expected));
        }
        let mut policy = read(&own, Some(&spec.of_role(&role)))?;
        policy.set_options(spec.options.clone());
        policies.push(policy);
    }
    Ok((policies, factory))
}

/// The task that a policy plays in. The user's task and options have precedence over those of the file.
///
/// # Errors
/// If there is no such file, it is not a policy, or there is no such task.
pub fn task_for(given: &Path, agent: Option<&str>, options: &TaskOptions) -> Result<TaskConfig, RunError> {
    task_config(given, agent, options, Policy::load)
}

fn task_config(given: &Path, agent: Option<&str>, options: &TaskOptions, load: Load) -> Result<TaskConfig, RunError> {
    let noted = task_with(given, load)?;
    let asked = agent.map(TaskConfig::named).transpose()?;
    if let (Some(name), Some(asked)) = (agent, &asked) {
        asked.check_model(name, options)?;
    }
    let task_config = match (asked, noted) {
        // the path of a model is an option of the task
        (Some(asked), Some(noted)) if noted.agent == asked.agent => noted.overlay(&asked),
        (Some(asked), _) => asked,
        (None, Some(noted)) => noted,
        // the message says what is missing
        (None, None) => TaskConfig::named(&read_with(given, None, load)?.meta().agent)?,
    };
    task_config.with(options)
}

/// The task that a file notes for its policy. `None` for files by other programs.
///
/// # Errors
/// If there is no such file, or it is not a policy.
pub fn task_of(given: &Path) -> Result<Option<TaskConfig>, RunError> {
    task_with(given, Policy::load)
}

fn task_with(given: &Path, load: Load) -> Result<Option<TaskConfig>, RunError> {
    let path = policy_path(given)?;
    let noted: Option<PolicyMeta> =
        if is_onnx(&path) { Policy::meta_of_onnx(&bytes(&path)?) } else { Some(load(&path)?.meta().clone()) };
    Ok(noted.map(|meta| TaskConfig::of_policy(&meta)))
}

/// Reads a policy for a task, or, without one, for the task that the file names, which may be unknown.
///
/// # Errors
/// If there is no such file, it is not a policy, or it is for another agent.
pub fn read(given: &Path, spec: Option<&Spec>) -> Result<Policy, RunError> {
    read_with(given, spec, Policy::load)
}

fn read_with(given: &Path, spec: Option<&Spec>, load: Load) -> Result<Policy, RunError> {
    let path = policy_path(given)?;
    if is_onnx(&path) {
        return Ok(Policy::from_onnx(&path, &bytes(&path)?, spec)?);
    }
    let policy = load(&path)?;
    if let Some(spec) = spec {
        policy.check(spec).map_err(|error| error.of_file(&path))?;
    }
    Ok(policy)
}

fn bytes(path: &Path) -> Result<Vec<u8>, RunError> {
    budget::read(path, &budget::POLICY_FILE).map_err(RunError::io(path, "read"))
}

/// Indices of the numbers that a policy observes in the observation of another task, which may have more. Parts are
/// matched by name.
///
/// # Errors
/// If the task lacks a part, or has other actions or another decision interval.
pub fn seen_by(policy: &Policy, path: &Path, task: &Spec) -> Result<Vec<usize>, RunError> {
    let whole = TaskConfig::of_policy(policy.meta()).factory()?.spec().clone();
    // the policy may be that of a role
    let roles = whole.deciders().into_iter().map(|role| whole.of_role(&role));
    let own = roles.into_iter().find(|spec| spec.id == policy.meta().agent).unwrap_or(whole);
    policy.check(&own)?;
    let wrong = |place: &str, found: String, expected: String| Err(RunError::file(path, place, found, expected));
    if own.act != task.act {
        let expected = format!("{} as {} has", task.act, task.id);
        return wrong("actions", own.act.to_string(), expected);
    }
    if own.dt != task.dt {
        let expected = format!("{} as {} has", task.dt, task.id);
        return wrong("seconds between decisions", own.dt.to_string(), expected);
    }
    if own.observations == task.observations {
        return Ok((0..task.obs).collect());
    }
    let mut sees = Vec::new();
    for group in &own.observations {
        let known = task.observations.iter().find(|known| known.name == group.name);
        match known {
            Some(known) if known.range.len() == group.range.len() => sees.extend(known.range.clone()),
            _ => {
                let found = format!("'{}' of {} numbers", group.name, group.range.len());
                let names = task.observations.iter().map(|group| format!("{} ({})", group.name, group.range.len()));
                let expected = format!("parts that {} observes: {}", task.id, names.collect::<Vec<_>>().join(", "));
                return wrong("observation", found, expected);
            }
        }
    }
    Ok(sees)
}

/// File endings that [`save`] supports.
pub const ENDINGS: [&str; 2] = ["safetensors", "onnx"];

/// Writes a policy in the format given by the file's ending.
///
/// # Errors
/// If the ending is not `.safetensors` or `.onnx`, or the file cannot be written.
pub fn save(policy: &Policy, path: &Path) -> Result<(), RunError> {
    match extension(path).as_str() {
        "onnx" => Ok(write_atomic(path, &policy.to_onnx())?),
        "safetensors" => Ok(policy.save(path)?),
        found => Err(RunError::file(path, "extension", format!("'{found}'"), ".safetensors or .onnx")),
    }
}

/// Whether a file has ONNX's ending.
pub fn is_onnx(path: &Path) -> bool {
    extension(path) == "onnx"
}

fn extension(path: &Path) -> String {
    path.extension().map(|end| end.to_string_lossy().to_lowercase()).unwrap_or_default()
}
