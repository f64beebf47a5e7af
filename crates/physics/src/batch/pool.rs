//! The threads that step a batch.

use crate::threads::{process_id, threads};
use rayon::{ThreadPool, ThreadPoolBuilder};

/// Threads that help the calling thread. They start at first use and sleep between uses.
pub(super) struct Helpers {
    count: usize,
    /// The threads, and the process that started them. A forked process inherits the memory of its parent's pool but
    /// none of its threads.
    pool: Option<(u32, ThreadPool)>,
}

impl Helpers {
    pub fn new(count: usize) -> Self {
        Helpers { count: threads(count + 1) - 1, pool: None }
    }

    /// Runs all jobs and returns when they have finished. The first job runs on the calling thread, the others on
    /// helper threads.
    pub fn run<'a, J: FnOnce() + Send + 'a>(&mut self, mut jobs: impl Iterator<Item = J>) {
        let Some(pool) = self.pool() else { return jobs.for_each(|job| job()) };
        pool.in_place_scope(|scope| {
            let first = jobs.next();
            jobs.for_each(|job| scope.spawn(move |_| job()));
            if let Some(first) = first {
                first();
            }
        });
    }

    /// The current process's pool; `None` if one thread does everything, or if the system cannot start more threads.
    fn pool(&mut self) -> Option<&ThreadPool> {
        if self.count == 0 {
            return None;
        }
        let process = process_id();
        if self.pool.as_ref().is_some_and(|(of, _)| *of != process) {
            self.forget();
        }
        if self.pool.is_none() {
            let builder = ThreadPoolBuilder::new().num_threads(self.count);
            let pool = builder.thread_name(|i| format!("marathon-batch-{i}")).build().ok()?;
            self.pool = Some((process, pool));
        }
        self.pool.as_ref().map(|(_, pool)| pool)
    }

    /// Drops a pool of another process without waiting for its threads.
    fn forget(&mut self) {
        std::mem::forget(self.pool.take());
    }
}

impl Drop for Helpers {
    fn drop(&mut self) {
        if self.pool.as_ref().is_some_and(|(of, _)| *of != process_id()) {
            self.forget();
        }
    }
}

#[cfg(all(test, not(target_family = "wasm")))]
mod tests {
    use super::*;
    use std::collections::BTreeSet;
    use std::sync::Mutex;
    use std::thread::{self, ThreadId};

    /// The threads that ran the jobs.
    fn threads(helpers: &mut Helpers, jobs: usize) -> BTreeSet<String> {
        let seen: Mutex<Vec<ThreadId>> = Mutex::new(Vec::new());
        let barrier = std::sync::Barrier::new(jobs);
        helpers.run((0..jobs).map(|_| {
            || {
                barrier.wait();
                seen.lock().expect("a job").push(thread::current().id());
            }
        }));
        seen.into_inner().expect("all jobs").iter().map(|id| format!("{id:?}")).collect()
    }

    /// Steps do not start threads.
    #[test]
    fn the_same_threads_work_again_and_again() {
        let mut helpers = Helpers::new(3);
        let first = threads(&mut helpers, 4);
        assert_eq!(first.len(), 4);
        assert!(first.contains(&format!("{:?}", thread::current().id())));
        for _ in 0..20 {
            assert_eq!(threads(&mut helpers, 4), first);
        }
    }

    #[test]
    fn without_helpers_the_caller_does_all() {
        let mut helpers = Helpers::new(0);
        let mut sum = 0;
        helpers.run([1, 2, 3].into_iter().map(|_| || ()));
        helpers.run(std::iter::once(|| sum = 5));
        assert!(helpers.pool.is_none() && sum == 5);
    }
}
