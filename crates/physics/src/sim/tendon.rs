//! Fixed tendons: weighted sums of joint positions.

use super::limit::split;
use super::softness::{Softness, softness};
use crate::lanes::Real;
use crate::model::{Model, Tendon, TendonKind};

/// One joint's share of a length.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Term<C> {
    pub qpos: usize,
    pub dof: usize,
    pub coef: C,
}

/// A fixed tendon: a weighted sum of joint positions.
#[derive(Clone, Debug)]
pub(crate) struct TendonSpec<C> {
    pub terms: Vec<Term<C>>,
    pub stiffness: C,
    /// The spring is slack between these lengths.
    pub slack: [C; 2],
    pub damping: C,
    /// Lower and upper limit, as sums of two numbers each.
    pub limit: Option<([C; 2], [C; 2], Softness<C>)>,
    pub friction: Option<(C, Softness<C>)>,
}

/// Prepares the tendons.
pub(super) fn tendons<T: Real>(model: &Model) -> Vec<TendonSpec<T::Scalar>> {
    let c = T::scalar;
    let flags = &model.opt.flags;
    let spec = |t: &Tendon| {
        let terms = match &t.kind {
            TendonKind::Fixed(terms) => terms
                .iter()
                .map(|(joint, coef)| {
                    let j = &model.joints[*joint];
                    Term { qpos: j.qpos_adr, dof: j.dof_adr, coef: c(*coef) }
                })
                .collect(),
            TendonKind::Spatial => Vec::new(),
        };
        let limited = t.limited && flags.limit && flags.constraint;
        let rubs = t.frictionloss > 0.0 && flags.frictionloss && flags.constraint;
        TendonSpec {
            terms,
            stiffness: c(if flags.spring { t.stiffness } else { 0.0 }),
            slack: t.spring_length.map(c),
            damping: c(if flags.damper { t.damping } else { 0.0 }),
            limit: limited.then(|| {
                let soft = softness::<T>(model, &t.solref_limit, &t.solimp_limit, t.margin, t.invweight0);
                (split::<T>(t.range[0]), split::<T>(t.range[1]), soft)
            }),
            friction: rubs.then(|| {
                let soft = softness::<T>(model, &t.solref_friction, &t.solimp_friction, 0.0, t.invweight0);
                (c(t.frictionloss), soft)
            }),
        }
    };
    model.tendons.iter().map(spec).collect()
}
