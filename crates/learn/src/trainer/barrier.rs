//! A barrier that is cheap when all threads arrive together and sleeps when they do not.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Condvar, Mutex};

/// Polls before the processor is offered to others, then offers before the thread sleeps.
const SPINS: usize = 1000;
const YIELDS: usize = 100;

/// Lets `n` threads wait for each other, again and again.
pub struct Barrier {
    n: usize,
    arrived: AtomicUsize,
    round: AtomicUsize,
    broken: AtomicBool,
    /// Number of sleeping threads.
    sleepers: Mutex<usize>,
    wake: Condvar,
}

impl Barrier {
    /// For `n` threads.
    pub fn new(n: usize) -> Self {
        Self {
            n,
            arrived: AtomicUsize::new(0),
            round: AtomicUsize::new(0),
            broken: AtomicBool::new(false),
            sleepers: Mutex::new(0),
            wake: Condvar::new(),
        }
    }

    /// Returns when all threads have called it.
    ///
    /// # Panics
    /// If a thread has given up ([`Barrier::guard`]): the others would wait forever.
    pub fn wait(&self) {
        let round = self.round.load(Ordering::Acquire);
        if self.arrived.fetch_add(1, Ordering::AcqRel) + 1 == self.n {
            self.arrived.store(0, Ordering::Relaxed);
            self.release(|| self.round.store(round.wrapping_add(1), Ordering::Release));
            return;
        }
        let passed = || self.round.load(Ordering::Acquire) != round || self.broken.load(Ordering::Acquire);
        for i in 0..SPINS + YIELDS {
            if passed() {
                break;
            }
            if i < SPINS { std::hint::spin_loop() } else { std::thread::yield_now() }
        }
        if !passed() {
            let mut sleepers = self.sleepers.lock().unwrap_or_else(|e| e.into_inner());
            *sleepers += 1;
            while !passed() {
                sleepers = self.wake.wait(sleepers).unwrap_or_else(|e| e.into_inner());
            }
            *sleepers -= 1;
        }
        assert!(!self.broken.load(Ordering::Acquire), "another worker has stopped");
    }

    /// As [`wait`](Barrier::wait) for a thread that will not come again, which need not wait itself.
    pub fn leave(&self) {
        let round = self.round.load(Ordering::Acquire);
        if self.arrived.fetch_add(1, Ordering::AcqRel) + 1 == self.n {
            self.release(|| self.round.store(round.wrapping_add(1), Ordering::Release));
        }
    }

    /// Wakes sleepers after a change; under the lock, so that none goes to sleep in between.
    fn release(&self, change: impl FnOnce()) {
        let sleepers = self.sleepers.lock().unwrap_or_else(|e| e.into_inner());
        change();
        if *sleepers > 0 {
            self.wake.notify_all();
        }
    }

    /// Breaks the barrier if its thread panics before it is dropped.
    pub fn guard(&self) -> BarrierGuard<'_> {
        BarrierGuard(self)
    }
}

/// See [`Barrier::guard`].
pub struct BarrierGuard<'a>(&'a Barrier);

impl Drop for BarrierGuard<'_> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            self.0.release(|| self.0.broken.store(true, Ordering::Release));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    #[cfg_attr(target_family = "wasm", ignore = "needs threads")]
    fn threads_stay_in_step() {
        let (barrier, counter) = (Barrier::new(3), AtomicUsize::new(0));
        std::thread::scope(|s| {
            for id in 0..3 {
                let (barrier, counter) = (&barrier, &counter);
                s.spawn(move || {
                    for round in 1..200 {
                        if id == 0 && round % 50 == 0 {
                            std::thread::sleep(std::time::Duration::from_millis(5));
                        }
                        counter.fetch_add(1, Ordering::Relaxed);
                        barrier.wait();
                        assert_eq!(counter.load(Ordering::Relaxed), 3 * round);
                        barrier.wait();
                    }
                });
            }
        });
    }

    #[test]
    #[cfg_attr(target_family = "wasm", ignore = "needs threads")]
    fn a_panic_frees_the_others() {
        let barrier = Barrier::new(2);
        let outcome = std::panic::catch_unwind(|| {
            std::thread::scope(|s| {
                s.spawn(|| barrier.wait());
                let _guard = barrier.guard();
                panic!("as a test");
            })
        });
        assert!(outcome.is_err());
    }
}
