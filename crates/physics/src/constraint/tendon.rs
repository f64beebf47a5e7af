//! Rows over several degrees of freedom: inertia, friction and limits of tendons, and limits of ball joints.

use crate::algebra::spatial::quat_to_rotvec;
use crate::lanes::{Real, kernel_fn};
use crate::rows::{ConstraintRows, Source};
use crate::sim::{Cost, Sim, Softness, impedance};
use crate::state::{Group, Work};

kernel_fn! {
    /// Writes the blocks of tendons' inertia. They come before all others.
    pub(crate) fn tendon_inertia<'a, T>(sim: &'a Sim<T>, work: &'a mut Work<T>) {
        let Work { rows, forces, strings, .. } = work;
        for (i, t) in sim.tendons.iter().enumerate() {
            for chain in &t.chains {
                let index = rows.blocks.add();
                let block = &mut rows.blocks[index];
                block.reset(Source::TendonInertia, Cost::Equal, 1);
                block.on = T::not(T::none());
                block.d[0] = T::splat(t.armature);
                block.u0[0] = strings.drift[i];
                block.tie_joints(chain.iter().map(|place| t.arm(*place, &forces.tendon_moments)));
            }
        }
    }
}
kernel_fn! {
    /// Writes the blocks of tendons' dry friction and limits, and of ball joints' limits.
    pub(crate) fn tendon_blocks<'a, T>(sim: &'a Sim<T>, group: &'a Group<T>, work: &'a mut Work<T>) {
        let one = T::lit(1.0);
        let Work { rows, forces, .. } = work;
        for (i, t) in sim.tendons.iter().enumerate() {
            let (length, velocity) = (forces.tendon_length[i], forces.tendon_velocity[i]);
            let moments = &forces.tendon_moments[..];
            let stiffness = group.weights().map(|weights| weights.tendons[i]);
            if let Some((loss, soft)) = &t.friction {
                let (_, mut d) = impedance(soft, T::zero());
                if let Some(stiffness) = stiffness {
                    d *= stiffness;
                }
                let index = rows.blocks.add();
                let block = &mut rows.blocks[index];
                block.reset(Source::TendonFriction(i), Cost::Dry, 1);
                block.on = T::not(T::none());
                block.d[0] = d;
                block.mu[0] = T::splat(*loss);
                block.u0[0] = velocity * T::splat(soft.b);
                block.tie_joints(t.arms(moments));
            }
            let Some((low, high, soft)) = &t.limit else { continue };
            for (upper, sign, dist) in [
                (false, one, (length - T::splat(low[0])) - T::splat(low[1])),
                (true, -one, (T::splat(high[0]) - length) + T::splat(high[1])),
            ] {
                let source = Source::TendonLimit { tendon: i, upper };
                let terms = t.arms(moments).map(|(dof, arm)| (dof, sign * arm));
                push(rows, source, (soft, stiffness), dist, sign * velocity, terms);
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
            let stiffness = group.weights().map(|weights| weights.dofs[limit.dof]);
            let soft = (&limit.soft, stiffness);
            push(rows, Source::BallLimit(limit.dof), soft, T::splat(limit.range) - angle, rate, terms);
        }
    }
}

/// A row that pushes while its distance is below the margin. Its stiffness may deviate from the model's by a factor.
#[inline(always)]
fn push<T: Real>(
    rows: &mut ConstraintRows<T>,
    source: Source,
    (soft, stiffness): (&Softness<T::Scalar>, Option<T>),
    dist: T,
    rate: T,
    terms: impl Iterator<Item = (usize, T)>,
) {
    let on = dist.lt(T::splat(soft.margin));
    if !T::any(on) {
        return;
    }
    let violation = dist - T::splat(soft.margin);
    let (imp, mut d) = impedance(soft, violation);
    if let Some(stiffness) = stiffness {
        d *= stiffness;
    }
    let index = rows.blocks.add();
    let block = &mut rows.blocks[index];
    block.reset(source, Cost::Push, 1);
    block.on = on;
    block.d[0] = T::masked(on, d);
    block.u0[0] = rate.mul_add(T::splat(soft.b), imp * violation * T::splat(soft.k));
    // other lanes may hold an undefined axis
    block.tie_joints(terms.map(|(dof, coef)| (dof, T::masked(on, coef))));
}
