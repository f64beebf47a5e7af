//! Who decides in a task: which numbers of the whole belong to whom.

use std::ops::Range;

use super::{BLOCK, BlockStep};

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
