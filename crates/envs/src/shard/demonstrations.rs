//! Demonstrations: observations and actions of an expert, decision by decision.

use std::ops::Range;

use super::{Role, Spec};

/// Decisions of an expert, as the environment observes them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Demonstrations {
    /// Length of an observation.
    pub obs_len: usize,
    /// Length of an action, 0 if actions are unknown.
    pub act_len: usize,
    /// Observations, `[row][obs]`.
    pub obs: Vec<f32>,
    /// For each decision, the observed row and the row observed next.
    pub decisions: Vec<[usize; 2]>,
    /// Ranges of decisions, one per motion. Motions have equal weight, regardless of their length.
    pub motions: Vec<Range<usize>>,
    /// Actions in [-1, 1], `[decision][act]`.
    pub actions: Vec<f32>,
    /// Source file. `None` for the task's own demonstrations.
    pub source: Option<String>,
}

impl Demonstrations {
    /// Number of decisions.
    pub fn len(&self) -> usize {
        self.decisions.len()
    }
    /// Whether there are no decisions.
    pub fn is_empty(&self) -> bool {
        self.decisions.is_empty()
    }
    /// An observation.
    pub fn row(&self, i: usize) -> &[f32] {
        &self.obs[i * self.obs_len..][..self.obs_len]
    }
    /// The action of a decision, empty if unknown.
    pub fn action(&self, decision: usize) -> &[f32] {
        &self.actions[decision * self.act_len..][..self.act_len]
    }

    /// The part of the demonstrations that a role of the task observes and controls.
    pub fn of_role(self, role: &Role, spec: &Spec) -> Self {
        let cut = |rows: &[f32], len: usize, own: &Range<usize>| -> Vec<f32> {
            rows.chunks_exact(len.max(1)).flat_map(|row| row[own.clone()].iter().copied()).collect()
        };
        if self.obs_len != spec.obs || role.obs.len() == spec.obs {
            return self;
        }
        let mut out = Demonstrations { obs: cut(&self.obs, self.obs_len, &role.obs), obs_len: role.obs.len(), ..self };
        if out.act_len == spec.act {
            (out.actions, out.act_len) = (cut(&out.actions, spec.act, &role.act), role.act.len());
        }
        out
    }
}
