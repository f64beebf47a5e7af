//! Policies on disk: Marathon's own files, and ONNX.

use crate::error::CliError;
use crate::folder::policy_path;
use marathon_envs::{ShardFactory, registry};
use marathon_learn::{Policy, write_atomic};
use marathon_physics::lanes::Isa;
use std::path::Path;
use std::sync::Arc;

/// Reads a policy and its task: the file, `.safetensors` or `.onnx`, or the one in a run's folder. The task is the one that
/// the user names, or the one that the file is for.
///
/// # Errors
/// If there is no such file, it is no policy, or it is for another agent.
pub fn load(given: &Path, agent: Option<&str>) -> Result<(Policy, Arc<dyn ShardFactory>), CliError> {
    let path = policy_path(given)?;
    let task = |name: &str| registry::factory(name, Isa::best());
    if !is_onnx(&path) {
        let factory = match agent {
            Some(agent) => task(agent)?,
            None => task(&Policy::load(&path)?.meta().agent)?,
        };
        return Ok((Policy::load_for(&path, factory.spec())?, factory));
    }
    let bytes = std::fs::read(&path).map_err(CliError::io(&path, "read"))?;
    let factory = match (agent, Policy::meta_of_onnx(&bytes)) {
        (Some(agent), _) => task(agent)?,
        (None, Some(meta)) => task(&meta.agent)?,
        (None, None) => {
            let expected = "one, since another program than Marathon has written the file: name it";
            return Err(CliError::file(&path, "agent", "none", expected));
        }
    };
    Ok((Policy::from_onnx(&path, &bytes, factory.spec())?, factory))
}

/// Writes a policy in the format that the file's name ends with.
///
/// # Errors
/// If it is not `.safetensors` or `.onnx`, or the file cannot be written.
pub fn save(policy: &Policy, path: &Path) -> Result<(), CliError> {
    match extension(path).as_str() {
        "onnx" => Ok(write_atomic(path, &policy.to_onnx())?),
        "safetensors" => Ok(policy.save(path)?),
        found => Err(CliError::file(path, "extension", format!("'{found}'"), ".safetensors or .onnx")),
    }
}

/// Whether a file is named as ONNX's are.
pub fn is_onnx(path: &Path) -> bool {
    extension(path) == "onnx"
}

fn extension(path: &Path) -> String {
    path.extension().map(|end| end.to_string_lossy().to_lowercase()).unwrap_or_default()
}
