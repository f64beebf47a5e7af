//! From forces on links to forces on joints.

use crate::algebra::spatial::*;
use crate::lanes::Real;
use crate::sim::Sim;
use crate::state::DofWork;

/// Adds the effect of forces on links to the joints. Every joint carries everything above it. Accumulates the forces on
/// the way.
#[inline(always)]
pub(crate) fn joint_space<T: Real>(sim: &Sim<T>, dofs: &[DofWork<T>], links: &mut [V6<T>], joints: &mut [T]) {
    for (l, link) in sim.links.iter().enumerate().rev() {
        let f = links[l];
        for d in link.dofs.clone() {
            joints[d] += dot6(&dofs[d].axis, &f);
        }
        if let Some(p) = link.parent {
            for i in 0..6 {
                links[p][i] += f[i];
            }
        }
    }
}
