//! Adapter for external tasks whose agents can only be stepped all at once. An example is an environment in another
//! language, where a call for all agents costs as much as a call for one.
//!
//! A learner's threads own blocks and normally run a rollout without waiting for each other. Here they synchronize at
//! every decision. Each thread [announces](Shard::announce) its actions, the last one steps the whole [`Crowd`], and
//! all continue with their own rows of the result.

use crate::error::EnvError;
use crate::shard::{BLOCK, BlockStep, Shard, ShardFactory, Spec};
use crate::vec::{Step, StepMut, VecEnv};
use std::any::Any;
use std::ops::Range;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};

/// The error of a [`Crowd`].
pub type CrowdError = Box<dyn std::error::Error + Send + Sync>;

/// All agents of a task, stepped together. When an episode ends, the next one starts within the same step.
pub trait Crowd: Send {
    /// Starts the first episodes with a seed and writes the observations, `[agents][obs]`.
    ///
    /// # Errors
    /// If the task fails.
    fn reset(&mut self, seed: u64, obs: &mut [f32]) -> Result<(), CrowdError>;
    /// Executes one decision of every agent. `actions` is `[agents][act]`.
    ///
    /// # Errors
    /// If the task fails.
    fn step(&mut self, actions: &[f32], out: StepMut<'_>) -> Result<(), CrowdError>;
    /// The complete state.
    ///
    /// # Errors
    /// If the task fails.
    fn save(&self) -> Result<Vec<u8>, CrowdError>;
    /// Restores a state of [`Crowd::save`].
    ///
    /// # Errors
    /// If the bytes are not such a state.
    fn load(&mut self, bytes: &[u8]) -> Result<(), CrowdError>;
}

/// A [`VecEnv`] with [`Autoreset::SameStep`](crate::Autoreset::SameStep).
impl Crowd for VecEnv {
    fn reset(&mut self, seed: u64, obs: &mut [f32]) -> Result<(), CrowdError> {
        Ok(VecEnv::reset(self, Some(seed), obs)?)
    }

    fn step(&mut self, actions: &[f32], out: StepMut<'_>) -> Result<(), CrowdError> {
        Ok(VecEnv::step(self, actions, out)?)
    }

    fn save(&self) -> Result<Vec<u8>, CrowdError> {
        Ok(VecEnv::save(self))
    }

    fn load(&mut self, bytes: &[u8]) -> Result<(), CrowdError> {
        Ok(VecEnv::load(self, bytes)?)
    }
}

/// Panic payload of threads after the crowd has failed, without a message; see [`Lockstep::take_error`].
#[derive(Debug)]
pub struct CrowdFailed;

/// Creates shards of one [`Crowd`]. Together they must cover all of its blocks and announce all actions. After all of
/// them are dropped, the next ones restart the crowd.
pub struct Lockstep {
    spec: Spec,
    agents: usize,
    meeting: Arc<Meeting>,
}

/// The barrier of the shards.
struct Meeting {
    hall: Mutex<Hall>,
    decided: Condvar,
}

struct Hall {
    crowd: Box<dyn Crowd>,
    /// Seed of the crowd's first episodes, once they have begun.
    begun: Option<u64>,
    /// `[agents][act]`.
    actions: Vec<f32>,
    out: Step,
    /// Number of shards in use.
    shards: usize,
    /// Number of agents whose actions are announced.
    present: usize,
    /// Number of decisions.
    round: u64,
    error: Option<CrowdError>,
    failed: bool,
}

impl Lockstep {
    /// Wraps a crowd of `agents` agents, a multiple of [`BLOCK`].
    ///
    /// # Panics
    /// If it is not such a multiple.
    pub fn new(crowd: Box<dyn Crowd>, spec: Spec, agents: usize) -> Self {
        assert!(agents > 0 && agents.is_multiple_of(BLOCK), "{agents} agents are not whole blocks of {BLOCK}");
        let out = Step::new(agents, &spec);
        let actions = vec![0.0; agents * spec.act];
        let hall =
            Hall { crowd, begun: None, actions, out, shards: 0, present: 0, round: 0, error: None, failed: false };
        Lockstep { spec, agents, meeting: Arc::new(Meeting { hall: Mutex::new(hall), decided: Condvar::new() }) }
    }

    /// The crowd's error. When the crowd fails, all threads that use its shards unwind with [`CrowdFailed`], and their
    /// starter catches that.
    pub fn take_error(&self) -> Option<CrowdError> {
        self.meeting.enter().error.take()
    }
}

impl ShardFactory for Lockstep {
    fn spec(&self) -> &Spec {
        &self.spec
    }

    fn shard(&self, first: usize, blocks: usize, seed: u64) -> Box<dyn Shard> {
        let agents = first * BLOCK..(first + blocks) * BLOCK;
        assert!(agents.end <= self.agents, "block {} of {}", first + blocks, self.agents / BLOCK);
        self.meeting.enter().shards += 1;
        Box::new(LockstepShard {
            spec: self.spec.clone(),
            own: Step::new(agents.len(), &self.spec),
            meeting: self.meeting.clone(),
            agents,
            seed,
            announced: 0,
        })
    }

    fn lockstep(&self) -> Option<usize> {
        Some(self.agents)
    }
}

impl Meeting {
    fn enter(&self) -> MutexGuard<'_, Hall> {
        // a panic of the crowd leaves no half-finished state that is used later
        self.hall.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Runs an operation of the crowd. If it fails, all waiting and later threads unwind.
    fn attempt<R>(&self, hall: &mut Hall, f: impl FnOnce(&mut Hall) -> Result<R, CrowdError>) -> R {
        let mut reason: Box<dyn Any + Send> = Box::new(CrowdFailed);
        if !hall.failed {
            match catch_unwind(AssertUnwindSafe(|| f(hall))) {
                Ok(Ok(result)) => return result,
                Ok(Err(error)) => hall.error = Some(error),
                Err(panic) => reason = panic,
            }
            hall.failed = true;
            self.decided.notify_all();
        }
        resume_unwind(reason)
    }
}

/// A range of blocks of a [`Crowd`].
struct LockstepShard {
    spec: Spec,
    meeting: Arc<Meeting>,
    agents: Range<usize>,
    seed: u64,
    /// Results of the last decision for the shard's agents.
    own: Step,
    /// Number of blocks that have not been stepped since the announcement.
    announced: usize,
}

impl LockstepShard {
    /// Copies the agents in `mask` from `[agents][columns]` to a block's `[column][16]`.
    fn show(&self, rows: &[f32], block: usize, mask: u16, out: &mut [f32]) {
        let columns = rows.len() / self.agents.len();
        for (i, row) in rows[block * BLOCK * columns..].chunks_exact(columns.max(1)).take(BLOCK).enumerate() {
            if mask >> i & 1 == 1 {
                for (column, x) in row.iter().enumerate() {
                    out[column * BLOCK + i] = *x;
                }
            }
        }
    }
}

impl Drop for LockstepShard {
    fn drop(&mut self) {
        let mut hall = self.meeting.enter();
        hall.shards -= 1;
        if hall.shards == 0 {
            (hall.begun, hall.present) = (None, 0);
        }
    }
}

impl Shard for LockstepShard {
    fn spec(&self) -> &Spec {
        &self.spec
    }

    fn blocks(&self) -> usize {
        self.agents.len() / BLOCK
    }

    /// At the start, begins the episodes of all agents of the crowd. Later, returns the first observations of the
    /// episodes that the last decision has begun.
    fn reset(&mut self, block: usize, mask: u16, obs: &mut [f32]) {
        let meeting = self.meeting.clone();
        let mut hall = meeting.enter();
        if hall.begun.is_none() {
            let seed = self.seed;
            meeting.attempt(&mut hall, |hall| hall.crowd.reset(seed, &mut hall.out.obs));
            hall.begun = Some(seed);
        }
        let n = self.spec.obs;
        self.show(&hall.out.obs[self.agents.start * n..self.agents.end * n], block, mask, obs);
    }

    fn announce(&mut self, actions: &[f32]) {
        let act = self.spec.act;
        let meeting = self.meeting.clone();
        let mut hall = meeting.enter();
        let rows = &mut hall.actions[self.agents.start * act..self.agents.end * act];
        for (rows, block) in rows.chunks_exact_mut(BLOCK * act).zip(actions.chunks_exact(act * BLOCK)) {
            for (i, row) in rows.chunks_exact_mut(act).enumerate() {
                for (a, x) in row.iter_mut().enumerate() {
                    *x = block[a * BLOCK + i];
                }
            }
        }
        hall.present += self.agents.len();
        if hall.present * act == hall.actions.len() {
            meeting.attempt(&mut hall, |hall| {
                let Hall { crowd, actions, out, .. } = hall;
                crowd.step(actions, out.into())
            });
            hall.present = 0;
            hall.round += 1;
            meeting.decided.notify_all();
        } else {
            let round = hall.round;
            while hall.round == round && !hall.failed {
                hall = meeting.decided.wait(hall).unwrap_or_else(PoisonError::into_inner);
            }
            if hall.round == round {
                resume_unwind(Box::new(CrowdFailed));
            }
        }
        self.own.copy_rows(&hall.out, &self.spec, self.agents.clone());
        self.announced = self.blocks();
    }

    /// # Panics
    /// If the actions were not announced.
    fn step(&mut self, block: usize, _: &[f32], obs: &mut [f32], out: &mut BlockStep) {
        assert!(self.announced > 0, "announce the actions of all blocks before the step of each");
        self.announced -= 1;
        let own = &self.own;
        self.show(&own.final_obs, block, !0, obs);
        out.terms.resize(BLOCK * self.spec.reward_terms.len(), 0.0);
        self.show(&own.terms, block, !0, &mut out.terms);
        out.info.resize(BLOCK * self.spec.info.len(), 0.0);
        self.show(&own.info, block, !0, &mut out.info);
        let agents = block * BLOCK..(block + 1) * BLOCK;
        out.reward.copy_from_slice(&own.reward[agents.clone()]);
        out.forward.copy_from_slice(&own.forward[agents.clone()]);
        let bits = |flags: &[bool]| flags[agents.clone()].iter().rev().fold(0, |bits, on| bits << 1 | u16::from(*on));
        out.terminated = bits(&own.terminated);
        out.truncated = bits(&own.truncated) & !out.terminated;
        out.diverged = bits(&own.diverged);
    }

    /// The first block holds the state of the whole crowd.
    fn save(&self, block: usize, bytes: &mut Vec<u8>) {
        if self.agents.start + block == 0 {
            let mut hall = self.meeting.enter();
            bytes.extend(self.meeting.attempt(&mut hall, |hall| hall.crowd.save()));
        }
    }

    fn load<'a>(&mut self, block: usize, bytes: &'a [u8]) -> Result<&'a [u8], EnvError> {
        if self.agents.start + block > 0 {
            return Ok(bytes);
        }
        let loaded = self.meeting.enter().crowd.load(bytes);
        loaded.map_err(|error| match error.downcast::<EnvError>() {
            Ok(error) => *error,
            Err(error) => EnvError::Snapshot(error.to_string()),
        })?;
        Ok(&[])
    }
}
