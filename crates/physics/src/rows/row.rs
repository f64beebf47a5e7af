//! The common interface of rows for the line search and the Newton iteration.

use crate::lanes::Real;

/// A constraint, as seen by the line search.
pub(crate) trait Row<T: Real> {
    /// Along the segment from the current point to the Newton point: the interpolated force at the start and at the
    /// end, and the true force at the start.
    fn ends(&self) -> [T; 3];
    /// First and second derivative of the row's cost at a fraction of the segment.
    fn slope(&self, alpha: T) -> [T; 2];
}

/// How far the lanes move towards the Newton point.
#[derive(Clone, Copy)]
pub(crate) struct NewtonStep<T: Real> {
    /// Lanes that do not move.
    pub done: T::Mask,
    /// Lanes that move to the Newton point.
    pub exact: T::Mask,
    /// Fraction of the segment for the other lanes.
    pub alpha: T,
    /// Lanes that are done after this step. They keep the system that they were solved with, regardless of other lanes.
    pub last: T::Mask,
}

impl<T: Real> NewtonStep<T> {
    /// The new point between `here` and `there`.
    #[inline(always)]
    pub fn of(&self, here: T, there: T) -> T {
        let moved = T::select(self.exact, there, self.alpha.mul_add(there - here, here));
        T::select(self.done, here, moved)
    }

    /// Lanes whose zones are updated.
    #[inline(always)]
    pub fn live(&self) -> T::Mask {
        T::not(T::or(self.done, self.last))
    }
}

/// `new` in the lanes `live`, `old` in the others.
#[inline(always)]
pub(crate) fn replace<T: Real>(live: T::Mask, new: T::Mask, old: T::Mask) -> T::Mask {
    T::or(T::and(live, new), T::and(T::not(live), old))
}

/// The previous row with a number, if there is one. Both come in ascending order, and `at` advances along the previous
/// rows.
#[inline(always)]
pub(crate) fn former<'a, R>(
    rows: &'a [R],
    at: &mut usize,
    number: usize,
    number_of: impl Fn(&R) -> usize,
) -> Option<&'a R> {
    while *at < rows.len() && number_of(&rows[*at]) < number {
        *at += 1;
    }
    if *at < rows.len() && number_of(&rows[*at]) == number { Some(&rows[*at]) } else { None }
}
