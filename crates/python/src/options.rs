//! Arguments of agents as keyword arguments.

use marathon_envs::Options;
use marathon_envs::options::Value;
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

/// Arguments by name.
pub fn read(given: Option<&Bound<'_, PyDict>>) -> PyResult<Options> {
    let mut options = Options::new();
    for (name, value) in given.into_iter().flatten() {
        let value = match value.extract::<Given>()? {
            Given::Bool(x) => Value::Bool(x),
            Given::Number(x) => Value::Number(x),
            Given::Pair(x) => Value::Pair(x),
            Given::Text(x) => Value::Text(x),
            Given::Path(x) => Value::Text(x.display().to_string()),
        };
        options.set(&name.extract::<String>()?, value);
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
