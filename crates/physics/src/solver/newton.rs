//! Newton's iteration over all rows.

use super::{blocks, coupled, crowd, search};
use crate::algebra::planar::Space;
use crate::algebra::spatial::*;
use crate::dynamics::{accelerate, bring_inward, factorize, link_accelerations};
use crate::lanes::Real;
use crate::rows::NewtonStep;
use crate::sim::Sim;
use crate::state::{Group, Work, net_bias_force};

/// Solves for the constrained acceleration, into `acc`. Rows end with their true forces.
#[inline(always)]
pub(crate) fn solve<T: Real, S: Space>(sim: &Sim<T>, group: &Group<T>, work: &mut Work<T>) {
    start::<T, S>(sim, group, work);
    let free = work.rows.contacts.is_empty()
        && work.rows.limits.is_empty()
        && work.rows.dry.is_empty()
        && work.rows.blocks.is_empty();
    let any_coupled = blocks::any_coupled(work);
    work.solver.crowded = if any_coupled { crowd::start(sim, work) } else { T::none() };
    let mut done = T::none();
    // lanes that stopped at a Newton point of their own active set
    let mut arrived = T::none();
    let mut iteration = 0;
    loop {
        assemble::<T, S>(sim, work);
        solve_system::<T, S>(sim, work, T::not(done), any_coupled);
        iteration += 1;
        if free {
            work.solver.qacc.copy_from_slice(&work.solver.solution);
            arrived = T::not(arrived);
            break;
        }
        let changed = newton_point(work);
        let exact = T::not(changed);
        arrived = T::or(arrived, T::and(exact, T::not(done)));
        if T::all(T::or(done, exact)) {
            // every live lane arrived
            advance(sim, work, &NewtonStep { done, exact, alpha: T::lit(1.0), last: exact });
            done = T::or(done, exact);
        } else if iteration == 1 {
            // the warm start only selects the active set and satisfies no identity: take the whole step
            advance(sim, work, &NewtonStep { done, exact: T::not(T::none()), alpha: T::lit(1.0), last: exact });
            done = exact;
        } else {
            let (alpha, small) = search::line_search(sim, work, T::or(done, exact), iteration);
            if sim.elliptic {
                arrived = T::or(arrived, T::and(small, T::not(done)));
            }
            let last = T::or(exact, small);
            advance(sim, work, &NewtonStep { done, exact, alpha, last });
            done = T::or(done, last);
        }
        if T::all(done) || iteration >= sim.max_newton {
            break;
        }
    }
    true_forces(work);
    refine::<T, S>(sim, work, arrived, any_coupled && !T::all(work.solver.crowded));
    report_forces(sim, work);
    work.stats.solves += 1;
    work.stats.newton += iteration as u64;
    work.stats.max_newton = work.stats.max_newton.max(iteration as u64);
    if !free {
        work.stats.unconverged += T::bits(T::not(done)).count_ones() as u64;
    }
}

/// Solves the current system: the Newton point, into `solution` and `link_acc`. For agents in crowds, only lanes in
/// `live` matter.
#[inline(always)]
pub(super) fn solve_system<T: Real, S: Space>(sim: &Sim<T>, work: &mut Work<T>, live: T::Mask, any_coupled: bool) {
    // lanes whose tree is corrected for its coupled blocks, and other lanes
    let (crowd, trees) = (T::any(work.solver.crowded), !T::all(work.solver.crowded));
    if crowd {
        crowd::factorize(sim, work, T::and(work.solver.crowded, live));
    }
    if any_coupled && trees {
        // links that are not stale keep their inward pass, without the correction of the last iteration
        let fresh = work.solver.stale.contains(&true);
        for dof in &mut work.dofs {
            dof.drive = dof.tree_drive;
        }
        factorize::<T, S>(sim, work, true);
        for dof in &mut work.dofs {
            dof.tree_drive = dof.drive;
        }
        coupled::factorize(sim, work, fresh);
        coupled::correct(sim, work, true);
    } else if trees {
        factorize::<T, S>(sim, work, true);
    }
    work.solver.stale.fill(false);
    if trees {
        accelerate::<T, S>(sim, work);
    }
    if crowd {
        crowd::solve(sim, work, T::and(work.solver.crowded, live), false);
    }
}

/// Initial active sets: those of the previous evaluation if there was one, else those at the warm start.
#[inline(always)]
fn start<T: Real, S: Space>(sim: &Sim<T>, group: &Group<T>, work: &mut Work<T>) {
    work.solver.stale.fill(true);
    let in_contact = &mut work.solver.in_contact[..];
    in_contact.fill(false);
    let mut known = true;
    for c in &work.rows.contacts {
        in_contact[c.link] = true;
        known &= !T::any(T::and(c.on, T::not(c.recalled)));
    }
    for l in &work.rows.limits {
        known &= !T::any(T::and(l.on, T::not(l.recalled)));
    }
    for f in &work.rows.dry {
        known &= f.recalled;
    }
    if !work.rows.blocks.is_empty() {
        known &= blocks::recall(work);
    }
    if !known {
        warm_start::<T, S>(sim, group, work);
    }
    if !work.rows.blocks.is_empty() {
        blocks::start(work, known);
    }
}

/// Row values at the warm start, and the active sets of new rows.
#[inline(always)]
fn warm_start<T: Real, S: Space>(sim: &Sim<T>, group: &Group<T>, work: &mut Work<T>) {
    if sim.warmstart {
        work.solver.qacc.copy_from_slice(&group.qacc_warmstart);
    } else {
        work.solver.qacc.fill(T::zero());
    }
    link_accelerations::<T, S>(sim, work);
    let (link_acc, qacc) = (&work.solver.link_acc[..], &work.solver.qacc[..]);
    for c in work.rows.contacts.iter_mut() {
        let ja = c.of_motion(&link_acc[c.link]);
        c.u = add3(&ja, &c.u0);
        c.activate(T::not(c.recalled));
    }
    for l in work.rows.limits.iter_mut() {
        l.u = l.sign.mul_add(qacc[l.dof], l.u0);
        l.activate(T::not(l.recalled));
    }
    for f in work.rows.dry.iter_mut() {
        f.u = qacc[f.dof] + f.u0;
        if !f.recalled {
            f.activate(T::not(T::none()));
        }
    }
}

/// Stiffness and right-hand side of the current active set, for the links where it changed.
#[inline(always)]
pub(super) fn assemble<T: Real, S: Space>(sim: &Sim<T>, work: &mut Work<T>) {
    let z = T::zero();
    let n = sim.links.len();
    let Work { rows, solver, dofs, forces, .. } = work;
    let (stale, in_contact) = (&solver.stale[..n], &solver.in_contact[..n]);
    let (stiffness, wrench) = (&mut solver.stiffness[..n], &mut solver.wrench[..n]);
    for l in 0..n {
        if stale[l] && in_contact[l] {
            (stiffness[l], wrench[l]) = ([z; 21], [z; 6]);
        }
    }
    let joints = sim.dof_link.iter().zip(&sim.armature).zip(&forces.qfrc_passive_actuator);
    for (dof, ((link, armature), force)) in dofs.iter_mut().zip(joints) {
        if stale[*link] {
            (dof.diag, dof.rhs) = (T::splat(*armature), *force);
        }
    }
    for c in rows.contacts.iter().filter(|c| stale[c.link]) {
        c.add_stiffness::<S>(&mut stiffness[c.link]);
        S::add(&mut wrench[c.link], &c.wrench(&c.linear_force(&c.u0)));
    }
    for l in rows.limits.iter().filter(|l| stale[l.link]) {
        let s = T::masked(l.active, l.d);
        let dof = &mut dofs[l.dof];
        dof.diag += s;
        dof.rhs += -(l.sign * (s * l.u0));
    }
    for f in rows.dry.iter().filter(|f| stale[f.link]) {
        let dof = &mut dofs[f.dof];
        dof.diag += T::masked(f.sticking, f.d);
        dof.rhs += f.linear(f.u0);
    }
    if !work.rows.blocks.is_empty() {
        blocks::assemble(sim, work);
    }
}

/// Row values at the Newton point. Returns lanes whose active set there differs from that of the solve.
#[inline(always)]
fn newton_point<T: Real>(work: &mut Work<T>) -> T::Mask {
    let mut changed = T::none();
    let (link_acc, solution) = (&work.solver.link_acc[..], &work.solver.solution[..]);
    for c in work.rows.contacts.iter_mut() {
        changed = T::or(changed, c.newton_point(&link_acc[c.link]));
    }
    for l in work.rows.limits.iter_mut() {
        changed = T::or(changed, l.newton_point(solution[l.dof]));
    }
    for f in work.rows.dry.iter_mut() {
        changed = T::or(changed, f.newton_point(solution[f.dof]));
    }
    if !work.rows.blocks.is_empty() {
        changed = T::or(changed, blocks::newton_point(work));
    }
    changed
}

/// Moves the lanes and marks the links whose system changed.
#[inline(always)]
fn advance<T: Real>(sim: &Sim<T>, work: &mut Work<T>, step: &NewtonStep<T>) {
    for (a, n) in work.solver.qacc.iter_mut().zip(&work.solver.solution) {
        *a = step.of(*a, *n);
    }
    let stale = &mut work.solver.stale[..];
    for c in work.rows.contacts.iter_mut() {
        stale[c.link] |= T::any(c.advance(step));
    }
    for l in work.rows.limits.iter_mut() {
        stale[l.link] |= T::any(l.advance(step));
    }
    for f in work.rows.dry.iter_mut() {
        stale[f.link] |= T::any(f.advance(step));
    }
    if !work.rows.blocks.is_empty() {
        blocks::advance(sim, work, *step);
    }
}

/// The true force of every row at the current point.
#[inline(always)]
fn true_forces<T: Real>(work: &mut Work<T>) {
    for c in work.rows.contacts.iter_mut() {
        c.force = c.true_force(&c.u);
    }
    for l in work.rows.limits.iter_mut() {
        l.force = l.true_force(l.u);
    }
    for f in work.rows.dry.iter_mut() {
        f.force = f.true_force(f.u);
    }
    if !work.rows.blocks.is_empty() {
        blocks::true_forces(work);
    }
}

/// One step of iterative refinement: evaluates the residual of the equation of motion link by link, and solves for it
/// with the matrix of the last iteration. It removes most of the rounding error of stiff contacts in single precision
/// at low cost. Only for lanes in `arrived`, because the matrix is that of their active set.
#[inline(always)]
fn refine<T: Real, S: Space>(sim: &Sim<T>, work: &mut Work<T>, arrived: T::Mask, coupled: bool) {
    let joints = work.solver.qacc.iter().zip(&work.forces.qfrc_passive_actuator).zip(&sim.armature);
    for (dof, ((acc, force), armature)) in work.dofs.iter_mut().zip(joints) {
        dof.rhs = T::splat(*armature).neg_mul_add(*acc, *force);
    }
    apply_forces::<T, S>(work);
    link_accelerations::<T, S>(sim, work);
    let n = sim.links.len();
    let Work { motion, forces, solver, .. } = work;
    let (inertia, link_acc, wrench) = (&motion.inertia[..n], &solver.link_acc[..n], &solver.wrench[..n]);
    let (bias_force, applied) = (&motion.bias_force[..n], &forces.link_applied[..]);
    let (in_contact, link_force) = (&solver.in_contact[..n], &mut solver.link_force[..n]);
    for l in 0..n {
        let mut f = S::momentum(&inertia[l], &link_acc[l]);
        S::add(&mut f, &net_bias_force(bias_force, applied, l));
        if in_contact[l] {
            S::sub(&mut f, &wrench[l]);
        }
        link_force[l] = f;
    }
    if !T::all(work.solver.crowded) {
        bring_inward::<T, S>(sim, work);
        if coupled {
            coupled::correct(sim, work, false);
        }
        accelerate::<T, S>(sim, work);
    }
    if T::any(work.solver.crowded) {
        crowd::solve(sim, work, work.solver.crowded, true);
    }
    for (a, x) in work.solver.qacc.iter_mut().zip(&work.solver.solution) {
        *a += T::masked(arrived, *x);
    }
    let (link_acc, solution) = (&work.solver.link_acc[..], &work.solver.solution[..]);
    for c in work.rows.contacts.iter_mut() {
        let du = c.of_motion(&link_acc[c.link]);
        for i in 0..3 {
            c.u[i] += T::masked(arrived, du[i]);
        }
    }
    for l in work.rows.limits.iter_mut() {
        l.u += T::masked(arrived, l.sign * solution[l.dof]);
    }
    for f in work.rows.dry.iter_mut() {
        f.u += T::masked(arrived, solution[f.dof]);
    }
    if !work.rows.blocks.is_empty() {
        blocks::add_refinement(work, arrived);
    }
    true_forces(work);
}

/// Adds the constraint forces to the right-hand side: contact wrenches on links, limit and friction forces on joints.
#[inline(always)]
pub(crate) fn apply_forces<T: Real, S: Space>(work: &mut Work<T>) {
    let (wrench, dofs) = (&mut work.solver.wrench[..], &mut work.dofs[..]);
    for (wrench, in_contact) in wrench.iter_mut().zip(&work.solver.in_contact) {
        if *in_contact {
            *wrench = [T::zero(); 6];
        }
    }
    for c in &work.rows.contacts {
        S::add(&mut wrench[c.link], &c.wrench(&c.force));
    }
    for l in &work.rows.limits {
        dofs[l.dof].rhs += l.sign * l.force;
    }
    for f in &work.rows.dry {
        dofs[f.dof].rhs += f.force;
    }
    if !work.rows.blocks.is_empty() {
        blocks::apply_forces(work);
    }
}

/// Normal forces for the readings.
#[inline(always)]
pub(super) fn report_forces<T: Real>(sim: &Sim<T>, work: &mut Work<T>) {
    let normal_force = &mut work.contacts.normal_force[..];
    normal_force.fill(T::zero());
    for c in &work.rows.contacts {
        normal_force[c.geom] += c.force[0];
    }
    if !work.rows.blocks.is_empty() {
        blocks::report_forces(sim, work);
    }
}
