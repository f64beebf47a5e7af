//! One role of a task as a behavior: its deciding agents, its name, its observations and its rewards.
//!
//! A task without roles has one face for everything. A role that skips decisions has no infos in between: its last
//! action stays, and its rewards are summed until its next info.

use crate::error::PlayerError;
use crate::wire::{ActionSpec, AgentActionList, AgentInfo, BrainParameters, FloatData, Observation};
use marathon_envs::{EnvError, Role, Spec, Step, VecEnv};
use std::ops::Range;

/// ML-Agents' suffix of all behaviors without self-play.
pub(crate) const TEAM: &str = "?team=0";
/// Bytes of an entry of a message's map, besides its key and its infos.
const ENTRY: usize = 32;

/// A role, as the trainer sees it.
pub(crate) struct Face {
    /// Name with the team suffix, as ML-Agents expects it.
    name: String,
    /// Index of the role in the task.
    number: usize,
    role: Role,
    /// Agents for which it decides next.
    decides: Vec<bool>,
    /// Agents for which its part of the episode has just ended: by failure, and otherwise.
    leaves: [Vec<bool>; 2],
    /// Agents in whose episode the role has finished.
    left: Vec<bool>,
    /// Rewards since its last info.
    earned: Vec<f32>,
    ids: Vec<i32>,
    /// Reused info.
    info: AgentInfo,
}

impl Face {
    /// Creates one face per role of a task. The first has the name `name`; the others append a point and the role's
    /// name. (Marathon's own configurations use a slash. ML-Agents would take it for a folder and fail to write its
    /// first checkpoint.) Agent numbers begin at `first_id`.
    pub fn all(name: &str, spec: &Spec, agents: usize, first_id: i32) -> Vec<Face> {
        let mut ids = first_id..;
        let face = |(number, role): (usize, Role)| Face {
            name: match number {
                0 => format!("{name}{TEAM}"),
                _ => format!("{name}.{}{TEAM}", role.name),
            },
            number,
            decides: vec![true; agents],
            leaves: [vec![false; agents], vec![false; agents]],
            left: vec![false; agents],
            earned: vec![0.0; agents],
            ids: ids.by_ref().take(agents).collect(),
            info: AgentInfo { observations: vec![observation(&vec![0.0; role.obs.len()])], ..Default::default() },
            role,
        };
        spec.deciders().into_iter().enumerate().map(face).collect()
    }

    /// Name for the trainer, such as `Hopper-v0?team=0`.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The name without the team.
    pub fn label(&self) -> &str {
        self.name.trim_end_matches(TEAM)
    }

    /// The role.
    pub fn role(&self) -> &Role {
        &self.role
    }

    /// Updates the ranges of the role in the task after one of its options has changed.
    pub fn set_role(&mut self, role: Role) {
        self.role = role;
    }

    /// Description of the behavior for the trainer.
    pub fn parameters(&self) -> BrainParameters {
        let action_spec = ActionSpec { num_continuous: self.role.act.len() as i32 };
        BrainParameters { brain_name: self.name.clone(), is_training: true, action_spec: Some(action_spec) }
    }

    /// Bytes of the behavior's part of a message without infos.
    pub fn frame_bytes(&self) -> usize {
        self.name.len() + ENTRY
    }

    /// Maximum bytes per agent: at the end of an episode there are two infos.
    pub fn bytes_per_agent(&self) -> usize {
        let info = AgentInfo { reward: 1.0, done: true, max_step_reached: true, id: i32::MAX, ..self.info.clone() };
        2 * prost::encoding::message::encoded_len(1, &info)
    }

    /// Writes the trainer's choice into the actions of all agents, `[agents][act]`.
    ///
    /// # Errors
    /// If it did not choose for exactly the agents for which the role decides, or not all of their actions.
    pub fn act(&self, chosen: Option<&AgentActionList>, spec: &Spec, actions: &mut [f32]) -> Result<(), PlayerError> {
        let Range { start, end } = self.role.act;
        let rows = actions.chunks_exact_mut(spec.act).zip(&self.decides).filter(|(_, decides)| **decides);
        let rows = rows.map(|(row, _)| &mut row[start..end]);
        let Some(list) = chosen else {
            // no decision: rest
            rows.for_each(|row| row.fill(0.0));
            return Ok(());
        };
        let (n, act) = (self.decides.iter().filter(|decides| **decides).count(), end - start);
        let mut lengths = list.value.iter().map(|action| action.continuous_actions.len());
        let wrong = lengths.find(|length| *length != act);
        if list.value.len() != n || wrong.is_some() {
            let found = (list.value.len(), wrong.unwrap_or(act));
            return Err(PlayerError::Actions { name: self.name.clone(), found, expected: (n, act) });
        }
        for (row, action) in rows.zip(&list.value) {
            for (i, (to, x)) in row.iter_mut().zip(&action.continuous_actions).enumerate() {
                *to = spec.action_of(start + i, *x);
            }
        }
        Ok(())
    }

    /// Adds the role's rewards of a decision.
    pub fn earn(&mut self, spec: &Spec, out: &Step) {
        if self.number == 0 {
            self.earned.iter_mut().zip(&out.reward).for_each(|(sum, x)| *sum += x);
            return;
        }
        let terms = out.terms.chunks_exact(spec.reward_terms.len().max(1));
        for (sum, terms) in self.earned.iter_mut().zip(terms) {
            *sum += terms[self.role.terms.clone()].iter().sum::<f32>();
        }
    }

    /// Reads which agents decide next, and for which the role has finished.
    pub fn look(&mut self, env: &VecEnv) -> Result<(), EnvError> {
        env.leaves(self.number, self.leaves.each_mut().map(|leaves| &mut leaves[..]))?;
        env.decides(self.number, &mut self.decides)
    }

    /// Resets the state after all episodes have restarted.
    pub fn begin(&mut self) {
        self.decides.fill(true);
        self.leaves.iter_mut().chain([&mut self.left]).for_each(|list| list.fill(false));
        self.earned.fill(0.0);
    }

    /// Appends an encoded [`AgentInfoList`](crate::wire::AgentInfoList). It has an info for each agent for which the
    /// role decides, and one more for each agent whose episode, or the role's part of it, ended. With `fresh_ids`, the
    /// number for the next new episode, agents change their numbers between episodes.
    pub fn report(
        &mut self,
        spec: &Spec,
        out: &Step,
        ended: &[bool],
        mut fresh_ids: Option<&mut i32>,
        infos: &mut Vec<u8>,
    ) {
        for (i, ended) in ended.iter().enumerate() {
            let row = i * spec.obs..(i + 1) * spec.obs;
            let leaves = self.leaves[0][i] || self.leaves[1][i];
            if (*ended || leaves) && !self.left[i] {
                // whether it ended for a reason other than failure
                let late = if *ended { out.truncated[i] } else { self.leaves[1][i] };
                self.describe(i, &out.final_obs[row.clone()], Some(late));
                put(infos, &self.info);
                if let Some(next) = &mut fresh_ids {
                    self.ids[i] = **next;
                    **next = next.wrapping_add(1).max(0);
                }
            }
            self.left[i] = (self.left[i] || leaves) && !ended;
            if *ended {
                self.earned[i] = 0.0;
            }
            if self.decides[i] {
                self.describe(i, &out.obs[row], None);
                put(infos, &self.info);
            }
        }
    }

    /// Writes an agent's info: for its current state, or for the end of its episode and whether that was the time
    /// limit. Rewards before the end belong to the end.
    fn describe(&mut self, i: usize, obs: &[f32], end: Option<bool>) {
        let info = &mut self.info;
        info.reward = std::mem::take(&mut self.earned[i]);
        info.done = end.is_some();
        info.max_step_reached = end.unwrap_or(false);
        info.id = self.ids[i];
        if let Some(numbers) = info.observations.first_mut().and_then(|sensor| sensor.float_data.as_mut()) {
            numbers.data.copy_from_slice(&obs[self.role.obs.clone()]);
        }
    }
}

/// Text of a task's roles for error messages.
pub(crate) fn roles(spec: &Spec) -> String {
    let one = |role: &Role| {
        let Role { name, obs, act, terms, .. } = role;
        let (obs, act, terms) = (obs.len(), act.len(), terms.len());
        let name = if name.is_empty() { "one role" } else { name };
        format!("{name} ({obs} observations, {act} actions, {terms} terms of the reward)")
    };
    spec.deciders().iter().map(one).collect::<Vec<_>>().join(", ")
}

/// Appends an entry of an [`AgentInfoList`](crate::wire::AgentInfoList).
fn put(list: &mut Vec<u8>, info: &AgentInfo) {
    prost::encoding::message::encode(1, info, list);
}

/// A vector of numbers as a sensor's observation.
pub(crate) fn observation(data: &[f32]) -> Observation {
    Observation {
        shape: vec![data.len() as i32],
        float_data: Some(FloatData { data: data.to_vec() }),
        dimension_properties: vec![Observation::NO_PROPERTY],
        name: format!("VectorSensor_size{}", data.len()),
    }
}
