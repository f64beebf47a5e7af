//! Limits of joints, and dry friction.

use super::softness::{Softness, softness};
use crate::lanes::Real;
use crate::model::{JointType, Model};

/// A joint limit.
#[derive(Clone, Debug)]
pub(crate) struct LimitSpec<C> {
    pub qpos: usize,
    pub dof: usize,
    /// Link of the degree of freedom.
    pub link: usize,
    /// Limits as sums of two numbers each. The rounding error of a limit would be large relative to a small violation.
    pub low: [C; 2],
    pub high: [C; 2],
    /// Whether both sides can be violated at once: two rows instead of one.
    pub two_sided: bool,
    pub soft: Softness<C>,
}

/// Dry friction of a degree of freedom.
#[derive(Clone, Debug)]
pub(crate) struct DryFriction<C> {
    pub dof: usize,
    /// Link of the degree of freedom.
    pub link: usize,
    pub loss: C,
    pub soft: Softness<C>,
}

/// The limit of a ball joint: the largest angle from the reference.
#[derive(Clone, Debug)]
pub(crate) struct BallLimit<C> {
    pub qpos: usize,
    pub dof: usize,
    pub range: C,
    pub soft: Softness<C>,
}

/// Prepares the limits of hinges and slides.
pub(super) fn limits<T: Real>(model: &Model, dof_link: &[usize]) -> Vec<LimitSpec<T::Scalar>> {
    let on = model.opt.flags.limit && model.opt.flags.constraint;
    let limited = model.joints.iter().filter(|j| on && j.limited && j.kind != JointType::Ball);
    limited
        .map(|j| LimitSpec {
            qpos: j.qpos_adr,
            dof: j.dof_adr,
            link: dof_link[j.dof_adr],
            low: split::<T>(j.range[0]),
            high: split::<T>(j.range[1]),
            two_sided: j.range[1] - j.range[0] <= 2.0 * j.margin,
            soft: softness::<T>(model, &j.solref_limit, &j.solimp_limit, j.margin, model.dofs[j.dof_adr].invweight0),
        })
        .collect()
}

/// Prepares the limits of ball joints.
pub(super) fn ball_limits<T: Real>(model: &Model) -> Vec<BallLimit<T::Scalar>> {
    let on = model.opt.flags.limit && model.opt.flags.constraint;
    let limited = model.joints.iter().filter(|j| on && j.limited && j.kind == JointType::Ball);
    limited
        .map(|j| BallLimit {
            qpos: j.qpos_adr,
            dof: j.dof_adr,
            range: T::scalar(j.range[0].max(j.range[1])),
            soft: softness::<T>(model, &j.solref_limit, &j.solimp_limit, j.margin, model.dofs[j.dof_adr].invweight0),
        })
        .collect()
}

/// Prepares the dry friction of the degrees of freedom.
pub(super) fn dry_friction<T: Real>(model: &Model, dof_link: &[usize]) -> Vec<DryFriction<T::Scalar>> {
    let on = model.opt.flags.frictionloss && model.opt.flags.constraint;
    let rubbing = model.dofs.iter().enumerate().filter(|(_, d)| on && d.frictionloss > 0.0);
    rubbing
        .map(|(dof, d)| DryFriction {
            dof,
            link: dof_link[dof],
            loss: T::scalar(d.frictionloss),
            soft: softness::<T>(model, &d.solref_friction, &d.solimp_friction, 0.0, d.invweight0),
        })
        .collect()
}

/// A number as the sum of its rounded value and the remainder.
pub(crate) fn split<T: Real>(x: f64) -> [T::Scalar; 2] {
    let rounded = T::scalar(x);
    [rounded, T::scalar(x - T::widen(rounded))]
}
