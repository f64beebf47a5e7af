//! Constant facts of a task for learners and tools.

use std::ops::Range;

use super::role::{Role, role_id};
use crate::agent::{CommandRange, Options};

/// Size of a double-precision number, bytes.
pub(crate) const NUMBER: usize = 8;
/// Size of an agent's allocations, counters and flags, bytes.
const OVERHEAD: usize = 1200;

/// Constant facts of a task.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Spec {
    /// Registry name, such as `Hopper-v0`.
    pub id: String,
    /// Observation length.
    pub obs: usize,
    /// Action length.
    pub act: usize,
    /// Names of the actuators.
    pub action_names: Vec<String>,
    /// Lowest meaningful action per actuator, in the actuator's units. It is -inf for an actuator without bounds.
    ///
    /// Every environment takes actions in these units. For the suite's own agents they are [-1, 1], and actions are
    /// clipped. For the tasks of Gymnasium and dm_control they are the actuators' `ctrlrange`. Those do not clip: the
    /// reward uses the given action, and the physics clamps it.
    ///
    /// A learner that acts in [-1, 1] maps its actions to the bounds with [`Spec::action_of`]. The policies that it
    /// writes do the same, so they earn the same here and in the original task.
    pub action_low: Vec<f32>,
    /// Highest meaningful action per actuator.
    pub action_high: Vec<f32>,
    /// Seconds between decisions.
    pub dt: f64,
    /// Physics steps per decision.
    pub frame_skip: usize,
    /// Decisions after which an episode is truncated.
    pub max_episode_steps: usize,
    /// Names of the reward's terms, in the order of [`BlockStep::terms`](crate::BlockStep::terms).
    pub reward_terms: Vec<String>,
    /// Names of the infos, in the order of [`BlockStep::info`](crate::BlockStep::info).
    pub info: Vec<String>,
    /// Groups of the observation, in order. Together they cover it.
    pub observations: Vec<ObsGroup>,
    /// Numbers per decision that measure success, see [`BlockStep::metric`](crate::BlockStep::metric).
    pub metrics: Vec<Metric>,
    /// Names, ranges and units of the command.
    pub command: Vec<CommandRange>,
    /// The roles of a task with several policies, otherwise empty. See [`Spec::deciders`].
    pub roles: Vec<Role>,
    /// The agent's arguments with their values.
    pub options: Options,
    /// Length of a configuration, `qpos`.
    pub nq: usize,
    /// Length of a velocity, `qvel`.
    pub nv: usize,
}

impl Spec {
    /// Memory per agent, bytes, in the environment and in the arrays of the caller.
    pub(crate) fn agent_bytes(&self) -> usize {
        let state = self.nq + 3 * self.nv;
        // the environment, then up to three sets of arrays, with observations twice and in double precision
        let told = self.act + self.reward_terms.len() + self.info.len() + 4 * self.command.len();
        let observed = self.obs * 7;
        NUMBER * (state + 4 * told + observed) + OVERHEAD
    }

    /// All roles: [`Spec::roles`], or a single role that covers the task.
    pub fn deciders(&self) -> Vec<Role> {
        if !self.roles.is_empty() {
            return self.roles.clone();
        }
        vec![Role { obs: 0..self.obs, act: 0..self.act, terms: 0..self.reward_terms.len(), ..Role::default() }]
    }

    /// The task of one role. Its id is `<task>/<role>`, or the task's id for a single role.
    pub fn of_role(&self, role: &Role) -> Spec {
        if role.name.is_empty() {
            return self.clone();
        }
        let Role { name, obs, act, terms, .. } = role;
        let seen =
            self.observations.iter().filter(|group| obs.start <= group.range.start && group.range.end <= obs.end);
        let observations = seen.cloned().map(|mut group| {
            group.range = group.range.start - obs.start..group.range.end - obs.start;
            group
        });
        Spec {
            id: role_id(&self.id, name),
            obs: obs.len(),
            act: act.len(),
            action_names: self.action_names[act.clone()].to_vec(),
            action_low: self.action_low[act.clone()].to_vec(),
            action_high: self.action_high[act.clone()].to_vec(),
            reward_terms: self.reward_terms[terms.clone()].to_vec(),
            observations: observations.collect(),
            roles: Vec::new(),
            ..self.clone()
        }
    }
}

/// A group of numbers in an observation.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ObsGroup {
    /// Name, such as `touch`.
    pub name: String,
    /// Range in the observation.
    pub range: Range<usize>,
}

/// A number per decision that measures success in a task.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Metric {
    /// Name.
    pub name: String,
    /// Source.
    pub source: MetricSource,
}

/// Source of a metric.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MetricSource {
    /// The distance along +x, [`BlockStep::forward`](crate::BlockStep::forward).
    Forward,
    /// A number of [`BlockStep::info`](crate::BlockStep::info).
    Info(usize),
}

impl Spec {
    /// The metrics without the distance along +x, which reports always include.
    pub fn own_metrics(&self) -> impl Iterator<Item = &Metric> {
        self.metrics.iter().filter(|metric| metric.source != MetricSource::Forward)
    }

    /// Index of the info `rising`: 1 while the character gets up after a fall, otherwise 0. `None` for tasks in which a
    /// fall ends the episode, or that do not notice falls.
    pub fn rising(&self) -> Option<usize> {
        self.info_named("rising")
    }

    /// Index of the info `skill`: the number of the active skill, or 0. Skills are counted from 1, first the buttons of
    /// the command in their order ([`CommandRange::is_button`]), then others.
    pub fn skill(&self) -> Option<usize> {
        self.info_named("skill")
    }

    fn info_named(&self, name: &str) -> Option<usize> {
        self.info.iter().position(|info| info == name)
    }

    /// Bounds of an actuator's actions for a policy with bounded actions. They are [-1, 1] for an actuator without
    /// bounds.
    #[inline(always)]
    pub fn action_range(&self, i: usize) -> [f32; 2] {
        let (low, high) = (self.action_low[i], self.action_high[i]);
        if low.is_finite() && high.is_finite() { [low, high] } else { [-1.0, 1.0] }
    }

    /// The action for a nominal one: clipped to [-1, 1] and mapped to the [range](Spec::action_range) of actuator `i`.
    #[inline(always)]
    pub fn action_of(&self, i: usize, nominal: f32) -> f32 {
        scale_action(self.action_range(i), nominal.clamp(-1.0, 1.0))
    }
}

/// Maps [-1, 1] to a range.
#[inline(always)]
pub fn scale_action([low, high]: [f32; 2], nominal: f32) -> f32 {
    // keep the bits if there is nothing to map
    if low == -1.0 && high == 1.0 { nominal } else { 0.5 * (low + high) + 0.5 * (high - low) * nominal }
}
