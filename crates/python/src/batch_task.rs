//! Learning natively what is defined in Python: an object with the interface of `VecEnv`, which is called once per
//! decision for all of its agents.

use crate::error;
use marathon_envs::{
    BatchAdapter, BatchTask, BatchTaskError, CommandRange, Metric, MetricSource, ObsGroup, Options, Spec, StepMut,
};
use numpy::{AllowTypeChange, Element, PyArray1, PyArrayLikeDyn, PyArrayMethods, PyUntypedArrayMethods};
use pyo3::conversion::FromPyObjectOwned;
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};

/// Agents behind a Python object with the interface of `VecEnv` that resets in the same step.
struct PyBatchTask {
    env: Py<PyAny>,
    agents: usize,
    act: usize,
}

impl BatchTask for PyBatchTask {
    fn reset(&mut self, seed: u64, obs: &mut [f32]) -> Result<(), BatchTaskError> {
        Python::attach(|py| copy("obs", &self.env.bind(py).call_method1("reset", (seed,))?, obs)).map_err(Into::into)
    }

    fn step(&mut self, actions: &[f32], out: StepMut<'_>) -> Result<(), BatchTaskError> {
        let result = Python::attach(|py| -> PyResult<()> {
            let env = self.env.bind(py);
            let actions = PyArray1::from_slice(py, actions).reshape([self.agents, self.act])?;
            let result = env.call_method1("step", (actions,))?;
            copy("obs", &result.get_item(0)?, out.obs)?;
            copy("reward", &result.get_item(1)?, out.reward)?;
            copy("terminated", &result.get_item(2)?, out.terminated)?;
            copy("truncated", &result.get_item(3)?, out.truncated)?;
            copy("final_obs", &env.getattr("final_obs")?, out.final_obs)?;
            copy("reward_terms", &env.getattr("reward_terms")?, out.terms)?;
            copy("info", &env.getattr("info")?, out.info)?;
            copy("forward", &env.getattr("forward")?, out.forward)?;
            copy("diverged", &env.getattr("diverged")?, out.diverged)
        });
        result.map_err(Into::into)
    }

    fn save(&self) -> Result<Vec<u8>, BatchTaskError> {
        Python::attach(|py| -> PyResult<Vec<u8>> { self.env.bind(py).call_method0("save")?.extract() })
            .map_err(Into::into)
    }

    fn load(&mut self, bytes: &[u8]) -> Result<(), BatchTaskError> {
        Python::attach(|py| self.env.bind(py).call_method1("load", (PyBytes::new(py, bytes),)).map(|_| ()))
            .map_err(Into::into)
    }
}

/// Copies an array that Python returned.
fn copy<T: Element + Copy + for<'a> FromPyObjectOwned<'a>>(
    name: &str,
    array: &Bound<'_, PyAny>,
    to: &mut [T],
) -> PyResult<()> {
    let array: PyArrayLikeDyn<'_, T, AllowTypeChange> = array.extract()?;
    if array.len() != to.len() {
        let (found, expected) = (array.len(), to.len());
        return Err(error::value(format!("{name} of the environment has {found} values, expected {expected}")));
    }
    match array.as_slice() {
        Ok(slice) if array.is_c_contiguous() => to.copy_from_slice(slice),
        _ => to.iter_mut().zip(array.as_array()).for_each(|(to, x)| *to = *x),
    }
    Ok(())
}

/// Facts of the task of a Python object with the interface of `VecEnv`.
pub fn spec(env: &Bound<'_, PyAny>) -> PyResult<Spec> {
    let spec = env.getattr("spec")?;
    Ok(Spec {
        id: spec.getattr("id")?.extract()?,
        obs: spec.getattr("obs_size")?.extract()?,
        act: spec.getattr("act_size")?.extract()?,
        action_names: spec.getattr("action_names")?.extract()?,
        action_low: spec.getattr("action_low")?.extract()?,
        action_high: spec.getattr("action_high")?.extract()?,
        dt: spec.getattr("dt")?.extract()?,
        frame_skip: spec.getattr("frame_skip")?.extract()?,
        max_episode_steps: spec.getattr("max_episode_steps")?.extract()?,
        reward_terms: spec.getattr("reward_terms")?.extract()?,
        info: spec.getattr("info")?.extract()?,
        options: Options::new(),
        nq: spec.getattr("nq")?.extract()?,
        nv: spec.getattr("nv")?.extract()?,
        observations: parts(&spec.getattr("observations")?)?,
        metrics: metrics(&spec.getattr("metrics")?, &spec.getattr("info")?)?,
        command: commands(&spec.getattr("command")?)?,
        roles: Vec::new(),
    })
}

/// Parts of an observation: slices by name.
fn parts(observations: &Bound<'_, PyAny>) -> PyResult<Vec<ObsGroup>> {
    let mut parts = Vec::new();
    for item in observations.call_method0("items")?.try_iter()? {
        let (name, slice): (String, Bound<'_, PyAny>) = item?.extract()?;
        let (start, stop): (usize, usize) = (slice.getattr("start")?.extract()?, slice.getattr("stop")?.extract()?);
        parts.push(ObsGroup { name, range: start..stop });
    }
    Ok(parts)
}

/// Metrics by their names, which are infos or `forward`.
fn metrics(names: &Bound<'_, PyAny>, info: &Bound<'_, PyAny>) -> PyResult<Vec<Metric>> {
    let (names, info): (Vec<String>, Vec<String>) = (names.extract()?, info.extract()?);
    let source = |name: &String| match info.iter().position(|known| known == name) {
        Some(i) => MetricSource::Info(i),
        None => MetricSource::Forward,
    };
    Ok(names.into_iter().map(|name| Metric { source: source(&name), name }).collect())
}

/// Ranges of the agents' commands.
fn commands(ranges: &Bound<'_, PyAny>) -> PyResult<Vec<CommandRange>> {
    let mut out = Vec::new();
    for range in ranges.try_iter()? {
        let range = range?;
        let number = |name| range.getattr(name)?.extract::<f64>();
        out.push(CommandRange {
            name: range.getattr("name")?.extract()?,
            low: number("low")?,
            high: number("high")?,
            unit: range.getattr("unit")?.extract()?,
        });
    }
    Ok(out)
}

/// The blocks of a Python object with the interface of `VecEnv`.
pub fn lockstep(env: &Bound<'_, PyAny>) -> PyResult<BatchAdapter> {
    let spec = spec(env)?;
    let (agents, autoreset) = (env.len()?, env.getattr("autoreset")?.extract::<String>()?);
    if agents == 0 || !agents.is_multiple_of(marathon_envs::BLOCK) {
        let block = marathon_envs::BLOCK;
        return Err(error::value(format!("the environment has {agents} agents, expected a multiple of {block}")));
    }
    if autoreset != "same_step" {
        return Err(error::value(format!("the environment's autoreset is '{autoreset}', expected 'same_step'")));
    }
    let batch_task = PyBatchTask { env: env.clone().unbind(), agents, act: spec.act };
    Ok(BatchAdapter::new(Box::new(batch_task), spec, agents))
}

/// Runs `f` without the GIL. If a batch task fails in Python meanwhile, that is the error.
pub fn run<R: Send>(py: Python<'_>, batch_task: Option<&BatchAdapter>, f: impl FnOnce() -> R + Send) -> PyResult<R> {
    let result = py.detach(AssertUnwindSafe(|| catch_unwind(AssertUnwindSafe(f))));
    result.map_err(|panic| match batch_task.and_then(BatchAdapter::take_error).map(|e| e.downcast::<PyErr>()) {
        Some(Ok(error)) => *error,
        Some(Err(error)) => error::value(error.to_string()),
        None => resume_unwind(panic),
    })
}

/// Whether training goes on after a callback's answer. Only False stops it: a callback may return nothing, or a number.
pub fn goes_on(answer: &Bound<'_, PyAny>) -> bool {
    answer.extract::<bool>().unwrap_or(true)
}
