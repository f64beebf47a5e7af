//! Clearances of pairs, kept from one evaluation of the forces to the next.
//!
//! Between evaluations geoms move by millimeters, and most pairs are much farther apart. A tested pair is skipped until
//! its two geoms together have moved as far as they were apart. This is conservative, so contacts are the same, to the
//! bit, as if every pair were tested every time.
//!
//! The clearances belong to one group of agents, see [`Work::continues`](super::Work::continues).

use crate::algebra::spatial::*;
use crate::lanes::Real;

/// Distance at which a pair counts as touching, as a fraction of its reach: far above the rounding of distances and
/// movements.
const SAFETY: f64 = 1e-3;

/// Clearances of all pairs. Movements and distances are relative to the tree that both geoms belong to.
#[derive(Clone, Debug)]
pub(crate) struct Clearances<T: Real> {
    /// Per geom: the longest movement of any of its points since the start, m.
    ways: Vec<T>,
    /// Per pair: sum of both geoms' movements up to which they cannot touch.
    safe: Vec<T>,
}

impl<T: Real> Clearances<T> {
    pub fn new(geoms: usize, pairs: usize) -> Self {
        Clearances { ways: vec![T::zero(); geoms], safe: vec![T::zero(); pairs] }
    }

    /// Clears everything.
    #[inline(always)]
    pub fn forget(&mut self) {
        self.ways.fill(T::zero());
        // no sum of movements is below this
        self.safe.fill(T::lit(-1.0));
    }

    /// Records that a geom's center moved by `shift` and its axis by `turn`. `half` is the half length of the geom
    /// along the axis. No point of a capsule moves farther than one of its ends.
    #[inline(always)]
    pub fn follow(&mut self, geom: usize, shift: &V3<T>, turn: &V3<T>, half: T) {
        let along = (half * dot(shift, turn)).abs();
        let square = (half * half).mul_add(dot(turn, turn), along.mul_add(T::lit(2.0), dot(shift, shift)));
        self.ways[geom] += square.sqrt();
    }

    /// Whether a pair is too far apart to touch, in all lanes.
    #[inline(always)]
    pub fn apart(&self, pair: usize, geoms: [usize; 2]) -> bool {
        // a NaN compares false
        T::all((self.ways[geoms[0]] + self.ways[geoms[1]]).lt(self.safe[pair]))
    }

    /// Records that a pair is `clearance` from touching, see [`clearance`].
    #[inline(always)]
    pub fn remember(&mut self, pair: usize, geoms: [usize; 2], clearance: T) {
        self.safe[pair] = self.ways[geoms[0]] + self.ways[geoms[1]] + clearance;
    }
}

/// Distance of a pair from touching, if `distance` is its distance beyond the margin. Negative if it may touch.
#[inline(always)]
pub(crate) fn clearance<T: Real>(distance: T, reach: T) -> T {
    reach.neg_mul_add(T::lit(SAFETY), distance)
}
