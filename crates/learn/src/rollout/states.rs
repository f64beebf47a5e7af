//! The state of agents between two rollouts: part of a checkpoint, and what travels to those who play elsewhere.

use super::collect::Collector;
use crate::error::Error;
use crate::lanes::BLOCK;
use crate::lanes::noise::Noise;
use std::ops::{Deref, Range};

/// States of the agents of consecutive blocks.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AgentStates {
    /// Words of the random streams, `[block][64]`.
    pub noise: Vec<u32>,
    /// Raw observations, `[block][obs][16]`.
    pub obs: Vec<f32>,
    /// Running sums of the agents, `[tally][block][16]`.
    pub tallies: Vec<f32>,
    /// What the environments saved, block after block, and where each block's part ends.
    pub env: Vec<u8>,
    pub env_ends: Vec<u64>,
}

impl AgentStates {
    /// Of those blocks in a range that collectors have; the collectors come in the order of their blocks.
    pub fn of<A: Deref<Target = Collector>>(collectors: impl IntoIterator<Item = A>, blocks: Range<usize>) -> Self {
        let mut states = Self::default();
        let mut tallies = [(); 4].map(|()| Vec::new());
        for collector in collectors {
            for b in (0..collector.blocks()).filter(|b| blocks.contains(&(collector.first_block() + b))) {
                states.noise.extend(collector.noise()[b].words());
                states.obs.extend_from_slice(collector.obs(b));
                for (all, tally) in tallies.iter_mut().zip(&collector.tallies) {
                    all.extend_from_slice(&tally[b]);
                }
                collector.shard().save(b, &mut states.env);
                states.env_ends.push(states.env.len() as u64);
            }
        }
        states.tallies = tallies.concat();
        states
    }

    /// Refuses states that are not of a number of blocks with observations of a length; `what` has them.
    pub fn check(&self, what: &str, blocks: usize, obs: usize) -> Result<(), Error> {
        let lengths = [
            ("noise", self.noise.len(), blocks * Noise::WORDS),
            ("obs", self.obs.len(), blocks * obs * BLOCK),
            ("tallies", self.tallies.len(), 4 * blocks * BLOCK),
            ("env_ends", self.env_ends.len(), blocks),
        ];
        match lengths.into_iter().find(|(_, found, expected)| found != expected) {
            None => Ok(()),
            Some((name, found, expected)) => Err(Error::Mismatch {
                what: format!("{what}: {name}"),
                found: format!("{found} numbers"),
                expected: expected.to_string(),
            }),
        }
    }

    /// Puts those of a collector's agents that are in `blocks`, to which these states belong, into their states. The states
    /// have been [checked](AgentStates::check); `what` has them.
    pub fn put(&self, what: &str, blocks: Range<usize>, collector: &mut Collector) -> Result<(), Error> {
        let tally = blocks.len() * BLOCK;
        for b in 0..collector.blocks() {
            let block = collector.first_block() + b;
            if !blocks.contains(&block) {
                continue;
            }
            let i = block - blocks.start;
            let words = self.noise[i * Noise::WORDS..].first_chunk().expect("the length was checked");
            collector.noise_mut()[b] = Noise::from_words(words);
            let row = collector.obs(b).len();
            collector.obs_mut(b).copy_from_slice(&self.obs[i * row..(i + 1) * row]);
            for (k, all) in collector.tallies.iter_mut().enumerate() {
                all[b].copy_from_slice(&self.tallies[k * tally + i * BLOCK..][..BLOCK]);
            }
            let start = if i == 0 { 0 } else { self.env_ends[i - 1] };
            let bytes = self.env.get(start as usize..self.env_ends[i] as usize);
            let size = bytes.map_or("no".into(), |bytes| bytes.len().to_string());
            let wrong = |why: &str| Error::Mismatch {
                what: format!("{what}: environment"),
                found: format!("{size} bytes of block {block}'s environment{why}"),
                expected: "what this version of the task saves".into(),
            };
            let loaded = collector.shard_mut().load(b, bytes.ok_or_else(|| wrong(""))?);
            if !loaded.map_err(|error| wrong(&format!(" ({error})")))?.is_empty() {
                return Err(wrong(""));
            }
        }
        Ok(())
    }
}
