//! The bytes of a block of agents, as [`Shard::save`](crate::Shard::save) writes them.
//!
//! A block begins with a mark of eight bytes. For each agent follow four 64-bit integers: seed, number of the agent,
//! number of the episode, and decisions in it. Then come the physics ([`PhysicsState::write_to`]), the memory, the last
//! action, and the command if there is one. Numbers are little-endian and have 64 bits. They represent single precision
//! exactly, so a block fits every lane type.

use marathon_physics::{AgentState as PhysicsState, Model};

use super::commands::{SavedCommand, numbers};
use crate::error::EnvError;
use crate::shard::{BLOCK, Spec};

/// Mark of a block. The last two digits are the version.
const MARK: &[u8; 8] = b"MRTHNb04";

/// An agent of a block.
pub(crate) struct Saved {
    /// Seed, number of the agent, number of the episode, decisions in it.
    pub life: [u64; 4],
    pub state: LaneState,
}

/// An agent's state without its life.
pub(crate) struct LaneState {
    pub physics: PhysicsState,
    pub memory: Vec<f64>,
    /// The last action.
    pub action: Vec<f64>,
    pub command: SavedCommand,
}

/// Starts a block.
pub(crate) fn begin(bytes: &mut Vec<u8>) {
    bytes.extend(MARK);
}

/// Appends the next agent of a block.
pub(crate) fn add(bytes: &mut Vec<u8>, agent: &Saved) {
    let Saved { life, state: LaneState { physics, memory, action, command } } = agent;
    bytes.extend(life.iter().flat_map(|x| x.to_le_bytes()));
    physics.write_to(bytes);
    bytes.extend(memory.iter().chain(action).flat_map(|x| x.to_le_bytes()));
    command.write_to(bytes);
}

/// Reads a block of agents of a task with this model and `memory` numbers of memory per agent. Returns the agents and
/// the bytes after the block.
pub(crate) fn read<'a>(
    model: &Model,
    spec: &Spec,
    memory: usize,
    bytes: &'a [u8],
) -> Result<([Saved; BLOCK], &'a [u8]), EnvError> {
    let Some(mut rest) = bytes.strip_prefix(MARK) else { return Err(EnvError::Snapshot(wrong_mark(bytes))) };
    let mut agents = Vec::with_capacity(BLOCK);
    for _ in 0..BLOCK {
        let saved = agent(model, spec, memory, &mut rest);
        agents.push(saved.ok_or_else(|| EnvError::Snapshot("it ends too early or belongs to another model".into()))?);
    }
    let agents = agents.try_into().unwrap_or_else(|_| unreachable!("a block was read"));
    Ok((agents, rest))
}

/// Error message for a block that does not begin with the mark.
fn wrong_mark(bytes: &[u8]) -> String {
    match bytes.first_chunk::<8>().filter(|mark| mark.starts_with(b"MRTHNb")) {
        Some(mark) => format!(
            "the format of its agents is '{}', expected '{}': it was saved by another version of Marathon",
            mark.escape_ascii(),
            MARK.escape_ascii()
        ),
        None => "it does not begin with the mark of a block of agents".into(),
    }
}

/// Reads one agent that [`add`] wrote, and returns it with the bytes after it.
pub(crate) fn read_agent<'a>(
    model: &Model,
    spec: &Spec,
    memory: usize,
    mut bytes: &'a [u8],
) -> Result<(Saved, &'a [u8]), EnvError> {
    let saved = agent(model, spec, memory, &mut bytes);
    Ok((saved.ok_or_else(|| EnvError::Snapshot("it ends too early or belongs to another model".into()))?, bytes))
}

fn agent(model: &Model, spec: &Spec, memory: usize, bytes: &mut &[u8]) -> Option<Saved> {
    let life = life(bytes)?;
    let (physics, rest) = PhysicsState::read_from(model, bytes)?;
    *bytes = rest;
    let (memory, action) = (numbers(bytes, memory)?, numbers(bytes, spec.act)?);
    let command = SavedCommand::read_from(spec.command.len(), bytes)?;
    Some(Saved { life, state: LaneState { physics, memory, action, command } })
}

fn life(bytes: &mut &[u8]) -> Option<[u64; 4]> {
    let mut words = [0; 4];
    for word in &mut words {
        let (first, rest) = bytes.split_first_chunk()?;
        (*word, *bytes) = (u64::from_le_bytes(*first), rest);
    }
    Some(words)
}
