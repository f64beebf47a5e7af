//! The state of agents between two rollouts: part of a checkpoint, and what travels to those who play elsewhere.

use crate::error::Error;
use crate::files::{Number, TensorReader, TensorWriter};
use crate::lanes::BLOCK;
use crate::lanes::noise::Noise;
use crate::rollout::collect::Actor;
use std::ops::{Deref, Range};

/// States of the agents of consecutive blocks.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Agents {
    /// Words of the random streams, `[block][64]`.
    noise: Vec<u32>,
    /// Raw observations, `[block][obs][16]`.
    obs: Vec<f32>,
    /// Running sums of the agents, `[tally][block][16]`.
    tallies: Vec<f32>,
    /// What the environments saved, block after block, and where each block's part ends.
    env: Vec<u8>,
    env_ends: Vec<u64>,
}

impl Agents {
    /// Of those blocks in a range that actors have; the actors come in the order of their blocks.
    pub fn of<A: Deref<Target = Actor>>(actors: impl IntoIterator<Item = A>, blocks: Range<usize>) -> Self {
        let mut states = Self::default();
        let mut tallies = [(); 4].map(|()| Vec::new());
        for actor in actors {
            for b in (0..actor.blocks()).filter(|b| blocks.contains(&(actor.first_block() + b))) {
                states.noise.extend(actor.noise()[b].words());
                states.obs.extend_from_slice(actor.obs(b));
                for (all, tally) in tallies.iter_mut().zip(&actor.tallies) {
                    all.extend_from_slice(&tally[b]);
                }
                actor.shard().save(b, &mut states.env);
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

    /// Puts those of an actor's agents that are in `blocks`, to which these states belong, into their states. The states
    /// have been [checked](Agents::check); `what` has them.
    pub fn put(&self, what: &str, blocks: Range<usize>, actor: &mut Actor) -> Result<(), Error> {
        let tally = blocks.len() * BLOCK;
        for b in 0..actor.blocks() {
            let block = actor.first_block() + b;
            if !blocks.contains(&block) {
                continue;
            }
            let i = block - blocks.start;
            let words = self.noise[i * Noise::WORDS..].first_chunk().expect("the length was checked");
            actor.noise_mut()[b] = Noise::from_words(words);
            let row = actor.obs(b).len();
            actor.obs_mut(b).copy_from_slice(&self.obs[i * row..(i + 1) * row]);
            for (k, all) in actor.tallies.iter_mut().enumerate() {
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
            let loaded = actor.shard_mut().load(b, bytes.ok_or_else(|| wrong(""))?);
            if !loaded.map_err(|error| wrong(&format!(" ({error})")))?.is_empty() {
                return Err(wrong(""));
            }
        }
        Ok(())
    }

    /// Adds the states to a file.
    pub fn write(&self, file: &mut TensorWriter) {
        file.list("noise", &self.noise);
        file.list("obs", &self.obs);
        file.list("tallies", &self.tallies);
        file.list("env", &self.env);
        file.list("env_ends", &self.env_ends);
    }

    /// Reads what [`write`](Agents::write) wrote.
    pub fn read(file: &TensorReader<'_>) -> Result<Self, Error> {
        fn list<N: Number>(file: &TensorReader<'_>, name: &str) -> Result<Vec<N>, Error> {
            file.get(name, &[file.list_len(name)])
        }
        Ok(Self {
            noise: list(file, "noise")?,
            obs: list(file, "obs")?,
            tallies: list(file, "tallies")?,
            env: list(file, "env")?,
            env_ends: list(file, "env_ends")?,
        })
    }
}
