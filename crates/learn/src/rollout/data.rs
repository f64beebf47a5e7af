//! The experience of agents in a rollout.

use super::sums::{BlockSums, Totals};
use crate::lanes::BLOCK;
use crate::lanes::buffer::Aligned;
use crate::rewards::Step;
use std::ops::Deref;

/// Sizes of the data that is kept per decision.
#[derive(Clone, Copy, Debug)]
pub struct Shape {
    /// Length of an observation.
    pub obs: usize,
    /// Length of an action.
    pub act: usize,
    /// Log-probabilities per sample.
    pub log_probs: usize,
    /// Streams of rewards.
    pub streams: usize,
    /// Whether next observations are kept.
    pub next_obs: bool,
    /// Agents per block: sixteen, or fewer, which the other lanes mirror.
    pub lanes: usize,
}

impl Shape {
    /// Numbers that a [`Rollout`] keeps per decision of an agent.
    pub fn numbers(&self) -> usize {
        let next = if self.next_obs { self.obs } else { 0 };
        self.obs + self.act + next + self.log_probs + 1 + 3 * self.streams
    }
}

/// Data of a block of samples, in rows of sixteen.
#[derive(Clone, Copy)]
pub struct Samples<'a, S> {
    /// Mask of the agents that decided. The rows of the others have no meaning.
    pub decided: u16,
    /// Actions taken, `[action][16]`.
    pub action: &'a [S],
    /// Their log-probabilities during the rollout, without a constant (see
    /// [`Gaussian`](crate::nets::gaussian::Gaussian)): for all actions together, or with one row per action.
    pub log_prob: &'a [S],
    /// Advantages, not normalized.
    pub advantage: &'a [S],
    /// Values during the rollout, `[stream][16]`.
    pub value: &'a [S],
    /// Returns that the value function is trained on, `[stream][16]`.
    pub target: &'a [S],
}

/// The experience of a worker's agents in one horizon. Item `t * blocks + b` is block `b` at decision `t`.
pub struct Rollout {
    blocks: usize,
    pub(super) obs_len: usize,
    pub(super) act_len: usize,
    /// Observations, `[item][obs][16]`: normalized, or raw if they are kept for later.
    pub(super) obs: Aligned<f32>,
    /// `[item][act][16]`.
    pub(super) action: Aligned<f32>,
    /// Next observations in the same form, or empty if they are not kept.
    pub(super) next_obs: Aligned<f32>,
    /// `[item][16]`, or `[item][act][16]` with a ratio per action.
    pub(super) log_prob: Aligned<f32>,
    /// `[item][16]`.
    pub(super) advantage: Aligned<f32>,
    /// `[item][stream][16]`.
    pub(super) reward: Aligned<f32>,
    pub(super) value: Aligned<f32>,
    pub(super) target: Aligned<f32>,
    /// Streams of rewards.
    pub(super) streams: usize,
    /// Agents per block, which the other lanes mirror.
    pub lanes: usize,
    /// Agents that decided at the item. Rewards of the others count for their last decision.
    pub(super) decided: Vec<u16>,
    /// Agents whose episode ended with the item, and agents whose episode failed.
    pub(super) done: Vec<u16>,
    pub(super) failed: Vec<u16>,
    /// Ended episodes whose last observation has a value: item, truncated agents, agents whose simulation stayed
    /// finite, and the last observation. If no reward continues beyond the end, only truncated ones.
    pub(super) cut: Vec<(usize, [u16; 2])>,
    pub(super) cut_obs: Vec<f32>,
    /// Value of the observation after the last decision, `[block][stream][16]`.
    pub(super) last_value: Aligned<f32>,
    /// Sums per block.
    pub sums: Vec<BlockSums>,
}

impl Rollout {
    /// Allocates `horizon` decisions of `blocks` blocks.
    pub fn new(blocks: usize, horizon: usize, shape: &Shape) -> Self {
        let Shape { obs: obs_len, act: act_len, streams, .. } = *shape;
        let items = blocks * horizon;
        let (row, stream_rows) = (|| Aligned::rows(items), || Aligned::rows(items * streams));
        let next_items = if shape.next_obs { items } else { 0 };
        Self {
            blocks,
            obs_len,
            act_len,
            obs: Aligned::rows(items * obs_len),
            action: Aligned::rows(items * act_len),
            next_obs: Aligned::rows(next_items * obs_len),
            log_prob: Aligned::rows(items * shape.log_probs),
            advantage: row(),
            reward: stream_rows(),
            value: stream_rows(),
            target: stream_rows(),
            streams,
            lanes: shape.lanes,
            decided: vec![!0; items],
            done: vec![0; items],
            failed: vec![0; items],
            cut: Vec::new(),
            cut_obs: Vec::new(),
            last_value: Aligned::rows(blocks * streams),
            sums: Vec::new(),
        }
    }

    /// Number of items.
    pub fn items(&self) -> usize {
        self.done.len()
    }
    /// Number of blocks.
    pub fn blocks(&self) -> usize {
        self.blocks
    }
    /// Normalized observations of an item, `[obs][16]`.
    pub fn obs(&self, item: usize) -> &[f32] {
        &self.obs[item * self.obs_len * BLOCK..][..self.obs_len * BLOCK]
    }
    /// The data that a learner needs, `[item][..][16]`, by name.
    pub fn rows(&self) -> [(&'static str, &[f32]); 7] {
        [
            ("normalized_obs", &self.obs),
            ("next_normalized_obs", &self.next_obs),
            ("action", &self.action),
            ("log_prob", &self.log_prob),
            ("value", &self.value),
            ("advantage", &self.advantage),
            ("target", &self.target),
        ]
    }
    /// The same data, mutable.
    pub fn rows_mut(&mut self) -> [(&'static str, &mut [f32]); 7] {
        [
            ("normalized_obs", &mut self.obs),
            ("next_normalized_obs", &mut self.next_obs),
            ("action", &mut self.action),
            ("log_prob", &mut self.log_prob),
            ("value", &mut self.value),
            ("advantage", &mut self.advantage),
            ("target", &mut self.target),
        ]
    }
    /// Copies the data of a block that a learner needs, and adds its sums to the list of sums.
    pub fn copy_block(&mut self, block: usize, from: &Rollout, its: usize) {
        let (blocks, items) = (self.blocks, self.items());
        for ((_, to), (_, rows)) in self.rows_mut().into_iter().zip(from.rows()) {
            let row = to.len() / items;
            for t in 0..items / blocks {
                let (to_item, item) = (t * blocks + block, t * from.blocks + its);
                to[to_item * row..(to_item + 1) * row].copy_from_slice(&rows[item * row..(item + 1) * row]);
            }
        }
        self.sums.push(from.sums[its].clone());
    }
    /// Data of an item for the objective.
    pub fn samples(&self, item: usize) -> Samples<'_, f32> {
        let row = item * BLOCK..(item + 1) * BLOCK;
        let log_prob = self.log_prob.len() / self.items();
        let rows = item * self.streams * BLOCK..(item + 1) * self.streams * BLOCK;
        Samples {
            decided: self.decided[item],
            action: &self.action[item * self.act_len * BLOCK..][..self.act_len * BLOCK],
            log_prob: &self.log_prob[item * log_prob..(item + 1) * log_prob],
            advantage: &self.advantage[row],
            value: &self.value[rows.clone()],
            target: &self.target[rows],
        }
    }
    /// Scaled rewards of an item, from the task only.
    pub fn reward(&self, item: usize) -> &[f32] {
        &self.reward[item * self.streams * BLOCK..][..BLOCK]
    }
    /// Agents whose episode ended with each item, and agents whose episode failed.
    pub fn ends(&self) -> impl Iterator<Item = (u16, u16)> + '_ {
        self.done.iter().copied().zip(self.failed.iter().copied())
    }
    /// Data of an item for the reward signals.
    pub fn step(&self, item: usize) -> Step<'_, f32> {
        Step {
            obs: self.obs(item),
            action: &self.action[item * self.act_len * BLOCK..][..self.act_len * BLOCK],
            next: &self.next_obs[item * self.obs_len * BLOCK..][..self.obs_len * BLOCK],
        }
    }
}

/// Rows for the advantage estimator, as in [`Rollout`].
pub(super) struct Rewards<'a> {
    pub streams: usize,
    pub reward: &'a [f32],
    pub value: &'a [f32],
    pub last_value: &'a [f32],
    pub decided: &'a [u16],
    pub done: &'a [u16],
    pub advantage: &'a mut [f32],
    pub target: &'a mut [f32],
    pub sums: &'a mut [BlockSums],
}

impl Rollout {
    /// Rows that the advantage estimator reads and writes.
    pub(super) fn rewards(&mut self) -> Rewards<'_> {
        Rewards {
            streams: self.streams,
            reward: &self.reward,
            value: &self.value,
            last_value: &self.last_value,
            decided: &self.decided,
            done: &self.done,
            advantage: &mut self.advantage,
            target: &mut self.target,
            sums: &mut self.sums,
        }
    }
}

/// The rollouts of all workers.
pub struct Experience<'a> {
    rollouts: Vec<&'a Rollout>,
    /// The worker of each block, and its index there.
    places: Vec<(usize, usize)>,
    /// Sums over them.
    pub totals: &'a Totals,
    /// The worker that has this view.
    worker: usize,
}

impl<'a> Experience<'a> {
    /// Creates one worker's view of the workers' rollouts, in order.
    pub fn new(rollouts: Vec<&'a Rollout>, totals: &'a Totals, worker: usize) -> Self {
        let places = rollouts.iter().enumerate().flat_map(|(r, x)| (0..x.blocks()).map(move |b| (r, b))).collect();
        Self { rollouts, places, totals, worker }
    }
    /// Number of items: blocks of samples.
    pub fn items(&self) -> usize {
        self.rollouts.iter().map(|rollout| rollout.items()).sum()
    }
    /// The rollout with an item, and its index there.
    pub fn item(&self, item: u32) -> (&'a Rollout, usize) {
        let (t, b) = (item as usize / self.places.len(), item as usize % self.places.len());
        let (r, local) = self.places[b];
        (self.rollouts[r], t * self.rollouts[r].blocks() + local)
    }
    /// The worker of a block, and the block's index there.
    pub fn place(&self, block: usize) -> (usize, usize) {
        self.places[block]
    }
    /// The worker that has this view.
    pub fn worker(&self) -> usize {
        self.worker
    }
    /// The rollout of this worker.
    pub fn own(&self) -> &'a Rollout {
        self.rollouts[self.worker]
    }
}

impl Totals {
    /// Sums the workers' rollouts, in order.
    pub fn new<R: Deref<Target = Rollout>>(rollouts: &[R], horizon: usize) -> Self {
        let mut t = Totals::default();
        for rollout in rollouts {
            t.samples += (rollout.sums.len() * horizon * rollout.lanes) as f64;
            rollout.sums.iter().for_each(|block| t.sums.add(block));
        }
        t
    }
}
