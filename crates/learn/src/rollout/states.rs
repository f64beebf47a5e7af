//! The state of agents between two rollouts, for checkpoints and for processes that play rollouts elsewhere.

use super::collect::Collector;
use crate::error::Error;
use crate::lanes::BLOCK;
use crate::lanes::noise::Noise;
use std::ops::{Deref, Range};

/// States of the agents of consecutive blocks.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AgentStates {
    /// State of each role.
    pub seats: Vec<SeatStates>,
    /// The current actions, in the environment's units, `[block][act][16]`. Empty if one role decides for all agents
    /// every time.
    pub action: Vec<f32>,
    /// The saved environments, block after block, and the end of each block's part.
    pub env: Vec<u8>,
    pub env_ends: Vec<u64>,
}

/// State of a role.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SeatStates {
    /// Words of the random streams, `[block][64]`.
    pub noise: Vec<u32>,
    /// Raw observations, `[block][obs][16]`.
    pub obs: Vec<f32>,
    /// Running sums of the agents, `[tally][block][16]`.
    pub tallies: Vec<f32>,
    /// Agents whose next action it chooses, one mask per block, and in the upper bits those in whose episode it has
    /// finished. Empty if one role chooses all actions.
    pub decides: Vec<u32>,
}

/// Sizes of the lists of agents' states.
#[derive(Clone, Copy)]
pub struct StatesShape<'a> {
    /// Blocks.
    pub blocks: usize,
    /// Length of the observation of each role.
    pub obs: &'a [usize],
    /// Length of the action.
    pub act: usize,
}

impl AgentStates {
    /// The states of the blocks in a range. The collectors come in the order of their blocks.
    pub fn of<A: Deref<Target = Collector>>(collectors: impl IntoIterator<Item = A>, blocks: Range<usize>) -> Self {
        let mut states = Self::default();
        let mut tallies: Vec<[Vec<f32>; 4]> = Vec::new();
        for collector in collectors {
            let several = collector.seats().len() > 1;
            states.seats.resize_with(collector.seats().len(), SeatStates::default);
            tallies.resize_with(collector.seats().len(), Default::default);
            for b in (0..collector.blocks()).filter(|b| blocks.contains(&(collector.first_block() + b))) {
                for ((seat, states), tallies) in collector.seats().iter().zip(&mut states.seats).zip(&mut tallies) {
                    states.noise.extend(seat.noise[b].words());
                    states.obs.extend_from_slice(seat.obs(b));
                    for (all, tally) in tallies.iter_mut().zip(&seat.tallies) {
                        all.extend_from_slice(&tally[b]);
                    }
                    states.decides.extend(several.then_some(seat.decides[b] as u32 | (seat.left[b] as u32) << BLOCK));
                }
                if several {
                    states.action.extend_from_slice(collector.action(b));
                }
                collector.shard().save(b, &mut states.env);
                states.env_ends.push(states.env.len() as u64);
            }
        }
        for (seat, tallies) in states.seats.iter_mut().zip(tallies) {
            seat.tallies = tallies.concat();
        }
        states
    }

    /// Refuses states of another shape. `what` names their source.
    pub fn check(&self, what: &str, shape: StatesShape<'_>) -> Result<(), Error> {
        let StatesShape { blocks, obs, act } = shape;
        let several = obs.len() > 1;
        let held = |n: usize| if several { blocks * n } else { 0 };
        let mut lengths = vec![
            ("roles", self.seats.len(), obs.len()),
            ("action", self.action.len(), held(act * BLOCK)),
            ("env_ends", self.env_ends.len(), blocks),
        ];
        for (seat, obs) in self.seats.iter().zip(obs) {
            lengths.extend([
                ("noise", seat.noise.len(), blocks * Noise::WORDS),
                ("obs", seat.obs.len(), blocks * obs * BLOCK),
                ("tallies", seat.tallies.len(), 4 * blocks * BLOCK),
                ("decides", seat.decides.len(), held(1)),
            ]);
        }
        match lengths.into_iter().find(|(_, found, expected)| found != expected) {
            None => Ok(()),
            Some((name, found, expected)) => Err(Error::Mismatch {
                what: format!("{what}: {name}"),
                found: format!("{found} numbers"),
                expected: expected.to_string(),
            }),
        }
    }

    /// Restores the agents of a collector that are in `blocks`, the range of these states. The states have been
    /// [checked](AgentStates::check). `what` names their source.
    pub fn put(&self, what: &str, blocks: Range<usize>, collector: &mut Collector) -> Result<(), Error> {
        let tally = blocks.len() * BLOCK;
        for b in 0..collector.blocks() {
            let block = collector.first_block() + b;
            if !blocks.contains(&block) {
                continue;
            }
            let i = block - blocks.start;
            for (seat, states) in collector.seats_mut().iter_mut().zip(&self.seats) {
                let words = states.noise[i * Noise::WORDS..].first_chunk().expect("the length was checked");
                seat.noise[b] = Noise::from_words(words);
                let row = seat.obs(b).len();
                seat.obs_mut(b).copy_from_slice(&states.obs[i * row..(i + 1) * row]);
                for (k, all) in seat.tallies.iter_mut().enumerate() {
                    all[b].copy_from_slice(&states.tallies[k * tally + i * BLOCK..][..BLOCK]);
                }
                if let Some(decides) = states.decides.get(i) {
                    (seat.decides[b], seat.left[b]) = (*decides as u16, (*decides >> BLOCK) as u16);
                }
            }
            if !self.action.is_empty() {
                let row = collector.action(b).len();
                collector.action_mut(b).copy_from_slice(&self.action[i * row..(i + 1) * row]);
            }
            let start = if i == 0 { 0 } else { self.env_ends[i - 1] };
            let bytes = self.env.get(start as usize..self.env_ends[i] as usize);
            let size = bytes.map_or("no".into(), |bytes| bytes.len().to_string());
            let wrong = |why: &str| Error::Mismatch {
                what: format!("{what}: environment"),
                found: format!("{size} bytes of block {block}'s environment{why}"),
                expected: "the state that this version of the task saves".into(),
            };
            let loaded = collector.shard_mut().load(b, bytes.ok_or_else(|| wrong(""))?);
            if !loaded.map_err(|error| wrong(&format!(" ({error})")))?.is_empty() {
                return Err(wrong(""));
            }
        }
        Ok(())
    }
}
