//! A replay of past experience: a ring of decisions of all blocks of a worker.

use super::data::Rollout;
use crate::lanes::BLOCK;

/// The last decisions of a worker's blocks.
pub struct Replay {
    blocks: usize,
    obs_len: usize,
    act_len: usize,
    /// Capacity and number of decisions, and the index of the next one.
    slots: usize,
    filled: usize,
    next_slot: usize,
    /// Raw observations, `[slot][block][obs][16]`.
    obs: Vec<f32>,
    /// Next observations, before a reset.
    next: Vec<f32>,
    /// `[slot][block][act][16]`.
    action: Vec<f32>,
    /// Rewards, scaled by the task's factor, `[slot][block][16]`.
    reward: Vec<f32>,
    /// Agents whose episode ended, and agents whose episode failed, `[slot][block]`.
    done: Vec<u16>,
    failed: Vec<u16>,
}

/// Names of the lists of [`Saved`].
pub const NUMBERS: [&str; 4] = ["replay_obs", "replay_next", "replay_action", "replay_reward"];
/// Names of the lists of flags.
pub const FLAGS: [&str; 2] = ["replay_done", "replay_failed"];

/// Data of a replay, for a file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Saved {
    /// Numbers of all blocks in their order, each block's decisions from the oldest on: observations, next
    /// observations, actions, rewards.
    pub numbers: [Vec<f32>; 4],
    /// Ended and failed episodes in the same order.
    pub flags: [Vec<u32>; 2],
    /// Number of decisions per block.
    pub filled: u64,
}

/// A chunk of samples, in rows of sixteen as in [`Replay`].
#[derive(Default)]
pub struct Batch {
    pub obs: Vec<f32>,
    pub next: Vec<f32>,
    pub action: Vec<f32>,
    /// Discounted sum of the rewards.
    pub reward: Vec<f32>,
    /// Discount of the value of the next observation; 0 if the episode failed.
    pub discount: Vec<f32>,
}

impl Batch {
    /// Removes all samples.
    pub fn clear(&mut self) {
        let Batch { obs, next, action, reward, discount } = self;
        [obs, next, action, reward, discount].into_iter().for_each(Vec::clear);
    }
}

impl Replay {
    /// Allocates `slots` decisions.
    pub fn new(blocks: usize, slots: usize, (obs_len, act_len): (usize, usize)) -> Self {
        let items = blocks * slots;
        Self {
            blocks,
            obs_len,
            act_len,
            slots,
            filled: 0,
            next_slot: 0,
            obs: vec![0.0; items * obs_len * BLOCK],
            next: vec![0.0; items * obs_len * BLOCK],
            action: vec![0.0; items * act_len * BLOCK],
            reward: vec![0.0; items * BLOCK],
            done: vec![0; items],
            failed: vec![0; items],
        }
    }

    /// Number of blocks.
    pub fn blocks(&self) -> usize {
        self.blocks
    }
    /// Number of stored decisions.
    pub fn filled(&self) -> usize {
        self.filled
    }

    /// Index of the decision of a block that is `age` decisions old.
    fn item(&self, block: usize, age: usize) -> usize {
        (self.next_slot + 2 * self.slots - 1 - age) % self.slots * self.blocks + block
    }

    /// Adds a rollout.
    pub fn push(&mut self, rollout: &Rollout) {
        let (obs_row, act_row) = (self.obs_len * BLOCK, self.act_len * BLOCK);
        for (item, (done, failed)) in rollout.ends().enumerate() {
            let at = self.next_slot * self.blocks + item % self.blocks;
            let (step, reward) = (rollout.step(item), rollout.reward(item));
            self.obs[at * obs_row..][..obs_row].copy_from_slice(step.obs);
            self.next[at * obs_row..][..obs_row].copy_from_slice(step.next);
            self.action[at * act_row..][..act_row].copy_from_slice(step.action);
            self.reward[at * BLOCK..][..BLOCK].copy_from_slice(reward);
            (self.done[at], self.failed[at]) = (done, failed);
            if item % self.blocks == self.blocks - 1 {
                self.next_slot = (self.next_slot + 1) % self.slots;
                self.filled = (self.filled + 1).min(self.slots);
            }
        }
    }

    /// Appends the decision of a block that is `age` decisions old to a batch, with the rewards of up to `n` decisions
    /// from there on. `age` is at least `n - 1`.
    pub fn sample(&self, block: usize, age: usize, n: usize, gamma: f64, batch: &mut Batch) {
        let item = |age: usize| self.item(block, age);
        let (obs_row, act_row, first) = (self.obs_len * BLOCK, self.act_len * BLOCK, item(age));
        batch.obs.extend_from_slice(&self.obs[first * obs_row..][..obs_row]);
        batch.action.extend_from_slice(&self.action[first * act_row..][..act_row]);
        let next = batch.next.len();
        batch.next.resize(next + obs_row, 0.0);
        for lane in 0..BLOCK {
            let (mut total, mut factor) = (0.0, 1.0);
            for k in 0..n {
                let at = item(age - k);
                total += factor * self.reward[at * BLOCK + lane] as f64;
                factor *= gamma;
                let ended = self.done[at] >> lane & 1 == 1;
                if ended || k + 1 == n {
                    for row in 0..self.obs_len {
                        batch.next[next + row * BLOCK + lane] = self.next[at * obs_row + row * BLOCK + lane];
                    }
                    if self.failed[at] >> lane & 1 == 1 {
                        factor = 0.0;
                    }
                    break;
                }
            }
            batch.reward.push(total as f32);
            batch.discount.push(factor as f32);
        }
    }

    /// Appends the data of a block.
    pub fn save(&self, block: usize, saved: &mut Saved) {
        saved.filled = self.filled as u64;
        for age in (0..self.filled).rev() {
            let at = self.item(block, age);
            let rows = [
                (&self.obs, self.obs_len),
                (&self.next, self.obs_len),
                (&self.action, self.act_len),
                (&self.reward, 1),
            ];
            for (out, (from, len)) in saved.numbers.iter_mut().zip(rows) {
                out.extend_from_slice(&from[at * len * BLOCK..][..len * BLOCK]);
            }
            saved.flags[0].push(self.done[at] as u32);
            saved.flags[1].push(self.failed[at] as u32);
        }
    }

    /// Restores block `block` from the data that [`Replay::save`] stored as block `of_all` of all blocks. Returns false
    /// if it does not fit.
    pub fn load(&mut self, block: usize, of_all: usize, saved: &Saved) -> bool {
        let filled = saved.filled as usize;
        let lens = [self.obs_len, self.obs_len, self.act_len, 1];
        let fits = |(numbers, len): (&Vec<f32>, usize)| numbers.len() >= (of_all + 1) * filled * len * BLOCK;
        if filled > self.slots
            || !saved.numbers.iter().zip(lens).all(fits)
            || saved.flags.iter().any(|f| f.len() < (of_all + 1) * filled)
        {
            return false;
        }
        for slot in 0..filled {
            let (from, at) = (of_all * filled + slot, slot * self.blocks + block);
            let rows = [&mut self.obs, &mut self.next, &mut self.action, &mut self.reward];
            for ((to, numbers), len) in rows.into_iter().zip(&saved.numbers).zip(lens) {
                let len = len * BLOCK;
                to[at * len..][..len].copy_from_slice(&numbers[from * len..][..len]);
            }
            self.done[at] = saved.flags[0][from] as u16;
            self.failed[at] = saved.flags[1][from] as u16;
        }
        (self.filled, self.next_slot) = (filled, filled % self.slots);
        true
    }
}
