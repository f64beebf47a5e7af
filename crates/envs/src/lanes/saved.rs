//! The bytes of a block of agents: what [`Shard::save`](crate::Shard::save) writes.
//!
//! A mark of eight bytes, then agent by agent: whose life it is and how far it has come, four 64-bit integers; the state of
//! its physics ([`PhysicsState::write_to`]); its memory. Numbers are little-endian and have 64 bits, which is exact for
//! single precision too, so that a block fits every lane width.
//!
//! Before there was a mark, the state of the physics was `qpos`, `qvel` and the solver's warm start alone. Such a block can
//! still be read, unless actuators have activations, which it lacks.

use marathon_physics::{AgentState as PhysicsState, Model};

use crate::error::EnvError;
use crate::shard::BLOCK;

const MARK: &[u8; 8] = b"MRTHNb03";

/// An agent out of a block.
pub(crate) struct Saved {
    /// Seed, number of the agent, number of the episode, decisions made in it.
    pub life: [u64; 4],
    pub body: Body,
}

/// What an agent is besides its life.
pub(crate) enum Body {
    /// Everything.
    Whole { physics: PhysicsState, memory: Vec<f64> },
    /// `qpos`, `qvel`, warm start and memory, from a block without a mark.
    Unmarked(Vec<f64>),
}

/// Begins a block.
pub(crate) fn begin(bytes: &mut Vec<u8>) {
    bytes.extend(MARK);
}

/// Appends the next agent of a block; of its memory, the numbers follow.
pub(crate) fn add(bytes: &mut Vec<u8>, life: [u64; 4], physics: &PhysicsState, memory: impl Iterator<Item = f64>) {
    bytes.extend(life.into_iter().flat_map(u64::to_le_bytes));
    physics.write_to(bytes);
    bytes.extend(memory.flat_map(f64::to_le_bytes));
}

/// Reads a block of agents of this model, with so many numbers of memory each, and returns the bytes that follow.
pub(crate) fn read<'a>(model: &Model, memory: usize, bytes: &'a [u8]) -> Result<([Saved; BLOCK], &'a [u8]), EnvError> {
    let (marked, mut rest) = match bytes.strip_prefix(MARK) {
        Some(rest) => (true, rest),
        None => (false, bytes),
    };
    if !marked && model.na > 0 {
        return Err(EnvError::Snapshot(
            "it was saved by an earlier version of Marathon, which left out the activations of actuators; load it with \
             that version, or save the environment anew"
                .into(),
        ));
    }
    let mut agents = Vec::with_capacity(BLOCK);
    for _ in 0..BLOCK {
        let saved = if marked { whole(model, memory, &mut rest) } else { unmarked(model, memory, &mut rest) };
        agents.push(saved.ok_or_else(|| EnvError::Snapshot("it ends too early, or is of another model".into()))?);
    }
    let agents = agents.try_into().unwrap_or_else(|_| unreachable!("a block was read"));
    Ok((agents, rest))
}

fn whole(model: &Model, memory: usize, bytes: &mut &[u8]) -> Option<Saved> {
    let life = life(bytes)?;
    let (physics, rest) = PhysicsState::read_from(model, bytes)?;
    *bytes = rest;
    Some(Saved { life, body: Body::Whole { physics, memory: numbers(bytes, memory)? } })
}

fn unmarked(model: &Model, memory: usize, bytes: &mut &[u8]) -> Option<Saved> {
    let life = life(bytes)?;
    Some(Saved { life, body: Body::Unmarked(numbers(bytes, model.nq + 2 * model.nv + memory)?) })
}

fn life(bytes: &mut &[u8]) -> Option<[u64; 4]> {
    let mut words = [0; 4];
    for word in &mut words {
        let (first, rest) = bytes.split_first_chunk()?;
        (*word, *bytes) = (u64::from_le_bytes(*first), rest);
    }
    Some(words)
}

fn numbers(bytes: &mut &[u8], count: usize) -> Option<Vec<f64>> {
    let (mine, rest) = bytes.split_at_checked(count * 8)?;
    *bytes = rest;
    Some(mine.as_chunks::<8>().0.iter().map(|word| f64::from_le_bytes(*word)).collect())
}
