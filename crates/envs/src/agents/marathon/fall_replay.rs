//! Replay of falls in training. An agent that falls once in ten minutes sees too few falls to learn from them. The
//! agent therefore stores earlier states of its episode. After a fall, a fraction of its episodes starts from a state
//! that was stored before it.

use marathon_physics::lanes::Real;

use crate::agent::{Senses, Start};

/// Time between two stored states, s. The older one is 0.75 to 1.5 s old when the character falls.
const APART: f64 = 0.75;

/// The memory slots that hold the stored states of an agent.
#[derive(Clone, Copy, Debug)]
pub(super) struct FallReplay {
    /// The first slot.
    pub slot: usize,
    /// Fraction of the episodes that start before the last fall.
    pub share: f64,
    /// Sizes of `qpos` and `qvel`.
    pub joints: [usize; 2],
    /// How many leading entries of `qpos` are positions along the ground. They are set to 0 at a start, because flat
    /// ground is the same everywhere.
    pub places: usize,
    /// Another slot of the agent that belongs to the state.
    pub also: Option<usize>,
}

impl FallReplay {
    /// Memory size of an agent whose last slots are these. If no falls are replayed, only the slots before them count.
    pub fn memory(self) -> usize {
        self.slot + if self.share > 0.0 { 3 + 3 * self.state() } else { 0 }
    }

    /// Size of a stored state: `qpos`, `qvel` and the other slot.
    fn state(self) -> usize {
        self.joints[0] + self.joints[1] + usize::from(self.also.is_some())
    }

    /// Slots of three numbers: decisions since the last stored state, states stored in a row, and whether a state from
    /// before a fall exists.
    const fn counts(self) -> [usize; 3] {
        [self.slot, self.slot + 1, self.slot + 2]
    }

    /// First slots of three states: the one from before a fall, the newest one and the one before it.
    fn states(self) -> [usize; 3] {
        let first = self.slot + 3;
        [first, first + self.state(), first + 2 * self.state()]
    }

    /// Keeps the state from before the last fall for the next episode.
    pub fn carry(self, start: &mut Start) {
        if self.share > 0.0 {
            let ([.., has], [lived, ..]) = (self.counts(), self.states());
            start.memory[has] = start.previous[has];
            start.memory[lived..lived + self.state()].copy_from_slice(&start.previous[lived..lived + self.state()]);
        }
    }

    /// Starts a fraction of the episodes from that state.
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

    /// Stores states after a decision. `fate` takes the agent's memory and returns two masks: lanes in which the
    /// character can continue, and lanes in which this decision made it fall. `fate` is not called if no falls are
    /// replayed.
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
