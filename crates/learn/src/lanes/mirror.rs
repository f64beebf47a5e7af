//! Fewer agents than a block has lanes: 1, 2, 4 or 8.
//!
//! The lanes that are left over show what those of the agents show: lane `i` has the experience of agent `i % agents`, to the
//! bit. Every agent then counts as often as any other, so means over samples, and with them gradients and statistics, are
//! those of the agents alone; sums are [scaled](crate::rollout::sums::BlockSums::scale) down to them. It costs as much as sixteen agents.

use crate::lanes::BLOCK;
use marathon_envs::BlockStep;

/// The mask of the agents alone, repeated.
fn repeat(mask: u16, agents: usize) -> u16 {
    let own = mask & ((1 << agents) - 1);
    (0..BLOCK).step_by(agents).fold(0, |all, at| all | own << at)
}

/// Repeats the first lanes of every row of sixteen.
pub fn rows<S: Copy>(rows: &mut [S], agents: usize) {
    for row in rows.chunks_exact_mut(BLOCK) {
        for at in (agents..BLOCK).step_by(agents) {
            row.copy_within(..agents, at);
        }
    }
}

/// Repeats what a decision led to.
pub fn step(out: &mut BlockStep, obs: &mut [f32], agents: usize) {
    for row in [obs, &mut out.reward, &mut out.forward, &mut out.terms, &mut out.info] {
        rows(row, agents);
    }
    let BlockStep { terminated, truncated, diverged, decides, leaves, .. } = out;
    for mask in [terminated, truncated, diverged].into_iter().chain(decides).chain(leaves.iter_mut().flatten()) {
        *mask = repeat(*mask, agents);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lanes_repeat() {
        assert_eq!([1, 2, 4, 8].map(|n| repeat(0b1001_0110, n)), [0, 0xaaaa, 0x6666, 0x9696]);
        let mut row: Vec<usize> = (0..2 * BLOCK).collect();
        rows(&mut row, 4);
        assert_eq!(row[..BLOCK], [0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3]);
        assert_eq!(row[BLOCK..BLOCK + 6], [16, 17, 18, 19, 16, 17]);
    }
}
