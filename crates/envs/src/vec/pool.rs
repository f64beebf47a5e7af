//! The threads of an environment.

use crate::error::EnvError;
use marathon_physics::process_id;
use rayon::{ThreadPool, ThreadPoolBuilder};

/// The thread pool of this process. A forked process has the memory of its parent's pool but none of its threads, and
/// would wait for them forever. It therefore creates its own pool.
pub(crate) struct Pool {
    threads: usize,
    process: u32,
    pool: Option<ThreadPool>,
}

impl Pool {
    pub fn new(threads: usize) -> Result<Self, EnvError> {
        let pool = Some(start(threads)?);
        Ok(Pool { threads, process: process_id(), pool })
    }

    /// The pool of the present process.
    pub fn get(&mut self) -> Result<&ThreadPool, EnvError> {
        if self.process != process_id() {
            self.forget();
            self.process = process_id();
        }
        let pool = match self.pool.take() {
            Some(pool) => pool,
            None => start(self.threads)?,
        };
        Ok(self.pool.insert(pool))
    }

    /// Drops the reference to a pool of another process without joining its threads.
    fn forget(&mut self) {
        std::mem::forget(self.pool.take());
    }
}

impl Drop for Pool {
    fn drop(&mut self) {
        if self.process != process_id() {
            self.forget();
        }
    }
}

fn start(threads: usize) -> Result<ThreadPool, EnvError> {
    let builder = ThreadPoolBuilder::new().num_threads(threads).thread_name(|i| format!("marathon-env-{i}"));
    builder.build().map_err(|error| EnvError::Option {
        option: "threads",
        found: format!("{threads} ({error})"),
        expected: "a number that the system can start",
    })
}
