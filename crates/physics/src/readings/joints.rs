//! Scalars of joints, tendons and actuators.

use super::Readings;
use crate::algebra::spatial::*;
use crate::lanes::Real;
use crate::model::{JointType, TendonKind, Transmission};
use crate::rows::Source;

/// An active limit: distance minus margin, its rate, the limit's force. Zero without an active limit.
#[derive(Clone, Copy)]
pub(super) struct LimitReading<T> {
    pub pos: T,
    pub vel: T,
    pub force: T,
}

impl<T: Real> Readings<'_, T> {
    /// Length of a tendon.
    #[inline(always)]
    pub(super) fn tendon_length(&self, tendon: usize) -> T {
        if self.sim.tendons[tendon].spatial {
            return self.work.strings.length[tendon];
        }
        let mut sum = T::zero();
        if let TendonKind::Fixed(terms) = &self.sim.model.tendons[tendon].kind {
            for (joint, coef) in terms {
                sum = T::lit(*coef).mul_add(self.group.qpos[self.sim.joints[*joint].qpos], sum);
            }
        }
        sum
    }

    /// Rate of change of a tendon's length.
    #[inline(always)]
    pub(super) fn tendon_velocity(&self, tendon: usize) -> T {
        if self.sim.tendons[tendon].spatial {
            return self.work.strings.velocity[tendon];
        }
        let mut sum = T::zero();
        if let TendonKind::Fixed(terms) = &self.sim.model.tendons[tendon].kind {
            for (joint, coef) in terms {
                sum = T::lit(*coef).mul_add(self.group.qvel[self.sim.joints[*joint].dof], sum);
            }
        }
        sum
    }

    /// Length of an actuator's transmission and its rate of change, gear included. The length of a free joint is 0.
    #[inline(always)]
    pub(super) fn transmission(&self, actuator: usize) -> [T; 2] {
        let m = &self.sim.model;
        let a = &m.actuators[actuator];
        let gear = [T::lit(a.gear[0]), T::lit(a.gear[1]), T::lit(a.gear[2])];
        let (joint, in_parent) = match a.transmission {
            Transmission::Tendon(t) => return [self.tendon_length(t) * gear[0], self.tendon_velocity(t) * gear[0]],
            Transmission::Joint(j) => (&m.joints[j], false),
            Transmission::JointInParent(j) => (&m.joints[j], true),
            // the velocity of contacts is not evaluated
            Transmission::Body(_) => return [T::zero(); 2],
            Transmission::Site { .. } | Transmission::SliderCrank { .. } => {
                let drive = self.sim.drives.iter().position(|d| d.actuator == actuator).unwrap_or_default();
                return [self.work.drives.length[drive], self.work.drives.velocity[drive]];
            }
        };
        let (q, d) = (joint.qpos_adr, joint.dof_adr);
        let rate = |d: usize| [self.group.qvel[d], self.group.qvel[d + 1], self.group.qvel[d + 2]];
        // a torque in the parent's axes, converted to the body's
        let turned = |gear: &V3<T>, q: usize| {
            if in_parent {
                let r = quat_to_rot(&self.joint_quat(q));
                [dot(&r[0], gear), dot(&r[1], gear), dot(&r[2], gear)]
            } else {
                *gear
            }
        };
        match joint.kind {
            JointType::Hinge | JointType::Slide => [self.group.qpos[q] * gear[0], self.group.qvel[d] * gear[0]],
            JointType::Ball => {
                let gear = turned(&gear, q);
                [dot(&quat_to_rotvec(&self.joint_quat(q)), &gear), dot(&rate(d), &gear)]
            }
            JointType::Free => {
                let turning = turned(&[T::lit(a.gear[3]), T::lit(a.gear[4]), T::lit(a.gear[5])], q + 3);
                [T::zero(), dot(&rate(d), &gear) + dot(&rate(d + 3), &turning)]
            }
        }
    }

    /// Total force of all actuators on a hinge or slide, including those that act through tendons and sites, and gravity
    /// compensation if it counts as one.
    #[inline(always)]
    pub(super) fn joint_actuator_force(&self, joint: usize) -> T {
        let m = &self.sim.model;
        let one = &m.joints[joint];
        let mut sum = self.work.forces.gravcomp[1].get(one.dof_adr).copied().unwrap_or(T::zero());
        for (i, a) in m.actuators.iter().enumerate() {
            if let Transmission::Tendon(t) = a.transmission
                && self.sim.tendons[t].spatial
            {
                let force = self.work.forces.actuator_force[i] * T::lit(a.gear[0]);
                for (dof, arm) in self.sim.tendons[t].arms(&self.work.forces.tendon_moments) {
                    if dof == one.dof_adr {
                        sum = arm.mul_add(force, sum);
                    }
                }
                continue;
            }
            let lever = match a.transmission {
                Transmission::Joint(j) | Transmission::JointInParent(j) => f64::from(j == joint),
                Transmission::Tendon(t) => match &m.tendons[t].kind {
                    TendonKind::Fixed(terms) => terms.iter().find(|(j, _)| *j == joint).map_or(0.0, |(_, c)| *c),
                    TendonKind::Spatial(_) => 0.0,
                },
                // below
                Transmission::Site { .. } | Transmission::SliderCrank { .. } | Transmission::Body(_) => 0.0,
            };
            if lever != 0.0 {
                sum = T::lit(lever * a.gear[0]).mul_add(self.work.forces.actuator_force[i], sum);
            }
        }
        for (i, drive) in self.sim.drives.iter().enumerate() {
            for (_, arm) in self.work.forces.drives.arms(self.sim, i).filter(|(dof, _)| *dof == one.dof_adr) {
                sum = arm.mul_add(self.work.forces.actuator_force[drive.actuator], sum);
            }
        }
        for (i, spec) in self.sim.adhesions.iter().enumerate() {
            let arm = self.work.adhesion.of(self.sim, i)[one.dof_adr];
            sum = arm.mul_add(self.work.forces.actuator_force[spec.actuator], sum);
        }
        if let Some([low, high]) = one.actuator_force_range {
            sum = sum.max(T::lit(low)).min(T::lit(high));
        }
        sum
    }

    /// Total force of the actuators that pull a tendon.
    #[inline(always)]
    pub(super) fn tendon_actuator_force(&self, tendon: usize) -> T {
        let mut sum = T::zero();
        for (a, force) in self.sim.model.actuators.iter().zip(&self.work.forces.actuator_force) {
            if a.transmission == Transmission::Tendon(tendon) {
                sum += *force;
            }
        }
        sum
    }

    /// The limit of a joint, the lower one if both are reached. For a ball joint, the limit of its angle.
    #[inline(always)]
    pub(super) fn joint_limit(&self, joint: usize) -> LimitReading<T> {
        let (z, one) = (T::zero(), &self.sim.joints[joint]);
        if one.kind == JointType::Ball {
            return self.ball_limit(joint);
        }
        let mut out = LimitReading { pos: z, vel: z, force: z };
        let Some(limit) = self.sim.limits.iter().find(|l| l.dof == one.dof) else { return out };
        let q = self.group.qpos[one.qpos];
        let low = (q - T::splat(limit.low[0])) - T::splat(limit.low[1]);
        let high = (T::splat(limit.high[0]) - q) + T::splat(limit.high[1]);
        (out.pos, out.vel) = reached(low, high, T::splat(limit.soft.margin), self.group.qvel[one.dof]);
        let mut left = T::not(T::none());
        for row in self.work.rows.limits.iter().filter(|row| row.dof == one.dof) {
            out.force = T::select(T::and(left, row.on), row.force, out.force);
            left = T::and(left, T::not(row.on));
        }
        out
    }

    #[inline(always)]
    fn ball_limit(&self, joint: usize) -> LimitReading<T> {
        let z = T::zero();
        let one = &self.sim.model.joints[joint];
        let flags = &self.sim.model.opt.flags;
        if !(one.limited && flags.limit && flags.constraint) {
            return LimitReading { pos: z, vel: z, force: z };
        }
        let turn = quat_to_rotvec(&self.joint_quat(one.qpos_adr));
        let angle = dot(&turn, &turn).sqrt();
        let v = &self.group.qvel[one.dof_adr..];
        let rate = dot(&turn, &[v[0], v[1], v[2]]).div(angle.max(T::lit(1e-20)));
        let rest = T::lit(one.range[0].max(one.range[1])) - angle;
        let margin = T::lit(one.margin);
        let on = rest.lt(margin);
        LimitReading {
            pos: T::masked(on, rest - margin),
            vel: T::masked(on, -rate),
            force: self.limit_force(|s| s == Source::BallLimit(one.dof_adr)),
        }
    }

    /// The limit of a tendon, the lower one if both are reached.
    #[inline(always)]
    pub(super) fn tendon_limit(&self, tendon: usize) -> LimitReading<T> {
        let z = T::zero();
        let t = &self.sim.model.tendons[tendon];
        let flags = &self.sim.model.opt.flags;
        if !(t.limited && flags.limit && flags.constraint) {
            return LimitReading { pos: z, vel: z, force: z };
        }
        let length = self.tendon_length(tendon);
        let (low, high) = (length - T::lit(t.range[0]), T::lit(t.range[1]) - length);
        let (pos, vel) = reached(low, high, T::lit(t.margin), self.tendon_velocity(tendon));
        let own = |s| matches!(s, Source::TendonLimit { tendon: t, .. } if t == tendon);
        LimitReading { pos, vel, force: self.limit_force(own) }
    }

    /// Force of the first row that a limit has in a lane.
    #[inline(always)]
    fn limit_force(&self, own: impl Fn(Source) -> bool) -> T {
        let mut force = T::zero();
        let mut left = T::not(T::none());
        for block in self.work.rows.blocks.iter().filter(|b| own(b.source)) {
            force = T::select(T::and(left, block.on), block.force[0], force);
            left = T::and(left, T::not(block.on));
        }
        force
    }
}

/// Distance from the first of two limits that is closer than the margin, minus the margin, and its rate for the
/// coordinate's rate `v`.
#[inline(always)]
fn reached<T: Real>(low: T, high: T, margin: T, v: T) -> (T, T) {
    let lower = low.lt(margin);
    let upper = high.lt(margin);
    let pos = T::select(lower, low - margin, T::masked(upper, high - margin));
    (pos, T::select(lower, v, T::masked(upper, -v)))
}
