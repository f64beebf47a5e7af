//! Errors as Python knows them. The texts are those of the Rust crates.

use marathon_envs::EnvError;
use marathon_learn::Error;
use marathon_runs::{RunError, Spelling};
use pyo3::PyErr;
use pyo3::exceptions::{PyFileNotFoundError, PyMemoryError, PyOSError, PyRuntimeError, PyTypeError, PyValueError};
use std::io::ErrorKind;
use std::path::Path;

/// `TypeError` for an unknown argument, `MemoryError` for too many agents, `ValueError` for an invalid value.
pub fn env(error: EnvError) -> PyErr {
    match &error {
        // Python's own words: there are libraries that look for them
        EnvError::UnknownOption { name, .. } => {
            PyTypeError::new_err(format!("got an unexpected keyword argument '{name}': {error}"))
        }
        EnvError::Memory { agents, source } => PyMemoryError::new_err(format!("num_envs is {agents}, which {source}")),
        EnvError::Option { option: "agents", found, expected } => {
            value(format!("num_envs is {found}, expected {expected}"))
        }
        _ => PyValueError::new_err(error.to_string()),
    }
}

/// `OSError` for files that cannot be read or written, `MemoryError` for a run that does not fit, `ValueError` for all
/// other errors of the trainer.
pub fn learn(error: Error) -> PyErr {
    let text = error.to_string();
    match &error {
        Error::Config { field, found, expected } if field == "run.agents" => {
            value(format!("num_envs is {found}, expected {expected}"))
        }
        Error::Io { source, .. } if source.kind() == ErrorKind::NotFound => PyFileNotFoundError::new_err(text),
        Error::Io { .. } => PyOSError::new_err(text),
        Error::Memory { .. } => PyMemoryError::new_err(text),
        _ => PyValueError::new_err(text),
    }
}

/// The same for a run, with options as keyword arguments.
pub fn run(error: RunError) -> PyErr {
    match error {
        RunError::Env(error) => env(error),
        RunError::Learn(error) => learn(error),
        RunError::Stopped { .. } => PyOSError::new_err(error.spelled(&Keywords)),
        _ => PyValueError::new_err(error.spelled(&Keywords)),
    }
}

/// Options as keyword arguments, advice as calls.
struct Keywords;

impl Spelling for Keywords {
    fn option(&self, name: &str) -> String {
        if name == "agents" { "num_envs".into() } else { name.into() }
    }
    fn with_value(&self, name: &str, value: &str) -> String {
        format!("{name}={}", value.replace(',', "_"))
    }
    fn resume(&self, folder: &Path) -> String {
        format!("train(resume={:?})", folder.to_string_lossy())
    }
}

/// `ValueError` for another error that comes from an argument.
pub fn any(error: impl std::error::Error) -> PyErr {
    PyValueError::new_err(error.to_string())
}

/// `ValueError` with a text.
pub fn value(text: impl Into<String>) -> PyErr {
    PyValueError::new_err(text.into())
}

/// `RuntimeError` for an array that cannot be written to.
pub fn array(name: &str, error: impl std::fmt::Display) -> PyErr {
    PyRuntimeError::new_err(format!("array '{name}' of the environment cannot be written to: {error}"))
}
