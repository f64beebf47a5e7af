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
        work.solver.drive.copy_from_slice(&work.solver.tree_drive);
        factorize::<T, S>(sim, work, true);
        work.solver.tree_drive.copy_from_slice(&work.solver.drive);
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
    work.solver.in_contact.fill(false);
    let mut known = true;
    for c in &work.rows.contacts {
        work.solver.in_contact[c.link] = true;
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
    for d in 0..sim.model.nv {
        work.solver.qacc[d] = if sim.warmstart { group.qacc_warmstart[d] } else { T::zero() };
    }
    link_accelerations::<T, S>(sim, work);
    for c in work.rows.contacts.iter_mut() {
        let ja = c.of_motion(&work.solver.link_acc[c.link]);
        c.u = add3(&ja, &c.u0);
        c.activate(T::not(c.recalled));
    }
    for l in work.rows.limits.iter_mut() {
        l.u = l.sign.mul_add(work.solver.qacc[l.dof], l.u0);
        l.activate(T::not(l.recalled));
    }
    for f in work.rows.dry.iter_mut() {
        f.u = work.solver.qacc[f.dof] + f.u0;
        if !f.recalled {
            f.activate(T::not(T::none()));
        }
    }
}

/// Stiffness and right-hand side of the current active set, for the links where it changed.
#[inline(always)]
pub(super) fn assemble<T: Real, S: Space>(sim: &Sim<T>, work: &mut Work<T>) {
    let z = T::zero();
    for (l, link) in sim.links.iter().enumerate() {
        if !work.solver.stale[l] {
            continue;
        }
        for d in link.dofs.clone() {
            work.solver.diag[d] = T::splat(sim.armature[d]);
            work.solver.rhs[d] = work.forces.qfrc_passive_actuator[d];
        }
        if work.solver.in_contact[l] {
            work.solver.stiffness[l] = [z; 21];
            work.solver.wrench[l] = [z; 6];
        }
    }
    for c in &work.rows.contacts {
        let l = c.link;
        if !work.solver.stale[l] {
            continue;
        }
        c.add_stiffness::<S>(&mut work.solver.stiffness[l]);
        let w = c.wrench(&c.linear_force(&c.u0));
        S::add(&mut work.solver.wrench[l], &w);
    }
    for l in &work.rows.limits {
        if !work.solver.stale[sim.dof_link[l.dof]] {
            continue;
        }
        let s = T::masked(l.active, l.d);
        work.solver.diag[l.dof] += s;
        work.solver.rhs[l.dof] += -(l.sign * (s * l.u0));
    }
    for f in &work.rows.dry {
        if !work.solver.stale[sim.dof_link[f.dof]] {
            continue;
        }
        work.solver.diag[f.dof] += T::masked(f.sticking, f.d);
        work.solver.rhs[f.dof] += f.linear(f.u0);
    }
    if !work.rows.blocks.is_empty() {
        blocks::assemble(sim, work);
    }
}

/// Row values at the Newton point. Returns lanes whose active set there differs from that of the solve.
#[inline(always)]
fn newton_point<T: Real>(work: &mut Work<T>) -> T::Mask {
    let mut changed = T::none();
    for c in work.rows.contacts.iter_mut() {
        changed = T::or(changed, c.newton_point(&work.solver.link_acc[c.link]));
    }
    for l in work.rows.limits.iter_mut() {
        changed = T::or(changed, l.newton_point(work.solver.solution[l.dof]));
    }
    for f in work.rows.dry.iter_mut() {
        changed = T::or(changed, f.newton_point(work.solver.solution[f.dof]));
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
    for c in work.rows.contacts.iter_mut() {
        work.solver.stale[c.link] |= T::any(c.advance(step));
    }
    for l in work.rows.limits.iter_mut() {
        work.solver.stale[sim.dof_link[l.dof]] |= T::any(l.advance(step));
    }
    for f in work.rows.dry.iter_mut() {
        work.solver.stale[sim.dof_link[f.dof]] |= T::any(f.advance(step));
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
    for d in 0..sim.model.nv {
        work.solver.rhs[d] =
            T::splat(sim.armature[d]).neg_mul_add(work.solver.qacc[d], work.forces.qfrc_passive_actuator[d]);
    }
    apply_forces::<T, S>(work);
    link_accelerations::<T, S>(sim, work);
    let applied = work.forces.acts_on_links();
    for l in 0..sim.links.len() {
        let mut f = S::momentum(&work.motion.inertia[l], &work.solver.link_acc[l]);
        S::add(&mut f, &net_bias_force(&work.motion, &work.forces, applied, l));
        if work.solver.in_contact[l] {
            S::sub(&mut f, &work.solver.wrench[l]);
        }
        work.solver.link_force[l] = f;
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
    for c in work.rows.contacts.iter_mut() {
        let du = c.of_motion(&work.solver.link_acc[c.link]);
        for i in 0..3 {
            c.u[i] += T::masked(arrived, du[i]);
        }
    }
    for l in work.rows.limits.iter_mut() {
        l.u += T::masked(arrived, l.sign * work.solver.solution[l.dof]);
    }
    for f in work.rows.dry.iter_mut() {
        f.u += T::masked(arrived, work.solver.solution[f.dof]);
    }
    if !work.rows.blocks.is_empty() {
        blocks::add_refinement(work, arrived);
    }
    true_forces(work);
}

/// Adds the constraint forces to the right-hand side: contact wrenches on links, limit and friction forces on joints.
#[inline(always)]
pub(crate) fn apply_forces<T: Real, S: Space>(work: &mut Work<T>) {
    for l in 0..work.solver.wrench.len() {
        if work.solver.in_contact[l] {
            work.solver.wrench[l] = [T::zero(); 6];
        }
    }
    for c in &work.rows.contacts {
        let w = c.wrench(&c.force);
        S::add(&mut work.solver.wrench[c.link], &w);
    }
    for l in &work.rows.limits {
        work.solver.rhs[l.dof] += l.sign * l.force;
    }
    for f in &work.rows.dry {
        work.solver.rhs[f.dof] += f.force;
    }
    if !work.rows.blocks.is_empty() {
        blocks::apply_forces(work);
    }
}

/// Normal forces for the readings.
#[inline(always)]
pub(super) fn report_forces<T: Real>(sim: &Sim<T>, work: &mut Work<T>) {
    work.contacts.normal_force.fill(T::zero());
    for c in &work.rows.contacts {
        work.contacts.normal_force[c.geom] += c.force[0];
    }
    if !work.rows.blocks.is_empty() {
        blocks::report_forces(sim, work);
    }
}
