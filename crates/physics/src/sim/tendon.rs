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
    /// Inertia of its velocity, and the parts of its arms that it couples: each part is on one path to the root.
    pub armature: C,
    pub chains: Vec<Vec<usize>>,
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

    /// One of these.
    #[inline(always)]
    pub fn arm<T: Real<Scalar = C>>(&self, place: usize, moments: &[T]) -> (usize, T)
    where
        C: Copy,
    {
        match self.terms.get(place) {
            Some(t) => (t.dof, T::splat(t.coef)),
            None => (self.dofs[place], moments[self.moments.start + place]),
        }
    }

    /// Whether it has inertia.
    #[inline(always)]
    pub fn is_heavy(&self) -> bool {
        !self.chains.is_empty()
    }
}

/// The degrees of freedom that a tendon pulls, in the order of its arms.
pub(super) fn dofs(model: &Model, kind: &TendonKind) -> Vec<usize> {
    match kind {
        TendonKind::Fixed(terms) => terms.iter().map(|(joint, _)| model.joints[*joint].dof_adr).collect(),
        spatial => string::dofs(model, spatial),
    }
}

/// The degrees of freedom that a tendon with armature pulls, split where the mass matrix has no entries. `None` if a
/// part of them branches.
pub(super) fn chains(model: &Model, tendon: &Tendon) -> Option<Vec<Vec<usize>>> {
    if tendon.armature == 0.0 {
        return Some(Vec::new());
    }
    let dofs = dofs(model, &tendon.kind);
    // ancestors come first
    let mut order: Vec<usize> = (0..dofs.len()).collect();
    order.sort_by_key(|place| dofs[*place]);
    let mut chains: Vec<Vec<usize>> = Vec::new();
    for place in order {
        let mut next = model.dofs[dofs[place]].parent;
        while next.is_some_and(|d| !dofs.contains(&d)) {
            next = next.and_then(|d| model.dofs[d].parent);
        }
        let Some(above) = next else {
            chains.push(vec![place]);
            continue;
        };
        let end = |chain: &&mut Vec<usize>| chain.last().is_some_and(|last| dofs[*last] == above);
        chains.iter_mut().find(end)?.push(place);
    }
    Some(chains)
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
            armature: c(t.armature),
            // others are refused
            chains: chains(model, t).unwrap_or_default(),
        }
    };
    model.tendons.iter().enumerate().map(&mut spec).collect()
}
