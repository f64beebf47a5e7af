//! What all rows have in common: how the line search and the Newton iteration see them.

use crate::lanes::Real;

/// What the line search needs of a constraint.
pub(crate) trait Row<T: Real> {
    /// Along the way from the present point to the Newton point: the interpolated force at the start, the one at the
    /// end, and the true force at the start.
    fn ends(&self) -> [T; 3];
    /// First and second derivative of the row's cost at a fraction of the way.
    fn slope(&self, alpha: T) -> [T; 2];
}

/// How far the lanes go towards the Newton point.
#[derive(Clone, Copy)]
pub(crate) struct NewtonStep<T: Real> {
    /// Lanes that stay where they are.
    pub done: T::Mask,
    /// Lanes that go all the way.
    pub exact: T::Mask,
    /// Fraction of the way of the others.
    pub alpha: T,
    /// Lanes that will be done after this: they keep the system that they were solved with, whatever other lanes go on
    /// to do.
    pub last: T::Mask,
}

impl<T: Real> NewtonStep<T> {
    /// From `here` towards `there`.
    #[inline(always)]
    pub fn of(&self, here: T, there: T) -> T {
        let moved = T::select(self.exact, there, self.alpha.mul_add(there - here, here));
        T::select(self.done, here, moved)
    }

    /// Lanes whose zones follow them.
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

/// The former row with a number, if there is one; both come in ascending order, and `at` walks along the former.
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
