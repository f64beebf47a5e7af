//! Readings of a group after a step: poses, velocities, contacts and sensors, in world axes.
//!
//! [`sensors`] evaluates a sensor by its kind. The other files have the quantities it needs.

mod central;
mod contacts;
mod elevation;
mod energy;
mod forces;
mod frames;
mod hfield;
mod joint_space;
mod joints;
mod measure;
mod ray;
mod rays;
mod sensors;
mod strings;
mod touch;

pub use forces::ContactReading;
pub use measure::MeasurePlan;

use crate::algebra::spatial::*;
use crate::lanes::Real;
use crate::sim::{Mount, Sim};
use crate::state::{Group, Work};

/// A view of the group that was last stepped (or refreshed) with `work`.
///
/// Positions and velocities belong to the current state. Accelerations, contacts and forces belong to the last physics
/// step, as do the dynamics that produced them. Indices are those of the [`Model`](crate::model::Model).
#[derive(Clone, Copy)]
pub struct Readings<'a, T: Real> {
    /// Constants.
    pub sim: &'a Sim<T>,
    /// State.
    pub group: &'a Group<T>,
    /// Scratch memory of the last step.
    pub work: &'a Work<T>,
}

impl<'a, T: Real> Readings<'a, T> {
    /// Creates a view. The last use of `work` must have been for `group`.
    #[inline(always)]
    pub fn new(sim: &'a Sim<T>, group: &'a Group<T>, work: &'a Work<T>) -> Self {
        Readings { sim, group, work }
    }

    /// Coordinate `i` of the configuration.
    #[inline(always)]
    pub fn qpos(&self, i: usize) -> T {
        self.group.qpos[i]
    }

    /// Velocity `i`.
    #[inline(always)]
    pub fn qvel(&self, i: usize) -> T {
        self.group.qvel[i]
    }

    /// Acceleration `i` of the last physics step.
    #[inline(always)]
    pub fn qacc(&self, i: usize) -> T {
        self.work.solver.qacc[i]
    }

    /// Force of an actuator in the last physics step (before its gear), N or N m.
    #[inline(always)]
    pub fn actuator_force(&self, i: usize) -> T {
        self.work.forces.actuator_force[i]
    }

    /// Origin of a body's frame, m.
    #[inline(always)]
    pub fn body_pos(&self, body: usize) -> V3<T> {
        self.mount_pos(&self.sim.bodies[body])
    }

    /// Axes of a body's frame (columns x, y, z).
    #[inline(always)]
    pub fn body_axes(&self, body: usize) -> Rot<T> {
        self.work.motion.axes(&self.sim.bodies[body])
    }

    /// Center of mass of a body, m.
    #[inline(always)]
    pub fn body_com(&self, body: usize) -> V3<T> {
        self.mount_pos(&self.sim.coms[body])
    }

    /// Velocity of the origin of a body's frame, m/s.
    #[inline(always)]
    pub fn body_velocity(&self, body: usize) -> V3<T> {
        self.mount_velocity(&self.sim.bodies[body])
    }

    /// Velocity of a body's center of mass, m/s.
    #[inline(always)]
    pub fn body_com_velocity(&self, body: usize) -> V3<T> {
        self.mount_velocity(&self.sim.coms[body])
    }

    /// Angular velocity of a body, rad/s.
    #[inline(always)]
    pub fn body_angular_velocity(&self, body: usize) -> V3<T> {
        self.mount_spin(&self.sim.bodies[body])
    }

    /// Center of a geom, m.
    #[inline(always)]
    pub fn geom_pos(&self, geom: usize) -> V3<T> {
        self.mount_pos(&self.sim.geoms[geom])
    }

    /// Axes of a geom's frame (columns).
    #[inline(always)]
    pub fn geom_axes(&self, geom: usize) -> Rot<T> {
        self.work.motion.axes(&self.sim.geoms[geom])
    }

    /// Velocity of a geom's center, m/s.
    #[inline(always)]
    pub fn geom_velocity(&self, geom: usize) -> V3<T> {
        self.mount_velocity(&self.sim.geoms[geom])
    }

    /// Position of a site, m.
    #[inline(always)]
    pub fn site_pos(&self, site: usize) -> V3<T> {
        self.mount_pos(&self.sim.sites[site])
    }

    /// Axes of a site's frame (columns).
    #[inline(always)]
    pub fn site_axes(&self, site: usize) -> Rot<T> {
        self.work.motion.axes(&self.sim.sites[site])
    }

    /// Lanes in which a geom touches the static world, at the last physics step.
    #[inline(always)]
    pub fn touching(&self, geom: usize) -> T::Mask {
        self.work.contacts.touching[geom]
    }

    /// Lanes in which a geom touched the static world at any physics step of the last call of [`Sim::step`].
    #[inline(always)]
    pub fn touched(&self, geom: usize) -> T::Mask {
        self.work.contacts.touched[geom]
    }

    /// Lanes in which a geom touches another moving geom, at the last physics step.
    #[inline(always)]
    pub fn touching_bodies(&self, geom: usize) -> T::Mask {
        self.work.contacts.touching_bodies[geom]
    }

    /// Number of contacts of a body with the static world at the last physics step.
    pub fn body_contacts(&self, body: usize) -> T {
        let mut n = T::zero();
        for (geom, count) in self.sim.model.geoms.iter().zip(&self.work.contacts.ground_contacts) {
            if geom.body == body {
                n += *count;
            }
        }
        n
    }

    /// Normal force of a geom's contacts with the static world at the last physics step, N.
    pub fn normal_force(&self, geom: usize) -> T {
        self.work.contacts.normal_force[geom]
    }

    #[inline(always)]
    fn mount_pos(&self, m: &Mount<T::Scalar>) -> V3<T> {
        match m.link {
            None => self.work.motion.still(m),
            Some(l) => add3(&self.work.motion.arm(m, l), &self.work.motion.reference[self.sim.links[l].tree]),
        }
    }

    #[inline(always)]
    fn mount_velocity(&self, m: &Mount<T::Scalar>) -> V3<T> {
        match m.link {
            None => [T::zero(); 3],
            Some(l) => {
                let v = &self.work.motion.vel[l];
                cross_add(&ang(v), &self.work.motion.arm(m, l), &lin(v))
            }
        }
    }

    #[inline(always)]
    fn mount_spin(&self, m: &Mount<T::Scalar>) -> V3<T> {
        m.link.map_or([T::zero(); 3], |l| ang(&self.work.motion.vel[l]))
    }

    /// Factor of a body's mass and inertia.
    #[inline(always)]
    fn mass_factor(&self, body: usize) -> T {
        match (&self.group.varied, self.sim.bodies[body].link) {
            (Some(varied), Some(link)) => varied.mass[link],
            _ => T::lit(1.0),
        }
    }

    /// Mass of a body, kg.
    #[inline(always)]
    fn own_mass(&self, body: usize) -> T {
        T::lit(self.sim.model.bodies[body].mass) * self.mass_factor(body)
    }

    /// Principal moments of inertia of a body, kg m^2.
    #[inline(always)]
    fn own_inertia(&self, body: usize) -> V3<T> {
        let (i, factor) = (&self.sim.model.bodies[body].inertia, self.mass_factor(body));
        [T::lit(i[0]) * factor, T::lit(i[1]) * factor, T::lit(i[2]) * factor]
    }

    /// Linear acceleration (including gravity as an upward acceleration, as an accelerometer measures it) and angular
    /// acceleration.
    #[inline(always)]
    fn mount_acceleration(&self, m: &Mount<T::Scalar>) -> (V3<T>, V3<T>) {
        let Some(link) = m.link else {
            let g = self.group.gravity(self.sim);
            return ([-g[0], -g[1], -g[2]], [T::zero(); 3]);
        };
        let mut a = self.work.motion.bias_acc[link];
        let mut l = Some(link);
        while let Some(i) = l {
            for d in self.sim.links[i].dofs.clone() {
                a = axpy6(&self.work.dofs[d].axis, self.work.solver.qacc[d], &a);
            }
            l = self.sim.links[i].parent;
        }
        let r = self.work.motion.arm(m, link);
        let v = self.mount_velocity(m);
        let spin = ang(&self.work.motion.vel[link]);
        let at_point = cross_add(&ang(&a), &r, &lin(&a));
        (cross_add(&spin, &v, &at_point), ang(&a))
    }
}
