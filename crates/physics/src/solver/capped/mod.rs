//! MuJoCo's own iteration, for models whose iteration cap stops the solver before it converges.
//!
//! The minimum does not depend on the path to it. The point after one, two or five iterations does, and such a model
//! was tuned with that point. So this solver takes MuJoCo's path (`engine_solver.c`):
//!
//! * The start is the better of the last step's acceleration and the one without constraints.
//! * The direction is Newton's, `a1 - a`, for the active set at the current point, or that of conjugate gradients
//!   ([`conjugate`]).
//! * The line search evaluates the same points as MuJoCo's ([`line`]).
//! * Every island of trees stops by its own improvement, gradient, or predicted improvement ([`islands`]).
//!
//! The Newton points use the same factorizations as the other iteration ([`newton`](super::newton)), but without its
//! shortcuts. This iteration also computes the unconstrained acceleration `a_s`, which needs one more factorization.
//! Its cost includes that of the masses, `1/2 (a - a_s)' M (a - a_s)`. M is never formed: products with it are sums
//! over the momenta of links.

mod conjugate;
mod inertia;
mod islands;
mod line;
mod stages;

use super::{blocks, crowd, newton};
use crate::algebra::planar::Space;
use crate::algebra::spatial::Inertia;
use crate::dynamics::{accelerate, factorize, link_accelerations};
use crate::lanes::Real;
use crate::sim::{Caps, Sim};
use crate::state::{Capped, Group, Work};
use line::{LEAST, LineSearch};

/// Computes the acceleration where MuJoCo's iteration ends into `qacc`, and the rows' forces there.
#[inline(always)]
pub(crate) fn solve<T: Real, S: Space>(sim: &Sim<T>, group: &Group<T>, work: &mut Work<T>) {
    let mut c = std::mem::take(&mut work.solver.capped);
    if let Some(caps) = &sim.capped {
        iterate::<T, S>(sim, caps, group, work, &mut c);
    }
    work.solver.capped = c;
    newton::report_forces(sim, work);
}

#[inline(always)]
fn iterate<T: Real, S: Space>(sim: &Sim<T>, caps: &Caps, group: &Group<T>, work: &mut Work<T>, c: &mut Capped<T>) {
    work.stats.solves += 1;
    smooth::<T, S>(sim, work, c);
    let rows = &work.rows;
    if rows.contacts.is_empty() && rows.limits.is_empty() && rows.dry.is_empty() && rows.blocks.is_empty() {
        work.solver.qacc.copy_from_slice(&c.smooth);
        // what is left of the forces, for the integrator
        c.gradient.fill(T::zero());
        return;
    }
    islands::find(sim, work, c);
    start::<T, S>(sim, group, work, c);
    scales::<T, S>(sim, caps, work, c);
    let any_coupled = blocks::any_coupled(work);
    work.solver.crowded = if any_coupled { crowd::start(sim, work) } else { T::none() };
    let mut iteration = 0;
    loop {
        stages::push(work);
        gradient::<T, S>(sim, work, c);
        squares_of_gradient(sim, c);
        let small = ends(sim, caps, c, iteration);
        if lanes(c) == 0 || iteration >= caps.iterations {
            break;
        }
        if caps.conjugate {
            conjugate::precondition::<T, S>(sim, work, c);
            conjugate::direction(sim, work, c, iteration);
        } else {
            work.solver.stale.fill(true);
            newton::assemble::<T, S>(sim, work);
            newton::solve_system::<T, S>(sim, work, T::from_bits(lanes(c)), any_coupled);
            for d in 0..sim.model.nv {
                c.direction[d] = work.solver.solution[d] - work.solver.qacc[d];
            }
        }
        way::<T, S>(sim, work, c);
        predicted_ends(sim, caps, c, iteration, &small);
        if lanes(c) == 0 {
            break;
        }
        search(sim, caps, work, c);
        advance(sim, work, c);
        iteration += 1;
    }
    work.stats.newton += iteration as u64;
    work.stats.max_newton = work.stats.max_newton.max(iteration as u64);
    work.stats.unconverged += u64::from(lanes(c).count_ones());
}

/// Lanes with an unfinished island.
#[inline(always)]
fn lanes<T: Real>(c: &Capped<T>) -> u32 {
    c.live.iter().fold(0, |a, b| a | b)
}

/// Computes the unconstrained acceleration.
#[inline(always)]
fn smooth<T: Real, S: Space>(sim: &Sim<T>, work: &mut Work<T>, c: &mut Capped<T>) {
    work.solver.in_contact.fill(false);
    work.solver.stale.fill(true);
    for ((dof, armature), force) in work.dofs.iter_mut().zip(&sim.armature).zip(&work.forces.qfrc_passive_actuator) {
        (dof.diag, dof.rhs) = (T::splat(*armature), *force);
    }
    factorize::<T, S>(sim, work, false);
    if sim.inertia_blocks > 0 {
        inertia::factorize(sim, work);
    }
    accelerate::<T, S>(sim, work);
    c.smooth.copy_from_slice(&work.solver.solution);
    c.smooth_acc.copy_from_slice(&work.solver.link_acc);
}

/// Starts at the last step's acceleration or at the unconstrained one, whichever costs less. Trees without constraints
/// take the unconstrained one.
#[inline(always)]
fn start<T: Real, S: Space>(sim: &Sim<T>, group: &Group<T>, work: &mut Work<T>, c: &mut Capped<T>) {
    for row in &work.rows.contacts {
        work.solver.in_contact[row.link] = true;
    }
    if !work.rows.blocks.is_empty() {
        stages::mark_links(work);
    }
    work.solver.qacc.copy_from_slice(&c.smooth);
    let cost_smooth = stages::measure(work);
    let mut by_smooth = T::not(T::none());
    if sim.warmstart {
        stages::keep(work);
        work.solver.qacc.copy_from_slice(&group.qacc_warmstart);
        link_accelerations::<T, S>(sim, work);
        let mut cost = stages::measure(work);
        let mut masses = T::zero();
        for l in 0..sim.links.len() {
            let mut away = work.solver.link_acc[l];
            S::sub(&mut away, &c.smooth_acc[l]);
            masses += S::dot(&away, &S::momentum(&work.motion.inertia[l], &away));
        }
        for d in 0..sim.model.nv {
            let away = work.solver.qacc[d] - c.smooth[d];
            masses = (T::splat(sim.armature[d]) * away).mul_add(away, masses);
        }
        masses += inertia::twice_cost(sim, work, c);
        cost += masses * T::lit(0.5);
        by_smooth = cost_smooth.lt(cost);
        stages::choose(work, by_smooth);
    }
    for (l, link) in sim.links.iter().enumerate() {
        let smooth = T::or(by_smooth, T::from_bits(!c.constrained[link.tree]));
        for d in link.dofs.clone() {
            work.solver.qacc[d] = T::select(smooth, c.smooth[d], work.solver.qacc[d]);
        }
        for i in 0..6 {
            c.here[l][i] = T::select(smooth, c.smooth_acc[l][i], work.solver.link_acc[l][i]);
        }
    }
}

/// The divisor of costs and gradients before MuJoCo compares them with the tolerance.
#[inline(always)]
fn scales<T: Real, S: Space>(sim: &Sim<T>, caps: &Caps, work: &Work<T>, c: &mut Capped<T>) {
    c.scale.fill(caps.scale);
    if !caps.islands {
        return;
    }
    for sums in c.sums.iter_mut() {
        *sums = [T::zero(); 3];
    }
    let sums = &mut c.sums;
    for_each_diagonal::<T, S>(sim, work, &mut c.composite, |tree, x| sums[tree][0] += x);
    inertia::add_diagonal(sim, work, c);
    islands::gather(&c.island, &mut c.sums);
    for tree in 0..sim.trees {
        for lane in 0..T::LANES {
            c.scale[tree * T::LANES + lane] = 1.0 / T::widen(c.sums[tree][0].get(lane));
        }
    }
}

/// Calls `visit` with the tree and the value of every number on the diagonal of the mass matrix. `composite` is memory
/// for one inertia per link.
#[inline(always)]
pub(super) fn for_each_diagonal<T: Real, S: Space>(
    sim: &Sim<T>,
    work: &Work<T>,
    composite: &mut [Inertia<T>],
    mut visit: impl FnMut(usize, T),
) {
    composite.copy_from_slice(&work.motion.inertia);
    for (l, link) in sim.links.iter().enumerate().rev() {
        for d in link.dofs.clone() {
            let axis = &work.dofs[d].axis;
            visit(link.tree, S::dot(axis, &S::momentum(&composite[l], axis)) + T::splat(sim.armature[d]));
        }
        if let Some(p) = link.parent {
            for i in 0..10 {
                let x = composite[l][i];
                composite[p][i] += x;
            }
        }
    }
}

/// Gradient of the cost by the accelerations: the forces that the masses need minus those of the constraints.
#[inline(always)]
fn gradient<T: Real, S: Space>(sim: &Sim<T>, work: &mut Work<T>, c: &mut Capped<T>) {
    for dof in &mut work.dofs {
        dof.rhs = T::zero();
    }
    newton::apply_forces::<T, S>(work);
    for l in 0..sim.links.len() {
        let mut away = c.here[l];
        S::sub(&mut away, &c.smooth_acc[l]);
        let mut f = S::momentum(&work.motion.inertia[l], &away);
        if work.solver.in_contact[l] {
            S::sub(&mut f, &work.solver.wrench[l]);
        }
        work.solver.link_force[l] = f;
    }
    for (l, link) in sim.links.iter().enumerate().rev() {
        let f = work.solver.link_force[l];
        for d in link.dofs.clone() {
            let away = work.solver.qacc[d] - c.smooth[d];
            let need = T::splat(sim.armature[d]).mul_add(away, S::dot(&work.dofs[d].axis, &f));
            c.gradient[d] = need - work.dofs[d].rhs;
        }
        if let Some(p) = link.parent {
            S::add(&mut work.solver.link_force[p], &f);
        }
    }
    inertia::add_gradient(sim, work, c);
}

/// The squared gradient of each island.
#[inline(always)]
fn squares_of_gradient<T: Real>(sim: &Sim<T>, c: &mut Capped<T>) {
    for sums in c.sums.iter_mut() {
        *sums = [T::zero(); 3];
    }
    for link in &sim.links {
        for d in link.dofs.clone() {
            let sum = &mut c.sums[link.tree][0];
            *sum = c.gradient[d].mul_add(c.gradient[d], *sum);
        }
    }
    islands::gather(&c.island, &mut c.sums);
}

/// Finishes the islands whose last improvement or gradient is below the tolerance. Returns, by tree, the lanes with
/// such a gradient. At the start, a small gradient alone does not end the iteration.
#[inline(always)]
fn ends<T: Real>(sim: &Sim<T>, caps: &Caps, c: &mut Capped<T>, iteration: usize) -> Vec<u32> {
    let mut small = vec![0; sim.trees];
    for tree in 0..sim.trees {
        for lane in 0..T::LANES {
            if !c.leads(tree, lane) {
                continue;
            }
            let at = tree * T::LANES + lane;
            let gradient = c.scale[at] * T::widen(c.sums[tree][0].get(lane)).sqrt();
            let improvement = c.scale[at] * c.improvement[at];
            if gradient < caps.tolerance {
                small[tree] |= 1 << lane;
            }
            let stalled = improvement > 0.0 && improvement < caps.tolerance;
            if iteration > 0 && (stalled || gradient < caps.tolerance) {
                c.stop(tree, lane);
            }
        }
    }
    small
}

/// Computes the changes of links and rows along the direction, and the cost of moving the masses.
#[inline(always)]
fn way<T: Real, S: Space>(sim: &Sim<T>, work: &mut Work<T>, c: &mut Capped<T>) {
    for tree in 0..sim.trees {
        c.sums[tree] = [T::zero(); 3];
        c.masses[tree] = [T::zero(); 2];
    }
    for (l, link) in sim.links.iter().enumerate() {
        let tree = link.tree;
        // use the joints' steps, not the difference of the links' accelerations, so that all of them round alike
        let mut way = link.parent.map_or([T::zero(); 6], |p| c.way[p]);
        for d in link.dofs.clone() {
            way = S::axpy(&work.dofs[d].axis, c.direction[d], &way);
        }
        let mut away = c.here[l];
        S::sub(&mut away, &c.smooth_acc[l]);
        let momentum = S::momentum(&work.motion.inertia[l], &way);
        c.masses[tree][0] += S::dot(&away, &momentum);
        c.masses[tree][1] += S::dot(&way, &momentum);
        c.way[l] = way;
        for d in link.dofs.clone() {
            let step = c.direction[d];
            let (away, armature) = (work.solver.qacc[d] - c.smooth[d], T::splat(sim.armature[d]) * step);
            c.masses[tree][0] = armature.mul_add(away, c.masses[tree][0]);
            c.masses[tree][1] = armature.mul_add(step, c.masses[tree][1]);
            c.sums[tree][0] = c.gradient[d].mul_add(step, c.sums[tree][0]);
            c.sums[tree][1] = step.mul_add(step, c.sums[tree][1]);
        }
    }
    inertia::add_way(sim, work, c);
    islands::gather(&c.island, &mut c.sums);
    stages::measure_way(work, c);
}

/// Finishes the islands whose direction predicts an improvement below the tolerance. For Newton's method this applies
/// at any point, at the start only if the gradient is also small. For conjugate gradients it applies only at the start,
/// where the prediction bounds the possible improvement.
#[inline(always)]
fn predicted_ends<T: Real>(sim: &Sim<T>, caps: &Caps, c: &mut Capped<T>, iteration: usize, small: &[u32]) {
    for tree in 0..sim.trees {
        for lane in 0..T::LANES {
            if !c.leads(tree, lane) {
                continue;
            }
            let promise = -0.5 * c.scale[tree * T::LANES + lane] * T::widen(c.sums[tree][0].get(lane));
            let counts = match (iteration, caps.conjugate) {
                (0, true) => true,
                (0, false) => small[tree] >> lane & 1 == 1,
                (_, conjugate) => !conjugate,
            };
            if counts && promise.max(0.0) < caps.tolerance {
                c.stop(tree, lane);
            }
        }
    }
}

/// Finds the step length of each island, and finishes the islands that do not improve.
#[inline(always)]
fn search<T: Real>(sim: &Sim<T>, caps: &Caps, work: &mut Work<T>, c: &mut Capped<T>) {
    let mut searches: Vec<Option<LineSearch>> = vec![None; sim.trees * T::LANES];
    for tree in 0..sim.trees {
        c.alpha[tree] = T::zero();
        for lane in 0..T::LANES {
            let at = tree * T::LANES + lane;
            let length = T::widen(c.sums[tree][1].get(lane)).sqrt();
            // a direction without length gives no step
            if !c.leads(tree, lane) || length < LEAST {
                continue;
            }
            let enough = caps.tolerance * caps.ls_tolerance * length / c.scale[at];
            searches[at] = Some(LineSearch::new(enough, caps.ls_iterations, rounded::<T>));
        }
    }
    let mut waiting = searches.iter().filter(|s| s.is_some()).count();
    for at in 0..searches.len() {
        let (tree, lane) = (at / T::LANES, at % T::LANES);
        if c.leads(tree, lane) && searches[at].is_none() {
            c.stop(tree, lane);
        }
    }
    while waiting > 0 {
        work.stats.line_search += 1;
        share(sim, c);
        stages::evaluate(sim, work, c);
        islands::gather(&c.island, &mut c.sums);
        for at in 0..searches.len() {
            let (tree, lane) = (at / T::LANES, at % T::LANES);
            let Some(search) = &mut searches[at] else { continue };
            let sums = [0, 1, 2].map(|k| T::widen(c.sums[tree][k].get(lane)));
            let alpha = match search.feed(sums) {
                None => search.wanted(),
                Some(found) => {
                    searches[at] = None;
                    waiting -= 1;
                    c.improvement[at] = found.improvement;
                    if found.alpha == 0.0 {
                        c.stop(tree, lane);
                    }
                    found.alpha
                }
            };
            c.alpha[tree].set(lane, T::scalar(alpha));
        }
    }
    share(sim, c);
}

fn rounded<T: Real>(x: f64) -> f64 {
    T::widen(T::scalar(x))
}

/// Copies the step length of each island's first tree to its other trees.
#[inline(always)]
fn share<T: Real>(sim: &Sim<T>, c: &mut Capped<T>) {
    for tree in 1..sim.trees {
        for lane in 0..T::LANES {
            let root = c.island[tree * T::LANES + lane];
            if root != tree {
                let alpha = c.alpha[root].get(lane);
                c.alpha[tree].set(lane, alpha);
            }
        }
    }
}

/// Moves the islands.
#[inline(always)]
fn advance<T: Real>(sim: &Sim<T>, work: &mut Work<T>, c: &mut Capped<T>) {
    for (l, link) in sim.links.iter().enumerate() {
        let (alpha, live) = (c.alpha[link.tree], T::from_bits(c.live[link.tree]));
        for d in link.dofs.clone() {
            let moved = alpha.mul_add(c.direction[d], work.solver.qacc[d]);
            work.solver.qacc[d] = T::select(live, moved, work.solver.qacc[d]);
        }
        for i in 0..6 {
            c.here[l][i] = T::select(live, alpha.mul_add(c.way[l][i], c.here[l][i]), c.here[l][i]);
        }
    }
    stages::advance(sim, work, c);
}
