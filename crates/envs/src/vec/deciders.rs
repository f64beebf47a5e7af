//! Tracks which roles act next, in a task with several roles.

use crate::shard::BlockStep;

/// Turns of the roles in the blocks of a worker.
pub(super) struct Deciders {
    roles: usize,
    /// `[block][role]`.
    turns: Vec<Turn>,
}

/// Turns of a role for the agents of a block, one bit each.
#[derive(Clone, Copy)]
pub(super) struct Turn {
    /// The role acts next.
    pub decides: u16,
    /// The role's part has ended before the episode: with failure and without.
    pub leaves: [u16; 2],
}

impl Turn {
    /// At the start of episodes, all roles act.
    const START: Turn = Turn { decides: !0, leaves: [0; 2] };
}

impl Deciders {
    /// All roles act. A task with a single role has no entries.
    pub fn new(roles: usize, blocks: usize) -> Self {
        Deciders { roles, turns: vec![Turn::START; roles * blocks] }
    }

    /// Records that agents begin an episode, at whose start all roles act.
    pub fn begin(&mut self, block: usize, mask: u16) {
        for turn in self.of(block) {
            turn.decides |= mask;
            turn.leaves.iter_mut().for_each(|leaves| *leaves &= !mask);
        }
    }

    /// Records a decision. `begun` masks the agents whose episode has ended or begun in it.
    pub fn follow(&mut self, block: usize, out: &BlockStep, begun: u16) {
        for (role, turn) in self.of(block).iter_mut().enumerate() {
            turn.decides = out.deciding(role) | begun;
            turn.leaves = out.leaving(role).map(|leaves| leaves & !begun);
        }
    }

    /// Makes all roles act, because their turns are unknown.
    pub fn forget(&mut self) {
        self.turns.fill(Turn::START);
    }

    /// Turns of a role in a block. A task with a single role keeps no entry: that role acts at every step.
    pub fn turn(&self, block: usize, role: usize) -> &Turn {
        self.turns.get(block * self.roles + role).unwrap_or(&Turn::START)
    }

    /// The turns of an agent of a block: a byte for each role, with bits for deciding and for the two ways of leaving.
    pub fn save(&self, block: usize, lane: usize) -> impl Iterator<Item = u8> {
        let bit = move |mask: u16, at: u8| ((mask >> lane & 1) as u8) << at;
        self.turns[block * self.roles..][..self.roles].iter().map(
            move |Turn { decides, leaves: [failed, finished] }| bit(*decides, 0) | bit(*failed, 1) | bit(*finished, 2),
        )
    }

    /// Restores the turns of an agent. `turns` has a byte for each role.
    pub fn load(&mut self, block: usize, lane: usize, turns: &[u8]) {
        for (turn, byte) in self.of(block).iter_mut().zip(turns) {
            let [failed, finished] = &mut turn.leaves;
            for (at, mask) in [&mut turn.decides, failed, finished].into_iter().enumerate() {
                *mask = *mask & !(1 << lane) | u16::from(byte >> at & 1) << lane;
            }
        }
    }

    fn of(&mut self, block: usize) -> &mut [Turn] {
        &mut self.turns[block * self.roles..][..self.roles]
    }
}
