//! A task in Python: its name, or an agent that is written in Python.

use crate::{batch_task, error};
use marathon_envs::{BatchAdapter, ShardFactory, Spec, registry};
use marathon_physics::lanes::Isa;
use marathon_runs::RunError;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyType};
use std::path::PathBuf;
use std::sync::Arc;

/// A task as an argument.
pub enum Task {
    /// One of the registry, or the path of a model.
    Name(String),
    /// A `MarathonAgent`, class or object. An object stands for its class.
    Agent(Py<PyAny>),
}

/// Reads an argument that may be missing.
pub fn optional(value: &Bound<'_, PyAny>) -> PyResult<Option<Task>> {
    if value.is_none() {
        return Ok(None);
    }
    if let Some(name) = text(value)? {
        return Ok(Some(Task::Name(name)));
    }
    check(value)?;
    Ok(Some(Task::Agent(value.clone().unbind())))
}

/// Reads an argument that is the name of a task or the path of a model.
pub fn name(value: &Bound<'_, PyAny>) -> PyResult<String> {
    let wrong = |found| {
        let expected = "expected a task's name or the path of a model";
        PyTypeError::new_err(format!("task is of type {found}, {expected}"))
    };
    text(value)?.ok_or_else(|| value.get_type().name().map_or_else(|error| error, wrong))
}

/// A text, or a path as a text.
fn text(value: &Bound<'_, PyAny>) -> PyResult<Option<String>> {
    if let Ok(text) = value.extract() {
        return Ok(Some(text));
    }
    if value.is_instance_of::<PyType>() || !value.hasattr("__fspath__")? {
        return Ok(None);
    }
    let path = value.extract::<PathBuf>()?.into_os_string();
    path.into_string().map(Some).map_err(|path| error::value(format!("task is {path:?}, expected a path in UTF-8")))
}

/// Gymnasium's namespace of the tasks, which may stand before a name.
const NAMESPACE: &str = "marathon_rl/";

/// A task's name, without Gymnasium's namespace.
pub fn plain(name: &str) -> &str {
    name.strip_prefix(NAMESPACE).unwrap_or(name)
}

/// Batch task of the Python agent that a run was started with, or the error.
#[derive(Default)]
pub struct Made {
    pub batch_task: Option<Arc<BatchAdapter>>,
    /// Why there is no batch task.
    pub error: Option<PyErr>,
}

impl Task {
    /// Facts of the task.
    pub fn spec(&self, py: Python<'_>) -> PyResult<Spec> {
        match self {
            Task::Name(name) => Ok(registry::factory(plain(name), Isa::best()).map_err(error::env)?.spec().clone()),
            Task::Agent(agent) => batch_task::spec(&vec_env(agent.bind(py), 1, 1, None)?),
        }
    }

    /// The task of a run; `made` learns of a batch task that is made for it. An agent that is written in Python takes the
    /// options as arguments of its constructor.
    pub fn of_run<'a>(
        &'a self,
        py: Python<'a>,
        threads: usize,
        options: Option<&'a Bound<'a, PyDict>>,
        made: &'a mut Made,
    ) -> PyResult<marathon_runs::Task<'a>> {
        let agent = match self {
            Task::Name(name) => return marathon_runs::Task::named(plain(name)).map_err(error::run),
            Task::Agent(agent) => agent.bind(py),
        };
        let id: String = agent.call_method0("task_id")?.extract()?;
        let text = id.clone();
        Ok(marathon_runs::Task::made(id, move |agents| match lockstep(agent, agents, threads, options) {
            Ok(batch_task) => {
                let batch_task = Arc::new(batch_task);
                made.batch_task = Some(batch_task.clone());
                Ok(batch_task as Arc<dyn ShardFactory>)
            }
            Err(error) => {
                made.error = Some(error);
                Err(RunError::option("task", format!("{text} cannot be made")))
            }
        }))
    }
}

/// So many agents of a kind, for the trainer.
pub fn lockstep(
    agent: &Bound<'_, PyAny>,
    agents: usize,
    threads: usize,
    options: Option<&Bound<'_, PyDict>>,
) -> PyResult<BatchAdapter> {
    batch_task::lockstep(&vec_env(agent, agents, threads, options)?)
}

fn vec_env<'py>(
    agent: &Bound<'py, PyAny>,
    agents: usize,
    threads: usize,
    options: Option<&Bound<'_, PyDict>>,
) -> PyResult<Bound<'py, PyAny>> {
    let keywords = PyDict::new(agent.py());
    keywords.set_item("threads", threads)?;
    keywords.set_item("autoreset", "same_step")?;
    if let Some(options) = options {
        keywords.update(options.as_mapping())?;
    }
    agent.call_method("vec_env", (agents,), Some(&keywords))
}

fn check(agent: &Bound<'_, PyAny>) -> PyResult<()> {
    match agent.hasattr("vec_env")? && agent.hasattr("task_id")? {
        true => Ok(()),
        false => {
            let found = match agent.cast::<PyType>() {
                Ok(class) => format!("the class {}", class.name()?),
                Err(_) => format!("of type {}", agent.get_type().name()?),
            };
            let expected = "expected a task's name, the path of a model or a MarathonAgent";
            Err(PyTypeError::new_err(format!("task is {found}, {expected}")))
        }
    }
}
