//! Forces on links that do not come from joints: gravity compensation, the [medium](super::fluid), and external pushes.

use super::fluid::fluid;
use super::joint_space::joint_space;
use crate::algebra::spatial::*;
use crate::lanes::{Real, kernel_fn};
use crate::sim::Sim;
use crate::state::{Group, Work};

kernel_fn! {
    /// External torques and forces on links.
    pub(crate) fn link_forces<'a, T>(sim: &'a Sim<T>, group: &'a Group<T>, work: &'a mut Work<T>) {
        work.forces.link_applied.resize(sim.links.len(), [T::zero(); 6]);
        if sim.actuated_gravcomp.is_empty() {
            gravity_compensation(sim, group, work);
        }
        fluid(sim, work);
        xfrc_applied(sim, group, work);
    }
}

kernel_fn! {
    /// Gravity compensation as forces of joints, for models in which some of it counts as an actuator force.
    pub(crate) fn joint_gravity_compensation<'a, T>(sim: &'a Sim<T>, group: &'a Group<T>, work: &'a mut Work<T>) {
        work.forces.link_applied.clear();
        work.forces.link_applied.resize(sim.links.len(), [T::zero(); 6]);
        gravity_compensation(sim, group, work);
        let Work { forces, dofs, .. } = work;
        let [passive, actuated] = &mut forces.gravcomp;
        actuated.fill(T::zero());
        joint_space(sim, dofs, &mut forces.link_applied, actuated);
        passive.fill(T::zero());
        for ((passive, actuated), by_actuator) in passive.iter_mut().zip(actuated).zip(&sim.actuated_gravcomp) {
            if !by_actuator {
                std::mem::swap(passive, actuated);
            }
        }
        // as in MuJoCo, no force acts as an actuator's in a model without actuators
        if sim.actuators.is_empty() {
            forces.gravcomp[1].fill(T::zero());
        }
    }
}

/// Upward forces that carry part of the links' weight.
#[inline(always)]
fn gravity_compensation<T: Real>(sim: &Sim<T>, group: &Group<T>, work: &mut Work<T>) {
    let gravity = group.gravity(sim);
    for carried in &sim.gravcomp {
        let link = carried.link;
        let r = rotate_add(&work.motion.rot[link], &splat3(&carried.at), &work.motion.pos[link]);
        let mut mass = T::splat(carried.mass);
        if let Some(varied) = &group.varied {
            mass *= varied.mass[link];
        }
        let force = [-(gravity[0] * mass), -(gravity[1] * mass), -(gravity[2] * mass)];
        work.forces.push(link, &r, &force, &[T::zero(); 3]);
    }
}

/// Pushes, at the bodies' centers of mass.
#[inline(always)]
fn xfrc_applied<T: Real>(sim: &Sim<T>, group: &Group<T>, work: &mut Work<T>) {
    for (body, push) in group.xfrc_applied.iter().enumerate() {
        let m = &sim.coms[body];
        let Some(link) = m.link else { continue };
        let r = work.motion.arm(m, link);
        work.forces.push(link, &r, &lin(push), &ang(push));
    }
}
