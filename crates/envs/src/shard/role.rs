//! Who decides in a task: which numbers of the whole belong to whom.

use std::ops::Range;

use super::{BLOCK, BlockStep, Spec};

/// One who decides in a task, and what of the task is its own.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Role {
    /// Name, such as `runner`; empty where one has it all.
    pub name: String,
    /// Numbers of the observation that it sees.
    pub obs: Range<usize>,
    /// Actions that it chooses.
    pub act: Range<usize>,
    /// Terms of the reward that it earns.
    pub terms: Range<usize>,
    /// Whether it does not decide every time.
    pub intermittent: bool,
}

/// The id of a task as its role of that name knows it.
pub fn role_id(task: &str, role: &str) -> String {
    format!("{task}/{role}")
}

/// The task that an id of [`role_id`] is about, or the id itself.
pub fn task_of_role(id: &str) -> &str {
    id.split_once('/').map_or(id, |(task, _)| task)
}

impl Spec {
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

impl BlockStep {
    /// What role number `i` earned.
    pub fn reward_of(&self, i: usize, role: &Role) -> [f32; BLOCK] {
        if i == 0 {
            return self.reward;
        }
        let mut sum = [0.0; BLOCK];
        for term in self.terms[role.terms.start * BLOCK..role.terms.end * BLOCK].chunks_exact(BLOCK) {
            sum.iter_mut().zip(term).for_each(|(sum, x)| *sum += x);
        }
        sum
    }

    /// Agents whose role number `i` has come to its end before their episode, a bit each: those where it has failed, and
    /// those where it has not.
    pub fn leaving(&self, i: usize) -> [u16; 2] {
        self.leaves.get(i).copied().unwrap_or_default()
    }

    /// Agents whose role number `i` decides next, a bit each: all, where the task has one role.
    pub fn deciding(&self, i: usize) -> u16 {
        self.decides.get(i).copied().unwrap_or(!0)
    }
}
