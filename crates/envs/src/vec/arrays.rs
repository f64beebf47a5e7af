//! Results of a step of a [`VecEnv`](crate::VecEnv), as rows of plain arrays.

use std::ops::Range;

use crate::shard::{BLOCK, Spec};

/// Number type of observations: `f32`, in which they are computed, or `f64`, which some interfaces require.
pub trait ObsNumber: Copy + Send + Sync + From<f32> {}

impl ObsNumber for f32 {}
impl ObsNumber for f64 {}

/// Results of a step in owned arrays. Create it with [`VecEnv::buffers`](crate::VecEnv::buffers).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Step {
    /// Observations for the next action, `[agents][obs]`.
    pub obs: Vec<f32>,
    /// Observations of the new states, `[agents][obs]`. They differ from `obs` only where an episode ended.
    pub final_obs: Vec<f32>,
    /// Rewards, `[agents]`.
    pub reward: Vec<f32>,
    /// Terms that add up to the rewards, `[agents][reward_terms]`.
    pub terms: Vec<f32>,
    /// Infos about the new states, `[agents][info]`.
    pub info: Vec<f32>,
    /// Distance moved along +x, m, `[agents]`.
    pub forward: Vec<f32>,
    /// The agent failed, `[agents]`.
    pub terminated: Vec<bool>,
    /// The episode reached its time limit, `[agents]`.
    pub truncated: Vec<bool>,
    /// The simulation of the agent diverged, `[agents]`. The agent counts as terminated with reward 0.
    pub diverged: Vec<bool>,
}

impl Step {
    /// Zeros for a number of agents.
    pub(crate) fn new(n: usize, spec: &Spec) -> Self {
        Step {
            obs: vec![0.0; n * spec.obs],
            final_obs: vec![0.0; n * spec.obs],
            reward: vec![0.0; n],
            terms: vec![0.0; n * spec.reward_terms.len()],
            info: vec![0.0; n * spec.info.len()],
            forward: vec![0.0; n],
            terminated: vec![false; n],
            truncated: vec![false; n],
            diverged: vec![false; n],
        }
    }

    /// Copies the rows of consecutive agents from those of more agents.
    pub(crate) fn copy_rows(&mut self, from: &Step, spec: &Spec, agents: Range<usize>) {
        let rows = |columns: usize| agents.start * columns..agents.end * columns;
        self.obs.copy_from_slice(&from.obs[rows(spec.obs)]);
        self.final_obs.copy_from_slice(&from.final_obs[rows(spec.obs)]);
        self.reward.copy_from_slice(&from.reward[rows(1)]);
        self.terms.copy_from_slice(&from.terms[rows(spec.reward_terms.len())]);
        self.info.copy_from_slice(&from.info[rows(spec.info.len())]);
        self.forward.copy_from_slice(&from.forward[rows(1)]);
        self.terminated.copy_from_slice(&from.terminated[rows(1)]);
        self.truncated.copy_from_slice(&from.truncated[rows(1)]);
        self.diverged.copy_from_slice(&from.diverged[rows(1)]);
    }
}

impl<'a> From<&'a mut Step> for StepMut<'a> {
    fn from(step: &'a mut Step) -> Self {
        StepMut {
            obs: &mut step.obs,
            final_obs: &mut step.final_obs,
            reward: &mut step.reward,
            terms: &mut step.terms,
            info: &mut step.info,
            forward: &mut step.forward,
            terminated: &mut step.terminated,
            truncated: &mut step.truncated,
            diverged: &mut step.diverged,
        }
    }
}

/// The caller's arrays for the results of a step, with the shapes of [`Step`].
#[derive(Debug)]
pub struct StepMut<'a, O = f32> {
    /// See [`Step::obs`].
    pub obs: &'a mut [O],
    /// See [`Step::final_obs`].
    pub final_obs: &'a mut [O],
    /// See [`Step::reward`].
    pub reward: &'a mut [f32],
    /// See [`Step::terms`].
    pub terms: &'a mut [f32],
    /// See [`Step::info`].
    pub info: &'a mut [f32],
    /// See [`Step::forward`].
    pub forward: &'a mut [f32],
    /// See [`Step::terminated`].
    pub terminated: &'a mut [bool],
    /// See [`Step::truncated`].
    pub truncated: &'a mut [bool],
    /// See [`Step::diverged`].
    pub diverged: &'a mut [bool],
}

impl<O> StepMut<'_, O> {
    /// The rows of the first `n` agents, and those of the others.
    pub(crate) fn split_at(self, n: usize, spec: &Spec) -> (Self, Self) {
        let (obs, obs_rest) = self.obs.split_at_mut(n * spec.obs);
        let (final_obs, final_obs_rest) = self.final_obs.split_at_mut(n * spec.obs);
        let (reward, reward_rest) = self.reward.split_at_mut(n);
        let (terms, terms_rest) = self.terms.split_at_mut(n * spec.reward_terms.len());
        let (info, info_rest) = self.info.split_at_mut(n * spec.info.len());
        let (forward, forward_rest) = self.forward.split_at_mut(n);
        let (terminated, terminated_rest) = self.terminated.split_at_mut(n);
        let (truncated, truncated_rest) = self.truncated.split_at_mut(n);
        let (diverged, diverged_rest) = self.diverged.split_at_mut(n);
        (
            StepMut { obs, final_obs, reward, terms, info, forward, terminated, truncated, diverged },
            StepMut {
                obs: obs_rest,
                final_obs: final_obs_rest,
                reward: reward_rest,
                terms: terms_rest,
                info: info_rest,
                forward: forward_rest,
                terminated: terminated_rest,
                truncated: truncated_rest,
                diverged: diverged_rest,
            },
        )
    }
}

/// Copies the agents in `mask` from a block's `[column][16]` to rows.
pub(crate) fn to_rows<O: ObsNumber>(block: &[f32], columns: usize, mask: u16, rows: &mut [O]) {
    // there may be no columns
    for (i, row) in rows.chunks_exact_mut(columns.max(1)).enumerate() {
        if mask >> i & 1 == 1 {
            for (column, x) in row.iter_mut().enumerate() {
                *x = O::from(block[column * BLOCK + i]);
            }
        }
    }
}
