//! Scratch numbers of the articulated-body recursion, one record per degree of freedom.

use crate::algebra::spatial::V6;
use crate::lanes::Real;

/// Scratch numbers of the recursion for a degree of freedom. It is one record, because its loops use most of it together.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DofWork<T: Real> {
    /// Motion axis.
    pub axis: V6<T>,
    /// Term added to the diagonal of the mass matrix: armature, limit stiffness, implicit damping.
    pub diag: T,
    /// Joint force of the current right-hand side.
    pub rhs: T,
    /// Articulated momentum times the inverse pivot, and the inverse pivot.
    pub gain: V6<T>,
    pub pivot: T,
    /// Acceleration if the link's parent did not accelerate.
    pub drive: T,
    /// The same before the coupled blocks' correction.
    pub tree_drive: T,
}

impl<T: Real> DofWork<T> {
    pub fn new() -> Self {
        let z = T::zero();
        DofWork { axis: [z; 6], diag: z, rhs: z, gain: [z; 6], pivot: z, drive: z, tree_drive: z }
    }
}
