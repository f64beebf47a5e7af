//! Regret against a reference runner (PAIRED: Dennis et al., "Emergent complexity and zero-shot transfer via
//! unsupervised environment design", 2020). A third role runs on the ground that the adversary has built for the first
//! one.
//!
//! An episode is two runs. In the first, the runner runs and the adversary builds. Then the body returns to the start,
//! and the reference controls the motors. Its run ends under the same conditions as the runner's, or where the built
//! ground ends.
//!
//! The adversary earns the reference's reward minus the runner's. Impassable ground therefore earns it no more than
//! level ground.

use marathon_physics::lanes::Real;

use super::profile::LEVEL_TO;
use super::{AT, BUILT, DUE, FARTHEST, HIT, HURT, LIES, MARK, SINCE};
use crate::agent::Site;

/// Slots of the memory, after those of every course: whether the reference runs.
pub(super) const SECOND: usize = super::MEMORY;
/// Slot of whether the reference has to begin.
const DUE_TO_BEGIN: usize = SECOND + 1;
/// Slot of the decisions of the present run.
const RUN: usize = SECOND + 2;
/// Slot of the runner's distance, m.
const WAY: usize = SECOND + 3;
pub(super) const MEMORY: usize = SECOND + 4;

/// Name of the role and of its term. It also is the prefix of its actuators' names.
pub(super) const REFERENCE: &str = "reference";
/// Term of the adversary's reward.
pub(super) const REGRET: &str = "regret";
/// Longest run, s.
const LONGEST: f64 = 10.0;

/// Lanes in which the reference runs. `memory` holds the course's slots, here and below.
#[inline(always)]
pub(super) fn runs<T: Real>(memory: &[T]) -> T::Mask {
    T::lit(0.5).lt(memory[SECOND])
}

/// Lanes in which the reference has to begin.
#[inline(always)]
pub(super) fn is_due<T: Real>(memory: &[T]) -> T::Mask {
    T::lit(0.5).lt(memory[DUE_TO_BEGIN])
}

/// The runner's distance, m.
#[inline(always)]
pub(super) fn way<T: Real>(memory: &[T]) -> T {
    T::select(runs(memory), memory[WAY], memory[FARTHEST])
}

/// The runner's distance in an episode that ended with this memory, if the reference has run in it.
pub(super) fn way_of_runner(memory: &[f64]) -> Option<f64> {
    memory.get(SECOND).filter(|second| **second > 0.5).map(|_| memory[WAY])
}

/// Lanes in which the present run is over without a fall. `stopped` masks those in which any run would be over.
#[inline(always)]
pub(super) fn is_over<T: Real>(memory: &[T], stopped: T::Mask, dt: f64) -> T::Mask {
    let late = T::lit(LONGEST / dt - 0.5).lt(memory[RUN]);
    let beyond = (memory[BUILT] + T::lit(LEVEL_TO)).lt(memory[AT]);
    T::or(stopped, T::or(late, T::and(runs(memory), beyond)))
}

/// Updates the memory after a decision of the present run. `failed` and `stopped` mask the lanes in which it failed or
/// stopped. Returns the lanes of the reference's first decision.
#[inline(always)]
pub(super) fn remember<T: Real>(memory: &mut [T], [failed, stopped]: [T::Mask; 2], dt: f64) -> T::Mask {
    let (second, one) = (runs(memory), T::lit(1.0));
    memory[RUN] += one;
    let over = T::or(failed, is_over(memory, stopped, dt));
    memory[DUE_TO_BEGIN] = T::masked(T::and(over, T::not(second)), one);
    // the adversary acts once more at the start of the second run
    let begins = T::and(second, memory[RUN].lt(T::lit(1.5)));
    memory[DUE] = T::select(begins, one, T::masked(T::not(over), memory[DUE]));
    begins
}

/// Ends the runner's run and starts the reference's, if it is due.
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
