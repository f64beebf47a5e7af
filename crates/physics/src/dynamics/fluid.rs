//! Forces of the medium on bodies, and their derivatives by the velocities of the links.

use super::ellipsoid::{ellipsoid_derivative, ellipsoid_force};
use crate::algebra::spatial::*;
use crate::lanes::Real;
use crate::sim::{Drag, EllipsoidDrag, Sim};
use crate::state::{Motion, Work};

/// Viscosity and drag of the medium.
#[inline(always)]
pub(super) fn fluid<T: Real>(sim: &Sim<T>, work: &mut Work<T>) {
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
        work.forces.push(drag.link, &r, &force, &torque);
    }
    for drag in &sim.ellipsoid_drags {
        let (axes, r, w, v) = through_medium(sim, &work.motion, drag);
        let [torque, force] = ellipsoid_force(drag, &w, &v);
        work.forces.push(drag.link, &r, &rotate(&axes, &force), &rotate(&axes, &torque));
    }
}

/// Axes and place of a geom, and its velocity through the medium along these axes.
#[inline(always)]
fn through_medium<T: Real>(
    sim: &Sim<T>,
    motion: &Motion<T>,
    drag: &EllipsoidDrag<T::Scalar>,
) -> (Rot<T>, V3<T>, V3<T>, V3<T>) {
    let m = &sim.geoms[drag.geom];
    let (axes, r, v) = (motion.axes(m), motion.arm(m, drag.link), &motion.vel[drag.link]);
    let through = sub3(&cross_add(&ang(v), &r, &lin(v)), &splat3(&sim.wind));
    (axes, r, into_axes(&axes, &ang(v)), into_axes(&axes, &through))
}

/// Adds the negative derivatives of the medium's forces on the links by the velocities of the links. `symmetric`: as
/// `implicitfast` takes them.
#[inline(always)]
pub(crate) fn add_fluid_derivatives<T: Real>(
    sim: &Sim<T>,
    motion: &Motion<T>,
    symmetric: bool,
    links: &mut [[[T; 6]; 6]],
) {
    for drag in &sim.drags {
        add_box_derivative(sim, motion, drag, &mut links[drag.link]);
    }
    for drag in &sim.ellipsoid_drags {
        add_ellipsoid_derivative(sim, motion, drag, symmetric && !drag.alone, &mut links[drag.link]);
    }
}

/// The same for one geom.
#[inline(always)]
fn add_ellipsoid_derivative<T: Real>(
    sim: &Sim<T>,
    motion: &Motion<T>,
    drag: &EllipsoidDrag<T::Scalar>,
    symmetric: bool,
    out: &mut [[T; 6]; 6],
) {
    let z = T::zero();
    let (axes, r, w, v) = through_medium(sim, motion, drag);
    let own = ellipsoid_derivative(drag, &w, &v);
    // rates of the geom's velocities, and their torques and forces on the link
    let mut rates = [[z; 6]; 6];
    for k in 0..3 {
        let (a, t) = (axes[k], cross(&r, &axes[k]));
        rates[k] = [a[0], a[1], a[2], z, z, z];
        rates[3 + k] = [t[0], t[1], t[2], a[0], a[1], a[2]];
    }
    for p in 0..6 {
        let mut by = [z; 6];
        for q in 0..6 {
            let x = if symmetric { T::lit(0.5) * (own[p][q] + own[q][p]) } else { own[p][q] };
            by = axpy6(&rates[q], x, &by);
        }
        for i in 0..6 {
            for j in 0..6 {
                out[i][j] = rates[p][i].neg_mul_add(by[j], out[i][j]);
            }
        }
    }
}

/// The same for one body.
#[inline(always)]
fn add_box_derivative<T: Real>(sim: &Sim<T>, motion: &Motion<T>, drag: &Drag<T::Scalar>, out: &mut [[T; 6]; 6]) {
    let (z, two) = (T::zero(), T::lit(2.0));
    let m = &sim.coms[drag.body];
    let axes = motion.axes(m);
    let r = motion.arm(m, drag.link);
    let v = &motion.vel[drag.link];
    let through = sub3(&cross_add(&ang(v), &r, &lin(v)), &splat3(&sim.wind));
    for k in 0..3 {
        let (w, u) = (dot(&axes[k], &ang(v)), dot(&axes[k], &through));
        let turning = (two * T::splat(drag.angular[k])).mul_add(w.abs(), T::splat(drag.viscous[0]));
        let pushing = (two * T::splat(drag.linear[k])).mul_add(u.abs(), T::splat(drag.viscous[1]));
        let (t, a) = (cross(&r, &axes[k]), axes[k]);
        add_outer(out, &[a[0], a[1], a[2], z, z, z], turning);
        add_outer(out, &[t[0], t[1], t[2], a[0], a[1], a[2]], pushing);
    }
}

/// Adds `s d s'`.
#[inline(always)]
fn add_outer<T: Real>(out: &mut [[T; 6]; 6], s: &V6<T>, d: T) {
    for i in 0..6 {
        let x = s[i] * d;
        for j in 0..6 {
            out[i][j] = x.mul_add(s[j], out[i][j]);
        }
    }
}
