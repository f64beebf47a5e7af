//! Errors as Python knows them. The texts are those of the Rust crates.

use marathon_envs::EnvError;
use pyo3::PyErr;
use pyo3::exceptions::{PyRuntimeError, PyTypeError, PyValueError};

/// `TypeError` for an argument that there is not, `ValueError` for all else: it comes from an argument's value.
pub fn env(error: EnvError) -> PyErr {
    match error {
        EnvError::UnknownOption { .. } => PyTypeError::new_err(error.to_string()),
        _ => PyValueError::new_err(error.to_string()),
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
