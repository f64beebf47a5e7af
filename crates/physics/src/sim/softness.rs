//! Softness of a constraint: the shape of its cost, and its impedance, which sets the stiffness at a given violation
//! (MuJoCo documentation, "Solver parameters").

use crate::lanes::Real;
use crate::model::Model;

/// Dependence of a block's cost on its row values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Cost {
    /// One row that pushes while its value is negative.
    Push,
    /// A friction pyramid: edges `u[0] +- mu[j] u[j + 1]` that push while negative.
    Pyramid,
    /// An elliptic friction cone.
    Elliptic,
    /// Every row pulls and pushes.
    Equal,
    /// One row whose force is bounded: dry friction.
    Dry,
}

/// Solver parameters of one constraint: impedance and reference acceleration as functions of the violation.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Softness<C> {
    /// Stiffness and damping of the reference acceleration, divided by `dmax` as MuJoCo does.
    pub k: C,
    pub b: C,
    pub d0: C,
    pub span: C,
    pub inv_width: C,
    pub midpoint: C,
    pub power: C,
    /// Normalizations of the two halves of the power curve.
    pub low_scale: C,
    pub high_scale: C,
    /// Whether `power` is 2 and the midpoint 1/2: the default, which needs no exponential.
    pub quadratic: bool,
    /// Distance from which the violation is measured.
    pub margin: C,
    /// Approximate inverse inertia for the constraint.
    pub diag: C,
}

/// Constants of MuJoCo's impedance and reference acceleration.
pub(crate) fn softness<T: Real>(
    model: &Model,
    solref: &[f64; 2],
    solimp: &[f64; 5],
    margin: f64,
    diag: f64,
) -> Softness<T::Scalar> {
    let c = T::scalar;
    let (min, max) = (1e-4, 0.9999);
    let (dmin, dmax) = (solimp[0].clamp(min, max), solimp[1].clamp(min, max));
    let width = solimp[2].max(0.0);
    let (midpoint, power) = (solimp[3].clamp(min, max), solimp[4].max(1.0));
    let (k, b) = if solref[0] > 0.0 && solref[1] > 0.0 {
        let floor = if model.opt.flags.refsafe { 2.0 * model.opt.timestep } else { 0.0 };
        let time = solref[0].max(floor);
        let ratio = solref[1];
        (1.0 / (dmax * dmax * time * time * ratio * ratio).max(1e-15), 2.0 / (dmax * time).max(1e-15))
    } else {
        (-solref[0] / (dmax * dmax), -solref[1] / dmax)
    };
    // a flat curve is the mean impedance everywhere
    let flat = dmin == dmax || width <= 1e-15;
    let (d0, span) = if flat { (0.5 * (dmin + dmax), 0.0) } else { (dmin, dmax - dmin) };
    Softness {
        k: c(k),
        b: c(b),
        d0: c(d0),
        span: c(span),
        inv_width: c(1.0 / width.max(1e-15)),
        midpoint: c(midpoint),
        power: c(power),
        low_scale: c(1.0 / libm::pow(midpoint, power - 1.0)),
        high_scale: c(1.0 / libm::pow(1.0 - midpoint, power - 1.0)),
        quadratic: power == 2.0 && midpoint == 0.5,
        margin: c(margin),
        diag: c(diag.max(1e-15)),
    }
}

/// Impedance at a violation (distance minus margin).
#[inline(always)]
pub(crate) fn impedance_at<T: Real>(soft: &Softness<T::Scalar>, violation: T) -> T {
    let one = T::lit(1.0);
    let x = (violation.abs() * T::splat(soft.inv_width)).min(one);
    let rest = one - x;
    let (low, high, mid) = if soft.quadratic {
        ((x * x) * T::lit(2.0), (rest * rest).neg_mul_add(T::lit(2.0), one), T::lit(0.5))
    } else {
        let p = T::splat(soft.power);
        let low = power(x, p) * T::splat(soft.low_scale);
        let high = power(rest, p).neg_mul_add(T::splat(soft.high_scale), one);
        (low, high, T::splat(soft.midpoint))
    };
    let y = T::select(x.lt(mid), low, high);
    y.mul_add(T::splat(soft.span), T::splat(soft.d0))
}

/// Impedance at a violation, and the row's stiffness `1 / R`.
#[inline(always)]
pub(crate) fn impedance<T: Real>(soft: &Softness<T::Scalar>, violation: T) -> (T, T) {
    let imp = impedance_at(soft, violation);
    (imp, imp.div((T::lit(1.0) - imp) * T::splat(soft.diag)))
}

/// `x^p` for 0 <= x <= 1, p >= 1.
#[inline(always)]
fn power<T: Real>(x: T, p: T) -> T {
    let tiny = T::lit(1e-30);
    T::masked(tiny.lt(x), (x.max(tiny).ln() * p).exp())
}
