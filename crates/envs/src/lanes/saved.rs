//! The bytes of a block of agents: what [`Shard::save`](crate::Shard::save) writes.
//!
//! A mark of eight bytes, then agent by agent: whose life it is and how far it has come, four 64-bit integers; the state of
//! its physics ([`PhysicsState::write_to`]); its memory; its last action; its command, if it takes any. Numbers are
//! little-endian and have 64 bits, which is exact for single precision too, so that a block fits every lane width.
//!
//! Blocks of earlier versions are read: `MRTHNb03` had no action (it was the controls of the physics) and no command (its
//! schedule begins at the next observation). Before there was a mark, the state of the physics was `qpos`, `qvel` and the
//! solver's warm start alone; such a block can be read unless actuators have activations, which it lacks.

use marathon_physics::{AgentState as PhysicsState, Model};

use super::context::SavedCommand;
use crate::error::EnvError;
use crate::shard::{BLOCK, Spec};

const MARK: &[u8; 8] = b"MRTHNb04";
const WITHOUT_COMMANDS: &[u8; 8] = b"MRTHNb03";

/// An agent out of a block.
pub(crate) struct Saved {
    /// Seed, number of the agent, number of the episode, decisions made in it.
    pub life: [u64; 4],
    pub body: Body,
}

/// What an agent is besides its life.
pub(crate) enum Body {
    /// Everything.
    Whole(Box<Whole>),
    /// `qpos`, `qvel`, warm start and memory, from a block without a mark.
    Unmarked(Vec<f64>),
}

/// What an agent's future depends on besides its life.
pub(crate) struct Whole {
    pub physics: PhysicsState,
    pub memory: Vec<f64>,
    /// Its last action and its command; none in an earlier version's.
    pub given: Option<(Vec<f64>, SavedCommand)>,
}

/// How a block is written.
#[derive(Clone, Copy, PartialEq)]
enum Format {
    Present,
    WithoutCommands,
    Unmarked,
}

/// Begins a block.
pub(crate) fn begin(bytes: &mut Vec<u8>) {
    bytes.extend(MARK);
}

/// Appends the next agent of a block.
pub(crate) fn add(bytes: &mut Vec<u8>, life: [u64; 4], agent: &Whole) {
    let Whole { physics, memory, given } = agent;
    bytes.extend(life.into_iter().flat_map(u64::to_le_bytes));
    physics.write_to(bytes);
    bytes.extend(memory.iter().flat_map(|x| x.to_le_bytes()));
    if let Some((action, command)) = given {
        bytes.extend(action.iter().flat_map(|x| x.to_le_bytes()));
        command.write_to(bytes);
    }
}

/// Reads a block of agents of a task with this model, with so many numbers of memory each, and returns the bytes that
/// follow.
pub(crate) fn read<'a>(
    model: &Model,
    spec: &Spec,
    memory: usize,
    bytes: &'a [u8],
) -> Result<([Saved; BLOCK], &'a [u8]), EnvError> {
    let (format, mut rest) = match (bytes.strip_prefix(MARK), bytes.strip_prefix(WITHOUT_COMMANDS)) {
        (Some(rest), _) => (Format::Present, rest),
        (_, Some(rest)) => (Format::WithoutCommands, rest),
        _ => (Format::Unmarked, bytes),
    };
    if format == Format::Unmarked && model.na > 0 {
        return Err(EnvError::Snapshot(
            "it was saved by an earlier version of Marathon, which left out the activations of actuators; load it with \
             that version, or save the environment anew"
                .into(),
        ));
    }
    let mut agents = Vec::with_capacity(BLOCK);
    for _ in 0..BLOCK {
        let saved = agent(model, spec, memory, format, &mut rest);
        agents.push(saved.ok_or_else(|| EnvError::Snapshot("it ends too early, or is of another model".into()))?);
    }
    let agents = agents.try_into().unwrap_or_else(|_| unreachable!("a block was read"));
    Ok((agents, rest))
}

fn agent(model: &Model, spec: &Spec, memory: usize, format: Format, bytes: &mut &[u8]) -> Option<Saved> {
    let life = life(bytes)?;
    if format == Format::Unmarked {
        return Some(Saved { life, body: Body::Unmarked(numbers(bytes, model.nq + 2 * model.nv + memory)?) });
    }
    let (physics, rest) = PhysicsState::read_from(model, bytes)?;
    *bytes = rest;
    let memory = numbers(bytes, memory)?;
    let given = match format {
        Format::Present => Some((numbers(bytes, spec.act)?, SavedCommand::read_from(spec.command.len(), bytes)?)),
        Format::WithoutCommands | Format::Unmarked => None,
    };
    Some(Saved { life, body: Body::Whole(Box::new(Whole { physics, memory, given })) })
}

fn life(bytes: &mut &[u8]) -> Option<[u64; 4]> {
    let mut words = [0; 4];
    for word in &mut words {
        let (first, rest) = bytes.split_first_chunk()?;
        (*word, *bytes) = (u64::from_le_bytes(*first), rest);
    }
    Some(words)
}

/// The next numbers.
pub(crate) fn numbers(bytes: &mut &[u8], count: usize) -> Option<Vec<f64>> {
    let (mine, rest) = bytes.split_at_checked(count * 8)?;
    *bytes = rest;
    Some(mine.as_chunks::<8>().0.iter().map(|word| f64::from_le_bytes(*word)).collect())
}
