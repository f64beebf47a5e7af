//! Falls lived again. Falls of an agent that falls once in ten minutes are too rare to learn from. So it keeps states that it has
//! been in, and a share of its later episodes start in one from before its last fall.

use marathon_physics::lanes::Real;

use crate::agent::{Senses, Start};

/// Time from one state that is kept to the next, s. The older of two is this long before a fall, or up to twice as long.
const APART: f64 = 0.75;

/// The variables for it of an agent.
#[derive(Clone, Copy, Debug)]
pub(super) struct Relive {
    /// The first of them.
    pub slot: usize,
    /// Share of the episodes.
    pub share: f64,
    /// Numbers of the configuration and of the velocity.
    pub joints: [usize; 2],
    /// How many of the configuration's are places along the ground, which is the same everywhere.
    pub places: usize,
    /// Another variable of the agent that belongs to a state.
    pub also: Option<usize>,
}

impl Relive {
    /// Number of all variables of an agent that has these behind its others; those alone without such episodes.
    pub fn memory(self) -> usize {
        self.slot + if self.share > 0.0 { 3 + 3 * self.state() } else { 0 }
    }

    /// Numbers of a state: angles and velocities of all joints, and the other variable.
    fn state(self) -> usize {
        self.joints[0] + self.joints[1] + usize::from(self.also.is_some())
    }

    /// Decisions since a state was kept, how many were kept in a row, and whether there is one from before a fall.
    const fn counts(self) -> [usize; 3] {
        [self.slot, self.slot + 1, self.slot + 2]
    }

    /// The state from before a fall, the newest and the one before.
    fn states(self) -> [usize; 3] {
        let first = self.slot + 3;
        [first, first + self.state(), first + 2 * self.state()]
    }

    /// The next episode may start in the state from before the last fall.
    pub fn carry(self, start: &mut Start) {
        if self.share > 0.0 {
            let ([.., has], [lived, ..]) = (self.counts(), self.states());
            start.memory[has] = start.previous[has];
            start.memory[lived..lived + self.state()].copy_from_slice(&start.previous[lived..lived + self.state()]);
        }
    }

    /// Starts there, some of the time.
    pub fn start(self, start: &mut Start) {
        let [.., has] = self.counts();
        if self.share == 0.0 || start.memory[has] == 0.0 || start.random.uniform(0.0, 1.0) >= self.share {
            return;
        }
        let [lived, ..] = self.states();
        let state = &start.previous[lived..lived + self.state()];
        let (qpos, rest) = state.split_at(self.joints[0]);
        let (qvel, also) = rest.split_at(self.joints[1]);
        start.qpos.copy_from_slice(qpos);
        start.qvel.copy_from_slice(qvel);
        start.qpos[..self.places].fill(0.0);
        for (slot, value) in self.also.into_iter().zip(also) {
            start.memory[slot] = *value;
        }
    }

    /// A decision has been made. `fate`, given the agent's variables, tells where it goes on, and where the decision has felled it: there
    /// it does not go on. Nobody asks without such episodes.
    #[inline(always)]
    pub fn remember<T: Real>(self, s: &Senses<T>, memory: &mut [T], fate: impl FnOnce(&[T]) -> [T::Mask; 2]) {
        if self.share == 0.0 {
            return;
        }
        let [goes, felled] = fate(memory);
        let ([since, kept, has], [lived, newest, older]) = (self.counts(), self.states());
        let one = T::lit(1.0);
        let felled = T::and(felled, T::lit(1.5).lt(memory[kept]));
        memory[has] = T::select(felled, one, memory[has]);
        let due = T::and(goes, T::lit(APART / s.dt() - 1.5).lt(memory[since]));
        memory[since] = T::masked(T::and(goes, T::not(due)), memory[since] + one);
        memory[kept] = T::masked(goes, memory[kept] + T::masked(due, one));
        let r = s.readings();
        let [qpos, qvel] = self.joints;
        for i in 0..self.state() {
            let now = match self.also {
                _ if i < qpos => r.qpos(i),
                _ if i < qpos + qvel => r.qvel(i - qpos),
                slot => slot.map_or(T::zero(), |slot| memory[slot]),
            };
            memory[lived + i] = T::select(felled, memory[older + i], memory[lived + i]);
            memory[older + i] = T::select(due, memory[newest + i], memory[older + i]);
            memory[newest + i] = T::select(due, now, memory[newest + i]);
        }
    }
}
