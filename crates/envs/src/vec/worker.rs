//! The agents of one thread.

use super::arrays::{ObsNumber, StepMut, to_rows};
use super::deciders::Deciders;
use super::options::Autoreset;
use crate::shard::{AgentShard, BLOCK, BlockStep};

/// A shard with the block-shaped arrays that it reads and writes.
pub(super) struct Worker {
    pub(super) shard: Box<dyn AgentShard>,
    action: Vec<f32>,
    pub(super) obs: Vec<f32>,
    out: BlockStep,
    /// Mask per block: agents that start a new episode at the next step instead of acting.
    pub(super) pending: Vec<u16>,
    pub(super) deciders: Deciders,
}

impl Worker {
    /// A worker before the first reset of its shard, which has `blocks` blocks.
    pub fn new(shard: Box<dyn AgentShard>, blocks: usize) -> Self {
        let spec = shard.spec();
        Worker {
            action: vec![0.0; spec.act * BLOCK],
            obs: vec![0.0; spec.obs * BLOCK],
            out: BlockStep::default(),
            pending: vec![0; blocks],
            deciders: Deciders::new(spec.roles.len(), blocks),
            shard,
        }
    }

    /// Records that agents of a block are at the start of an episode.
    pub fn begin(&mut self, block: usize, mask: u16) {
        self.pending[block] &= !mask;
        self.deciders.begin(block, mask);
    }

    /// Starts new episodes in a block and writes their observations to `self.obs`.
    pub fn reset(&mut self, block: usize, mask: u16) {
        self.shard.reset(block, mask, &mut self.obs);
        self.begin(block, mask);
    }

    /// Writes the observations of a block to `self.obs`, as at the start of episodes.
    pub fn observe(&mut self, block: usize, mask: u16) {
        self.shard.observe(block, mask, &mut self.obs);
        self.deciders.begin(block, mask);
    }

    /// Steps all agents of this worker.
    pub fn step<O: ObsNumber>(&mut self, autoreset: Autoreset, actions: &[f32], out: &mut StepMut<'_, O>) {
        let Worker { shard, action, obs, out: o, pending, deciders } = self;
        let spec = shard.spec();
        let (n_obs, n_act) = (spec.obs, spec.act);
        let (n_terms, n_info) = (spec.reward_terms.len(), spec.info.len());
        for block in 0..shard.blocks() {
            let first = block * BLOCK;
            let count = BLOCK.min(out.reward.len() - first);
            let real = ((1_u32 << count) - 1) as u16;
            let agents = first..first + count;

            // lanes without an agent need no action
            for (i, row) in actions[first * n_act..(first + count) * n_act].chunks_exact(n_act).enumerate() {
                for (a, x) in row.iter().enumerate() {
                    action[a * BLOCK + i] = *x;
                }
            }
            shard.step(block, action, obs, o);
            let due = std::mem::take(&mut pending[block]);
            if due != 0 {
                shard.reset(block, due, obs);
                shard.info(block, due, &mut o.info);
                clear(o, due);
            }

            out.reward[agents.clone()].copy_from_slice(&o.reward[..count]);
            out.forward[agents.clone()].copy_from_slice(&o.forward[..count]);
            to_rows(&o.terms, n_terms, real, &mut out.terms[first * n_terms..(first + count) * n_terms]);
            to_rows(&o.info, n_info, real, &mut out.info[first * n_info..(first + count) * n_info]);
            for i in 0..count {
                out.terminated[first + i] = o.terminated >> i & 1 == 1;
                out.truncated[first + i] = o.truncated >> i & 1 == 1;
                out.diverged[first + i] = o.diverged >> i & 1 == 1;
            }
            let rows = first * n_obs..(first + count) * n_obs;
            to_rows(obs, n_obs, real, &mut out.final_obs[rows.clone()]);
            // lanes without an agent continue unseen
            let ended = o.terminated | o.truncated;
            deciders.follow(block, o, ended | due);
            let begun = match autoreset {
                Autoreset::SameStep => ended,
                Autoreset::NextStep | Autoreset::Disabled => 0,
            };
            if autoreset == Autoreset::NextStep {
                pending[block] = ended;
            }
            out.obs[rows.clone()].copy_from_slice(&out.final_obs[rows.clone()]);
            if begun != 0 {
                shard.reset(block, begun, obs);
                to_rows(obs, n_obs, real & begun, &mut out.obs[rows]);
            }
        }
    }
}

/// Clears the results of a step for the agents in `mask`.
fn clear(out: &mut BlockStep, mask: u16) {
    let terms = out.terms.chunks_exact_mut(BLOCK);
    for row in terms.chain([&mut out.reward[..], &mut out.forward[..]]) {
        for lane in (0..BLOCK).filter(|i| mask >> i & 1 == 1) {
            row[lane] = 0.0;
        }
    }
    out.terminated &= !mask;
    out.truncated &= !mask;
    out.diverged &= !mask;
}
