//! Errors as Python knows them. The texts are those of the Rust crates.

use marathon_cli::session::CliError;
use marathon_envs::EnvError;
use marathon_learn::Error;
use pyo3::PyErr;
use pyo3::exceptions::{PyFileNotFoundError, PyOSError, PyRuntimeError, PyTypeError, PyValueError};
use std::io::ErrorKind;

/// `TypeError` for an argument that there is not, `ValueError` for all else: it comes from an argument's value.
pub fn env(error: EnvError) -> PyErr {
    match &error {
        // Python's own words: there are libraries that look for them
        EnvError::UnknownOption { name, .. } => {
            PyTypeError::new_err(format!("got an unexpected keyword argument '{name}': {error}"))
        }
        _ => PyValueError::new_err(error.to_string()),
    }
}

/// `OSError` for files that cannot be read or written, `ValueError` for all else of the trainer.
pub fn learn(error: Error) -> PyErr {
    let text = error.to_string();
    of_learn(&error, text)
}

fn of_learn(error: &Error, text: String) -> PyErr {
    match error {
        Error::Io { source, .. } if source.kind() == ErrorKind::NotFound => PyFileNotFoundError::new_err(text),
        Error::Io { .. } => PyOSError::new_err(text),
        _ => PyValueError::new_err(text),
    }
}

/// The same for what the command line shares with Python.
pub fn cli(error: CliError) -> PyErr {
    match error {
        CliError::Learn(error) => of_learn(&error, in_python(&error.to_string())),
        CliError::Env(error) => env(error),
        CliError::Stopped { .. } => PyOSError::new_err(in_python(&error.to_string())),
        _ => PyValueError::new_err(in_python(&error.to_string())),
    }
}

/// Arguments of `train` that the command line has as flags.
const FLAGS: [&str; 7] = ["config", "seed", "steps", "agents", "threads", "out", "resume"];

/// What is said to users of the command line, said to users of Python.
fn in_python(text: &str) -> String {
    let mut told = String::new();
    for (i, part) in text.split('`').enumerate() {
        match part.split_once(" train --resume ") {
            Some((_, folder)) if i % 2 == 1 => told += &format!("train(resume={:?})", folder.trim_matches('\'')),
            _ if i % 2 == 1 => told += &format!("`{part}`"),
            _ => told += part,
        }
    }
    for flag in FLAGS {
        told = told
            .replace(&format!("--{flag} "), &format!("{flag} "))
            .replace(&format!("--{flag}:"), &format!("{flag}:"));
    }
    told
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
