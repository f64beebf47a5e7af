//! Facts of a task.

use crate::{error, options, task};
use marathon_envs::{Options, registry};
use marathon_physics::lanes::Isa;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PySlice};

/// One number of an agent's command: its name, range and unit.
#[pyclass(frozen, eq, get_all, module = "marathon_rl")]
#[derive(Clone, PartialEq)]
pub struct CommandRange {
    /// Name, such as `velocity`.
    pub name: String,
    /// Lowest value.
    pub low: f64,
    /// Highest value.
    pub high: f64,
    /// Unit, such as `m/s`; empty for a pure number.
    pub unit: String,
}

#[pymethods]
impl CommandRange {
    #[new]
    #[pyo3(signature = (name, low, high, unit = ""))]
    fn new(name: &str, low: f64, high: f64, unit: &str) -> PyResult<Self> {
        if !(low.is_finite() && high.is_finite() && low <= high) {
            return Err(error::value(format!(
                "command '{name}' is from {low} to {high}, expected a range of finite numbers"
            )));
        }
        Ok(CommandRange { name: name.into(), low, high, unit: unit.into() })
    }

    fn __getnewargs__(&self) -> (String, f64, f64, String) {
        let CommandRange { name, low, high, unit } = self.clone();
        (name, low, high, unit)
    }

    fn __repr__(&self) -> String {
        let CommandRange { name, low, high, unit } = self;
        format!("CommandRange({name:?}, {low}, {high}, {unit:?})")
    }
}

/// Constant facts of a task.
#[pyclass(frozen, module = "marathon_rl")]
pub struct Spec {
    /// Name in the registry, such as `Hopper-v0`.
    #[pyo3(get)]
    pub id: String,
    /// One line about the task.
    #[pyo3(get)]
    pub summary: String,
    /// Length of an observation.
    #[pyo3(get)]
    pub obs_size: usize,
    /// Length of an action.
    #[pyo3(get)]
    pub act_size: usize,
    /// Names of the actuators, in the order of the action.
    #[pyo3(get)]
    pub action_names: Vec<String>,
    /// Lowest sensible action per actuator, in the actuator's own units; -inf for one without bounds.
    #[pyo3(get)]
    pub action_low: Vec<f32>,
    /// Highest sensible action per actuator.
    #[pyo3(get)]
    pub action_high: Vec<f32>,
    /// Seconds between two steps.
    #[pyo3(get)]
    pub dt: f64,
    /// Physics steps per step.
    #[pyo3(get)]
    pub frame_skip: usize,
    /// Steps after which an episode is truncated.
    #[pyo3(get)]
    pub max_episode_steps: usize,
    /// Names of the reward's terms, which add up to the reward.
    #[pyo3(get)]
    pub reward_terms: Vec<String>,
    /// Names of the numbers in `VecEnv.info`.
    #[pyo3(get)]
    pub info: Vec<String>,
    /// Names of the numbers that tell, step by step, how well the task is done: those in `VecEnv.info`, and `forward`,
    /// which is `VecEnv.forward`.
    #[pyo3(get)]
    pub metrics: Vec<String>,
    /// Names of the observation's parts, and where they begin and end.
    observations: Vec<marathon_envs::ObsGroup>,
    /// Commands of the agents, see `VecEnv.set_command`.
    pub command: Vec<CommandRange>,
    /// Length of `qpos`.
    #[pyo3(get)]
    pub nq: usize,
    /// Length of `qvel`.
    #[pyo3(get)]
    pub nv: usize,
    /// Arguments that the task takes, with the values that it has.
    pub options: Options,
}

#[pymethods]
impl Spec {
    /// Arguments that the task takes, with the values that it has.
    #[getter]
    fn options<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        options::show(py, &self.options)
    }

    /// Type of the observations, unless an environment is made with another: "float64" for Gymnasium's own tasks, as
    /// there, and "float32" for all others.
    #[getter]
    fn dtype(&self) -> &'static str {
        if self.is_double() { "float64" } else { "float32" }
    }

    /// Parts of the observation by name, in their order: `obs[:, spec.observations["touch"]]`.
    #[getter]
    fn observations<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let parts = PyDict::new(py);
        for group in &self.observations {
            parts.set_item(&group.name, PySlice::new(py, group.range.start as isize, group.range.end as isize, 1))?;
        }
        Ok(parts)
    }

    /// Commands of the agents, a number each, see `VecEnv.set_command`.
    #[getter]
    fn command(&self) -> Vec<CommandRange> {
        self.command.clone()
    }

    /// For `copy` and `pickle`: what the facts follow from.
    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, Arguments<'py>)> {
        let make = py.import("marathon_rl._native")?.getattr("_spec")?;
        Ok((make, (self.id.clone(), options::show(py, &self.options)?, self.max_episode_steps)))
    }

    fn __repr__(&self) -> String {
        let Spec { id, obs_size, act_size, dt, max_episode_steps, .. } = self;
        format!(
            "Spec(id={id:?}, obs_size={obs_size}, act_size={act_size}, dt={dt}, max_episode_steps={max_episode_steps})"
        )
    }
}

/// Name, arguments and limit of a task.
type Arguments<'py> = (String, Bound<'py, PyDict>, usize);

/// Facts of a task with a limit of its own.
#[pyfunction]
pub fn _spec(id: String, options: &Bound<'_, PyDict>, max_episode_steps: usize) -> PyResult<Spec> {
    Ok(Spec { max_episode_steps, ..spec(id, Some(options))? })
}

/// Names of all registered tasks.
#[pyfunction]
pub fn ids() -> Vec<String> {
    registry::ids()
}

/// Steps after which each task truncates its episodes, by name. No task is made ready to be simulated.
#[pyfunction]
pub fn _limits() -> PyResult<Vec<(String, usize)>> {
    let registry = registry::global();
    let limit = |id: String| Ok((id.clone(), registry.agent(&id)?.facts().max_episode_steps));
    registry.ids().into_iter().map(limit).collect::<Result<_, _>>().map_err(error::env)
}

/// Facts of a task, by any of its names, with other values for some of its arguments.
#[pyfunction]
#[pyo3(signature = (id, /, **options))]
pub fn spec(#[pyo3(from_py_with = task::name)] id: String, options: Option<&Bound<'_, PyDict>>) -> PyResult<Spec> {
    let id = task::plain(&id);
    Spec::of(options::set(id, options)?.factory_on(Isa::F32).map_err(error::run)?.spec())
}

impl CommandRange {
    fn of(range: &marathon_envs::CommandRange) -> Self {
        let marathon_envs::CommandRange { name, low, high, unit } = range.clone();
        CommandRange { name, low, high, unit }
    }
}

impl Spec {
    /// Whether observations are float64: those of Gymnasium's own tasks, which alone have these versions.
    pub fn is_double(&self) -> bool {
        self.id.ends_with("-v4") || self.id.ends_with("-v5")
    }

    /// From the facts that an environment goes by.
    pub fn of(spec: &marathon_envs::Spec) -> PyResult<Self> {
        let agent = registry::global().agent_with(&spec.id, &spec.options).map_err(error::env)?;
        let facts = agent.facts();
        Ok(Spec {
            id: spec.id.clone(),
            summary: facts.summary,
            obs_size: spec.obs,
            act_size: spec.act,
            action_names: spec.action_names.clone(),
            action_low: spec.action_low.clone(),
            action_high: spec.action_high.clone(),
            dt: spec.dt,
            frame_skip: spec.frame_skip,
            max_episode_steps: spec.max_episode_steps,
            reward_terms: spec.reward_terms.clone(),
            info: spec.info.clone(),
            metrics: spec.metrics.iter().map(|metric| metric.name.clone()).collect(),
            observations: spec.observations.clone(),
            command: spec.command.iter().map(CommandRange::of).collect(),
            nq: spec.nq,
            nv: spec.nv,
            options: spec.options.clone(),
        })
    }
}
