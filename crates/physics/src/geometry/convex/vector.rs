//! Vectors of one agent, with every product and sum rounded on its own.
//!
//! MuJoCo's binaries have no fused multiply-adds. In aligned poses its branches depend on numbers that cancel exactly, and
//! a fused product would cancel them only up to rounding. Without fused operations these functions also need no
//! instruction set of their own: they are compiled once per precision, for all lane types.

use super::super::{Real, Rot, V3};

/// The number of one lane.
pub(crate) trait Number: Real<Scalar = Self> + PartialOrd {}
impl<S: Real<Scalar = S> + PartialOrd> Number for S {}

#[inline]
pub(super) fn dot<S: Number>(a: &V3<S>, b: &V3<S>) -> S {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline]
pub(super) fn cross<S: Number>(a: &V3<S>, b: &V3<S>) -> V3<S> {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[inline]
pub(super) fn add<S: Number>(a: &V3<S>, b: &V3<S>) -> V3<S> {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

#[inline]
pub(super) fn sub<S: Number>(a: &V3<S>, b: &V3<S>) -> V3<S> {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline]
pub(super) fn neg<S: Number>(a: &V3<S>) -> V3<S> {
    [-a[0], -a[1], -a[2]]
}

#[inline]
pub(super) fn scale<S: Number>(a: &V3<S>, s: S) -> V3<S> {
    [a[0] * s, a[1] * s, a[2] * s]
}

/// `a + s b`.
#[inline]
pub(super) fn along<S: Number>(a: &V3<S>, b: &V3<S>, s: S) -> V3<S> {
    [a[0] + b[0] * s, a[1] + b[1] * s, a[2] + b[2] * s]
}

#[inline]
pub(super) fn norm<S: Number>(a: &V3<S>) -> S {
    dot(a, a).sqrt()
}

/// A vector's direction, the x axis for a vector of (almost) no length.
#[inline]
pub(super) fn unit<S: Number>(a: &V3<S>) -> V3<S> {
    let length = norm(a);
    if length < S::lit(super::super::TINY) {
        return [S::lit(1.0), S::zero(), S::zero()];
    }
    scale(a, S::lit(1.0).div(length))
}

/// Point halfway between two.
#[inline]
pub(super) fn middle<S: Number>(a: &V3<S>, b: &V3<S>) -> V3<S> {
    scale(&add(a, b), S::lit(0.5))
}

/// A local vector in the outer frame.
#[inline]
pub(super) fn turn<S: Number>(axes: &Rot<S>, v: &V3<S>) -> V3<S> {
    [
        axes[0][0] * v[0] + axes[1][0] * v[1] + axes[2][0] * v[2],
        axes[0][1] * v[0] + axes[1][1] * v[1] + axes[2][1] * v[2],
        axes[0][2] * v[0] + axes[1][2] * v[1] + axes[2][2] * v[2],
    ]
}

/// A vector of the outer frame in the local one.
#[inline]
pub(super) fn into_local<S: Number>(axes: &Rot<S>, v: &V3<S>) -> V3<S> {
    [dot(&axes[0], v), dot(&axes[1], v), dot(&axes[2], v)]
}

/// Sum of points with weights.
#[inline]
pub(super) fn combine<S: Number, const N: usize>(points: [&V3<S>; N], weights: &[S]) -> V3<S> {
    let mut out = scale(points[0], weights[0]);
    for (p, w) in points.iter().zip(weights).skip(1) {
        out = along(&out, p, *w);
    }
    out
}
