//! Euler's method with some forces taken at the end of the step: joint damping, and with `integrator="implicitfast"`
//! every velocity-dependent actuator force.

use super::euler::integrate;
use super::implicit::implicit;
use super::implicit_tendons::implicit_tendons;
use crate::algebra::planar::{Full, Planar, Space};
use crate::algebra::spatial::*;
use crate::dynamics::{accelerate, bring_inward, factorize};
use crate::lanes::{Real, kernel_fn};
use crate::sim::Sim;
use crate::solver::apply_forces;
use crate::state::{Group, Work, net_bias_force};

kernel_fn! {
    /// Acceleration with the joint damping taken at the end of the step.
    fn implicit_acceleration<'a, T>(sim: &'a Sim<T>, work: &'a mut Work<T>) {
        implicit_damping::<T, Full>(sim, work);
    }
}
kernel_fn! {
    /// The same for a planar model.
    fn planar_implicit_acceleration<'a, T>(sim: &'a Sim<T>, work: &'a mut Work<T>) {
        implicit_damping::<T, Planar>(sim, work);
    }
}
kernel_fn! {
    /// Moves the state along the implicit acceleration.
    fn integrate_implicit<'a, T>(sim: &'a Sim<T>, group: &'a mut Group<T>, work: &'a mut Work<T>) {
        integrate(sim, group, work, &work.solver.solution);
    }
}

impl<T: Real> Sim<T> {
    pub(super) fn implicitfast(&self, work: &mut Work<T>, group: &mut Group<T>) {
        if let Some(matrix) = &self.tree_matrix {
            if matrix.full {
                implicit(self, group, work, matrix);
            } else {
                implicit_tendons(self, work, matrix);
            }
        } else if self.planar {
            planar_implicit_acceleration(self, work);
        } else {
            implicit_acceleration(self, work);
        }
        integrate_implicit(self, group, work);
    }
}

/// Solves `(M + dt B) a = tau - bias + J' f` for the forces of the constraint solver, into `solution`.
#[inline(always)]
fn implicit_damping<T: Real, S: Space>(sim: &Sim<T>, work: &mut Work<T>) {
    let dt = T::splat(sim.dt);
    let forces = work.forces.minus_qderiv.iter().zip(&work.forces.qfrc_passive_actuator).zip(&sim.armature);
    for (dof, ((damping, force), armature)) in work.dofs.iter_mut().zip(forces) {
        (dof.diag, dof.rhs) = (damping.mul_add(dt, T::splat(*armature)), *force);
    }
    apply_forces::<T, S>(work);
    work.solver.stale.fill(true);
    factorize::<T, S>(sim, work, false);
    accelerate::<T, S>(sim, work);
    // if the solver has not converged, the forces do not match the accelerations
    if sim.hard && sim.capped.is_none() {
        damp::<T, S>(sim, work);
    }
    if sim.implicit_fast {
        for l in 0..sim.links.len() {
            if sim.links[l].alone {
                gyroscope(sim, work, l);
            }
        }
    }
}

/// The same from the accelerations, without the forces, with the existing factors: `(M + dt B) (a' - a) = -dt B a`. The
/// forces of links that [`gyroscope`] solves for stay in `rhs`.
#[inline(always)]
fn damp<T: Real, S: Space>(sim: &Sim<T>, work: &mut Work<T>) {
    let dt = T::splat(sim.dt);
    for (l, link) in sim.links.iter().enumerate() {
        work.solver.link_force[l] = [T::zero(); 6];
        if !(sim.implicit_fast && link.alone) {
            for d in link.dofs.clone() {
                work.dofs[d].rhs = -(work.forces.minus_qderiv[d] * dt * work.solver.qacc[d]);
            }
        }
    }
    bring_inward::<T, S>(sim, work);
    accelerate::<T, S>(sim, work);
    for (x, a) in work.solver.solution.iter_mut().zip(&work.solver.qacc) {
        *x += *a;
    }
}

/// Solves for the acceleration of a free body, into `solution`, with the bias force at the end of the step, too.
///
/// With the first moment m c and the inertia J about the body's origin, the bias is `w x (w x m c)` and `w x J w`. Its
/// derivative is not symmetric, so this body is solved separately (MuJoCo documentation, "Integrators").
#[inline(always)]
fn gyroscope<T: Real>(sim: &Sim<T>, work: &mut Work<T>, l: usize) {
    let (d, dt) = (sim.links[l].dofs.start, T::splat(sim.dt));
    let [m, x, y, z, jxx, jyy, jzz, jxy, jxz, jyz] = work.motion.inertia[l];
    let (moment, w) = ([x, y, z], ang(&work.motion.vel[l]));
    // symmetric, so rows are columns
    let inertia = [[jxx, jxy, jxz], [jxy, jyy, jyz], [jxz, jyz, jzz]];
    let spin = rotate(&inertia, &w);
    let mut wrench = net_bias_force(&work.motion.bias_force, &work.forces.link_applied, l);
    if work.solver.in_contact[l] {
        for i in 0..6 {
            wrench[i] -= work.solver.wrench[l][i];
        }
    }
    // torques are along the body's axes
    let dofs = &work.dofs[d..d + 6];
    let axes = [ang(&dofs[3].axis), ang(&dofs[4].axis), ang(&dofs[5].axis)];
    let torque = sub3(&rotate(&axes, &[dofs[3].rhs, dofs[4].rhs, dofs[5].rhs]), &ang(&wrench));
    let force = sub3(&[dofs[0].rhs, dofs[1].rhs, dofs[2].rhs], &lin(&wrench));
    let (mass, along) = ((m + dofs[0].diag).recip(), dot(&w, &moment));
    // derivative with respect to `w`, column by column: of the force, and of the torque about the origin
    let mut columns = [[T::zero(); 3]; 3];
    let mut pulls = [[T::zero(); 3]; 3];
    for k in 0..3 {
        let mut e = [T::zero(); 3];
        e[k] = T::lit(1.0);
        // e x m c, and the derivative of w x (w x m c)
        let mut pull = cross(&e, &moment);
        let mut column = inertia[k];
        let bend = sub3(&cross(&w, &inertia[k]), &cross(&spin, &e));
        for i in 0..3 {
            let lean = w[i].mul_add(moment[k], T::lit(-2.0) * (moment[i] * w[k]));
            pull[i] = lean.mul_add(dt, pull[i]);
            column[i] = bend[i].mul_add(dt, column[i]);
        }
        pull[k] = along.mul_add(dt, pull[k]);
        column[k] += dofs[3 + k].diag;
        // eliminate the acceleration of the origin
        let arm = cross(&moment, &pull);
        for i in 0..3 {
            column[i] = (arm[i] * mass).neg_mul_add(T::lit(1.0), column[i]);
        }
        (columns[k], pulls[k]) = (column, pull);
    }
    let arm = cross(&moment, &force);
    let mut rest = torque;
    for i in 0..3 {
        rest[i] = (arm[i] * mass).neg_mul_add(T::lit(1.0), rest[i]);
    }
    // Cramer's rule
    let across = [cross(&columns[1], &columns[2]), cross(&columns[2], &columns[0]), cross(&columns[0], &columns[1])];
    let inverse = dot(&columns[0], &across[0]).recip();
    let turn = [dot(&across[0], &rest) * inverse, dot(&across[1], &rest) * inverse, dot(&across[2], &rest) * inverse];
    let held = rotate(&pulls, &turn);
    for i in 0..3 {
        work.solver.solution[d + i] = (force[i] - held[i]) * mass;
        work.solver.solution[d + 3 + i] = dot(&axes[i], &turn);
    }
}
