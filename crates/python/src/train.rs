//! The native trainer, called from Python.

use crate::config::{self, Config};
use crate::players::PyPlayers;
use crate::policy::{Policy, json};
use crate::task::{self, Made, Task};
use crate::{batch_task, error, number, options as arguments};
use marathon_envs::{EnvError, Options, registry};
use marathon_learn::{Control, Players};
use marathon_physics::hint::nearest;
use marathon_runs::report::csv::columns;
use marathon_runs::{LearnOptions, RunError, RunOptions, Session};
use pyo3::exceptions::{PyTypeError, PyUserWarning};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::ffi::CString;
use std::path::PathBuf;

/// Result of a run.
#[pyclass(frozen, module = "marathon_rl")]
pub struct TrainResult {
    /// The policy.
    #[pyo3(get)]
    policy: Py<Policy>,
    /// Steps of all agents together.
    #[pyo3(get)]
    steps: u64,
    /// Whether the run was stopped before its last step.
    #[pyo3(get)]
    interrupted: bool,
    /// Folder with the results, if they were written to one.
    #[pyo3(get)]
    folder: Option<PathBuf>,
    summary: serde_json::Value,
}

#[pymethods]
impl TrainResult {
    /// How the policy's best actions do over 100 episodes, as `evaluate` tells it; None if the run was interrupted.
    #[getter]
    fn evaluation<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        json(py, &self.summary["eval"])
    }

    /// The run in numbers, as in `summary.json`.
    #[getter]
    fn summary<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        json(py, &self.summary)
    }

    /// For `copy` and `pickle`: the parts.
    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, Parts)> {
        let make = py.import("marathon_rl._native")?.getattr("_train_result")?;
        let summary = serde_json::to_string(&self.summary).map_err(error::any)?;
        Ok((make, (self.policy.clone_ref(py), self.steps, self.interrupted, self.folder.clone(), summary)))
    }

    fn __repr__(&self) -> String {
        format!("TrainResult(steps={}, interrupted={})", self.steps, self.interrupted)
    }
}

/// Policy, steps, interrupted, folder and summary in JSON.
type Parts = (Py<Policy>, u64, bool, Option<PathBuf>, String);

/// A result from its parts.
#[pyfunction]
pub fn _train_result(
    policy: Py<Policy>,
    steps: u64,
    interrupted: bool,
    folder: Option<PathBuf>,
    summary: &str,
) -> PyResult<TrainResult> {
    let summary = serde_json::from_str(summary).map_err(error::any)?;
    Ok(TrainResult { policy, steps, interrupted, folder, summary })
}

/// Keyword arguments of other trainers and of the command, and those of [`train`] for them.
const ALIASES: [(&str, &str); 5] = [
    ("agents", "num_envs"),
    ("num_agents", "num_envs"),
    ("n_envs", "num_envs"),
    ("total_steps", "steps"),
    ("total_timesteps", "steps"),
];
/// Keyword arguments of [`train`].
const PARAMETERS: [&str; 11] = [
    "config",
    "callback",
    "progress",
    "seed",
    "steps",
    "num_envs",
    "threads",
    "out",
    "resume",
    "players",
    "initialize_from",
];

/// Refuses an option that the task does not take and that is nearly an argument of [`train`].
fn check_spelling(task: &str, options: &Options) -> PyResult<()> {
    for (name, value) in options.iter() {
        let tried = registry::global().agent_with(task, &Options::new().with(name, value.clone()));
        let Err(EnvError::UnknownOption { nearest: near_option, .. }) = tried.map(|_| ()) else { continue };
        let alias = ALIASES.iter().find(|(other, _)| *other == name).map(|(_, own)| *own);
        if let Some(own) = alias.or_else(|| nearest(name, PARAMETERS).filter(|_| near_option.is_none())) {
            let text = format!("got an unexpected keyword argument '{name}'; did you mean '{own}'?");
            return Err(PyTypeError::new_err(text));
        }
    }
    Ok(())
}

fn callback(value: &Bound<'_, PyAny>) -> PyResult<Option<Py<PyAny>>> {
    if value.is_none() || value.is_callable() {
        return Ok(Some(value).filter(|value| !value.is_none()).map(|value| value.clone().unbind()));
    }
    let found = value.get_type().name()?;
    Err(PyTypeError::new_err(format!("callback is of type {found}, expected a function")))
}

/// Trains a policy with the native trainer, without the GIL, and evaluates it.
///
/// `task`: its name, or a `MarathonAgent` class or object, which stands for its class. `config`: a file, or a dictionary with
/// the same keys, such as `{"ppo": {"lr": 3e-4}}`; the task's preset holds for what it leaves out. `seed`, `steps` (of all
/// agents together), `num_envs` (a multiple of 16) and `threads` change it. `callback`: called after every iteration with a
/// dictionary of the numbers that `progress.csv` holds; if it returns False, training stops. `out`: a new folder for everything
/// that the command `marathon train` writes; without, nothing is written. `resume`: the folder of a run to continue, in place
/// of a configuration; the task is needed for a class alone. `initialize_from`: a policy to start from in place of random
/// weights, a file or the folder of a run, whose hidden layers are no wider; it may observe less. `players`: an object that has
/// the rollouts played elsewhere, as `marathon_rl.ray.Workers` does. `options`: options of the task; a class gets them as
/// arguments of its constructor. `progress`: show how far the run is on standard error, as a bar in a terminal and as lines
/// elsewhere.
///
/// Ctrl-C and exceptions of the callback end training after the iteration; with a folder, what was learned is there and
/// `resume` goes on with it. The same seed gives the same policy, bit for bit, for any number of threads.
#[pyfunction]
#[pyo3(signature = (
    task = None, config = None, *, callback = None, progress = true, seed = None, steps = None, num_envs = None, threads = None,
    out = None, resume = None, players = None, initialize_from = None, **options
))]
#[expect(clippy::too_many_arguments, reason = "keyword arguments of a Python function")]
pub fn train(
    py: Python<'_>,
    #[pyo3(from_py_with = task::optional)] task: Option<Task>,
    #[pyo3(from_py_with = config::read)] config: Option<Config>,
    #[pyo3(from_py_with = self::callback)] callback: Option<Py<PyAny>>,
    progress: bool,
    #[pyo3(from_py_with = number::seed)] seed: Option<u64>,
    #[pyo3(from_py_with = number::steps)] steps: Option<u64>,
    #[pyo3(from_py_with = number::num_envs)] num_envs: Option<usize>,
    #[pyo3(from_py_with = number::threads)] threads: Option<usize>,
    out: Option<PathBuf>,
    resume: Option<PathBuf>,
    players: Option<Py<PyAny>>,
    initialize_from: Option<PathBuf>,
    options: Option<&Bound<'_, PyDict>>,
) -> PyResult<TrainResult> {
    // one function: the keywords of Python in order
    let given = options;
    let of_task = match &task {
        _ if resume.is_some() && !matches!(task, Some(Task::Agent(_))) => {
            // a run keeps its options; a keyword may be misspelled, so the message names it
            if let Some((name, _)) = given.and_then(|given| given.iter().next()) {
                return Err(error::value(format!("{name} is for new runs, not for one that resume continues")));
            }
            Options::new()
        }
        Some(Task::Name(name)) => {
            let options = arguments::read(task::plain(name), given)?;
            check_spelling(task::plain(name), &options)?;
            options
        }
        // a class takes them itself
        _ => Options::new(),
    };
    let mut options = RunOptions {
        learn: LearnOptions { steps, seed, threads, ..Default::default() },
        task: of_task.into(),
        agents: num_envs,
        processes: 0,
        out,
        resume,
        initialize_from,
    };
    let mut made = Made::default();
    let task = task.as_ref().map(|task| task.of_run(py, threads.unwrap_or(0), given, &mut made)).transpose()?;
    let mut loaded = None;
    match config {
        None => {}
        Some(Config::Path(file)) => options.learn.config = Some(file),
        Some(Config::Table(_)) if options.resume.is_some() => {
            return Err(error::run(RunError::NewRunOnly { name: "config" }));
        }
        Some(Config::Table(table)) => {
            let text = config::json(table.bind(py))?;
            let parse = |id: &str| marathon_config::parse_object("config", &text, id);
            loaded = task.as_ref().map(|task| parse(task.id())).transpose().map_err(error::any)?;
        }
    }
    let dry = options.out.is_none();
    let opened = Session::open(task, &options, loaded, dry);
    let (session, notes) = opened.map_err(|e| made.error.take().unwrap_or_else(|| error::run(e)))?;
    for note in notes {
        PyErr::warn(py, &py.get_type::<PyUserWarning>(), &CString::new(note)?, 1)?;
    }

    let terms = session.factory.spec().reward_terms.clone();
    let run = &session.run;
    let mut players =
        players.map(|object| PyPlayers::begin(py, object, &session.task_config, &run.config)).transpose()?;
    let mut failure: Option<PyErr> = None;
    let mut last = (session.steps(), 0.0);
    let result = batch_task::run(py, made.batch_task.as_deref(), || {
        let players = players.as_mut().map(|players| players as &mut dyn Players);
        session.carry_out_with(players, progress, &mut |stats| {
            let (steps, wall) = std::mem::replace(&mut last, (stats.steps, stats.wall_seconds));
            let rate = (stats.steps - steps) as f64 / (stats.wall_seconds - wall).max(1e-9);
            let ask = |py: Python<'_>| {
                py.check_signals()?;
                let Some(callback) = &callback else { return Ok(true) };
                let metrics = PyDict::new(py);
                for (name, value) in columns(stats, rate, &terms) {
                    metrics.set_item(name, value)?;
                }
                Ok(batch_task::goes_on(&callback.bind(py).call1((metrics,))?))
            };
            match Python::attach(ask) {
                Ok(true) => Control::Continue,
                Ok(false) => Control::Stop,
                Err(error) => {
                    failure = Some(error);
                    Control::Stop
                }
            }
        })
    })?;
    // what was learned has been written by now
    if let Some(error) = failure.or(players.and_then(|players| players.failure)) {
        return Err(error);
    }
    let outcome = result.map_err(error::run)?;
    Ok(TrainResult {
        policy: Py::new(py, Policy(outcome.policy))?,
        steps: outcome.steps,
        interrupted: outcome.evaluation.is_none(),
        folder: outcome.folder.map(|folder| folder.path().into()),
        summary: serde_json::to_value(&outcome.summary).map_err(error::any)?,
    })
}
