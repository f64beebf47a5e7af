//! Policies as functions of NumPy arrays.

use crate::arrays::tuple;
use crate::task::{self, Task};
use crate::{batch_task, error, interrupt, number, options as arguments};
use marathon_envs::BLOCK;
use marathon_learn::{BlockPolicy, EvalOptions, evaluate as play};
use marathon_physics::lanes::Isa;
use marathon_runs::{TaskConfig, policy_file};
use numpy::{AllowTypeChange, PyArray1, PyArrayDyn, PyArrayLikeDyn, PyArrayMethods, PyUntypedArrayMethods};
use pyo3::exceptions::PyFileNotFoundError;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use std::path::PathBuf;

/// Most agents that play side by side.
const MOST_AGENTS: usize = 1024;

/// A trained policy: a function from observations to actions.
#[pyclass(frozen, module = "marathon_rl")]
pub struct Policy(pub marathon_learn::Policy);

#[pymethods]
impl Policy {
    /// Task that the policy is for, such as `Hopper-v0`.
    #[getter]
    fn task(&self) -> &str {
        &self.0.meta().agent
    }

    /// Length of an observation.
    #[getter]
    fn obs_size(&self) -> usize {
        self.0.meta().obs
    }

    /// Length of an action.
    #[getter]
    fn act_size(&self) -> usize {
        self.0.meta().act
    }

    /// Seconds between two actions.
    #[getter]
    fn dt(&self) -> f64 {
        self.0.meta().control_dt
    }

    /// Arguments of the task: `VecEnv(policy.task, **policy.options)` is what the policy was trained in.
    #[getter]
    fn options<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        arguments::show(py, &self.0.meta().options)
    }

    /// All that the file says of the policy: network, training with its configuration, evaluation.
    #[getter]
    fn meta<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        json(py, self.0.meta())
    }

    /// The actions for observations, `(obs_size,)` or `(n, obs_size)`; float32, `(act_size,)` or `(n, act_size)`.
    ///
    /// Without `rng`, the best actions. With a `numpy.random.Generator` or a seed for one, actions drawn as in training.
    #[pyo3(signature = (obs, rng = None))]
    fn __call__<'py>(
        &self,
        py: Python<'py>,
        obs: PyArrayLikeDyn<'_, f32, AllowTypeChange>,
        rng: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyArrayDyn<f32>>> {
        let meta = self.0.meta();
        let mut shape = obs.shape().to_vec();
        if !(1..=2).contains(&shape.len()) || shape.last() != Some(&meta.obs) {
            let n = meta.obs;
            let found = tuple(&shape);
            return Err(error::value(format!("observations have the shape {found}, expected ({n},) or (n, {n})")));
        }
        *shape.last_mut().expect("there are one or two") = meta.act;
        let mut action = vec![0.0_f32; shape.iter().product()];
        let noise = rng.map(|rng| normal(py, rng, action.len())).transpose()?;
        let obs: Vec<f32> = obs.as_array().iter().copied().collect();
        py.detach(|| BlockPolicy::new(&self.0, Isa::best()).act_rows(&obs, noise.as_deref(), &mut action));
        PyArray1::from_vec(py, action).reshape(shape)
    }

    /// Writes the policy to a file: `.safetensors`, or `.onnx` by the contract of ML-Agents' models.
    fn save(&self, path: PathBuf) -> PyResult<()> {
        policy_file::save(&self.0, &path).map_err(error::run)
    }

    /// For `copy` and `pickle`: the bytes of a file.
    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, (Bound<'py, PyBytes>,))> {
        let make = py.import("marathon_rl._native")?.getattr("_policy")?;
        Ok((make, (PyBytes::new(py, &self.0.to_bytes()),)))
    }

    fn __repr__(&self) -> String {
        let meta = self.0.meta();
        format!("Policy({:?}, obs_size={}, act_size={}, hidden={:?})", meta.agent, meta.obs, meta.act, meta.hidden)
    }
}

/// A policy from the bytes of a file.
#[pyfunction]
pub fn _policy(bytes: &[u8]) -> PyResult<Policy> {
    let policy = marathon_learn::Policy::from_bytes("policy".as_ref(), bytes).map_err(error::learn)?;
    Ok(Policy(policy))
}

/// Reads a policy from a file, `.safetensors` or `.onnx`, or from the folder of a run. Without `task`, it is for the one that
/// the file names; ONNX files that another program has written, multi-layer perceptrons from observations to actions, name
/// none.
#[pyfunction]
#[pyo3(signature = (path, task = None))]
pub fn load_policy(
    py: Python<'_>,
    path: PathBuf,
    #[pyo3(from_py_with = task::optional)] task: Option<Task>,
) -> PyResult<Policy> {
    let spec = task.map(|task| task.spec(py)).transpose()?;
    let policy = policy_file::read(&path, spec.as_ref()).map_err(|error| match path.exists() {
        true => error::run(error),
        false => PyFileNotFoundError::new_err(error.to_string()),
    })?;
    Ok(Policy(policy))
}

/// Plays whole episodes with a policy's best actions. Returns `return_mean`, `return_std`, `return_min`, `return_max`,
/// `length_mean` (decisions), `distance_mean` (m), `speed_mean` (m/s), `falls`, `diverged` and `episodes`. `task` is needed
/// for agents that are written in Python; without, it is the policy's own. `options`: options of the task. Those of a task
/// with a name that are not given are the ones that the policy was trained with; a class gets them as arguments of its
/// constructor. Ctrl-C ends it.
#[pyfunction]
#[pyo3(signature = (policy, episodes = 100, *, task = None, seed = EvalOptions::default().seed, threads = 0, **options))]
pub fn evaluate<'py>(
    py: Python<'py>,
    policy: &Policy,
    #[pyo3(from_py_with = number::episodes)] episodes: usize,
    #[pyo3(from_py_with = task::optional)] task: Option<Task>,
    #[pyo3(from_py_with = number::seed)] seed: u64,
    #[pyo3(from_py_with = number::threads)] threads: usize,
    options: Option<&Bound<'_, PyDict>>,
) -> PyResult<Bound<'py, PyDict>> {
    let given = options;
    let options = EvalOptions { episodes, seed, threads };
    let result = match &task {
        Some(Task::Agent(agent)) => {
            let agents = episodes.clamp(1, MOST_AGENTS).next_multiple_of(BLOCK);
            let batch_task = task::lockstep(agent.bind(py), agents, threads, given)?;
            batch_task::run(py, Some(&batch_task), || play(&batch_task, Isa::best(), &policy.0, &options))?
        }
        other => {
            let name = if let Some(Task::Name(name)) = other { task::plain(name) } else { policy.task() };
            let noted = TaskConfig::of_policy(policy.0.meta());
            let asked = TaskConfig::named(name).map_err(error::run)?;
            let task_config = if asked.agent == noted.agent { noted } else { asked };
            let given = arguments::read(name, given)?.into();
            let factory = task_config.with(&given).and_then(|task_config| task_config.factory()).map_err(error::run)?;
            interrupt::playing(py, &*factory, |factory| play(factory, Isa::best(), &policy.0, &options))?
        }
    };
    Ok(json(py, &result.map_err(error::learn)?)?.cast_into()?)
}

/// `n` standard normal numbers of a generator, or of a new one with the given seed.
fn normal<'py>(py: Python<'py>, rng: Bound<'py, PyAny>, n: usize) -> PyResult<Vec<f32>> {
    let rng = match rng.hasattr("standard_normal")? {
        true => rng,
        false => py.import("numpy.random")?.call_method1("default_rng", (rng,))?,
    };
    let drawn = rng.call_method1("standard_normal", (n, "float32"))?;
    Ok(drawn.cast_into::<PyArray1<f32>>()?.to_vec()?)
}

/// A document as Python's dictionaries and lists.
pub fn json<'py>(py: Python<'py>, document: &impl serde::Serialize) -> PyResult<Bound<'py, PyAny>> {
    let text = serde_json::to_string(document).map_err(error::any)?;
    py.import("json")?.call_method1("loads", (text,))
}
