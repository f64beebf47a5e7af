//! Arguments of agents as keyword arguments.

use crate::clip::Clip;
use crate::error;
use marathon_envs::options::Value;
use marathon_envs::{Clips, EnvError, NamedClip, Options, registry};
use marathon_runs::TaskConfig;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList, PyString};
use std::path::PathBuf;

/// Python value of an argument.
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
    #[pyo3(transparent)]
    Clip(Py<Clip>),
    #[pyo3(transparent)]
    Clips(Vec<GivenClip>),
}

/// A clip of several.
#[derive(FromPyObject)]
enum GivenClip {
    #[pyo3(transparent)]
    Clip(Py<Clip>),
    #[pyo3(transparent)]
    Text(String),
    #[pyo3(transparent)]
    Path(PathBuf),
}

impl GivenClip {
    fn named(self) -> NamedClip {
        match self {
            GivenClip::Clip(clip) => clip.get().named(),
            GivenClip::Text(name) => NamedClip::shipped(name),
            GivenClip::Path(path) => NamedClip::shipped(path.display().to_string()),
        }
    }
}

/// A task with its arguments; files of clips that they name are read.
pub fn set(task: &str, given: Option<&Bound<'_, PyDict>>) -> PyResult<TaskConfig> {
    let options = read(task, given)?;
    TaskConfig::named(task).and_then(|task_config| task_config.with(&options.into())).map_err(error::run)
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
            Ok(Given::Clip(x)) => x.get().named().into(),
            Ok(Given::Clips(x)) => Value::Clips(x.into_iter().map(GivenClip::named).collect::<Clips>()),
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

/// The same as a dictionary. Given clips are objects, which make the same task again.
pub fn show<'py>(py: Python<'py>, options: &Options) -> PyResult<Bound<'py, PyDict>> {
    let table = PyDict::new(py);
    for (name, value) in options.iter() {
        match value {
            Value::Bool(x) => table.set_item(name, x),
            Value::Number(x) => table.set_item(name, x),
            Value::Pair([a, b]) => table.set_item(name, (a, b)),
            Value::Text(x) => table.set_item(name, x),
            Value::Clips(x) => table.set_item(name, clips(py, x)?),
        }?;
    }
    Ok(table)
}

/// One clip, or a list of several.
fn clips<'py>(py: Python<'py>, clips: &Clips) -> PyResult<Bound<'py, PyAny>> {
    let object = |clip: &NamedClip| match Clip::of(clip) {
        Some(clip) => Ok(Bound::new(py, clip)?.into_any()),
        None => Ok(PyString::new(py, clip.name()).into_any()),
    };
    let all: Vec<_> = clips.iter().map(object).collect::<PyResult<_>>()?;
    match &all[..] {
        [one] => Ok(one.clone()),
        _ => Ok(PyList::new(py, all)?.into_any()),
    }
}
