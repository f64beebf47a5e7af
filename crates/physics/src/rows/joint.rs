//! Rows of single degrees of freedom: joint limits and dry friction. They add to the diagonal.

use super::row::{NewtonStep, Row, replace};
use crate::lanes::Real;

/// A joint limit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LimitRow<T: Real> {
    pub dof: usize,
    /// Link of the degree of freedom.
    pub link: usize,
    /// Index among all limits, in ascending order.
    pub number: usize,
    /// +1 at the lower limit, -1 at the upper.
    pub sign: T,
    pub d: T,
    pub u0: T,
    pub u: T,
    pub next: T,
    pub force: T,
    pub active: T::Mask,
    pub on: T::Mask,
    /// Lanes whose active set comes from the previous evaluation.
    pub recalled: T::Mask,
}

/// Dry friction of a joint: a force of bounded size.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DryRow<T: Real> {
    pub dof: usize,
    /// Link of the degree of freedom.
    pub link: usize,
    pub loss: T::Scalar,
    pub d: T,
    pub u0: T,
    pub u: T,
    pub next: T,
    pub force: T,
    /// Whether the force is below its bound.
    pub sticking: T::Mask,
    /// Sign of `u`, if the force is at its bound.
    pub positive: T::Mask,
    /// Whether the zone comes from the previous evaluation.
    pub recalled: bool,
}

impl<T: Real> LimitRow<T> {
    /// Force at `u` with the current active set.
    #[inline(always)]
    fn linear(&self, u: T) -> T {
        -(T::masked(self.active, self.d) * u)
    }

    /// Force at `u`.
    #[inline(always)]
    pub fn true_force(&self, u: T) -> T {
        -(self.d * u.min(T::zero()))
    }

    /// Sets whether the limit pushes at `u` in the lanes `live`. Returns the lanes with a change.
    #[inline(always)]
    pub fn activate(&mut self, live: T::Mask) -> T::Mask {
        let active = replace::<T>(live, T::and(self.u.lt(T::zero()), self.on), self.active);
        let changed = T::xor(active, self.active);
        self.active = active;
        changed
    }

    #[inline(always)]
    pub fn newton_point(&mut self, acc: T) -> T::Mask {
        self.next = self.sign.mul_add(acc, self.u0);
        T::xor(T::and(self.next.lt(T::zero()), self.on), self.active)
    }

    #[inline(always)]
    pub fn advance(&mut self, step: &NewtonStep<T>) -> T::Mask {
        let linear = self.linear(self.next);
        self.u = step.of(self.u, self.next);
        self.force = step.of(self.force, linear);
        self.activate(step.live())
    }
}

impl<T: Real> LimitRow<T> {
    /// First and second derivative of the cost at the fraction `alpha` of the step `du`.
    #[inline(always)]
    pub(super) fn slope_along(&self, du: T, alpha: T) -> [T; 2] {
        let u = du.mul_add(alpha, self.u);
        let pushing = T::masked(u.lt(T::zero()), self.d * du);
        [pushing * u, pushing * du]
    }
}

impl<T: Real> Row<T> for LimitRow<T> {
    #[inline(always)]
    fn ends(&self) -> [T; 3] {
        let du = self.next - self.u;
        [du * self.force, du * self.linear(self.next), du * self.true_force(self.u)]
    }

    #[inline(always)]
    fn slope(&self, alpha: T) -> [T; 2] {
        self.slope_along(self.next - self.u, alpha)
    }
}

impl<T: Real> DryRow<T> {
    /// Zone at `u`: below the bound, and the sign of `u`.
    #[inline(always)]
    fn zone(&self, u: T) -> (T::Mask, T::Mask) {
        ((self.d * u).abs().lt(T::splat(self.loss)), T::zero().lt(u))
    }

    /// Force at `u`.
    #[inline(always)]
    pub fn true_force(&self, u: T) -> T {
        let bound = T::splat(self.loss);
        -((self.d * u).max(-bound).min(bound))
    }

    /// Force at `u` in the linear model of the current zone.
    #[inline(always)]
    pub fn linear(&self, u: T) -> T {
        let bound = T::splat(self.loss);
        T::select(self.sticking, -(self.d * u), T::select(self.positive, -bound, bound))
    }

    /// Sets the zone at `u` in the lanes `live`. Returns the lanes with a change.
    #[inline(always)]
    pub fn activate(&mut self, live: T::Mask) -> T::Mask {
        let (sticking, positive) = self.zone(self.u);
        let sticking = replace::<T>(live, sticking, self.sticking);
        let positive = replace::<T>(live, positive, self.positive);
        let changed = T::or(T::xor(sticking, self.sticking), T::xor(positive, self.positive));
        (self.sticking, self.positive) = (sticking, positive);
        changed
    }

    #[inline(always)]
    pub fn newton_point(&mut self, acc: T) -> T::Mask {
        self.next = acc + self.u0;
        let (sticking, positive) = self.zone(self.next);
        let sliding_differs = T::and(T::not(sticking), T::xor(positive, self.positive));
        T::or(T::xor(sticking, self.sticking), sliding_differs)
    }

    #[inline(always)]
    pub fn advance(&mut self, step: &NewtonStep<T>) -> T::Mask {
        let linear = self.linear(self.next);
        self.u = step.of(self.u, self.next);
        self.force = step.of(self.force, linear);
        self.activate(step.live())
    }
}

impl<T: Real> DryRow<T> {
    /// First and second derivative of the cost at the fraction `alpha` of the step `du`.
    #[inline(always)]
    pub(super) fn slope_along(&self, du: T, alpha: T) -> [T; 2] {
        let u = du.mul_add(alpha, self.u);
        let (sticking, _) = self.zone(u);
        [-(du * self.true_force(u)), T::masked(sticking, self.d * du) * du]
    }
}

impl<T: Real> Row<T> for DryRow<T> {
    #[inline(always)]
    fn ends(&self) -> [T; 3] {
        let du = self.next - self.u;
        [du * self.force, du * self.linear(self.next), du * self.true_force(self.u)]
    }

    #[inline(always)]
    fn slope(&self, alpha: T) -> [T; 2] {
        self.slope_along(self.next - self.u, alpha)
    }
}
