//! The cost of rows, and its increase along a segment. Differences are computed per zone, as in MuJoCo, so that they
//! stay accurate if two costs are nearly equal.

use super::block::{Block, RowValues, Source};
use super::cone::ConePoint;
use super::floor::FloorRow;
use super::joint::{DryRow, LimitRow};
use crate::lanes::Real;
use crate::sim::Cost;

/// The cost of a constraint at the current point and along a step from there. The step is stored instead of the Newton
/// point, because the difference of two close points would lose digits.
pub(crate) trait RowCost<T: Real> {
    /// Cost at the current point.
    fn cost(&self) -> T;
    /// Cost at a fraction of the step minus the cost at its start, and the first and second derivative there.
    fn along(&self, alpha: T) -> [T; 3];
}

/// Twice the increase in cost from `x` to `x + by`, for a row of unit stiffness that pushes below zero.
#[inline(always)]
fn push_rise<T: Real>(x: T, by: T) -> T {
    let zero = T::zero();
    let end = x + by;
    let (m0, m1) = (x.min(zero), end.min(zero));
    let both = T::and(x.lt(zero), end.lt(zero));
    T::select(both, by, m1 - m0) * (m0 + m1)
}

#[inline(always)]
fn push_cost<T: Real>(x: T) -> T {
    let m = x.min(T::zero());
    m * m
}

/// Cost of dry friction of stiffness `d` and force `loss`.
#[inline(always)]
fn dry_cost<T: Real>(d: T, loss: T, x: T) -> T {
    let half = T::lit(0.5);
    let below = (d * x).abs().lt(loss);
    let safe = d.max(T::lit(1e-30));
    T::select(below, half * d * x * x, loss * (x.abs() - half * loss.div(safe)))
}

#[inline(always)]
fn dry_rise<T: Real>(d: T, loss: T, x: T, by: T) -> T {
    let zero = T::zero();
    let end = x + by;
    let (below0, below1) = ((d * x).abs().lt(loss), (d * end).abs().lt(loss));
    let positive = T::and(zero.lt(x), zero.lt(end));
    let negative = T::and(x.lt(zero), end.lt(zero));
    let quadratic = T::lit(0.5) * d * by * (x + end);
    let linear = T::select(positive, loss * by, -(loss * by));
    let apart = dry_cost(d, loss, end) - dry_cost(d, loss, x);
    let neither = T::not(T::or(below0, below1));
    let other = T::select(T::and(neither, T::or(positive, negative)), linear, apart);
    T::select(T::and(below0, below1), quadratic, other)
}

impl<T: Real> RowCost<T> for FloorRow<T> {
    #[inline(always)]
    fn cost(&self) -> T {
        let mut sum = T::zero();
        for e in self.edges(&self.u) {
            sum += push_cost(e);
        }
        self.d * sum * T::lit(0.5)
    }

    #[inline(always)]
    fn along(&self, alpha: T) -> [T; 3] {
        let (e, de) = (self.edges(&self.u), self.edges(&self.next));
        let mut sum = T::zero();
        for k in 0..4 {
            sum += push_rise(e[k], de[k] * alpha);
        }
        let [slope, curvature] = self.slope_along(&self.next, alpha);
        [self.d * sum * T::lit(0.5), slope, curvature]
    }
}

impl<T: Real> RowCost<T> for LimitRow<T> {
    #[inline(always)]
    fn cost(&self) -> T {
        self.d * push_cost(self.u) * T::lit(0.5)
    }

    #[inline(always)]
    fn along(&self, alpha: T) -> [T; 3] {
        let rise = self.d * push_rise(self.u, self.next * alpha) * T::lit(0.5);
        let [slope, curvature] = self.slope_along(self.next, alpha);
        [rise, slope, curvature]
    }
}

impl<T: Real> RowCost<T> for DryRow<T> {
    #[inline(always)]
    fn cost(&self) -> T {
        dry_cost(self.d, T::splat(self.loss), self.u)
    }

    #[inline(always)]
    fn along(&self, alpha: T) -> [T; 3] {
        let rise = dry_rise(self.d, T::splat(self.loss), self.u, self.next * alpha);
        let [slope, curvature] = self.slope_along(self.next, alpha);
        [rise, slope, curvature]
    }
}

impl<T: Real> Block<T> {
    /// Twice the cost of full sticking, at `u`.
    #[inline(always)]
    fn flat_cost(&self, u: &RowValues<T>) -> T {
        let mut sum = T::zero();
        for k in 0..self.dim {
            sum = (self.d[k] * u[k]).mul_add(u[k], sum);
        }
        sum
    }

    /// The increase of [`Block::flat_cost`] from `u` to `u + by`.
    #[inline(always)]
    fn flat_rise(&self, u: &RowValues<T>, by: &RowValues<T>) -> T {
        let mut sum = T::zero();
        for k in 0..self.dim {
            sum = (self.d[k] * by[k]).mul_add(u[k] + (u[k] + by[k]), sum);
        }
        sum
    }

    /// Twice the cost of an elliptic cone.
    #[inline(always)]
    fn cone_cost(&self, cone: &ConePoint<T>, u: &RowValues<T>) -> T {
        let curved = cone.weight * cone.excess * cone.excess;
        T::select(cone.middle, curved, T::masked(cone.bottom, self.flat_cost(u)))
    }

    #[inline(always)]
    fn cone_rise(&self, by: &RowValues<T>) -> T {
        let mut u = self.u;
        for k in 0..self.dim {
            u[k] += by[k];
        }
        let (from, to) = (ConePoint::at(self, &self.u), ConePoint::at(self, &u));
        // on the curved part, use the difference of the squared sliding speeds
        let mut squares = T::zero();
        for k in 1..self.dim {
            let m = self.mu[k - 1];
            squares = (m * m * by[k]).mul_add(self.u[k] + u[k], squares);
        }
        let speeds = (from.sliding + to.sliding).max(T::lit(1e-30));
        let excess = self.slope * (by[0] - squares.div(speeds));
        let curved = from.weight * excess * (from.excess + (from.excess + excess));
        let apart = self.cone_cost(&to, &u) - self.cone_cost(&from, &self.u);
        let other = T::select(T::and(from.middle, to.middle), curved, apart);
        T::select(T::and(from.bottom, to.bottom), self.flat_rise(&self.u, by), other)
    }
}

impl<T: Real> RowCost<T> for Block<T> {
    #[inline(always)]
    fn cost(&self) -> T {
        // its cost is one of the masses
        if self.source == Source::TendonInertia {
            return T::zero();
        }
        let twice = match self.cost {
            Cost::Push => self.d[0] * push_cost(self.u[0]),
            Cost::Equal => self.flat_cost(&self.u),
            Cost::Dry => return T::masked(self.on, dry_cost(self.d[0], self.mu[0], self.u[0])),
            Cost::Pyramid => {
                let mut sum = T::zero();
                for e in 0..self.edges() {
                    sum += push_cost(self.edge(&self.u, e));
                }
                self.d[0] * sum
            }
            Cost::Elliptic => self.cone_cost(&ConePoint::at(self, &self.u), &self.u),
        };
        twice * T::lit(0.5)
    }

    #[inline(always)]
    fn along(&self, alpha: T) -> [T; 3] {
        if self.source == Source::TendonInertia {
            return [T::zero(); 3];
        }
        let (mut by, half) = ([T::zero(); 6], T::lit(0.5));
        for k in 0..self.dim {
            by[k] = self.next[k] * alpha;
        }
        let [slope, curvature] = self.slope_along(&self.next, alpha);
        let rise = match self.cost {
            Cost::Push => half * self.d[0] * push_rise(self.u[0], by[0]),
            Cost::Equal => half * self.flat_rise(&self.u, &by),
            Cost::Dry => T::masked(self.on, dry_rise(self.d[0], self.mu[0], self.u[0], by[0])),
            Cost::Pyramid => {
                let mut sum = T::zero();
                for e in 0..self.edges() {
                    sum += push_rise(self.edge(&self.u, e), self.edge(&by, e));
                }
                half * self.d[0] * sum
            }
            Cost::Elliptic => half * self.cone_rise(&by),
        };
        [rise, slope, curvature]
    }
}
