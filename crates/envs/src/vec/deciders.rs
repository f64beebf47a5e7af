//! Who decides next, where a task has several roles.

use super::vec_env::VecEnv;
use crate::error::EnvError;
use crate::shard::{BLOCK, BlockStep};

/// Who decides next in the blocks of a worker, and whose part has just ended.
pub(super) struct Deciders {
    roles: usize,
    /// `[block][role]`.
    turns: Vec<Turn>,
}

/// Agents of a block, a bit each, by what they ask of a role.
#[derive(Clone, Copy)]
struct Turn {
    /// It decides next.
    decides: u16,
    /// Its part has just ended before the episode: it has failed, or it has not.
    leaves: [u16; 2],
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

    fn of(&mut self, block: usize) -> &mut [Turn] {
        &mut self.turns[block * self.roles..][..self.roles]
    }
}

impl VecEnv {
    /// Writes for which agents a role decides next, `[agents]`. Roles are numbered as in
    /// [`Spec::deciders`](crate::Spec::deciders). Where an intermittent role does not decide, its last action is to be repeated.
    /// All roles decide at the start of an episode, and after [`VecEnv::load`] until the next step.
    ///
    /// # Errors
    /// If there is no such role, or the array's length is wrong.
    pub fn decides(&self, role: usize, out: &mut [bool]) -> Result<(), EnvError> {
        self.check("decides [agents]", out.len(), 1)?;
        self.ask(role, |turn| turn.decides, out)
    }

    /// Writes for which agents a role's part of the episode has ended with the last decision while others go on, `[agents]`: those in
    /// which it has failed, and those in which it has not, see [`Agent::leaves`](crate::Agent::leaves).
    ///
    /// # Errors
    /// The same.
    pub fn leaves(&self, role: usize, [failed, finished]: [&mut [bool]; 2]) -> Result<(), EnvError> {
        for (which, out) in [failed, finished].into_iter().enumerate() {
            self.check("leaves [agents]", out.len(), 1)?;
            self.ask(role, |turn| turn.leaves[which], out)?;
        }
        Ok(())
    }

    /// Writes a mask of a role for all agents.
    fn ask(&self, role: usize, mask: impl Fn(&Turn) -> u16, out: &mut [bool]) -> Result<(), EnvError> {
        let roles = self.spec.roles.len();
        if role >= roles.max(1) {
            let expected = "less than the number of roles";
            return Err(EnvError::Option { option: "role", found: role.to_string(), expected });
        }
        for (worker, rows) in self.workers.iter().zip(out.chunks_mut(self.stride)) {
            for (block, rows) in rows.chunks_mut(BLOCK).enumerate() {
                // who has it all is not in the list, and always decides
                let mask = mask(worker.deciders.turns.get(block * roles + role).unwrap_or(&Turn::START));
                rows.iter_mut().enumerate().for_each(|(i, bit)| *bit = mask >> i & 1 == 1);
            }
        }
        Ok(())
    }
}
