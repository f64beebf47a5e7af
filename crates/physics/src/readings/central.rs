//! MuJoCo's quantities about centers of mass, and its joint-space forces, in MuJoCo's conventions: world axes, about
//! the center of mass of the whole tree below a child of the world (`subtree_com[body_rootid]`).
//!
//! A step does not need them. [`Sim::measure`] computes them from the results of the last physics step.

use super::Readings;
use super::forces::{ContactForce, Wrench};
use super::joint_space::constraint_wrenches;
use crate::algebra::spatial::*;
use crate::dynamics::joint_space;
use crate::lanes::{Kernel, Real};
use crate::rows::Source;
use crate::sim::{Mount, Sim, TransmissionSpec};
use crate::state::{Group, Work};

impl<T: Real> Sim<T> {
    /// Centers of mass for the current frames of `work`.
    pub(super) fn measure_centers(&self, work: &mut Work<T>, group: &Group<T>) {
        T::enter(Centers(self, group, work));
    }

    /// Forces on bodies, and the centers of mass that they refer to.
    pub(super) fn measure_bodies(&self, work: &mut Work<T>, group: &Group<T>) {
        self.measure_centers(work, group);
        T::enter(Wrenches(self, group, work));
    }

    /// Forces of actuators and constraints on the degrees of freedom.
    pub(super) fn measure_joints(&self, work: &mut Work<T>) {
        self.measure_actuators(work);
        T::enter(JointForces(self, work));
    }

    /// Forces of actuators on the degrees of freedom.
    pub(super) fn measure_actuators(&self, work: &mut Work<T>) {
        T::enter(Actuation(self, work));
    }
}

impl<T: Real> Readings<'_, T> {
    /// Inertia of a body about the center of mass of its tree, world axes: xx, yy, zz, xy, xz, yz (kg m^2), mass times
    /// the offset of its own center of mass (kg m), mass (kg). With
    /// [`MeasurePlan::centers`](super::MeasurePlan::centers).
    #[inline(always)]
    pub fn cinert(&self, body: usize) -> [T; 10] {
        let com = &self.sim.coms[body];
        let (mass, i) = (self.own_mass(body), self.own_inertia(body));
        let [x, y, z] = self.work.motion.axes(com);
        // sum of moment times axis times axis' over the principal axes
        let entry = |a: usize, b: usize| (i[0] * x[a]).mul_add(x[b], (i[1] * y[a]).mul_add(y[b], i[2] * z[a] * z[b]));
        let d = self.offset(body, com);
        let [xx, yy, zz] = [d[0] * d[0], d[1] * d[1], d[2] * d[2]];
        [
            mass.mul_add(yy + zz, entry(0, 0)),
            mass.mul_add(xx + zz, entry(1, 1)),
            mass.mul_add(xx + yy, entry(2, 2)),
            mass.neg_mul_add(d[0] * d[1], entry(0, 1)),
            mass.neg_mul_add(d[0] * d[2], entry(0, 2)),
            mass.neg_mul_add(d[1] * d[2], entry(1, 2)),
            mass * d[0],
            mass * d[1],
            mass * d[2],
            mass,
        ]
    }

    /// Velocity of a body: angular (rad/s), and linear at the center of mass of its tree (m/s). With
    /// [`MeasurePlan::centers`](super::MeasurePlan::centers).
    #[inline(always)]
    pub fn cvel(&self, body: usize) -> V6<T> {
        let com = &self.sim.coms[body];
        let spin = self.mount_spin(com);
        let d = self.offset(body, com);
        let v = cross_add(&spin, &[-d[0], -d[1], -d[2]], &self.mount_velocity(com));
        [spin[0], spin[1], spin[2], v[0], v[1], v[2]]
    }

    /// External force on a body from contacts, connect and weld constraints and pushes: torque about the center of mass
    /// of its tree (N m), and force (N). Zero for the world. With [`MeasurePlan::bodies`](super::MeasurePlan::bodies).
    #[inline(always)]
    pub fn cfrc_ext(&self, body: usize) -> V6<T> {
        self.work.readings.cfrc_ext[body]
    }

    /// Force of all actuators on a degree of freedom, N or N m. With [`MeasurePlan::actuators`](super::MeasurePlan::actuators).
    #[inline(always)]
    pub fn qfrc_actuator(&self, dof: usize) -> T {
        self.work.readings.qfrc_actuator[dof]
    }

    /// Force of all constraints on a degree of freedom, N or N m. With [`MeasurePlan::joints`](super::MeasurePlan::joints).
    #[inline(always)]
    pub fn qfrc_constraint(&self, dof: usize) -> T {
        self.work.readings.qfrc_constraint[dof]
    }

    /// Center of mass of all bodies, m. With [`MeasurePlan::centers`](super::MeasurePlan::centers).
    #[inline(always)]
    pub fn center_of_mass(&self) -> V3<T> {
        let bodies = &self.sim.model.bodies;
        let mut sum = [T::zero(); 3];
        for (root, body) in bodies.iter().enumerate().skip(1) {
            if body.root_id == root {
                let center = add3(&self.mount_pos(&self.sim.coms[root]), &self.work.readings.tree_com[root]);
                // a single tree has all of the mass, and then no digit is lost
                let share = T::lit(body.subtree_mass / bodies[0].subtree_mass);
                for k in 0..3 {
                    sum[k] = center[k].mul_add(share, sum[k]);
                }
            }
        }
        sum
    }

    /// Vector from the center of mass of a body's tree to a frame.
    #[inline(always)]
    fn offset(&self, body: usize, to: &Mount<T::Scalar>) -> V3<T> {
        let root = self.sim.model.bodies[body].root_id;
        sub3(&self.separation(&self.sim.coms[root], to), &self.work.readings.tree_com[root])
    }

    /// Adds a contact to the bodies that it acts on.
    #[inline(always)]
    fn add_contact(&self, c: &ContactForce<T>, out: &mut [V6<T>]) {
        for (side, geom) in c.geoms.into_iter().enumerate() {
            let body = self.sim.model.geoms[geom].body;
            let root = self.sim.model.bodies[body].root_id;
            if body == 0 {
                continue;
            }
            let arm = self.arm_from(&self.sim.coms[root], Some(c.tree), &c.point);
            self.add_wrench(body, &arm, (&c.force, &c.torque), (side == 1, c.on), out);
        }
    }

    /// Adds or subtracts a force on a body at the offset `arm` from the center of mass of the body's tree.
    #[inline(always)]
    fn add_wrench(
        &self,
        body: usize,
        arm: &V3<T>,
        (force, torque): (&V3<T>, &V3<T>),
        (plus, on): (bool, T::Mask),
        out: &mut [V6<T>],
    ) {
        let root = self.sim.model.bodies[body].root_id;
        let arm = sub3(arm, &self.work.readings.tree_com[root]);
        let mut sum = Wrench { force: lin(&out[body]), torque: ang(&out[body]) };
        if plus {
            sum.add(&arm, force, torque, on);
        } else {
            sum.subtract(&arm, force, torque, on);
        }
        let (t, f) = (sum.torque, sum.force);
        out[body] = [t[0], t[1], t[2], f[0], f[1], f[2]];
    }
}

/// Centers of mass of the trees.
struct Centers<'a, T: Real>(&'a Sim<T>, &'a Group<T>, &'a mut Work<T>);
impl<T: Real> Kernel<T> for Centers<'_, T> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        let Centers(sim, group, work) = self;
        let mut center = std::mem::take(&mut work.readings.tree_com);
        let bodies = &sim.model.bodies;
        let readings = Readings::new(sim, group, work);
        for root in 1..bodies.len() {
            if bodies[root].root_id != root {
                continue;
            }
            // a tree follows its root without gaps
            let mut end = root + 1;
            while end < bodies.len() && bodies[end].root_id == root {
                end += 1;
            }
            let (mut mass, mut sum) = (T::zero(), [T::zero(); 3]);
            for b in root..end {
                let (m, r) = (readings.own_mass(b), readings.separation(&sim.coms[root], &sim.coms[b]));
                mass += m;
                for k in 0..3 {
                    sum[k] = r[k].mul_add(m, sum[k]);
                }
            }
            let inverse = mass.max(T::lit(1e-15)).recip();
            center[root] = [sum[0] * inverse, sum[1] * inverse, sum[2] * inverse];
        }
        work.readings.tree_com = center;
    }
}

/// Forces on bodies.
struct Wrenches<'a, T: Real>(&'a Sim<T>, &'a Group<T>, &'a mut Work<T>);
impl<T: Real> Kernel<T> for Wrenches<'_, T> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        let Wrenches(sim, group, work) = self;
        let mut out = std::mem::take(&mut work.readings.cfrc_ext);
        out.fill([T::zero(); 6]);
        let readings = Readings::new(sim, group, work);
        for row in &work.rows.contacts {
            readings.add_contact(&readings.floor_contact(row), &mut out);
        }
        for block in work.rows.blocks.iter() {
            if block.source != Source::Contacts {
                continue;
            }
            for (index, on) in &block.members {
                if let Some(contact) = readings.pair_contact(block, *index, *on) {
                    readings.add_contact(&contact, &mut out);
                }
            }
        }
        let all = T::not(T::none());
        if !sim.equalities.is_empty() {
            for tie in readings.tie_forces() {
                for (side, body) in tie.bodies.into_iter().enumerate() {
                    if body != 0 {
                        let root = &sim.coms[sim.model.bodies[body].root_id];
                        let arm = readings.separation(root, &tie.points[side]);
                        readings.add_wrench(body, &arm, (&tie.force, &tie.torque), (side == 1, all), &mut out);
                    }
                }
            }
        }
        for string in readings.string_forces() {
            for (side, body) in string.bodies.into_iter().enumerate() {
                if body != 0 {
                    let root = &sim.coms[sim.model.bodies[body].root_id];
                    let arm = readings.arm_from(root, string.trees[side], &string.points[side]);
                    let force = (&string.force, &[T::zero(); 3]);
                    readings.add_wrench(body, &arm, force, (side == 1, string.on), &mut out);
                }
            }
        }
        for (body, push) in group.xfrc_applied.iter().enumerate().skip(1) {
            let root = &sim.coms[sim.model.bodies[body].root_id];
            let arm = readings.separation(root, &sim.coms[body]);
            readings.add_wrench(body, &arm, (&lin(push), &ang(push)), (true, all), &mut out);
        }
        work.readings.cfrc_ext = out;
    }
}

/// Forces of actuators on degrees of freedom.
struct Actuation<'a, T: Real>(&'a Sim<T>, &'a mut Work<T>);
impl<T: Real> Kernel<T> for Actuation<'_, T> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        let Actuation(sim, work) = self;
        work.readings.qfrc_actuator.fill(T::zero());
        for (actuator, force) in sim.actuators.iter().zip(&work.forces.actuator_force) {
            match &actuator.transmission {
                TransmissionSpec::Joint { dofs, gear, .. } => {
                    for (k, d) in dofs.clone().enumerate() {
                        work.readings.qfrc_actuator[d] =
                            force.mul_add(T::splat(gear[k]), work.readings.qfrc_actuator[d]);
                    }
                }
                TransmissionSpec::Tendon { index, gear } => {
                    let pull = *force * T::splat(*gear);
                    for (dof, arm) in sim.tendons[*index].arms(&work.forces.tendon_moments) {
                        work.readings.qfrc_actuator[dof] = pull.mul_add(arm, work.readings.qfrc_actuator[dof]);
                    }
                }
                // below
                TransmissionSpec::Adhesion => {}
                TransmissionSpec::Drive(drive) => {
                    for (dof, arm) in work.forces.drives.arms(sim, *drive) {
                        work.readings.qfrc_actuator[dof] = force.mul_add(arm, work.readings.qfrc_actuator[dof]);
                    }
                }
            }
        }
        for (sum, carried) in work.readings.qfrc_actuator.iter_mut().zip(&work.forces.gravcomp[1]) {
            *sum += *carried;
        }
        for (i, spec) in sim.adhesions.iter().enumerate() {
            let force = work.forces.actuator_force[spec.actuator];
            for (sum, arm) in work.readings.qfrc_actuator.iter_mut().zip(work.adhesion.of(sim, i)) {
                *sum = force.mul_add(*arm, *sum);
            }
        }
        for (dof, low, high) in &sim.joint_force_ranges {
            work.readings.qfrc_actuator[*dof] =
                work.readings.qfrc_actuator[*dof].max(T::splat(*low)).min(T::splat(*high));
        }
    }
}

/// Forces of constraints on degrees of freedom.
struct JointForces<'a, T: Real>(&'a Sim<T>, &'a mut Work<T>);
impl<T: Real> Kernel<T> for JointForces<'_, T> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        let JointForces(sim, work) = self;
        let mut links = std::mem::take(&mut work.readings.link_force);
        let mut joints = std::mem::take(&mut work.readings.qfrc_constraint);
        constraint_wrenches(work, &mut links, &mut joints);
        joint_space(sim, &work.dofs, &mut links, &mut joints);
        (work.readings.link_force, work.readings.qfrc_constraint) = (links, joints);
    }
}
