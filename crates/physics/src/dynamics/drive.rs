//! Lengths, velocities and moment arms of drives: transmissions through sites.

use super::string::{arm, between};
use crate::algebra::spatial::*;
use crate::lanes::{Real, kernel_fn};
use crate::sim::{DriveKind, DriveSpec, Sim};
use crate::state::{Group, Motion, Work};

kernel_fn! {
    /// Measures all drives at the positions and velocities of the bodies.
    pub(crate) fn measure_drives<'a, T>(sim: &'a Sim<T>, group: &'a Group<T>, work: &'a mut Work<T>) {
        let Work { motion, dofs, drives, .. } = work;
        drives.moments.fill(T::zero());
        for (i, drive) in sim.drives.iter().enumerate() {
            let (length, wrenches) = effect(motion, drive);
            let moments = &mut drives.moments[drive.moments.clone()];
            for lever in &drive.levers {
                moments[lever.place] += dot6(&dofs[lever.dof].axis, &wrenches[lever.end]);
            }
            let mut velocity = T::zero();
            for (dof, arm) in drive.dofs.iter().zip(moments.iter()) {
                velocity = arm.mul_add(group.qvel[*dof], velocity);
            }
            (drives.length[i], drives.velocity[i]) = (length, velocity);
        }
    }
}

/// Torque about the reference of a tree, and force, of a torque and a force at a point.
#[inline(always)]
fn wrench<T: Real>(point: &V3<T>, force: &V3<T>, torque: &V3<T>) -> V6<T> {
    let t = cross_add(point, force, torque);
    [t[0], t[1], t[2], force[0], force[1], force[2]]
}

/// The same, for the end that takes the opposite.
#[inline(always)]
fn opposite<T: Real>(point: &V3<T>, force: &V3<T>, torque: &V3<T>) -> V6<T> {
    wrench(point, &neg3(force), &neg3(torque))
}

/// Length of a drive, and what a unit of the actuator's force does at its ends.
#[inline(always)]
fn effect<T: Real>(motion: &Motion<T>, drive: &DriveSpec<T::Scalar>) -> (T, [V6<T>; 2]) {
    let [first, second] = &drive.ends;
    let arms = [arm(motion, first), arm(motion, second)];
    match &drive.kind {
        DriveKind::Site { force, torque } => {
            let axes = motion.axes(&second.mount);
            let (force, torque) = (rotate(&axes, &splat3(force)), rotate(&axes, &splat3(torque)));
            (T::zero(), [[T::zero(); 6], wrench(&arms[1], &force, &torque)])
        }
        DriveKind::Between { force, torque, turns } => {
            let axes = motion.axes(&first.mount);
            let (force, torque) = (splat3(force), splat3(torque));
            let mut length = dot(&into_axes(&axes, &between(motion, [first, second], &arms)), &force);
            if *turns {
                let [x, y, z] = motion.axes(&second.mount);
                let turn = [into_axes(&axes, &x), into_axes(&axes, &y), into_axes(&axes, &z)];
                length += dot(&quat_to_rotvec(&rot_to_quat(&turn)), &torque);
            }
            let (force, torque) = (rotate(&axes, &force), rotate(&axes, &torque));
            (length, [opposite(&arms[0], &force, &torque), wrench(&arms[1], &force, &torque)])
        }
        DriveKind::Crank { rod, gear } => {
            let (rod, gear, one) = (T::splat(*rod), T::splat(*gear), T::lit(1.0));
            let axis = motion.axes(&first.mount)[2];
            let apart = between(motion, [first, second], &arms);
            // distance of the crank along the axis; the rod bridges the distance from it
            let along = dot(&apart, &axis);
            let square = along.mul_add(along, rod * rod) - dot(&apart, &apart);
            // a rod that is too short leaves the slider next to the crank
            let reaches = T::zero().lt(square);
            let root = T::select(reaches, square, one).sqrt();
            let inverse = T::masked(reaches, root.recip());
            let share = along.neg_mul_add(inverse, one);
            let (mut force, mut lever) = ([T::zero(); 3], [T::zero(); 3]);
            for i in 0..3 {
                force[i] = share.mul_add(axis[i], inverse * apart[i]) * gear;
                lever[i] = share * apart[i] * gear;
            }
            let length = (along - T::masked(reaches, root)) * gear;
            let turn = cross(&axis, &lever);
            (length, [wrench(&arms[0], &neg3(&force), &turn), wrench(&arms[1], &force, &[T::zero(); 3])])
        }
    }
}
