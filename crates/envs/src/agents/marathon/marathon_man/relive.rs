//! Falls lived again. Falls of someone who falls once in ten minutes are too rare to learn from. So an agent keeps states that it has
//! been in, and a share of its later episodes start in one from before its last fall.

use marathon_physics::lanes::Real;

use super::body::{FIRST_QPOS, JOINTS};
use super::steer::PHASE;
use crate::agent::{Senses, Start};

/// Numbers of a state: angles and velocities of all joints, and the phase of the gait.
const QPOS: usize = FIRST_QPOS + JOINTS.len();
const QVEL: usize = QPOS - 1;
const STATE: usize = QPOS + QVEL + 1;
/// Decisions from one state that is kept to the next, 0.75 s. The older of two is this long before a fall, or up to twice as long.
const APART: f64 = 30.0;

/// The variables for it of an agent.
#[derive(Clone, Copy, Debug)]
pub(super) struct Relive {
    /// The first of them.
    pub slot: usize,
    /// Share of the episodes.
    pub share: f64,
}

impl Relive {
    /// How many variables there are; none without such episodes.
    pub fn slots(self) -> usize {
        if self.share > 0.0 { 3 + 3 * STATE } else { 0 }
    }

    /// Decisions since a state was kept, how many were kept in a row, and whether there is one from before a fall.
    const fn counts(self) -> [usize; 3] {
        [self.slot, self.slot + 1, self.slot + 2]
    }

    /// The state from before a fall, the newest and the one before.
    const fn states(self) -> [usize; 3] {
        let first = self.slot + 3;
        [first, first + STATE, first + 2 * STATE]
    }

    /// The next episode may start in the state from before the last fall.
    pub fn carry(self, start: &mut Start) {
        if self.share > 0.0 {
            let ([.., has], [lived, ..]) = (self.counts(), self.states());
            start.memory[has] = start.previous[has];
            start.memory[lived..lived + STATE].copy_from_slice(&start.previous[lived..lived + STATE]);
        }
    }

    /// Starts there, some of the time.
    pub fn start(self, start: &mut Start) {
        let [.., has] = self.counts();
        if self.share == 0.0 || start.memory[has] == 0.0 || start.random.uniform(0.0, 1.0) >= self.share {
            return;
        }
        let [lived, ..] = self.states();
        let state = &start.previous[lived..lived + STATE];
        start.qpos.copy_from_slice(&state[..QPOS]);
        start.qvel.copy_from_slice(&state[QPOS..QPOS + QVEL]);
        start.memory[PHASE] = state[STATE - 1];
        // the ground is the same everywhere
        start.qpos[..2].fill(0.0);
    }

    /// A decision has been made, after which he `goes`, or which has `felled` him: then he does not go.
    #[inline(always)]
    pub fn remember<T: Real>(self, s: &Senses<T>, memory: &mut [T], goes: T::Mask, felled: T::Mask) {
        if self.share == 0.0 {
            return;
        }
        let ([since, kept, has], [lived, newest, older]) = (self.counts(), self.states());
        let one = T::lit(1.0);
        let felled = T::and(felled, T::lit(1.5).lt(memory[kept]));
        memory[has] = T::select(felled, one, memory[has]);
        let due = T::and(goes, T::lit(APART - 1.5).lt(memory[since]));
        memory[since] = T::masked(T::and(goes, T::not(due)), memory[since] + one);
        memory[kept] = T::masked(goes, memory[kept] + T::masked(due, one));
        let r = s.readings();
        for i in 0..STATE {
            let now = match i {
                _ if i < QPOS => r.qpos(i),
                _ if i < QPOS + QVEL => r.qvel(i - QPOS),
                _ => memory[PHASE],
            };
            memory[lived + i] = T::select(felled, memory[older + i], memory[lived + i]);
            memory[older + i] = T::select(due, memory[newest + i], memory[older + i]);
            memory[newest + i] = T::select(due, now, memory[newest + i]);
        }
    }
}
