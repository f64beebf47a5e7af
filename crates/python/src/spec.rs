//! Facts of a task.

use crate::error;
use marathon_envs::registry;
use marathon_physics::lanes::Isa;
use pyo3::prelude::*;

/// Constant facts of a task.
#[pyclass(frozen, get_all, module = "marathon_envs")]
pub struct Spec {
    /// Name in the registry, such as `Hopper-v0`.
    pub id: String,
    /// One line about the task.
    pub summary: String,
    /// Length of an observation.
    pub obs_size: usize,
    /// Length of an action.
    pub act_size: usize,
    /// Names of the actuators, in the order of the action.
    pub action_names: Vec<String>,
    /// Lowest sensible action per actuator, in the actuator's own units; -inf for one without bounds.
    pub action_low: Vec<f32>,
    /// Highest sensible action per actuator.
    pub action_high: Vec<f32>,
    /// Seconds between two steps.
    pub dt: f64,
    /// Physics steps per step.
    pub frame_skip: usize,
    /// Steps after which an episode is truncated.
    pub max_episode_steps: usize,
    /// Names of the reward's terms, which add up to the reward.
    pub reward_terms: Vec<String>,
    /// Names of the numbers in `VecEnv.info`.
    pub info: Vec<String>,
    /// Length of `qpos`.
    pub nq: usize,
    /// Length of `qvel`.
    pub nv: usize,
}

#[pymethods]
impl Spec {
    fn __repr__(&self) -> String {
        let Spec { id, obs_size, act_size, dt, max_episode_steps, .. } = self;
        format!(
            "Spec(id={id:?}, obs_size={obs_size}, act_size={act_size}, dt={dt}, max_episode_steps={max_episode_steps})"
        )
    }
}

/// Names of all registered tasks.
#[pyfunction]
pub fn ids() -> Vec<String> {
    registry::ids()
}

/// Facts of a task, by any of its names.
#[pyfunction]
#[pyo3(signature = (id, /))]
pub fn spec(id: &str) -> PyResult<Spec> {
    Spec::of(registry::factory(id, Isa::F32).map_err(error::env)?.spec())
}

impl Spec {
    /// From the facts that an environment goes by.
    pub fn of(spec: &marathon_envs::Spec) -> PyResult<Self> {
        let facts = registry::agent(&spec.id).map_err(error::env)?.facts();
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
            nq: spec.nq,
            nv: spec.nv,
        })
    }
}
