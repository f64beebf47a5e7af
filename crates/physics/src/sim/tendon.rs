//! Tendons: weighted sums of joint positions, and strings through sites, whose paths are in [`string`](super::string).

use super::limit::split;
use super::softness::{Softness, softness};
use super::string;
use super::weights::tendon_weight;
use crate::lanes::Real;
use crate::model::{Model, Tendon, TendonKind};
use std::ops::Range;

/// One joint's share of a length.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Term<C> {
    pub qpos: usize,
    pub dof: usize,
    pub coef: C,
}

/// A tendon.
#[derive(Clone, Debug)]
pub(crate) struct TendonSpec<C> {
    /// The sum of a fixed tendon.
    pub terms: Vec<Term<C>>,
    /// Degrees of freedom that move a string, and the place of their moment arms in
    /// [`Forces::tendon_moments`](crate::state::Forces::tendon_moments). Empty for a fixed tendon.
    pub dofs: Vec<usize>,
    pub moments: Range<usize>,
    /// Whether it is a string.
    pub spatial: bool,
    pub stiffness: C,
    /// The spring is slack between these lengths.
    pub slack: [C; 2],
    pub damping: C,
    /// Lower and upper limit, as sums of two numbers each.
    pub limit: Option<([C; 2], [C; 2], Softness<C>)>,
    pub friction: Option<(C, Softness<C>)>,
}

impl<C> TendonSpec<C> {
    /// The degrees of freedom and their moment arms, given those of all strings.
    #[inline(always)]
    pub fn arms<'a, T: Real<Scalar = C>>(&'a self, moments: &'a [T]) -> impl Iterator<Item = (usize, T)> + 'a
    where
        C: Copy,
    {
        let fixed = self.terms.iter().map(|t| (t.dof, T::splat(t.coef)));
        fixed.chain(self.dofs.iter().copied().zip(moments[self.moments.clone()].iter().copied()))
    }
}

/// Prepares the tendons.
pub(super) fn tendons<T: Real>(model: &Model) -> Vec<TendonSpec<T::Scalar>> {
    let c = T::scalar;
    let flags = &model.opt.flags;
    let mut count = 0;
    let mut spec = |(index, t): (usize, &Tendon)| {
        let dofs = string::dofs(model, &t.kind);
        let moments = count..count + dofs.len();
        count = moments.end;
        let terms: Vec<_> = match &t.kind {
            TendonKind::Fixed(terms) => terms
                .iter()
                .map(|(joint, coef)| {
                    let j = &model.joints[*joint];
                    Term { qpos: j.qpos_adr, dof: j.dof_adr, coef: c(*coef) }
                })
                .collect(),
            TendonKind::Spatial(_) => Vec::new(),
        };
        // a string that nothing moves has no rows
        let moves = !(terms.is_empty() && dofs.is_empty());
        let limited = moves && t.limited && flags.limit && flags.constraint;
        let rubs = moves && t.frictionloss > 0.0 && flags.frictionloss && flags.constraint;
        let weight = tendon_weight::<T>(model, [Some(index), None]);
        TendonSpec {
            terms,
            dofs,
            moments,
            spatial: matches!(t.kind, TendonKind::Spatial(_)),
            stiffness: c(if flags.spring { t.stiffness } else { 0.0 }),
            slack: t.spring_length.map(c),
            damping: c(if flags.damper { t.damping } else { 0.0 }),
            limit: limited.then(|| {
                let soft = softness::<T>(model, &t.solref_limit, &t.solimp_limit, t.margin, weight);
                (split::<T>(t.range[0]), split::<T>(t.range[1]), soft)
            }),
            friction: rubs.then(|| {
                let soft = softness::<T>(model, &t.solref_friction, &t.solimp_friction, 0.0, weight);
                (c(t.frictionloss), soft)
            }),
        }
    };
    model.tendons.iter().enumerate().map(&mut spec).collect()
}
