//! Regret against a reference runner (PAIRED: Dennis and others, "Emergent complexity and zero-shot transfer via unsupervised
//! environment design", 2020): a third role runs over the ground that the adversary has built for the first one.
//!
//! An episode is two runs. In the first, the runner runs and the adversary builds. When it is over, the body goes back to the
//! start, and the reference has the motors: its run is over when the runner's would be, or where the built ground ends. The
//! adversary earns what the reference earns, less what the runner has earned. So ground that nobody can pass is worth no more
//! to it than level ground.

use marathon_physics::lanes::Real;

use super::course::LEVEL_TO;
use super::{AT, BUILT, DUE, FARTHEST, HIT, HURT, LIES, MARK, SINCE};
use crate::agent::Site;

/// Slots of the memory, behind those of every course: whether the reference runs, whether it is to begin, decisions of the present
/// run, and the runner's way, m.
pub(super) const SECOND: usize = super::MEMORY;
const DUE_TO_BEGIN: usize = SECOND + 1;
const RUN: usize = SECOND + 2;
const WAY: usize = SECOND + 3;
pub(super) const MEMORY: usize = SECOND + 4;

/// Name of the role, and of what it earns; what the names of its actuators begin with.
pub(super) const REFERENCE: &str = "reference";
/// What the adversary earns.
pub(super) const REGRET: &str = "regret";
/// Longest run, s.
const LONGEST: f64 = 10.0;

/// Lanes in which the reference runs. `memory`: the course's variables, here and below.
#[inline(always)]
pub(super) fn runs<T: Real>(memory: &[T]) -> T::Mask {
    T::lit(0.5).lt(memory[SECOND])
}

/// Lanes in which the reference is to begin.
#[inline(always)]
pub(super) fn is_due<T: Real>(memory: &[T]) -> T::Mask {
    T::lit(0.5).lt(memory[DUE_TO_BEGIN])
}

/// The runner's way, m.
#[inline(always)]
pub(super) fn way<T: Real>(memory: &[T]) -> T {
    T::select(runs(memory), memory[WAY], memory[FARTHEST])
}

/// The same after an episode that has left its memory, if the reference has run in it.
pub(super) fn way_of_runner(memory: &[f64]) -> Option<f64> {
    memory.get(SECOND).filter(|second| **second > 0.5).map(|_| memory[WAY])
}

/// Lanes in which the present run is over though nobody has fallen. `stopped`: those in which any run would be.
#[inline(always)]
pub(super) fn is_over<T: Real>(memory: &[T], stopped: T::Mask, dt: f64) -> T::Mask {
    let late = T::lit(LONGEST / dt - 0.5).lt(memory[RUN]);
    let beyond = (memory[BUILT] + T::lit(LEVEL_TO)).lt(memory[AT]);
    T::or(stopped, T::or(late, T::and(runs(memory), beyond)))
}

/// Takes note of a decision of the present run, with which the figure has failed or the run has stopped in some lanes. Returns those in
/// which it was the reference's first.
#[inline(always)]
pub(super) fn remember<T: Real>(memory: &mut [T], [failed, stopped]: [T::Mask; 2], dt: f64) -> T::Mask {
    let (second, one) = (runs(memory), T::lit(1.0));
    memory[RUN] += one;
    let over = T::or(failed, is_over(memory, stopped, dt));
    memory[DUE_TO_BEGIN] = T::masked(T::and(over, T::not(second)), one);
    // the adversary is asked what it makes of the second run
    let begins = T::and(second, memory[RUN].lt(T::lit(1.5)));
    memory[DUE] = T::select(begins, one, T::masked(T::not(over), memory[DUE]));
    begins
}

/// Ends the runner's run and has the reference begin, if it is to.
pub(super) fn restart(site: &mut Site, first: usize) -> bool {
    let memory = &mut site.memory[first..];
    let due = memory[DUE_TO_BEGIN] > 0.5;
    if due {
        (memory[SECOND], memory[DUE_TO_BEGIN], memory[WAY]) = (1.0, 0.0, memory[FARTHEST]);
        for slot in [AT, FARTHEST, MARK, SINCE, LIES, HIT, HURT, RUN] {
            memory[slot] = 0.0;
        }
        site.restart = true;
    }
    due
}
