//! A contact of two links, as part of their fronts.

use crate::algebra::spatial::*;
use crate::lanes::Real;
use crate::rows::RowValues;

/// A contact of two links.
#[derive(Clone, Debug)]
pub(crate) struct Tie<S> {
    pub block: usize,
    /// The link that is eliminated first, the other one, and the place of the other in the front of the first.
    pub links: [usize; 2],
    pub slot: usize,
    /// The next contact of the same front.
    pub next: usize,
    pub dim: usize,
    /// Directions of the rows, and the points relative to the references of both links' trees.
    pub lin: [V3<S>; 3],
    pub ang: [V3<S>; 3],
    pub r: [V3<S>; 2],
    /// Sign of the force on each link.
    pub sign: [S; 2],
    /// Stiffness of the rows, and their force without any acceleration.
    pub w: [S; 21],
    pub force: RowValues<S>,
}

impl<S> Tie<S> {
    /// Sides of the blocks that a tie adds to its front, rows and columns. Of the blocks of both links, only the one
    /// above the diagonal is added. Two points of one link meet on the diagonal, which needs both.
    #[inline(always)]
    pub(super) fn blocks(&self) -> impl Iterator<Item = (usize, usize)> + use<S> {
        let both = self.slot == 0;
        [(0, 0), (0, 1), (1, 0), (1, 1)].into_iter().filter(move |sides| both || *sides != (1, 0))
    }
}

impl<S: Real> Tie<S> {
    /// Motion direction of row `k` as a wrench on a link, with its sign.
    #[inline(always)]
    pub(super) fn wrench(&self, side: usize, k: usize) -> V6<S> {
        let (z, sign) = (S::zero(), self.sign[side]);
        if k < 3 {
            let t = cross(&self.r[side], &self.lin[k]);
            let f = &self.lin[k];
            [sign * t[0], sign * t[1], sign * t[2], sign * f[0], sign * f[1], sign * f[2]]
        } else {
            let t = &self.ang[k - 3];
            [sign * t[0], sign * t[1], sign * t[2], z, z, z]
        }
    }

    /// Subtracts the force on both links from what their motion needs.
    #[inline(always)]
    pub fn exert(&self, forces: &mut [V6<S>]) {
        for side in 0..2 {
            let f = &mut forces[self.links[side]];
            let (mut force, mut torque) = ([S::zero(); 3], [S::zero(); 3]);
            for i in 0..3 {
                for k in 0..self.dim.min(3) {
                    force[i] = self.lin[k][i].mul_add(self.force[k], force[i]);
                }
                for k in 3..self.dim {
                    torque[i] = self.ang[k - 3][i].mul_add(self.force[k], torque[i]);
                }
            }
            let torque = cross_add(&self.r[side], &force, &torque);
            for i in 0..3 {
                f[i] = self.sign[side].neg_mul_add(torque[i], f[i]);
                f[3 + i] = self.sign[side].neg_mul_add(force[i], f[3 + i]);
            }
        }
    }
}
