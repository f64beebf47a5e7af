//! Adapter for external tasks whose agents can only be stepped all at once. An example is an environment in another
//! language, where a call for all agents costs as much as a call for one.
//!
//! A learner's threads own blocks and normally run a rollout without waiting for each other. Here they synchronize at
//! every decision. Each thread [announces](Shard::announce) its actions, the last one steps the whole [`BatchTask`], and
//! all continue with their own rows of the result.

use crate::error::EnvError;
use crate::shard::{BLOCK, BlockStep, Shard, ShardFactory, Spec};
use crate::vec::{Step, StepMut, VecEnv};
use std::any::Any;
use std::ops::Range;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};

/// The error of a [`BatchTask`].
pub type BatchTaskError = Box<dyn std::error::Error + Send + Sync>;

/// All agents of a task, stepped together. When an episode ends, the next one starts within the same step.
pub trait BatchTask: Send {
    /// Starts the first episodes with a seed and writes the observations, `[agents][obs]`.
    ///
    /// # Errors
    /// If the task fails.
    fn reset(&mut self, seed: u64, obs: &mut [f32]) -> Result<(), BatchTaskError>;
    /// Executes one decision of every agent. `actions` is `[agents][act]`.
    ///
    /// # Errors
    /// If the task fails.
    fn step(&mut self, actions: &[f32], out: StepMut<'_>) -> Result<(), BatchTaskError>;
    /// The complete state.
    ///
    /// # Errors
    /// If the task fails.
    fn save(&self) -> Result<Vec<u8>, BatchTaskError>;
    /// Restores a state of [`BatchTask::save`].
    ///
    /// # Errors
    /// If the bytes are not such a state.
    fn load(&mut self, bytes: &[u8]) -> Result<(), BatchTaskError>;
}

/// A [`VecEnv`] with [`Autoreset::SameStep`](crate::Autoreset::SameStep).
impl BatchTask for VecEnv {
    fn reset(&mut self, seed: u64, obs: &mut [f32]) -> Result<(), BatchTaskError> {
        Ok(VecEnv::reset(self, Some(seed), obs)?)
    }

    fn step(&mut self, actions: &[f32], out: StepMut<'_>) -> Result<(), BatchTaskError> {
        Ok(VecEnv::step(self, actions, out)?)
    }

    fn save(&self) -> Result<Vec<u8>, BatchTaskError> {
        Ok(VecEnv::save(self))
    }

    fn load(&mut self, bytes: &[u8]) -> Result<(), BatchTaskError> {
        Ok(VecEnv::load(self, bytes)?)
    }
}

/// Panic payload of threads after the task has failed, without a message; see [`BatchAdapter::take_error`].
#[derive(Debug)]
pub struct BatchTaskFailed;

/// Creates shards of one [`BatchTask`]. Together they must cover all of its blocks and announce all actions. After all of
/// them are dropped, the next ones restart the task.
pub struct BatchAdapter {
    spec: Spec,
    agents: usize,
    barrier: Arc<Barrier>,
}

/// The barrier of the shards.
struct Barrier {
    shared: Mutex<Shared>,
    decided: Condvar,
}

struct Shared {
    task: Box<dyn BatchTask>,
    /// Seed of the task's first episodes, once they have begun.
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
    error: Option<BatchTaskError>,
    failed: bool,
}

impl BatchAdapter {
    /// Wraps a task of `agents` agents, a multiple of [`BLOCK`].
    ///
    /// # Panics
    /// If it is not such a multiple.
    pub fn new(task: Box<dyn BatchTask>, spec: Spec, agents: usize) -> Self {
        assert!(agents > 0 && agents.is_multiple_of(BLOCK), "{agents} agents are not whole blocks of {BLOCK}");
        let out = Step::new(agents, &spec);
        let actions = vec![0.0; agents * spec.act];
        let shared =
            Shared { task, begun: None, actions, out, shards: 0, present: 0, round: 0, error: None, failed: false };
        BatchAdapter {
            spec,
            agents,
            barrier: Arc::new(Barrier { shared: Mutex::new(shared), decided: Condvar::new() }),
        }
    }

    /// The task's error. When the task fails, all threads that use its shards unwind with [`BatchTaskFailed`], and their
    /// starter catches that.
    pub fn take_error(&self) -> Option<BatchTaskError> {
        self.barrier.enter().error.take()
    }
}

impl ShardFactory for BatchAdapter {
    fn spec(&self) -> &Spec {
        &self.spec
    }

    fn shard(&self, first: usize, blocks: usize, seed: u64) -> Box<dyn Shard> {
        let agents = first * BLOCK..(first + blocks) * BLOCK;
        assert!(agents.end <= self.agents, "block {} of {}", first + blocks, self.agents / BLOCK);
        self.barrier.enter().shards += 1;
        Box::new(LockstepShard {
            spec: self.spec.clone(),
            own: Step::new(agents.len(), &self.spec),
            barrier: self.barrier.clone(),
            agents,
            seed,
            announced: 0,
        })
    }

    fn lockstep(&self) -> Option<usize> {
        Some(self.agents)
    }
}

impl Barrier {
    fn enter(&self) -> MutexGuard<'_, Shared> {
        // a panic of the task leaves no half-finished state that is used later
        self.shared.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Runs an operation of the task. If it fails, all waiting and later threads unwind.
    fn attempt<R>(&self, shared: &mut Shared, f: impl FnOnce(&mut Shared) -> Result<R, BatchTaskError>) -> R {
        let mut reason: Box<dyn Any + Send> = Box::new(BatchTaskFailed);
        if !shared.failed {
            match catch_unwind(AssertUnwindSafe(|| f(shared))) {
                Ok(Ok(result)) => return result,
                Ok(Err(error)) => shared.error = Some(error),
                Err(panic) => reason = panic,
            }
            shared.failed = true;
            self.decided.notify_all();
        }
        resume_unwind(reason)
    }
}

/// A range of blocks of a [`BatchTask`].
struct LockstepShard {
    spec: Spec,
    barrier: Arc<Barrier>,
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
        let mut shared = self.barrier.enter();
        shared.shards -= 1;
        if shared.shards == 0 {
            (shared.begun, shared.present) = (None, 0);
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

    /// At the start, begins the episodes of all agents of the task. Later, returns the first observations of the
    /// episodes that the last decision has begun.
    fn reset(&mut self, block: usize, mask: u16, obs: &mut [f32]) {
        let barrier = self.barrier.clone();
        let mut shared = barrier.enter();
        if shared.begun.is_none() {
            let seed = self.seed;
            barrier.attempt(&mut shared, |shared| shared.task.reset(seed, &mut shared.out.obs));
            shared.begun = Some(seed);
        }
        let n = self.spec.obs;
        self.show(&shared.out.obs[self.agents.start * n..self.agents.end * n], block, mask, obs);
    }

    fn announce(&mut self, actions: &[f32]) {
        let act = self.spec.act;
        let barrier = self.barrier.clone();
        let mut shared = barrier.enter();
        let rows = &mut shared.actions[self.agents.start * act..self.agents.end * act];
        for (rows, block) in rows.chunks_exact_mut(BLOCK * act).zip(actions.chunks_exact(act * BLOCK)) {
            for (i, row) in rows.chunks_exact_mut(act).enumerate() {
                for (a, x) in row.iter_mut().enumerate() {
                    *x = block[a * BLOCK + i];
                }
            }
        }
        shared.present += self.agents.len();
        if shared.present * act == shared.actions.len() {
            barrier.attempt(&mut shared, |shared| {
                let Shared { task, actions, out, .. } = shared;
                task.step(actions, out.into())
            });
            shared.present = 0;
            shared.round += 1;
            barrier.decided.notify_all();
        } else {
            let round = shared.round;
            while shared.round == round && !shared.failed {
                shared = barrier.decided.wait(shared).unwrap_or_else(PoisonError::into_inner);
            }
            if shared.round == round {
                resume_unwind(Box::new(BatchTaskFailed));
            }
        }
        self.own.copy_rows(&shared.out, &self.spec, self.agents.clone());
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

    /// The first block holds the state of the whole task.
    fn save(&self, block: usize, bytes: &mut Vec<u8>) {
        if self.agents.start + block == 0 {
            let mut shared = self.barrier.enter();
            bytes.extend(self.barrier.attempt(&mut shared, |shared| shared.task.save()));
        }
    }

    fn load<'a>(&mut self, block: usize, bytes: &'a [u8]) -> Result<&'a [u8], EnvError> {
        if self.agents.start + block > 0 {
            return Ok(bytes);
        }
        let loaded = self.barrier.enter().task.load(bytes);
        loaded.map_err(|error| match error.downcast::<EnvError>() {
            Ok(error) => *error,
            Err(error) => EnvError::Snapshot(error.to_string()),
        })?;
        Ok(&[])
    }
}
