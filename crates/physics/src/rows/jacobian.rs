//! Row values of a block: motions of points of two bodies, or sums over joints.

use crate::algebra::spatial::*;
use crate::lanes::Real;

/// Definition of the row values.
#[derive(Clone, Debug)]
pub(crate) enum Jacobian<T: Real> {
    /// Motion of a point of the second side relative to one of the first: linear along `lin` (rows 0 to 2), angular
    /// along `ang` (rows 3 to 5).
    Points { sides: [Side<T>; 2], lin: [V3<T>; 3], ang: [V3<T>; 3] },
    /// One row: a weighted sum over degrees of freedom.
    Joints(Vec<(usize, T)>),
}

/// One side of a [`Jacobian::Points`].
#[derive(Clone, Debug)]
pub(crate) struct Side<T: Real> {
    /// The links that carry the point, each with its lanes. Empty for a static point.
    pub links: Vec<(usize, T::Mask)>,
    /// The point, relative to the reference point of the link's tree.
    pub r: V3<T>,
}
