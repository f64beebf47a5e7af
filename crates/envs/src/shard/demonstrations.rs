//! Demonstrations: what an expert observed and did, decision by decision.

use std::ops::Range;

use super::{Role, Spec};

/// Decisions of an expert, as the environment observes them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Demonstrations {
    /// Length of an observation.
    pub obs_len: usize,
    /// Length of an action; 0 if the actions are not known.
    pub act_len: usize,
    /// Observations, `[row][obs]`.
    pub obs: Vec<f32>,
    /// Per decision, the row that was observed and the one that was observed next.
    pub decisions: Vec<[usize; 2]>,
    /// Runs of decisions, one for each motion, that are as important as each other however long they are.
    pub motions: Vec<Range<usize>>,
    /// Actions in [-1, 1], `[decision][act]`.
    pub actions: Vec<f32>,
    /// File that they come from; none if they are the task's own.
    pub source: Option<String>,
}

impl Demonstrations {
    /// Number of decisions.
    pub fn len(&self) -> usize {
        self.decisions.len()
    }
    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.decisions.is_empty()
    }
    /// A row.
    pub fn row(&self, i: usize) -> &[f32] {
        &self.obs[i * self.obs_len..][..self.obs_len]
    }
    /// The action of a decision; nothing if it is not known.
    pub fn action(&self, decision: usize) -> &[f32] {
        &self.actions[decision * self.act_len..][..self.act_len]
    }

    /// As far as a role of the task knows it.
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
