//! Blocks with fewer agents than lanes: 1, 2, 4 or 8.
//!
//! The unused lanes mirror the agents: lane `i` has the experience of agent `i % agents`, to the bit. Every agent then
//! has the same weight, so means over samples, gradients and statistics are those of the agents alone. Sums are
//! [scaled](crate::rollout::sums::BlockSums::scale) down to them. The cost is that of sixteen agents.

use crate::lanes::BLOCK;
use marathon_envs::BlockStep;

/// Repeats the mask of the agents.
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

/// Repeats the results of a decision.
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
