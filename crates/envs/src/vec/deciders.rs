//! Who decides next, where a task has several roles.

use crate::shard::BlockStep;

/// Who decides next in the blocks of a worker, and whose part has just ended.
pub(super) struct Deciders {
    roles: usize,
    /// `[block][role]`.
    turns: Vec<Turn>,
}

/// Agents of a block, a bit each, by what they ask of a role.
#[derive(Clone, Copy)]
pub(super) struct Turn {
    /// It decides next.
    pub decides: u16,
    /// Its part has just ended before the episode: it has failed, or it has not.
    pub leaves: [u16; 2],
}

impl Turn {
    /// At the start of episodes, where all roles decide.
    const START: Turn = Turn { decides: !0, leaves: [0; 2] };
}

impl Deciders {
    /// Everybody, of so many roles; none where one has it all.
    pub fn new(roles: usize, blocks: usize) -> Self {
        Deciders { roles, turns: vec![Turn::START; roles * blocks] }
    }

    /// Takes note that agents begin an episode, at whose start all roles decide.
    pub fn begin(&mut self, block: usize, mask: u16) {
        for turn in self.of(block) {
            turn.decides |= mask;
            turn.leaves.iter_mut().for_each(|leaves| *leaves &= !mask);
        }
    }

    /// Takes note of a decision, in which episodes of the agents in `begun` have ended or begun.
    pub fn follow(&mut self, block: usize, out: &BlockStep, begun: u16) {
        for (role, turn) in self.of(block).iter_mut().enumerate() {
            turn.decides = out.deciding(role) | begun;
            turn.leaves = out.leaving(role).map(|leaves| leaves & !begun);
        }
    }

    /// Lets everybody decide, as nobody knows.
    pub fn forget(&mut self) {
        self.turns.fill(Turn::START);
    }

    /// What the agents of a block ask of a role. A task with a single role keeps no entry: that role acts at every step.
    pub fn turn(&self, block: usize, role: usize) -> &Turn {
        self.turns.get(block * self.roles + role).unwrap_or(&Turn::START)
    }

    fn of(&mut self, block: usize) -> &mut [Turn] {
        &mut self.turns[block * self.roles..][..self.roles]
    }
}
