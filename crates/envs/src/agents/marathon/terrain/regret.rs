//! Regret against a reference runner (PAIRED: Dennis and others, "Emergent complexity and zero-shot transfer via unsupervised
//! environment design", 2020): a third role runs over the ground that the adversary has built for the first one.
//!
//! An episode is two runs. In the first, the runner runs and the adversary builds. When it is over, the body goes back to the
//! start, and the reference has the motors: its run is over when the runner's would be, or where the built ground ends. The
//! adversary earns what the reference earns, less what the runner has earned. So ground that nobody can pass is worth no more
//! to it than level ground.

use marathon_physics::lanes::Real;

use super::course::LEVEL_TO;
use super::{AT, BUILT, DUE, FARTHEST, FIRST_OF_RUN, HIT, HURT, LIES, MARK, PHASE, RESTART, RUN, SINCE, WAY};
use crate::agent::Site;

/// Name of the role, and of what it earns; what the names of its actuators begin with.
pub(super) const REFERENCE: &str = "reference";
/// What the adversary earns.
pub(super) const REGRET: &str = "regret";
/// Longest run, s.
const LONGEST: f64 = 10.0;

/// Lanes in which the reference runs. `memory`: the course's variables.
#[inline(always)]
pub(super) fn runs<T: Real>(memory: &[T]) -> T::Mask {
    T::lit(0.5).lt(memory[PHASE])
}

/// Lanes in which the present run is over though nobody has fallen. `stopped`: those in which any run would be.
#[inline(always)]
pub(super) fn is_over<T: Real>(memory: &[T], stopped: T::Mask, dt: f64) -> T::Mask {
    let late = T::lit(LONGEST / dt - 0.5).lt(memory[RUN]);
    let beyond = (memory[BUILT] + T::lit(LEVEL_TO)).lt(memory[AT]);
    T::or(stopped, T::or(late, T::and(runs(memory), beyond)))
}

/// Takes note of a decision of the present run, which is `over` with it in some lanes.
#[inline(always)]
pub(super) fn remember<T: Real>(memory: &mut [T], over: T::Mask) {
    let (second, one) = (runs(memory), T::lit(1.0));
    memory[RESTART] = T::masked(T::and(over, T::not(second)), one);
    // the adversary is asked what it makes of the second run
    let begins = T::and(second, memory[RUN].lt(T::lit(1.5)));
    memory[FIRST_OF_RUN] = T::masked(begins, one);
    memory[DUE] = T::select(begins, one, T::masked(T::not(over), memory[DUE]));
}

/// Ends the runner's run, and has the reference begin.
pub(super) fn restart(site: &mut Site, first: usize) {
    let memory = &mut site.memory[first..];
    (memory[PHASE], memory[RESTART], memory[WAY]) = (1.0, 0.0, memory[FARTHEST]);
    for slot in [AT, FARTHEST, MARK, SINCE, LIES, HIT, HURT, RUN] {
        memory[slot] = 0.0;
    }
    site.restart = true;
}
