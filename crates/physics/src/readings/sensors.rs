//! Values of sensors, equal to MuJoCo's `sensordata`.

use super::Readings;
use super::joints::LimitReading;
use super::rays::inside_shape;
use crate::algebra::spatial::*;
use crate::lanes::{Kernel, Real};
use crate::model::{Sensor, SensorObject, SensorType, Transmission};
use crate::sim::Mount;

impl<T: Real> Readings<'_, T> {
    /// Value of a sensor, `dim` numbers, clamped to its cutoff. `None` for a sensor that is not evaluated:
    /// * [`SensorType::Distance`], [`SensorType::Normal`], [`SensorType::FromTo`], [`SensorType::Clock`],
    ///   [`SensorType::Unsupported`];
    /// * [`SensorType::Contact`] that reports single contacts instead of their number (`data="found"`) or their sum
    ///   (`reduce="netforce"`);
    /// * [`SensorType::InsideSite`] that measures how far a shape is enclosed;
    /// * [`SensorType::Force`] and [`SensorType::Torque`] on a site of the world;
    /// * [`SensorType::RangeFinder`] in a model with a visible mesh;
    /// * [`SensorType::ActuatorVel`] of an actuator on contacts;
    /// * [`SensorType::JointActuatorFrc`] of a joint whose gravity compensation counts as an actuator;
    /// * frames of cameras that turn by themselves.
    pub fn sensor(&self, sensor: usize) -> Option<Vec<T>> {
        T::enter(Evaluate { readings: *self, sensor })
    }

    #[inline(always)]
    fn sensor_value(&self, s: &Sensor) -> Option<Vec<T>> {
        use SensorObject as O;
        use SensorType as S;
        Some(match (s.kind, s.object) {
            (S::Touch, O::Geom(g)) => vec![self.geom_touch(g)],
            (S::Touch, O::Site(site)) => vec![self.site_touch(site)],
            (S::Force | S::Torque, O::Site(site)) => {
                let (force, torque) = self.interaction(site)?;
                if s.kind == S::Force { force.to_vec() } else { torque.to_vec() }
            }
            (S::RangeFinder, O::Site(site)) => self.range_finder(site, s.intprm[0])?,
            (S::JointPos, O::Joint(j)) => vec![self.group.qpos[self.sim.joints[j].qpos]],
            (S::JointVel, O::Joint(j)) => vec![self.group.qvel[self.sim.joints[j].dof]],
            (S::JointActuatorFrc, O::Joint(j)) => vec![self.joint_actuator_force(j)],
            (S::JointLimitPos | S::JointLimitVel | S::JointLimitFrc, O::Joint(j)) => {
                limit_value(s.kind, &self.joint_limit(j))
            }
            (S::BallQuat, O::Joint(j)) => self.joint_quat(self.sim.joints[j].qpos).to_vec(),
            (S::BallAngVel, O::Joint(j)) => self.group.qvel[self.sim.joints[j].dof..][..3].to_vec(),
            (S::TendonPos, O::Tendon(t)) => vec![self.tendon_length(t)],
            (S::TendonVel, O::Tendon(t)) => vec![self.tendon_velocity(t)],
            (S::TendonActuatorFrc, O::Tendon(t)) => vec![self.tendon_actuator_force(t)],
            (S::TendonLimitPos | S::TendonLimitVel | S::TendonLimitFrc, O::Tendon(t)) => {
                limit_value(s.kind, &self.tendon_limit(t))
            }
            // as in MuJoCo, the velocity is then not computed
            (S::ActuatorVel, _) if !self.sim.model.opt.flags.actuation => vec![T::zero()],
            (S::ActuatorVel, O::Actuator(a))
                if matches!(self.sim.model.actuators[a].transmission, Transmission::Body(_)) =>
            {
                return None;
            }
            (S::ActuatorPos | S::ActuatorVel, O::Actuator(a)) => {
                vec![self.transmission(a)[usize::from(s.kind == S::ActuatorVel)]]
            }
            (S::ActuatorFrc, O::Actuator(a)) => vec![self.work.forces.actuator_force[a]],
            (S::SubtreeCom | S::SubtreeLinVel | S::SubtreeAngMom, O::Body(b) | O::XBody(b)) => {
                let sums = self.subtree(b);
                match s.kind {
                    S::SubtreeCom => sums.com.to_vec(),
                    S::SubtreeLinVel => sums.velocity.to_vec(),
                    _ => sums.momentum.to_vec(),
                }
            }
            (S::Contact, _) => self.contact_value(s)?,
            (S::PotentialEnergy, _) => vec![self.potential_energy()],
            (S::KineticEnergy, _) => vec![self.kinetic_energy()],
            (S::FrameQuat, object) => {
                let q = self.quat_of(object)?;
                match s.reference {
                    O::None => q.to_vec(),
                    reference => quat_mul(&quat_conjugate(&self.quat_of(reference)?), &q).to_vec(),
                }
            }
            (S::InsideSite, object) => {
                let O::Site(site) = s.reference else { return None };
                if s.intprm[0] != 0 {
                    return None;
                }
                let (zone, mount) = (&self.sim.model.sites[site], &self.sim.sites[site]);
                let p = self.in_axes(mount, &self.separation(mount, &self.mount_of(object)?));
                vec![T::masked(inside_shape(zone.kind, &zone.size, &p), T::lit(1.0))]
            }
            (kind, object) => self.frame_value(kind, &self.mount_of(object)?, s.reference)?.to_vec(),
        })
    }

    /// Vector sensors of a frame.
    #[inline(always)]
    fn frame_value(&self, kind: SensorType, m: &Mount<T::Scalar>, reference: SensorObject) -> Option<V3<T>> {
        use SensorType as S;
        let from = match reference {
            SensorObject::None => None,
            object => Some(self.mount_of(object)?),
        };
        // a direction, along the reference frame's axes if there is one
        let seen = |v: V3<T>| from.as_ref().map_or(v, |f| self.in_axes(f, &v));
        Some(match kind {
            S::FramePos => match &from {
                None => self.mount_pos(m),
                Some(f) => self.in_axes(f, &self.separation(f, m)),
            },
            S::FrameXAxis => seen(self.work.motion.axes(m)[0]),
            S::FrameYAxis => seen(self.work.motion.axes(m)[1]),
            S::FrameZAxis => seen(self.work.motion.axes(m)[2]),
            S::FrameLinVel => match &from {
                None => self.mount_velocity(m),
                Some(f) => self.relative_velocity(m, f).0,
            },
            S::FrameAngVel => match &from {
                None => self.mount_spin(m),
                Some(f) => self.relative_velocity(m, f).1,
            },
            S::FrameLinAcc => self.mount_acceleration(m).0,
            S::FrameAngAcc => self.mount_acceleration(m).1,
            S::Velocimeter => self.in_axes(m, &self.mount_velocity(m)),
            S::Gyro => self.in_axes(m, &self.mount_spin(m)),
            S::Accelerometer => self.in_axes(m, &self.mount_acceleration(m).0),
            S::Magnetometer => {
                let flux = self.sim.model.opt.magnetic;
                into_axes(&self.work.motion.axes(m), &[T::lit(flux[0]), T::lit(flux[1]), T::lit(flux[2])])
            }
            _ => return None,
        })
    }
}

/// The value of a limit for a kind of sensor.
#[inline(always)]
fn limit_value<T: Real>(kind: SensorType, limit: &LimitReading<T>) -> Vec<T> {
    vec![match kind {
        SensorType::JointLimitPos | SensorType::TendonLimitPos => limit.pos,
        SensorType::JointLimitVel | SensorType::TendonLimitVel => limit.vel,
        _ => limit.force,
    }]
}

/// Effect of a cutoff on a kind of sensor.
enum Range {
    /// Between minus and plus the cutoff.
    Real,
    /// Up to the cutoff.
    Positive,
    /// Directions, orientations and contacts have no cutoff.
    Uncut,
}

impl Range {
    fn of(kind: SensorType) -> Range {
        use SensorType as S;
        match kind {
            S::Touch | S::InsideSite => Range::Positive,
            S::BallQuat | S::FrameQuat | S::FrameXAxis | S::FrameYAxis | S::FrameZAxis | S::Contact => Range::Uncut,
            _ => Range::Real,
        }
    }
}

struct Evaluate<'a, T: Real> {
    readings: Readings<'a, T>,
    sensor: usize,
}

impl<T: Real> Kernel<T> for Evaluate<'_, T> {
    type Output = Option<Vec<T>>;
    #[inline(always)]
    fn run(self) -> Option<Vec<T>> {
        let s = &self.readings.sim.model.sensors[self.sensor];
        let mut out = self.readings.sensor_value(s)?;
        if s.cutoff > 0.0 {
            let c = T::lit(s.cutoff);
            for x in &mut out {
                *x = match Range::of(s.kind) {
                    Range::Real => x.min(c).max(-c),
                    Range::Positive => x.min(c),
                    Range::Uncut => *x,
                };
            }
        }
        Some(out)
    }
}
