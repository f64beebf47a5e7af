//! Policies on disk: Marathon's own files, and ONNX.

use crate::error::RunError;
use crate::folder::policy_path;
use marathon_envs::{ShardFactory, Spec, registry};
use marathon_learn::{Policy, write_atomic};
use marathon_physics::lanes::Isa;
use std::path::Path;
use std::sync::Arc;

/// Reads a policy and its task: the file, `.safetensors` or `.onnx`, or the one in a run's folder. The task is the one that
/// the user names, or the one that the file is for.
///
/// # Errors
/// If there is no such file, it is no policy, or it is for another agent.
pub fn load(given: &Path, agent: Option<&str>) -> Result<(Policy, Arc<dyn ShardFactory>), RunError> {
    let factory = match agent {
        Some(agent) => registry::factory(agent, Isa::best())?,
        None => registry::factory(&read(given, None)?.meta().agent, Isa::best())?,
    };
    Ok((read(given, Some(factory.spec()))?, factory))
}

/// Reads a policy for a task, or, without one, for whatever task its file names: this program may not know that.
///
/// # Errors
/// If there is no such file, it is no policy, or it is for another agent.
pub fn read(given: &Path, spec: Option<&Spec>) -> Result<Policy, RunError> {
    let path = policy_path(given)?;
    if is_onnx(&path) {
        let bytes = std::fs::read(&path).map_err(RunError::io(&path, "read"))?;
        return Ok(Policy::from_onnx(&path, &bytes, spec)?);
    }
    Ok(match spec {
        Some(spec) => Policy::load_for(&path, spec)?,
        None => Policy::load(&path)?,
    })
}

/// Writes a policy in the format that the file's name ends with.
///
/// # Errors
/// If it is not `.safetensors` or `.onnx`, or the file cannot be written.
pub fn save(policy: &Policy, path: &Path) -> Result<(), RunError> {
    match extension(path).as_str() {
        "onnx" => Ok(write_atomic(path, &policy.to_onnx())?),
        "safetensors" => Ok(policy.save(path)?),
        found => Err(RunError::file(path, "extension", format!("'{found}'"), ".safetensors or .onnx")),
    }
}

/// Whether a file is named as ONNX's are.
pub fn is_onnx(path: &Path) -> bool {
    extension(path) == "onnx"
}

fn extension(path: &Path) -> String {
    path.extension().map(|end| end.to_string_lossy().to_lowercase()).unwrap_or_default()
}
