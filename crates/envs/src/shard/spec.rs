//! Constant facts of a task, as learners and tools see them.

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
    /// Lowest sensible action per actuator, in the actuator's own units; -inf for an actuator without bounds.
    ///
    /// Every environment takes actions in these units: [-1, 1] for the suite's own agents, which clip them, the
    /// actuators' `ctrlrange` for Gymnasium's and dm_control's tasks, which do not: their rewards see what was asked for,
    /// their physics clamps what acts. A learner that acts in [-1, 1] maps that to the bounds with
    /// [`Spec::action_of`], and so do the policies that it writes: their actions are the environment's, and earn the same
    /// here and in the original task.
    pub action_low: Vec<f32>,
    /// Highest sensible action per actuator.
    pub action_high: Vec<f32>,
    /// Seconds between decisions.
    pub dt: f64,
    /// Physics steps per decision.
    pub frame_skip: usize,
    /// Decisions after which an episode is truncated.
    pub max_episode_steps: usize,
    /// Names of the reward's terms, in the order of [`BlockStep::terms`](crate::BlockStep::terms).
    pub reward_terms: Vec<String>,
    /// Names of further numbers for logs, in the order of [`BlockStep::info`](crate::BlockStep::info).
    pub info: Vec<String>,
    /// Names of the observation's parts, in their order, and where they lie; together they are all of it.
    pub observations: Vec<ObsGroup>,
    /// Numbers that tell how well the task is done, see [`BlockStep::metric`](crate::BlockStep::metric).
    pub metrics: Vec<Metric>,
    /// What the agent can be told to do: names, ranges and units of its command.
    pub command: Vec<CommandRange>,
    /// Who decides in the task, if more than one does, each with a policy of its own, see [`Spec::deciders`].
    pub roles: Vec<Role>,
    /// Arguments that the agent takes, with the values that it has.
    pub options: Options,
    /// Length of a configuration, `qpos`.
    pub nq: usize,
    /// Length of a velocity, `qvel`.
    pub nv: usize,
}

impl Spec {
    /// Memory per agent that follows from this description, in the environment and in the arrays that a caller reads,
    /// bytes.
    pub(crate) fn agent_bytes(&self) -> usize {
        let state = self.nq + 3 * self.nv;
        // first the environment; then up to three sets of arrays, with the observations twice and in double precision
        let told = self.act + self.reward_terms.len() + self.info.len() + 4 * self.command.len();
        let observed = self.obs * 7;
        NUMBER * (state + 4 * told + observed) + OVERHEAD
    }

    /// All who decide in the task: [`Spec::roles`], or one who has it all.
    pub fn deciders(&self) -> Vec<Role> {
        if !self.roles.is_empty() {
            return self.roles.clone();
        }
        vec![Role { obs: 0..self.obs, act: 0..self.act, terms: 0..self.reward_terms.len(), ..Role::default() }]
    }

    /// The task as a role knows it. Its id is `<task>/<role>`, unless the role has it all.
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

/// A part of an observation.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ObsGroup {
    /// Name, such as `touch`.
    pub name: String,
    /// Which numbers of the observation.
    pub range: Range<usize>,
}

/// A number that tells, decision by decision, how well a task is done.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Metric {
    /// Name.
    pub name: String,
    /// Where it is.
    pub source: MetricSource,
}

/// Where a metric is to be found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MetricSource {
    /// It is the distance along +x, [`BlockStep::forward`](crate::BlockStep::forward).
    Forward,
    /// It is a number of [`BlockStep::info`](crate::BlockStep::info).
    Info(usize),
}

impl Spec {
    /// The metrics but for the distance along +x, which reports have in any case.
    pub fn own_metrics(&self) -> impl Iterator<Item = &Metric> {
        self.metrics.iter().filter(|metric| metric.source != MetricSource::Forward)
    }

    /// Bounds of an actuator's actions for a policy that acts within bounds: [-1, 1] for an actuator that has none.
    #[inline(always)]
    pub fn action_range(&self, i: usize) -> [f32; 2] {
        let (low, high) = (self.action_low[i], self.action_high[i]);
        if low.is_finite() && high.is_finite() { [low, high] } else { [-1.0, 1.0] }
    }

    /// The action that a nominal one stands for: clipped to [-1, 1], and mapped to the [range](Spec::action_range) of
    /// actuator `i`.
    #[inline(always)]
    pub fn action_of(&self, i: usize, nominal: f32) -> f32 {
        scale_action(self.action_range(i), nominal.clamp(-1.0, 1.0))
    }
}

/// Maps [-1, 1] to a range.
#[inline(always)]
pub fn scale_action([low, high]: [f32; 2], nominal: f32) -> f32 {
    // the same bits where there is nothing to map
    if low == -1.0 && high == 1.0 { nominal } else { 0.5 * (low + high) + 0.5 * (high - low) * nominal }
}
