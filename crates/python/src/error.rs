//! Errors as Python knows them. The texts are those of the Rust crates.

use marathon_envs::EnvError;
use pyo3::PyErr;
use pyo3::exceptions::{PyRuntimeError, PyValueError};

/// `ValueError`: everything that can go wrong with an environment comes from an argument.
pub fn env(error: EnvError) -> PyErr {
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
