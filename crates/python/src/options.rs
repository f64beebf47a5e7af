//! Arguments of agents as keyword arguments.

use crate::error;
use marathon_envs::options::Value;
use marathon_envs::{EnvError, Options, registry};
use marathon_runs::Setting;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::path::PathBuf;

/// What Python gives for an argument.
#[derive(FromPyObject)]
enum Given {
    #[pyo3(transparent)]
    Bool(bool),
    #[pyo3(transparent)]
    Number(f64),
    #[pyo3(transparent)]
    Pair([f64; 2]),
    #[pyo3(transparent)]
    Text(String),
    #[pyo3(transparent)]
    Path(PathBuf),
}

/// A task with its arguments; files of clips that they name are read.
pub fn set(task: &str, given: Option<&Bound<'_, PyDict>>) -> PyResult<Setting> {
    let options = read(task, given)?;
    Setting::named(task).and_then(|setting| setting.with(&options.into())).map_err(error::run)
}

/// Arguments of a task by name.
pub fn read(task: &str, given: Option<&Bound<'_, PyDict>>) -> PyResult<Options> {
    let mut options = Options::new();
    for (name, value) in given.into_iter().flatten() {
        let name: String = name.extract()?;
        let value = match value.extract::<Given>() {
            Ok(Given::Bool(x)) => Value::Bool(x),
            Ok(Given::Number(x)) => Value::Number(x),
            Ok(Given::Pair(x)) => Value::Pair(x),
            Ok(Given::Text(x)) => Value::Text(x),
            Ok(Given::Path(x)) => Value::Text(x.display().to_string()),
            Err(_) => {
                // whether there is such an argument comes first
                let tried = registry::global().agent_with(task, &Options::new().with(&name, false));
                let expected = match tried.map(|_| ()) {
                    Err(EnvError::OptionValue { expected, .. }) => expected,
                    Err(error) => return Err(error::env(error)),
                    Ok(()) => "true or false",
                };
                let found = value.get_type().name()?;
                return Err(PyTypeError::new_err(format!(
                    "agent '{task}': option {name} is of type {found}, expected {expected}"
                )));
            }
        };
        options.set(&name, value);
    }
    Ok(options)
}

/// The same as a dictionary.
pub fn show<'py>(py: Python<'py>, options: &Options) -> PyResult<Bound<'py, PyDict>> {
    let table = PyDict::new(py);
    for (name, value) in options.iter() {
        match value {
            Value::Bool(x) => table.set_item(name, x),
            Value::Number(x) => table.set_item(name, x),
            Value::Pair([a, b]) => table.set_item(name, (a, b)),
            Value::Text(x) => table.set_item(name, x),
        }?;
    }
    Ok(table)
}
