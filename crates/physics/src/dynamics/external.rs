//! Forces on links that do not come from joints: compensation of gravity, a medium, and pushes from outside.

use crate::algebra::spatial::*;
use crate::lanes::{Real, kernel_fn};
use crate::sim::Sim;
use crate::state::{Group, Work};

kernel_fn! {
    /// Wrenches on links from outside, into `external`, and off the bias forces.
    pub(crate) fn external_forces<'a, T>(sim: &'a Sim<T>, group: &'a Group<T>, work: &'a mut Work<T>) {
        let z = T::zero();
        let gravity = group.gravity(sim);
        work.forces.external.resize(sim.links.len(), [z; 6]);
        for lift in &sim.lifts {
            let r = rotate_add(&work.motion.rot[lift.link], &splat3(&lift.at), &work.motion.pos[lift.link]);
            let mut weight = T::splat(lift.mass);
            if let Some(varied) = &group.varied {
                weight *= varied.mass[lift.link];
            }
            push(
                work,
                lift.link,
                &r,
                &[-(gravity[0] * weight), -(gravity[1] * weight), -(gravity[2] * weight)],
                &[z; 3],
            );
        }
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
            push(work, drag.link, &r, &force, &torque);
        }
        for (body, x) in group.external.iter().enumerate() {
            let m = &sim.coms[body];
            let Some(link) = m.link else { continue };
            let r = work.motion.arm(m, link);
            push(work, link, &r, &lin(x), &ang(x));
        }
        for l in 0..sim.links.len() {
            for i in 0..6 {
                work.motion.bias_force[l][i] -= work.forces.external[l][i];
            }
        }
    }
}

/// Adds a force at a point of a link, and a torque.
#[inline(always)]
fn push<T: Real>(work: &mut Work<T>, link: usize, r: &V3<T>, force: &V3<T>, torque: &V3<T>) {
    let t = cross_add(r, force, torque);
    for i in 0..3 {
        work.forces.external[link][i] += t[i];
        work.forces.external[link][3 + i] += force[i];
    }
}
