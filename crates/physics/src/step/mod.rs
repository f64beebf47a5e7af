//! One step, stage by stage.

use crate::algebra::planar::{Full, Planar, Space};
use crate::algebra::spatial::*;
use crate::collision::{collide_floor, collide_pairs};
use crate::constraint::{equality_blocks, joint_rows, tendon_blocks};
use crate::dynamics::*;
use crate::lanes::{Kernel, Real, kernel_fn};
use crate::model::JointType;
use crate::sim::Sim;
use crate::solver::{apply_forces, solve};
use crate::state::{Group, Work};

kernel_fn! {
    /// Frames, axes, inertias, velocities.
    fn motion_stage<'a, T>(sim: &'a Sim<T>, group: &'a Group<T>, work: &'a mut Work<T>) {
        kinematics(sim, group, work);
        velocities(sim, group, work);
    }
}
kernel_fn! {
    /// Applied forces.
    fn force_stage<'a, T>(sim: &'a Sim<T>, group: &'a Group<T>, work: &'a mut Work<T>) {
        measure_tendons(sim, group, work);
        passive(sim, group, work);
        tendon_springs(sim, work);
        actuation(sim, group, work);
    }
}
kernel_fn! {
    /// Contacts, limits, dry friction.
    fn constraint_stage<'a, T>(sim: &'a Sim<T>, group: &'a Group<T>, work: &'a mut Work<T>) {
        work.put_rows_aside();
        collide_floor(sim, group, work);
        joint_rows(sim, group, work);
    }
}
kernel_fn! {
    /// Contacts that are not points above a level floor.
    fn pair_stage<'a, T>(sim: &'a Sim<T>, group: &'a Group<T>, work: &'a mut Work<T>) {
        collide_pairs(sim, group, work);
    }
}
kernel_fn! {
    /// Constrained acceleration.
    fn solver_stage<'a, T>(sim: &'a Sim<T>, group: &'a Group<T>, work: &'a mut Work<T>) {
        solve::<T, Full>(sim, group, work);
    }
}
kernel_fn! {
    /// The same for a planar model.
    fn planar_solver_stage<'a, T>(sim: &'a Sim<T>, group: &'a Group<T>, work: &'a mut Work<T>) {
        solve::<T, Planar>(sim, group, work);
    }
}
kernel_fn! {
    /// Acceleration with the joint damping taken at the end of the step.
    fn damping_stage<'a, T>(sim: &'a Sim<T>, work: &'a mut Work<T>) {
        implicit_damping::<T, Full>(sim, work);
    }
}
kernel_fn! {
    /// The same for a planar model.
    fn planar_damping_stage<'a, T>(sim: &'a Sim<T>, work: &'a mut Work<T>) {
        implicit_damping::<T, Planar>(sim, work);
    }
}
kernel_fn! {
    /// Velocities, activations and positions at the end of the step.
    fn integrate<'a, T>(sim: &'a Sim<T>, group: &'a mut Group<T>, work: &'a mut Work<T>) {
        let dt = T::splat(sim.dt);
        let acc = if sim.implicit_damping { &work.solver.next } else { &work.solver.acc };
        group.warm.copy_from_slice(&work.solver.acc);
        for (v, a) in group.qvel.iter_mut().zip(acc) {
            *v = a.mul_add(dt, *v);
        }
        advance_activations(sim, &mut group.act, &work.forces.act_dot);
        integrate_positions(sim, &mut group.qpos, &group.qvel, dt);
    }
}

/// A stage of [`Sim::forward`]; public for the benchmark of the stages alone.
#[doc(hidden)]
#[derive(Clone, Copy, Debug)]
pub enum Stage {
    /// Frames, velocities, applied forces.
    Smooth,
    /// Collision detection and the rows of all constraints.
    Constraints,
    /// Constrained acceleration.
    Solver,
}

impl<T: Real> Sim<T> {
    /// Accelerations and constraint forces at the present state; the state does not change.
    pub fn forward(&self, work: &mut Work<T>, group: &Group<T>) {
        work.continues = false;
        self.forward_again(work, group);
    }

    /// The same, of a group that was advanced a little since the last evaluation if [`Work::continues`] says so.
    fn forward_again(&self, work: &mut Work<T>, group: &Group<T>) {
        for stage in [Stage::Smooth, Stage::Constraints, Stage::Solver] {
            self.stage(stage, work, group);
        }
        work.continues = true;
    }

    /// One stage of [`Sim::forward`], after those before it.
    #[doc(hidden)]
    pub fn run_stage(&self, stage: Stage, work: &mut Work<T>, group: &Group<T>) {
        work.continues = false;
        self.stage(stage, work, group);
    }

    fn stage(&self, stage: Stage, work: &mut Work<T>, group: &Group<T>) {
        match stage {
            Stage::Smooth => {
                motion_stage(self, group, work);
                force_stage(self, group, work);
                work.forces.external.clear();
                work.forces.bias_is_net =
                    !self.lifts.is_empty() || !self.drags.is_empty() || !group.external.is_empty();
                if work.forces.bias_is_net {
                    external_forces(self, group, work);
                }
            }
            Stage::Constraints => {
                constraint_stage(self, group, work);
                if !self.equalities.is_empty() {
                    equality_blocks(self, group, work);
                }
                if !self.tendons.is_empty() || !self.ball_limits.is_empty() {
                    tendon_blocks(self, group, work);
                }
                if !self.contacts.pairs.is_empty() {
                    pair_stage(self, group, work);
                }
            }
            Stage::Solver if self.planar => planar_solver_stage(self, group, work),
            Stage::Solver => solver_stage(self, group, work),
        }
    }

    /// The end of a step after [`Sim::forward`]: damping taken at the end of the step, integration.
    #[doc(hidden)]
    pub fn finish_step(&self, work: &mut Work<T>, group: &mut Group<T>) {
        if self.implicit_damping {
            if self.planar {
                planar_damping_stage(self, work);
            } else {
                damping_stage(self, work);
            }
        }
        integrate(self, group, work);
    }

    /// Advances every agent of a group by `substeps` steps with its present controls, then brings the readings
    /// (positions and velocities) up to date.
    pub fn step(&self, work: &mut Work<T>, group: &mut Group<T>, substeps: usize) {
        self.advance(work, group, substeps);
        self.refresh(work, group);
    }

    /// The same without bringing the readings up to date: they show the state from which the last physics step computed
    /// its forces, as after MuJoCo's `mj_step` (with RK4, the state of its last stage).
    ///
    /// What a step learns helps the next ones of the same call, which makes it faster than as many calls of one step each.
    /// The results are the same to rounding; equal bits take equal calls.
    pub fn advance(&self, work: &mut Work<T>, group: &mut Group<T>, substeps: usize) {
        for touched in work.contacts.touched.iter_mut() {
            *touched = T::none();
        }
        work.continues = false;
        for _ in 0..substeps {
            if self.rk4 {
                self.step_rk4(work, group);
            } else {
                self.forward_again(work, group);
                self.finish_step(work, group);
            }
        }
    }

    /// Recomputes positions and velocities of bodies at the present state.
    pub fn refresh(&self, work: &mut Work<T>, group: &Group<T>) {
        motion_stage(self, group, work);
        work.forces.bias_is_net = false;
    }

    /// The same, and the forces of the actuators there, which [`Sim::measure_actuators`] then makes readable.
    pub fn refresh_actuators(&self, work: &mut Work<T>, group: &Group<T>) {
        motion_stage(self, group, work);
        force_stage(self, group, work);
        work.forces.bias_is_net = false;
    }

    /// Classical Runge-Kutta over the whole dynamics.
    fn step_rk4(&self, work: &mut Work<T>, group: &mut Group<T>) {
        let mut stages = std::mem::take(&mut work.stages);
        let [start, sum] = stages.as_mut_slice() else { unreachable!("a model with RK4 has two stage states") };
        start.qpos.copy_from_slice(&group.qpos);
        start.qvel.copy_from_slice(&group.qvel);
        start.act.copy_from_slice(&group.act);
        // weighted sums of velocities and accelerations live in `sum.qvel` and `sum.warm`
        let tableau = [(1.0, 0.0, 0.5), (2.0, 0.5, 0.5), (2.0, 0.5, 1.0), (1.0, 1.0, 0.0)];
        for (stage, (weight, reach_before, reach)) in tableau.into_iter().enumerate() {
            self.forward_again(work, group);
            let first = stage == 0;
            T::enter(RkStage { sim: self, work, group, start, sum, first, weight, reach_before, reach });
        }
        work.stages = stages;
    }
}

/// Adds one stage's derivatives to the weighted sum and moves to the next stage's state, or to the end of the step.
struct RkStage<'a, T: Real> {
    sim: &'a Sim<T>,
    work: &'a mut Work<T>,
    group: &'a mut Group<T>,
    start: &'a mut Group<T>,
    sum: &'a mut Group<T>,
    first: bool,
    weight: f64,
    /// Fraction of the step at which this stage was taken.
    reach_before: f64,
    /// Fraction of the step at which the next stage is taken; 0 after the last.
    reach: f64,
}
impl<T: Real> Kernel<T> for RkStage<'_, T> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        let RkStage { sim, work, group, start, sum, first, weight, reach_before, reach } = self;
        let dt = T::splat(sim.dt);
        let w = T::lit(weight);
        // velocities in the coordinates of the start's tangent space; `start.warm` holds those of the stage before
        let mut rate = std::mem::take(&mut sum.ctrl);
        rate.clear();
        rate.extend_from_slice(&group.qvel);
        if !first {
            correct_rotations(sim, &start.warm, &mut rate, dt * T::lit(reach_before));
        }
        for d in 0..sim.model.nv {
            let (v, a) = (rate[d] * w, work.solver.acc[d] * w);
            sum.qvel[d] = if first { v } else { sum.qvel[d] + v };
            sum.warm[d] = if first { a } else { sum.warm[d] + a };
        }
        for (s, rate) in sum.act.iter_mut().zip(&work.forces.act_dot) {
            *s = if first { *rate * w } else { rate.mul_add(w, *s) };
        }
        group.warm.copy_from_slice(&work.solver.acc);
        group.qpos.copy_from_slice(&start.qpos);
        if reach > 0.0 {
            let h = dt * T::lit(reach);
            for i in 0..group.act.len() {
                group.act[i] = work.forces.act_dot[i].mul_add(h, start.act[i]);
            }
            integrate_positions(sim, &mut group.qpos, &rate, h);
            for d in 0..sim.model.nv {
                group.qvel[d] = work.solver.acc[d].mul_add(h, start.qvel[d]);
            }
            start.warm.copy_from_slice(&rate);
        } else {
            let h = dt * T::lit(1.0 / 6.0);
            for (mean, s) in work.forces.act_dot.iter_mut().zip(&sum.act) {
                *mean = *s * T::lit(1.0 / 6.0);
            }
            group.act.copy_from_slice(&start.act);
            advance_activations(sim, &mut group.act, &work.forces.act_dot);
            integrate_positions(sim, &mut group.qpos, &sum.qvel, h);
            for d in 0..sim.model.nv {
                group.qvel[d] = sum.warm[d].mul_add(h, start.qvel[d]);
            }
        }
        sum.ctrl = rate;
    }
}

/// Angular velocities of rotated stages as rates of the rotation vector from the start (Munthe-Kaas: the inverse of the
/// exponential's differential), which is what makes the method of fourth order for quaternions.
///
/// `rate` holds the stage's velocities, `before` the rates of the stage that led here in `h` seconds.
#[inline(always)]
fn correct_rotations<T: Real>(sim: &Sim<T>, before: &[T], rate: &mut [T], h: T) {
    for joint in &sim.joints {
        let d = match joint.kind {
            JointType::Free => joint.dof + 3,
            JointType::Ball => joint.dof,
            _ => continue,
        };
        let u = [before[d] * h, before[d + 1] * h, before[d + 2] * h];
        let w = [rate[d], rate[d + 1], rate[d + 2]];
        let once = cross(&u, &w);
        let twice = cross(&u, &once);
        // (1 - t/2 cot(t/2)) / t^2 for the angle t, as its series
        let t2 = dot(&u, &u);
        let c = T::lit(1.0 / 1_209_600.0).mul_add(t2, T::lit(1.0 / 30_240.0));
        let c = c.mul_add(t2, T::lit(1.0 / 720.0)).mul_add(t2, T::lit(1.0 / 12.0));
        for i in 0..3 {
            rate[d + i] = c.mul_add(twice[i], T::lit(0.5).mul_add(once[i], w[i]));
        }
    }
}

/// Solves `(M + dt B) a = tau - bias + J' f` for the forces of the constraint solver, into `next`.
#[inline(always)]
fn implicit_damping<T: Real, S: Space>(sim: &Sim<T>, work: &mut Work<T>) {
    let dt = T::splat(sim.dt);
    for d in 0..sim.model.nv {
        work.solver.diag[d] = work.forces.rate[d].mul_add(dt, T::splat(sim.armature[d]));
        work.solver.rhs[d] = work.forces.tau[d];
    }
    apply_forces::<T, S>(work);
    work.solver.stale.fill(true);
    factorize::<T, S>(sim, work, false);
    accelerate::<T, S>(sim, work);
    if sim.hard {
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

/// The same from the accelerations, without the forces, with the factors at hand: `(M + dt B) (a' - a) = -dt B a`. Of what
/// [`gyroscope`] does anew, the forces stay in `rhs`.
#[inline(always)]
fn damp<T: Real, S: Space>(sim: &Sim<T>, work: &mut Work<T>) {
    let dt = T::splat(sim.dt);
    for (l, link) in sim.links.iter().enumerate() {
        work.solver.link_force[l] = [T::zero(); 6];
        if !(sim.implicit_fast && link.alone) {
            for d in link.dofs.clone() {
                work.solver.rhs[d] = -(work.forces.rate[d] * dt * work.solver.acc[d]);
            }
        }
    }
    bring_inward::<T, S>(sim, work);
    accelerate::<T, S>(sim, work);
    for (x, a) in work.solver.next.iter_mut().zip(&work.solver.acc) {
        *x += *a;
    }
}

/// Solves for the acceleration of a free body, into `next`, with the bias force too taken at the end of the step.
///
/// With the first moment m c and the inertia J about the body's origin, the bias is `w x (w x m c)` and `w x J w`; its
/// derivative is not symmetric, so this body is solved for on its own (MuJoCo documentation, "Integrators").
#[inline(always)]
fn gyroscope<T: Real>(sim: &Sim<T>, work: &mut Work<T>, l: usize) {
    let (d, dt) = (sim.links[l].dofs.start, T::splat(sim.dt));
    let [m, x, y, z, jxx, jyy, jzz, jxy, jxz, jyz] = work.motion.inertia[l];
    let (moment, w) = ([x, y, z], ang(&work.motion.vel[l]));
    // symmetric, so rows are columns
    let inertia = [[jxx, jxy, jxz], [jxy, jyy, jyz], [jxz, jyz, jzz]];
    let spin = rotate(&inertia, &w);
    let mut wrench = work.motion.bias_force[l];
    if work.solver.in_contact[l] {
        for i in 0..6 {
            wrench[i] -= work.solver.wrench[l][i];
        }
    }
    // torques are given along the body's axes
    let axes = [ang(&work.motion.axis[d + 3]), ang(&work.motion.axis[d + 4]), ang(&work.motion.axis[d + 5])];
    let torque =
        sub3(&rotate(&axes, &[work.solver.rhs[d + 3], work.solver.rhs[d + 4], work.solver.rhs[d + 5]]), &ang(&wrench));
    let force = sub3(&[work.solver.rhs[d], work.solver.rhs[d + 1], work.solver.rhs[d + 2]], &lin(&wrench));
    let (mass, along) = ((m + work.solver.diag[d]).recip(), dot(&w, &moment));
    // what turning by `w` changes, column by column: the force, and the torque about the origin
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
        column[k] += work.solver.diag[d + 3 + k];
        // the origin gives way
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
        work.solver.next[d + i] = (force[i] - held[i]) * mass;
        work.solver.next[d + 3 + i] = dot(&axes[i], &turn);
    }
}

/// `qpos` moved along `qvel` for `h` seconds; quaternions stay normalized.
#[inline(always)]
fn integrate_positions<T: Real>(sim: &Sim<T>, qpos: &mut [T], qvel: &[T], h: T) {
    for joint in &sim.joints {
        let (q, d) = (joint.qpos, joint.dof);
        match joint.kind {
            JointType::Hinge | JointType::Slide => qpos[q] = qvel[d].mul_add(h, qpos[q]),
            JointType::Ball => turn(&mut qpos[q..q + 4], &[qvel[d], qvel[d + 1], qvel[d + 2]], h),
            JointType::Free => {
                for i in 0..3 {
                    qpos[q + i] = qvel[d + i].mul_add(h, qpos[q + i]);
                }
                turn(&mut qpos[q + 3..q + 7], &[qvel[d + 3], qvel[d + 4], qvel[d + 5]], h);
            }
        }
    }
}

#[inline(always)]
fn turn<T: Real>(q: &mut [T], w: &V3<T>, h: T) {
    let r = integrate_quat(&[q[0], q[1], q[2], q[3]], w, h);
    q.copy_from_slice(&r);
}
