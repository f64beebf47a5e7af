//! Collecting rollouts: a worker's agents play one horizon, and the results are stored for learning.
//!
//! A worker owns consecutive blocks and plays the whole rollout without waiting for other workers. All sums are kept
//! per block. Totals are taken in the order of the blocks, so they do not depend on how blocks are distributed over
//! workers.
//!
//! Each role of the task has a [`RoleRollout`] with its own rollout. Most tasks have one role.

use super::context::RolloutContext;
use super::data::Rollout;
use super::role_rollout::{RoleRollout, RoleSetup};
use crate::lanes::BLOCK;
use crate::lanes::mirror;
use crate::nets::mlp::CHUNK;
use marathon_envs::{BlockStep, Shard, ShardFactory};
use std::ops::DerefMut;

/// Plays a worker's agents.
pub struct Collector {
    shard: Box<dyn Shard>,
    first_block: usize,
    blocks: usize,
    /// Agents per block.
    lanes: usize,
    seats: Vec<RoleRollout>,
    /// The actions in the environment's units, `[block][act][16]`.
    action: Vec<f32>,
    /// Observation of a block, `[obs][16]`, if several roles see parts of it.
    whole: Vec<f32>,
    out: BlockStep,
}

impl Collector {
    /// Creates agents of `blocks` blocks from `first_block`, each at the start of its first episode, for all roles of
    /// the task.
    pub fn new(
        factory: &dyn ShardFactory,
        (first_block, blocks): (usize, usize),
        seed: u64,
        plans: Vec<RoleSetup<'_>>,
    ) -> Self {
        let spec = factory.spec();
        let lanes = plans[0].lanes;
        let seat = |(number, plan)| RoleRollout::new(number, plan, (first_block, blocks));
        let mut collector = Self {
            shard: factory.shard(first_block, blocks, seed),
            first_block,
            blocks,
            lanes,
            seats: plans.into_iter().enumerate().map(seat).collect(),
            action: vec![0.0; blocks * spec.act * BLOCK],
            whole: vec![0.0; spec.obs * BLOCK],
            out: BlockStep::default(),
        };
        for b in 0..blocks {
            collector.reset(b, !0);
        }
        collector
    }

    /// First block of the whole environment that this worker owns.
    pub fn first_block(&self) -> usize {
        self.first_block
    }
    /// Number of blocks.
    pub fn blocks(&self) -> usize {
        self.blocks
    }
    /// The environments.
    pub fn shard(&self) -> &dyn Shard {
        &*self.shard
    }
    /// The environments.
    pub fn shard_mut(&mut self) -> &mut dyn Shard {
        &mut *self.shard
    }
    /// The roles' seats.
    pub fn seats(&self) -> &[RoleRollout] {
        &self.seats
    }
    /// The roles' seats.
    pub fn seats_mut(&mut self) -> &mut [RoleRollout] {
        &mut self.seats
    }
    /// The current actions of a block, in the environment's units, `[act][16]`.
    pub fn action(&self, block: usize) -> &[f32] {
        let row = self.action.len() / self.blocks;
        &self.action[block * row..(block + 1) * row]
    }
    /// The current actions of a block, mutable.
    pub fn action_mut(&mut self, block: usize) -> &mut [f32] {
        let row = self.action.len() / self.blocks;
        &mut self.action[block * row..(block + 1) * row]
    }

    /// Plays one horizon and fills the rollouts of all roles, advantages included. Returns the seconds spent in the
    /// environments, measured by the clock `now`.
    pub fn collect<R: DerefMut<Target = Rollout>>(
        &mut self,
        with: &[RolloutContext<'_>],
        rollouts: &mut [R],
        now: fn() -> f64,
    ) -> f64 {
        let blocks = self.blocks;
        for ((seat, with), rollout) in self.seats.iter_mut().zip(with).zip(rollouts.iter_mut()) {
            seat.begin(with, rollout);
        }
        let mut env_seconds = 0.0;
        for t in 0..rollouts[0].items() / blocks {
            for ((seat, with), rollout) in self.seats.iter_mut().zip(with).zip(rollouts.iter_mut()) {
                for first in (0..blocks).step_by(CHUNK) {
                    seat.act(with, rollout, t * blocks, first, CHUNK.min(blocks - first));
                }
            }
            let start = now();
            self.announce(with, rollouts, t);
            for b in 0..blocks {
                self.step(with, rollouts, t * blocks + b, b);
            }
            env_seconds += now() - start;
        }
        for ((seat, with), rollout) in self.seats.iter_mut().zip(with).zip(rollouts) {
            seat.end(with, rollout);
        }
        env_seconds
    }

    /// Passes the actions of all blocks to the environments, in their own units.
    fn announce<R: DerefMut<Target = Rollout>>(&mut self, with: &[RolloutContext<'_>], rollouts: &[R], t: usize) {
        let Self { shard, seats, action, blocks, .. } = self;
        let spec = shard.spec();
        for ((seat, with), rollout) in seats.iter().zip(with).zip(rollouts) {
            let (act, scale) = (&seat.role.act, with.acting.action_scale);
            let row = act.len() * BLOCK;
            let drawn = &rollout.action[t * *blocks * row..(t + 1) * *blocks * row];
            for ((action, drawn), decides) in
                action.chunks_exact_mut(spec.act * BLOCK).zip(drawn.chunks_exact(row)).zip(&seat.decides)
            {
                let own = &mut action[act.start * BLOCK..act.end * BLOCK];
                for (i, (own, drawn)) in own.iter_mut().zip(drawn).enumerate() {
                    // other agents keep their last action
                    if *decides == !0 || decides >> (i % BLOCK) & 1 == 1 {
                        *own = spec.action_of(act.start + i / BLOCK, drawn * scale);
                    }
                }
            }
        }
        shard.announce(action);
    }

    /// Makes one decision of one block, with all bookkeeping.
    fn step<R: DerefMut<Target = Rollout>>(
        &mut self,
        with: &[RolloutContext<'_>],
        rollouts: &mut [R],
        item: usize,
        b: usize,
    ) {
        let Self { shard, seats, action, whole, out, lanes, .. } = self;
        let row = shard.spec().act * BLOCK;
        let obs = observation(seats, b, whole);
        shard.step(b, &action[b * row..(b + 1) * row], obs, out);
        // lanes without an agent also continue
        let ended = out.terminated | out.truncated | out.diverged;
        if *lanes < BLOCK {
            mirror::step(out, obs, *lanes);
        }
        if let [_, _, ..] = &seats[..] {
            seats.iter_mut().for_each(|seat| seat.see(b, whole));
        }
        for ((seat, with), rollout) in seats.iter_mut().zip(with).zip(rollouts) {
            seat.take(with, rollout, item, b, out);
        }
        let ended = ended | out.terminated | out.truncated | out.diverged;
        if ended != 0 {
            self.reset(b, ended);
        }
    }

    /// Starts new episodes for agents of a block.
    fn reset(&mut self, b: usize, mask: u16) {
        let Self { shard, seats, whole, lanes, .. } = self;
        let obs = observation(seats, b, whole);
        shard.reset(b, mask, obs);
        mirror::rows(obs, *lanes);
        if let [_, _, ..] = &seats[..] {
            seats.iter_mut().for_each(|seat| seat.see(b, whole));
        }
    }
}

/// Buffer for the observations of a block: that of the single role, or one for the whole observation.
fn observation<'a>(seats: &'a mut [RoleRollout], b: usize, whole: &'a mut [f32]) -> &'a mut [f32] {
    match seats {
        [seat] => seat.obs_mut(b),
        _ => whole,
    }
}
