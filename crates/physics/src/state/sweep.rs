//! Memory of the broad phase.

use crate::algebra::spatial::V3;
use crate::lanes::Real;

/// Boxes of a group of agents, and the found pairs. The memory is reused from step to step.
#[derive(Clone, Debug)]
pub(crate) struct Sweep<S> {
    /// By geom and by group: least and largest coordinates.
    pub geoms: Vec<[V3<S>; 2]>,
    pub groups: Vec<[V3<S>; 2]>,
    /// Groups along the axis.
    pub order: Vec<usize>,
    /// Geoms of two groups that reach into the box of the other group.
    pub reaching: Vec<bool>,
    /// Indices of the pairs with overlapping boxes, ascending.
    pub found: Vec<u32>,
}

impl<S: Real> Sweep<S> {
    pub fn new(geoms: usize) -> Self {
        Sweep {
            geoms: vec![nowhere(); geoms],
            groups: Vec::new(),
            order: Vec::new(),
            reaching: vec![false; geoms],
            found: Vec::new(),
        }
    }
}

/// An empty box.
#[inline(always)]
pub(crate) fn nowhere<S: Real>() -> [V3<S>; 2] {
    [[S::lit(f64::INFINITY); 3], [S::lit(f64::NEG_INFINITY); 3]]
}
