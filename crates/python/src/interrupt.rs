//! Ctrl-C during episodes that native threads play.

use marathon_envs::{BlockStep, Demonstrations, EnvError, Shard, ShardFactory, Spec};
use pyo3::prelude::*;
use std::panic::resume_unwind;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread;
use std::time::Duration;

/// Time between two looks for signals.
const PERIOD: Duration = Duration::from_millis(50);

/// Panic payload of threads whose work is not wanted any more.
struct Stopped;

/// Lets `f` play the episodes of a task on a thread of its own, without the GIL. Meanwhile this thread looks for signals;
/// an exception of a handler, such as `KeyboardInterrupt`, ends the episodes and is the error.
pub fn playing<R: Send>(
    py: Python<'_>,
    factory: &dyn ShardFactory,
    f: impl FnOnce(&dyn ShardFactory) -> R + Send,
) -> PyResult<R> {
    let stop = Arc::new(AtomicBool::new(false));
    let watched = Watched { factory, stop: stop.clone() };
    py.detach(|| {
        thread::scope(|scope| {
            let (working, ended) = channel::<()>();
            let work = scope.spawn(|| {
                // dropped at the end, also by a panic
                let _working = working;
                f(&watched)
            });
            let mut failure = None;
            while let Err(RecvTimeoutError::Timeout) = ended.recv_timeout(PERIOD) {
                if failure.is_none()
                    && let Err(error) = Python::attach(|py| py.check_signals())
                {
                    failure = Some(error);
                    stop.store(true, Ordering::Relaxed);
                }
            }
            match (work.join(), failure) {
                (_, Some(failure)) => Err(failure),
                (Ok(result), None) => Ok(result),
                (Err(panic), None) => resume_unwind(panic),
            }
        })
    })
}

/// A task whose shards end their threads when they are to stop.
struct Watched<'a> {
    factory: &'a dyn ShardFactory,
    stop: Arc<AtomicBool>,
}

impl ShardFactory for Watched<'_> {
    fn spec(&self) -> &Spec {
        self.factory.spec()
    }
    fn shard(&self, first: usize, blocks: usize, seed: u64) -> Box<dyn Shard> {
        Box::new(WatchedShard { shard: self.factory.shard(first, blocks, seed), stop: self.stop.clone() })
    }
    fn lockstep(&self) -> Option<usize> {
        self.factory.lockstep()
    }
    fn agent_bytes(&self) -> usize {
        self.factory.agent_bytes()
    }
    fn demonstrations(&self) -> Option<Demonstrations> {
        self.factory.demonstrations()
    }
}

struct WatchedShard {
    shard: Box<dyn Shard>,
    stop: Arc<AtomicBool>,
}

impl Shard for WatchedShard {
    fn spec(&self) -> &Spec {
        self.shard.spec()
    }
    fn blocks(&self) -> usize {
        self.shard.blocks()
    }
    fn reset(&mut self, block: usize, mask: u16, obs: &mut [f32]) {
        self.shard.reset(block, mask, obs);
    }
    fn announce(&mut self, actions: &[f32]) {
        if self.stop.load(Ordering::Relaxed) {
            // without the message of a panic
            resume_unwind(Box::new(Stopped));
        }
        self.shard.announce(actions);
    }
    fn step(&mut self, block: usize, action: &[f32], obs: &mut [f32], out: &mut BlockStep) {
        self.shard.step(block, action, obs, out);
    }
    fn save(&self, block: usize, bytes: &mut Vec<u8>) {
        self.shard.save(block, bytes);
    }
    fn load<'a>(&mut self, block: usize, bytes: &'a [u8]) -> Result<&'a [u8], EnvError> {
        self.shard.load(block, bytes)
    }
}
