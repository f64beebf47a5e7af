//! Forces on links that do not come from joints: gravity compensation, fluid forces, and external pushes.

use crate::algebra::spatial::*;
use crate::lanes::{Real, kernel_fn};
use crate::sim::Sim;
use crate::state::{Group, Work};

kernel_fn! {
    /// External torques and forces on links.
    pub(crate) fn link_forces<'a, T>(sim: &'a Sim<T>, group: &'a Group<T>, work: &'a mut Work<T>) {
        work.forces.link_applied.resize(sim.links.len(), [T::zero(); 6]);
        gravity_compensation(sim, group, work);
        fluid(sim, work);
        xfrc_applied(sim, group, work);
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
        apply(work, link, &r, &force, &[T::zero(); 3]);
    }
}

/// Viscosity and drag of the medium.
#[inline(always)]
fn fluid<T: Real>(sim: &Sim<T>, work: &mut Work<T>) {
    let z = T::zero();
    for drag in &sim.drags {
        let m = &sim.coms[drag.body];
        let axes = work.motion.axes(m);
        let r = work.motion.arm(m, drag.link);
        let v = &work.motion.vel[drag.link];
        let through = sub3(&cross_add(&ang(v), &r, &lin(v)), &splat3(&sim.wind));
        let (mut force, mut torque) = ([z; 3], [z; 3]);
        for k in 0..3 {
            let (w, u) = (dot(&axes[k], &ang(v)), dot(&axes[k], &through));
            let t = -(w * T::splat(drag.angular[k]).mul_add(w.abs(), T::splat(drag.viscous[0])));
            let f = -(u * T::splat(drag.linear[k]).mul_add(u.abs(), T::splat(drag.viscous[1])));
            for i in 0..3 {
                torque[i] = axes[k][i].mul_add(t, torque[i]);
                force[i] = axes[k][i].mul_add(f, force[i]);
            }
        }
        apply(work, drag.link, &r, &force, &torque);
    }
}

/// Pushes, at the bodies' centers of mass.
#[inline(always)]
fn xfrc_applied<T: Real>(sim: &Sim<T>, group: &Group<T>, work: &mut Work<T>) {
    for (body, push) in group.xfrc_applied.iter().enumerate() {
        let m = &sim.coms[body];
        let Some(link) = m.link else { continue };
        let r = work.motion.arm(m, link);
        apply(work, link, &r, &lin(push), &ang(push));
    }
}

/// Adds a force at a point of a link, and a torque.
#[inline(always)]
fn apply<T: Real>(work: &mut Work<T>, link: usize, r: &V3<T>, force: &V3<T>, torque: &V3<T>) {
    let t = cross_add(r, force, torque);
    for i in 0..3 {
        work.forces.link_applied[link][i] += t[i];
        work.forces.link_applied[link][3 + i] += force[i];
    }
}
