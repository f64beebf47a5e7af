//! Snapshots of a whole environment, and of one agent.
//!
//! | bytes | |
//! |---|---|
//! | 8 | `MRTHNv03` |
//! | 4 | CRC-32 of all that follows |
//! | 8 | number of agents |
//! | 8 | length of the task's name |
//! | as long | the task's name |
//!
//! For every sixteen agents, their block follows (`lanes/saved.rs`), then two bytes with a bit for each agent that
//! begins an episode at the next step. Integers are little-endian.
//!
//! The snapshot of one agent begins with the mark `MRTHNa01` and has no number of agents. After the task's name follow a
//! byte with whether the agent begins an episode at the next step, a byte for each role (`deciders.rs`), and the agent.

use super::vec_env::VecEnv;
use crate::error::EnvError;
use crate::shard::BLOCK;

/// Mark of a snapshot. The last two digits are the version.
const MARK: &[u8; 8] = b"MRTHNv03";
/// Mark of a snapshot of one agent.
const AGENT_MARK: &[u8; 8] = b"MRTHNa01";

fn refuse<X>(problem: String) -> Result<X, EnvError> {
    Err(EnvError::Snapshot(problem))
}

impl VecEnv {
    /// The complete state as bytes. After [`VecEnv::load`], the environment continues with the same bits, regardless of
    /// the number of threads. It includes the agents' own inputs ([`VecEnv::context`]), but not the task's arguments
    /// and the episode limit.
    pub fn save(&self) -> Vec<u8> {
        let mut bytes = (self.agents as u64).to_le_bytes().to_vec();
        self.add_name(&mut bytes);
        for worker in &self.workers {
            for block in 0..worker.shard.blocks() {
                worker.shard.save(block, &mut bytes);
                bytes.extend(worker.pending[block].to_le_bytes());
            }
        }
        seal(MARK, &bytes)
    }

    /// Appends the name of the task, after its length.
    fn add_name(&self, bytes: &mut Vec<u8>) {
        bytes.extend((self.spec.id.len() as u64).to_le_bytes());
        bytes.extend(self.spec.id.as_bytes());
    }

    /// Restores a state of [`VecEnv::save`]. It does not include which roles [act](VecEnv::decides) next.
    ///
    /// # Errors
    /// If the bytes are damaged, or belong to an environment with another agent or number of agents. Then nothing has
    /// changed.
    pub fn load(&mut self, bytes: &[u8]) -> Result<(), EnvError> {
        let blocks = self.blocks_in(bytes)?;
        let before = self.save();
        let result = self.load_blocks(blocks);
        if result.is_ok() {
            self.workers.iter_mut().for_each(|worker| worker.deciders.forget());
        } else {
            let own = self.blocks_in(&before).and_then(|blocks| self.load_blocks(blocks));
            debug_assert!(own.is_ok(), "an environment loads what it saved");
        }
        result
    }

    /// The complete state of one agent as bytes, with which roles act next. After [`VecEnv::load_agent`], the agent continues
    /// with the same bits, whatever its number and its neighbors are.
    ///
    /// # Errors
    /// If there is no such agent.
    pub fn save_agent(&self, agent: usize) -> Result<Vec<u8>, EnvError> {
        self.check_agent(agent)?;
        let (worker, local) = (&self.workers[agent / self.stride], agent % self.stride);
        let (block, lane) = (local / BLOCK, local % BLOCK);
        let mut bytes = Vec::new();
        self.add_name(&mut bytes);
        bytes.push((worker.pending[block] >> lane & 1) as u8);
        bytes.extend(worker.deciders.save(block, lane));
        worker.shard.save_agent(local, &mut bytes);
        Ok(seal(AGENT_MARK, &bytes))
    }

    /// Restores a state of [`VecEnv::save_agent`] in any agent of the same task. The bits of the other agents do not
    /// change.
    ///
    /// # Errors
    /// If there is no such agent, or the bytes are damaged or belong to another task. Then nothing has changed.
    pub fn load_agent(&mut self, agent: usize, bytes: &[u8]) -> Result<(), EnvError> {
        self.check_agent(agent)?;
        let (id, rest) = sealed(bytes, AGENT_MARK, "an agent").and_then(|body| name(body).ok_or_else(too_early))?;
        if id != self.spec.id {
            return refuse(format!("it is an agent of '{id}', expected one of '{}'", self.spec.id));
        }
        let roles = self.spec.roles.len();
        let (Some(pending), Some(turns)) = (rest.first(), rest.get(1..1 + roles)) else { return Err(too_early()) };
        let (worker, local) = (&mut self.workers[agent / self.stride], agent % self.stride);
        let (block, lane) = (local / BLOCK, local % BLOCK);
        worker.shard.load_agent(local, &rest[1 + roles..])?;
        worker.pending[block] = worker.pending[block] & !(1 << lane) | u16::from(pending & 1) << lane;
        worker.deciders.load(block, lane, turns);
        Ok(())
    }

    /// The blocks of a snapshot, after checking that it belongs to this kind of environment.
    fn blocks_in<'a>(&self, bytes: &'a [u8]) -> Result<&'a [u8], EnvError> {
        let body = sealed(bytes, MARK, "an environment")?;
        let expected = (self.agents, self.spec.id.as_str());
        match head(body) {
            Some((agents, id, blocks)) if (agents, id) == expected => Ok(blocks),
            Some((agents, id, _)) => {
                refuse(format!("it has {agents} agents of '{id}', expected {} of '{}'", expected.0, expected.1))
            }
            None => Err(too_early()),
        }
    }

    fn load_blocks(&mut self, mut bytes: &[u8]) -> Result<(), EnvError> {
        for worker in &mut self.workers {
            for block in 0..worker.shard.blocks() {
                let rest = worker.shard.load(block, bytes)?;
                let Some((pending, rest)) = rest.split_first_chunk() else { return refuse("it ends too early".into()) };
                worker.pending[block] = u16::from_le_bytes(*pending);
                bytes = rest;
            }
        }
        if bytes.is_empty() { Ok(()) } else { refuse(format!("it has {} bytes after its end", bytes.len())) }
    }
}

/// A snapshot of a body: its mark, its checksum and the body.
fn seal(mark: &[u8; 8], body: &[u8]) -> Vec<u8> {
    [&mark[..], &crc32fast::hash(body).to_le_bytes(), body].concat()
}

/// The body of a snapshot of `what`, after checking its mark and its checksum.
fn sealed<'a>(bytes: &'a [u8], expected: &[u8; 8], what: &str) -> Result<&'a [u8], EnvError> {
    let Some((mark, rest)) = bytes.split_first_chunk::<8>() else {
        return refuse(format!("it has {} bytes, expected a snapshot of {what}", bytes.len()));
    };
    match rest.split_first_chunk() {
        Some((sum, body)) if mark == expected => {
            let (found, expected) = (crc32fast::hash(body), u32::from_le_bytes(*sum));
            if found == expected {
                return Ok(body);
            }
            refuse(format!("it is damaged or cut short: its checksum is {found:08x}, expected {expected:08x}"))
        }
        _ if mark[..6] == expected[..6] => refuse(format!(
            "its format is '{}', expected '{}': it was saved by another version of Marathon",
            mark.escape_ascii(),
            expected.escape_ascii()
        )),
        _ => refuse(format!("it does not begin with the mark of {what}")),
    }
}

fn too_early() -> EnvError {
    EnvError::Snapshot("it ends too early".into())
}

/// Number of agents and name of the task at the start of a snapshot's body, and the blocks after them.
fn head(body: &[u8]) -> Option<(usize, &str, &[u8])> {
    let (agents, rest) = body.split_first_chunk()?;
    let (id, blocks) = name(rest)?;
    Some((usize::try_from(u64::from_le_bytes(*agents)).ok()?, id, blocks))
}

/// Name of the task, and the bytes after it.
fn name(bytes: &[u8]) -> Option<(&str, &[u8])> {
    let (length, rest) = bytes.split_first_chunk()?;
    let (id, rest) = rest.split_at_checked(usize::try_from(u64::from_le_bytes(*length)).ok()?)?;
    Some((std::str::from_utf8(id).ok()?, rest))
}
