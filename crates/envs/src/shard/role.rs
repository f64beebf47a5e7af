//! Roles of a task: which observations, actions and rewards belong to each.

use std::ops::Range;

use super::{BLOCK, BlockStep};

/// A role of a task.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Role {
    /// Name, such as `runner`. It is empty in a task with a single role.
    pub name: String,
    /// Range of the observation.
    pub obs: Range<usize>,
    /// Range of the actions.
    pub act: Range<usize>,
    /// Range of the reward's terms.
    pub terms: Range<usize>,
    /// Whether it acts in some decisions only.
    pub intermittent: bool,
}

/// The id of a task for one of its roles.
pub fn role_id(task: &str, role: &str) -> String {
    format!("{task}/{role}")
}

/// The task of an id from [`role_id`], or the id itself.
pub fn task_of_role(id: &str) -> &str {
    id.split_once('/').map_or(id, |(task, _)| task)
}

impl BlockStep {
    /// Reward of role `i`.
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

    /// Agents for which role `i` ended its part before the episode, one bit each: with failure and without.
    pub fn leaving(&self, i: usize) -> [u16; 2] {
        self.leaves.get(i).copied().unwrap_or_default()
    }

    /// Agents for which role `i` acts next, one bit each. In a task with one role, all of them.
    pub fn deciding(&self, i: usize) -> u16 {
        self.decides.get(i).copied().unwrap_or(!0)
    }
}
