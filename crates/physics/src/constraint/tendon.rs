//! Fixed tendons and ball-joint limits: rows over several degrees of freedom.

use crate::equality::Term;
use crate::lanes::{Real, kernel_fn};
use crate::model::{JointType, Model, TendonKind};
use crate::sim::{Sim, split};
use crate::solver::block::{Cost, Source};
use crate::solver::softness::{Softness, impedance, softness};
use crate::spatial::quat_to_rotvec;
use crate::work::{Group, Work};

/// A fixed tendon: a weighted sum of joint positions.
#[derive(Clone, Debug)]
pub(crate) struct TendonSpec<C> {
    pub terms: Vec<Term<C>>,
    pub stiffness: C,
    /// The spring is slack between these lengths.
    pub slack: [C; 2],
    pub damping: C,
    /// Lower and upper limit, as sums of two numbers each.
    limit: Option<([C; 2], [C; 2], Softness<C>)>,
    friction: Option<(C, Softness<C>)>,
}

/// The limit of a ball joint: the largest angle from the reference.
#[derive(Clone, Debug)]
pub(crate) struct BallLimit<C> {
    qpos: usize,
    dof: usize,
    range: C,
    soft: Softness<C>,
}

/// Prepares the tendons.
pub(crate) fn tendons<T: Real>(model: &Model) -> Vec<TendonSpec<T::Scalar>> {
    let c = T::scalar;
    let flags = &model.opt.flags;
    let spec = |t: &crate::model::Tendon| {
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

/// Prepares the limits of ball joints.
pub(crate) fn ball_limits<T: Real>(model: &Model) -> Vec<BallLimit<T::Scalar>> {
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

/// Lengths and velocities of the tendons.
#[inline(always)]
pub(crate) fn measure_tendons<T: Real>(sim: &Sim<T>, group: &Group<T>, work: &mut Work<T>) {
    for (i, t) in sim.tendons.iter().enumerate() {
        let (mut length, mut velocity) = (T::zero(), T::zero());
        for term in &t.terms {
            length = T::splat(term.coef).mul_add(group.qpos[term.qpos], length);
            velocity = T::splat(term.coef).mul_add(group.qvel[term.dof], velocity);
        }
        work.tendon_length[i] = length;
        work.tendon_velocity[i] = velocity;
    }
}

/// Forces of the tendons' springs and dampers, onto `tau`.
#[inline(always)]
pub(crate) fn tendon_springs<T: Real>(sim: &Sim<T>, work: &mut Work<T>) {
    let z = T::zero();
    for (i, t) in sim.tendons.iter().enumerate() {
        let length = work.tendon_length[i];
        // zero between the slack lengths
        let below = (T::splat(t.slack[0]) - length).max(z);
        let above = (T::splat(t.slack[1]) - length).min(z);
        let force = (below + above) * T::splat(t.stiffness) - T::splat(t.damping) * work.tendon_velocity[i];
        for term in &t.terms {
            work.tau[term.dof] = T::splat(term.coef).mul_add(force, work.tau[term.dof]);
        }
    }
}

kernel_fn! {
    /// Writes the blocks of tendons' dry friction and limits, and of ball joints' limits.
    pub(crate) fn tendon_blocks<'a, T>(sim: &'a Sim<T>, group: &'a Group<T>, work: &'a mut Work<T>) {
        let one = T::lit(1.0);
        for (i, t) in sim.tendons.iter().enumerate() {
            let (length, velocity) = (work.tendon_length[i], work.tendon_velocity[i]);
            if let Some((loss, soft)) = &t.friction {
                let (_, d) = impedance(soft, T::zero());
                let index = work.blocks.add();
                let block = &mut work.blocks[index];
                block.reset(Source::TendonFriction, Cost::Dry, 1);
                block.on = T::not(T::none());
                block.d[0] = d;
                block.mu[0] = T::splat(*loss);
                block.u0[0] = velocity * T::splat(soft.b);
                block.tie_joints(t.terms.iter().map(|t| (t.dof, T::splat(t.coef))));
            }
            let Some((low, high, soft)) = &t.limit else { continue };
            for (sign, dist) in [
                (one, (length - T::splat(low[0])) - T::splat(low[1])),
                (-one, (T::splat(high[0]) - length) + T::splat(high[1])),
            ] {
                push(
                    work,
                    Source::TendonLimit(i),
                    soft,
                    dist,
                    sign * velocity,
                    t.terms.iter().map(|t| (t.dof, sign * T::splat(t.coef))),
                );
            }
        }
        for limit in &sim.ball_limits {
            let q = limit.qpos;
            let turn = quat_to_rotvec(&[group.qpos[q], group.qpos[q + 1], group.qpos[q + 2], group.qpos[q + 3]]);
            let square = turn[0].mul_add(turn[0], turn[1].mul_add(turn[1], turn[2] * turn[2]));
            let angle = square.sqrt();
            let inverse = one.div(angle.max(T::lit(1e-20)));
            let axis = [turn[0] * inverse, turn[1] * inverse, turn[2] * inverse];
            let mut rate = T::zero();
            for k in 0..3 {
                rate = axis[k].neg_mul_add(group.qvel[limit.dof + k], rate);
            }
            let terms = (0..3).map(|k| (limit.dof + k, -axis[k]));
            push(work, Source::BallLimit(limit.dof), &limit.soft, T::splat(limit.range) - angle, rate, terms);
        }
    }
}

/// A row that pushes while its distance is below the margin.
#[inline(always)]
fn push<T: Real>(
    work: &mut Work<T>,
    source: Source,
    soft: &Softness<T::Scalar>,
    dist: T,
    rate: T,
    terms: impl Iterator<Item = (usize, T)>,
) {
    let on = dist.lt(T::splat(soft.margin));
    if !T::any(on) {
        return;
    }
    let violation = dist - T::splat(soft.margin);
    let (imp, d) = impedance(soft, violation);
    let index = work.blocks.add();
    let block = &mut work.blocks[index];
    block.reset(source, Cost::Push, 1);
    block.on = on;
    block.d[0] = T::masked(on, d);
    block.u0[0] = rate.mul_add(T::splat(soft.b), imp * violation * T::splat(soft.k));
    // other lanes may hold an undefined axis
    block.tie_joints(terms.map(|(dof, coef)| (dof, T::masked(on, coef))));
}
