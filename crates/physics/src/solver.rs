//! The constraint solver: MuJoCo's convex problem, solved by Newton's method without a mass matrix.
//!
//! The acceleration minimizes `1/2 (a - a_s)' M (a - a_s) + sum_i s_i(J_i a - aref_i)`, where `s_i` is quadratic while the
//! row pushes and zero while it does not (MuJoCo documentation, "Computation", primal form). Given the set of pushing
//! rows, the minimizer solves `(M + J' D J) a = tau - bias + J' D aref`. A contact with the static floor adds to its own
//! link alone, so that system has the structure of the mass matrix and is solved by the articulated-body recursion
//! ([`crate::articulated`]) in linear time.
//!
//! Two identities keep the iteration in the space of rows, without ever multiplying by M:
//! * after a solve with active set A the accelerations obey `M a - (tau - bias) = J' f`, with the linear forces
//!   `f_i = -D_i (J_i a - aref_i)` on A and 0 elsewhere;
//! * along a segment between two such points the same holds with the interpolated `f`. The derivative of the cost along
//!   the segment is therefore `sum_i dJa_i (f_i - F_i)`, `F_i` being the row's true force: a sum over rows.
//!
//! So each iteration solves for the full Newton point, and lanes whose active set did not change are done: the point is
//! the exact minimum. The others search along the segment for the point where that sum vanishes. Lanes never wait for
//! each other's decisions: a lane that is done is frozen.

use crate::articulated::{articulated_resolve, articulated_solve};
use crate::lanes::Real;
use crate::sim::{Sim, Softness};
use crate::spatial::*;
use crate::work::{Group, Work};

/// A contact with the floor: a pyramid of four edges. Vectors are along (normal, tangent 1, tangent 2).
#[derive(Clone, Copy, Debug)]
pub(crate) struct ContactRow<T: Real> {
    pub link: usize,
    pub candidate: usize,
    /// Contact point relative to the tree's reference point.
    pub r: V3<T>,
    /// First tangent in the plane.
    pub tx: T,
    pub ty: T,
    pub mu: [T::Scalar; 2],
    /// Stiffness of an edge, 0 in lanes without this contact.
    pub d: T,
    /// Minus the reference acceleration.
    pub u0: V3<T>,
    /// `J a - aref` at the present point and at the Newton point.
    pub u: V3<T>,
    pub next: V3<T>,
    /// Force of the present point in the sense of the first identity.
    pub force: V3<T>,
    /// Edges that push.
    pub active: [T::Mask; 4],
    pub on: T::Mask,
}

/// A joint limit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LimitRow<T: Real> {
    pub dof: usize,
    /// +1 at the lower limit, -1 at the upper.
    pub sign: T,
    pub d: T,
    pub u0: T,
    pub u: T,
    pub next: T,
    pub force: T,
    pub active: T::Mask,
    pub on: T::Mask,
}

/// Dry friction of a joint: a force of bounded size.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DryRow<T: Real> {
    pub dof: usize,
    pub loss: T::Scalar,
    pub d: T,
    pub u0: T,
    pub u: T,
    pub next: T,
    pub force: T,
    /// The force is below its bound.
    pub sticking: T::Mask,
    /// Sign of `u`, where the force is at its bound.
    pub positive: T::Mask,
}

/// Impedance at a violation (distance minus margin), and the row's stiffness `1 / R`.
#[inline(always)]
pub(crate) fn impedance<T: Real>(soft: &Softness<T::Scalar>, violation: T) -> (T, T) {
    let one = T::lit(1.0);
    let x = (violation.abs() * T::splat(soft.inv_width)).min(one);
    let rest = one - x;
    let (low, high, mid) = if soft.quadratic {
        ((x * x) * T::lit(2.0), (rest * rest).neg_mul_add(T::lit(2.0), one), T::lit(0.5))
    } else {
        let p = T::splat(soft.power);
        let low = power(x, p) * T::splat(soft.low_scale);
        let high = power(rest, p).neg_mul_add(T::splat(soft.high_scale), one);
        (low, high, T::splat(soft.midpoint))
    };
    let y = T::select(x.lt(mid), low, high);
    let imp = y.mul_add(T::splat(soft.span), T::splat(soft.d0));
    (imp, imp.div((one - imp) * T::splat(soft.diag)))
}

/// `x^p` for 0 <= x <= 1, p >= 1.
#[inline(always)]
fn power<T: Real>(x: T, p: T) -> T {
    let tiny = T::lit(1e-30);
    T::masked(tiny.lt(x), (x.max(tiny).ln() * p).exp())
}

impl<T: Real> ContactRow<T> {
    /// Row values of a motion of the link.
    #[inline(always)]
    fn of_motion(&self, w: &V6<T>) -> V3<T> {
        let v = cross_add(&ang(w), &self.r, &lin(w));
        [v[2], v[0].mul_add(self.tx, v[1] * self.ty), v[1].mul_add(self.tx, -(v[0] * self.ty))]
    }

    /// Values along the four edges of the pyramid.
    #[inline(always)]
    fn edges(&self, u: &V3<T>) -> [T; 4] {
        let (m1, m2) = (T::splat(self.mu[0]), T::splat(self.mu[1]));
        [m1.mul_add(u[1], u[0]), m1.neg_mul_add(u[1], u[0]), m2.mul_add(u[2], u[0]), m2.neg_mul_add(u[2], u[0])]
    }

    /// Total of forces along the edges.
    #[inline(always)]
    fn total(&self, f: &[T; 4]) -> V3<T> {
        let (m1, m2) = (T::splat(self.mu[0]), T::splat(self.mu[1]));
        [(f[0] + f[1]) + (f[2] + f[3]), m1 * (f[0] - f[1]), m2 * (f[2] - f[3])]
    }

    /// Force of the row's linear model with the present active set, at `u`.
    #[inline(always)]
    fn linear_force(&self, u: &V3<T>) -> V3<T> {
        let e = self.edges(u);
        let mut f = [T::zero(); 4];
        for k in 0..4 {
            f[k] = -(T::masked(self.active[k], self.d) * e[k]);
        }
        self.total(&f)
    }

    /// The force that the row exerts at `u`.
    #[inline(always)]
    fn true_force(&self, u: &V3<T>) -> V3<T> {
        let e = self.edges(u);
        let mut f = [T::zero(); 4];
        for k in 0..4 {
            f[k] = -(self.d * e[k].min(T::zero()));
        }
        self.total(&f)
    }

    /// A force in the contact frame as a wrench about the reference point.
    #[inline(always)]
    pub(crate) fn wrench(&self, f: &V3<T>) -> V6<T> {
        let world = [f[1].mul_add(self.tx, -(f[2] * self.ty)), f[1].mul_add(self.ty, f[2] * self.tx), f[0]];
        let t = cross(&self.r, &world);
        [t[0], t[1], t[2], world[0], world[1], world[2]]
    }

    /// Adds the active edges' stiffness to the link's 6x6 matrix.
    #[inline(always)]
    fn add_stiffness(&self, k: &mut Sym6<T>) {
        let (m1, m2) = (T::splat(self.mu[0]), T::splat(self.mu[1]));
        let mut s = [T::zero(); 4];
        for e in 0..4 {
            s[e] = T::masked(self.active[e], self.d);
        }
        // the 3x3 block in the contact frame, turned into world axes
        let nn = (s[0] + s[1]) + (s[2] + s[3]);
        let (n1, n2) = (m1 * (s[0] - s[1]), m2 * (s[2] - s[3]));
        let (t11, t22) = (m1 * m1 * (s[0] + s[1]), m2 * m2 * (s[2] + s[3]));
        let (tx, ty) = (self.tx, self.ty);
        let (cxx, cyy, cxy) = (tx * tx, ty * ty, tx * ty);
        let xx = t11.mul_add(cxx, t22 * cyy);
        let yy = t11.mul_add(cyy, t22 * cxx);
        let xy = (t11 - t22) * cxy;
        let xz = n1.mul_add(tx, -(n2 * ty));
        let yz = n1.mul_add(ty, n2 * tx);
        // moment arms: [r] W and [r] W [r]'
        let r = &self.r;
        let c0 = cross(r, &[xx, xy, xz]);
        let c1 = cross(r, &[xy, yy, yz]);
        let c2 = cross(r, &[xz, yz, nn]);
        let q0 = cross(r, &[c0[0], c1[0], c2[0]]);
        let q1 = cross(r, &[c0[1], c1[1], c2[1]]);
        let q2 = cross(r, &[c0[2], c1[2], c2[2]]);
        let add = [
            q0[0], q1[1], q2[2], q0[1], q0[2], q1[2], c0[0], c1[0], c2[0], c0[1], c1[1], c2[1], c0[2], c1[2], c2[2],
            xx, yy, nn, xy, xz, yz,
        ];
        for i in 0..21 {
            k[i] += add[i];
        }
    }
}

/// Writes the rows of violated joint limits and of dry friction.
#[inline(always)]
pub(crate) fn joint_rows<T: Real>(sim: &Sim<T>, group: &Group<T>, work: &mut Work<T>) {
    let one = T::lit(1.0);
    work.limits.clear();
    for limit in &sim.limits {
        let q = group.qpos[limit.qpos];
        let low = (q - T::splat(limit.low[0])) - T::splat(limit.low[1]);
        let high = (T::splat(limit.high[0]) - q) + T::splat(limit.high[1]);
        if limit.two_sided {
            push_limit(limit.dof, low, one, &limit.soft, group, work);
            push_limit(limit.dof, high, -one, &limit.soft, group, work);
        } else {
            // at most one side is violated: one row serves both
            let lower = low.lt(high);
            let sign = T::select(lower, one, -one);
            push_limit(limit.dof, T::select(lower, low, high), sign, &limit.soft, group, work);
        }
    }
    work.dry.clear();
    for dry in &sim.dry {
        let (_, d) = impedance(&dry.soft, T::zero());
        let u0 = T::splat(dry.soft.b) * group.qvel[dry.dof];
        work.dry.push(DryRow {
            dof: dry.dof,
            loss: dry.loss,
            d,
            u0,
            u: u0,
            next: u0,
            force: T::zero(),
            sticking: T::none(),
            positive: T::none(),
        });
    }
}

#[inline(always)]
fn push_limit<T: Real>(dof: usize, dist: T, sign: T, soft: &Softness<T::Scalar>, group: &Group<T>, work: &mut Work<T>) {
    let on = dist.lt(T::splat(soft.margin));
    if !T::any(on) {
        return;
    }
    let violation = dist - T::splat(soft.margin);
    let (imp, d) = impedance(soft, violation);
    let u0 = (sign * group.qvel[dof]).mul_add(T::splat(soft.b), imp * violation * T::splat(soft.k));
    let d = T::masked(on, d);
    work.limits.push(LimitRow { dof, sign, d, u0, u: u0, next: u0, force: T::zero(), active: T::none(), on });
}

/// Solves for the constrained acceleration, into `acc`; rows end with their true forces.
#[inline(always)]
pub(crate) fn solve<T: Real>(sim: &Sim<T>, group: &Group<T>, work: &mut Work<T>) {
    start(sim, group, work);
    let free = work.contacts.is_empty() && work.limits.is_empty() && work.dry.is_empty();
    let mut done = T::none();
    // lanes that stopped at a Newton point of their own active set
    let mut arrived = T::none();
    let mut iteration = 0;
    loop {
        assemble(sim, work);
        articulated_solve(sim, work, true);
        iteration += 1;
        if free {
            work.acc.copy_from_slice(&work.next);
            arrived = T::not(arrived);
            break;
        }
        let changed = newton_point(work);
        let exact = T::not(changed);
        arrived = T::or(arrived, T::and(exact, T::not(done)));
        if T::all(T::or(done, exact)) {
            // every live lane arrived
            advance(work, done, exact, T::lit(1.0));
            done = T::or(done, exact);
        } else if iteration == 1 {
            // the warm start only chose the active set: its accelerations obey no identity, take the whole step
            advance(work, done, T::not(T::none()), T::lit(1.0));
            done = exact;
        } else {
            let (alpha, small) = line_search(sim, work, T::or(done, exact));
            advance(work, done, exact, alpha);
            done = T::or(done, T::or(exact, small));
        }
        if T::all(done) || iteration >= sim.max_newton {
            break;
        }
    }
    true_forces(work);
    refine(sim, work, arrived);
    for c in &work.contacts {
        work.normal_force[c.candidate] = c.force[0];
    }
    work.stats.solves += 1;
    work.stats.newton += iteration as u64;
    work.stats.max_newton = work.stats.max_newton.max(iteration as u64);
    if !free {
        work.stats.unconverged += T::bits(T::not(done)).count_ones() as u64;
    }
}

/// Every row's true force at the present point.
#[inline(always)]
fn true_forces<T: Real>(work: &mut Work<T>) {
    for c in work.contacts.iter_mut() {
        c.force = c.true_force(&c.u);
    }
    for l in work.limits.iter_mut() {
        l.force = -(l.d * l.u.min(T::zero()));
    }
    for f in work.dry.iter_mut() {
        f.force = dry_force(f, f.u);
    }
}

/// One step of iterative refinement: the equation of motion's residual, evaluated link by link, solved for with the
/// matrix of the last iteration. It takes the rounding of stiff contacts out of single precision for little cost.
/// Only for lanes in `arrived`: the matrix is that of their active set.
#[inline(always)]
fn refine<T: Real>(sim: &Sim<T>, work: &mut Work<T>, arrived: T::Mask) {
    for d in 0..sim.model.nv {
        work.rhs[d] = T::splat(sim.armature[d]).neg_mul_add(work.acc[d], work.tau[d]);
    }
    apply_forces(work);
    link_accelerations(sim, work);
    for l in 0..sim.links.len() {
        let needed = inertia_mul(&work.inertia[l], &work.link_acc[l]);
        let mut f = work.bias_force[l];
        for i in 0..6 {
            f[i] += needed[i];
        }
        if work.in_contact[l] {
            for i in 0..6 {
                f[i] -= work.wrench[l][i];
            }
        }
        work.link_force[l] = f;
    }
    articulated_resolve(sim, work);
    for (a, x) in work.acc.iter_mut().zip(&work.next) {
        *a += T::masked(arrived, *x);
    }
    for c in work.contacts.iter_mut() {
        let du = c.of_motion(&work.link_acc[c.link]);
        for i in 0..3 {
            c.u[i] += T::masked(arrived, du[i]);
        }
    }
    for l in work.limits.iter_mut() {
        l.u += T::masked(arrived, l.sign * work.next[l.dof]);
    }
    for f in work.dry.iter_mut() {
        f.u += T::masked(arrived, work.next[f.dof]);
    }
    true_forces(work);
}

/// The links' accelerations without bias for `acc`.
#[inline(always)]
fn link_accelerations<T: Real>(sim: &Sim<T>, work: &mut Work<T>) {
    for (l, link) in sim.links.iter().enumerate() {
        let mut a = link.parent.map_or([T::zero(); 6], |p| work.link_acc[p]);
        for d in link.dofs.clone() {
            a = axpy6(&work.axis[d], work.acc[d], &a);
        }
        work.link_acc[l] = a;
    }
}

/// Rows and active sets at the warm start.
#[inline(always)]
fn start<T: Real>(sim: &Sim<T>, group: &Group<T>, work: &mut Work<T>) {
    let z = T::zero();
    for d in 0..sim.model.nv {
        work.acc[d] = if sim.warmstart { group.warm[d] } else { z };
    }
    link_accelerations(sim, work);
    for c in work.contacts.iter_mut() {
        let ja = c.of_motion(&work.link_acc[c.link]);
        c.u = add3(&ja, &c.u0);
        let e = c.edges(&c.u);
        for k in 0..4 {
            c.active[k] = T::and(e[k].lt(z), c.on);
        }
    }
    for l in work.limits.iter_mut() {
        l.u = l.sign.mul_add(work.acc[l.dof], l.u0);
        l.active = T::and(l.u.lt(z), l.on);
    }
    for f in work.dry.iter_mut() {
        f.u = work.acc[f.dof] + f.u0;
        (f.sticking, f.positive) = dry_zone(f, f.u);
    }
}

/// Zone of dry friction at `u`: below its bound, and the sign of `u`.
#[inline(always)]
fn dry_zone<T: Real>(f: &DryRow<T>, u: T) -> (T::Mask, T::Mask) {
    ((f.d * u).abs().lt(T::splat(f.loss)), T::zero().lt(u))
}

/// Force of dry friction at `u`.
#[inline(always)]
fn dry_force<T: Real>(f: &DryRow<T>, u: T) -> T {
    let bound = T::splat(f.loss);
    -((f.d * u).max(-bound).min(bound))
}

/// Force of dry friction in the linear model of the present zone.
#[inline(always)]
fn dry_linear<T: Real>(f: &DryRow<T>, u: T) -> T {
    let bound = T::splat(f.loss);
    T::select(f.sticking, -(f.d * u), T::select(f.positive, -bound, bound))
}

/// Stiffness and right-hand side of the present active set.
#[inline(always)]
fn assemble<T: Real>(sim: &Sim<T>, work: &mut Work<T>) {
    let z = T::zero();
    for d in 0..sim.model.nv {
        work.diag[d] = T::splat(sim.armature[d]);
        work.rhs[d] = work.tau[d];
    }
    for l in 0..sim.links.len() {
        work.in_contact[l] = false;
    }
    for c in &work.contacts {
        let l = c.link;
        if !work.in_contact[l] {
            work.in_contact[l] = true;
            work.stiffness[l] = [z; 21];
            work.wrench[l] = [z; 6];
        }
        c.add_stiffness(&mut work.stiffness[l]);
        let w = c.wrench(&c.linear_force(&c.u0));
        for i in 0..6 {
            work.wrench[l][i] += w[i];
        }
    }
    for l in &work.limits {
        let s = T::masked(l.active, l.d);
        work.diag[l.dof] += s;
        work.rhs[l.dof] += -(l.sign * (s * l.u0));
    }
    for f in &work.dry {
        work.diag[f.dof] += T::masked(f.sticking, f.d);
        work.rhs[f.dof] += dry_linear(f, f.u0);
    }
}

/// Row values at the Newton point; lanes whose active set differs there from the one that was solved with.
#[inline(always)]
fn newton_point<T: Real>(work: &mut Work<T>) -> T::Mask {
    let z = T::zero();
    let mut changed = T::none();
    for c in work.contacts.iter_mut() {
        let ja = c.of_motion(&work.link_acc[c.link]);
        c.next = add3(&ja, &c.u0);
        let e = c.edges(&c.next);
        for k in 0..4 {
            let active = T::and(e[k].lt(z), c.on);
            changed = T::or(changed, T::xor(active, c.active[k]));
        }
    }
    for l in work.limits.iter_mut() {
        l.next = l.sign.mul_add(work.next[l.dof], l.u0);
        changed = T::or(changed, T::xor(T::and(l.next.lt(z), l.on), l.active));
    }
    for f in work.dry.iter_mut() {
        f.next = work.next[f.dof] + f.u0;
        let (sticking, positive) = dry_zone(f, f.next);
        let sliding_differs = T::and(T::not(sticking), T::xor(positive, f.positive));
        changed = T::or(changed, T::or(T::xor(sticking, f.sticking), sliding_differs));
    }
    changed
}

/// Moves every lane that is not `done`: `exact` lanes to the Newton point, the others by `alpha` of the way.
#[inline(always)]
fn advance<T: Real>(work: &mut Work<T>, done: T::Mask, exact: T::Mask, alpha: T) {
    let z = T::zero();
    for (a, n) in work.acc.iter_mut().zip(&work.next) {
        let moved = T::select(exact, *n, alpha.mul_add(*n - *a, *a));
        *a = T::select(done, *a, moved);
    }
    for c in work.contacts.iter_mut() {
        let linear = c.linear_force(&c.next);
        for i in 0..3 {
            let moved = T::select(exact, c.next[i], alpha.mul_add(c.next[i] - c.u[i], c.u[i]));
            c.u[i] = T::select(done, c.u[i], moved);
            let force = T::select(exact, linear[i], alpha.mul_add(linear[i] - c.force[i], c.force[i]));
            c.force[i] = T::select(done, c.force[i], force);
        }
        let e = c.edges(&c.u);
        for k in 0..4 {
            c.active[k] = T::and(e[k].lt(z), c.on);
        }
    }
    for l in work.limits.iter_mut() {
        let linear = -(T::masked(l.active, l.d) * l.next);
        let moved = T::select(exact, l.next, alpha.mul_add(l.next - l.u, l.u));
        l.u = T::select(done, l.u, moved);
        let force = T::select(exact, linear, alpha.mul_add(linear - l.force, l.force));
        l.force = T::select(done, l.force, force);
        l.active = T::and(l.u.lt(z), l.on);
    }
    for f in work.dry.iter_mut() {
        let linear = dry_linear(f, f.next);
        let moved = T::select(exact, f.next, alpha.mul_add(f.next - f.u, f.u));
        f.u = T::select(done, f.u, moved);
        let force = T::select(exact, linear, alpha.mul_add(linear - f.force, f.force));
        f.force = T::select(done, f.force, force);
        (f.sticking, f.positive) = dry_zone(f, f.u);
    }
}

/// Finds where the cost is least along the segment to the Newton point. Returns the fraction of the way and the lanes
/// whose predicted improvement is below the tolerance. Lanes in `skip` do not matter.
#[inline(always)]
fn line_search<T: Real>(sim: &Sim<T>, work: &mut Work<T>, skip: T::Mask) -> (T, T::Mask) {
    let (z, one) = (T::zero(), T::lit(1.0));
    // interpolated forces against the direction at both ends, and the true forces at the start
    let (mut g0, mut g1, mut f0) = (z, z, z);
    for c in &work.contacts {
        let du = sub3(&c.next, &c.u);
        g0 += dot(&du, &c.force);
        g1 += dot(&du, &c.linear_force(&c.next));
        f0 += dot(&du, &c.true_force(&c.u));
    }
    for l in &work.limits {
        let du = l.next - l.u;
        g0 = du.mul_add(l.force, g0);
        g1 = du.mul_add(-(T::masked(l.active, l.d) * l.next), g1);
        f0 = du.mul_add(-(l.d * l.u.min(z)), f0);
    }
    for f in &work.dry {
        let du = f.next - f.u;
        g0 = du.mul_add(f.force, g0);
        g1 = du.mul_add(dry_linear(f, f.next), g1);
        f0 = du.mul_add(dry_force(f, f.u), f0);
    }
    let descent = f0 - g0;
    // an improvement below the rounding of its two parts is noise: searching along it leads anywhere
    let noise = (f0.abs() + g0.abs()) * T::lit(4.0 * T::EPSILON);
    let small = descent.lt(noise.max(T::splat(sim.tolerance)));
    let enough = descent.abs().mul_add(T::lit(LINE_SEARCH_TOLERANCE), T::lit(1e-30));
    let curvature = g1 - g0;

    let (mut low, mut high) = (z, T::lit(LONGEST_SEARCH));
    let mut alpha = one;
    let mut settled = T::or(skip, small);
    for step in 0..sim.max_line_search {
        work.stats.line_search += 1;
        // slope of the cost and its derivative at alpha
        let mut slope = alpha.mul_add(curvature, g0);
        let mut second = curvature;
        for c in &work.contacts {
            let du = sub3(&c.next, &c.u);
            let u = [du[0].mul_add(alpha, c.u[0]), du[1].mul_add(alpha, c.u[1]), du[2].mul_add(alpha, c.u[2])];
            let (e, de) = (c.edges(&u), c.edges(&du));
            let (mut s1, mut s2) = (z, z);
            for k in 0..4 {
                let pushing = T::masked(e[k].lt(z), de[k]);
                s1 = pushing.mul_add(e[k], s1);
                s2 = pushing.mul_add(de[k], s2);
            }
            slope = c.d.mul_add(s1, slope);
            second = c.d.mul_add(s2, second);
        }
        for l in &work.limits {
            let du = l.next - l.u;
            let u = du.mul_add(alpha, l.u);
            let pushing = T::masked(u.lt(z), l.d * du);
            slope = pushing.mul_add(u, slope);
            second = pushing.mul_add(du, second);
        }
        for f in &work.dry {
            let du = f.next - f.u;
            let u = du.mul_add(alpha, f.u);
            slope = du.neg_mul_add(dry_force(f, u), slope);
            let (sticking, _) = dry_zone(f, u);
            second = T::masked(sticking, f.d * du).mul_add(du, second);
        }
        settled = T::or(settled, slope.abs().lt(enough));
        if T::all(settled) || step + 1 == sim.max_line_search {
            break;
        }
        // Newton step in one dimension; where it leaves the bracket, doubling up to the first point beyond the minimum
        // and bisection after it
        let short = slope.lt(z);
        low = T::select(short, alpha, low);
        high = T::select(short, high, alpha);
        let newton = slope.div(second.max(T::lit(1e-30))).neg_mul_add(one, alpha);
        let inside = T::and(low.lt(newton), newton.lt(high));
        let middle = (low + high) * T::lit(0.5);
        let middle = middle.min(alpha.max(one) * T::lit(2.0));
        let proposal = T::select(inside, newton, middle);
        alpha = T::select(settled, alpha, proposal);
    }
    (alpha, small)
}

/// Longest way of a line search in units of the Newton step. The minimum is hardly ever beyond a few; where it is, the
/// next iteration goes on.
const LONGEST_SEARCH: f64 = 64.0;

/// Slope left over by the line search, as a fraction of the slope at its start.
const LINE_SEARCH_TOLERANCE: f64 = 0.01;

/// Puts the constraint forces on the right-hand side: contact wrenches on links, limit and friction forces on joints.
#[inline(always)]
pub(crate) fn apply_forces<T: Real>(work: &mut Work<T>) {
    for c in &work.contacts {
        work.wrench[c.link] = [T::zero(); 6];
    }
    for c in &work.contacts {
        let w = c.wrench(&c.force);
        for i in 0..6 {
            work.wrench[c.link][i] += w[i];
        }
    }
    for l in &work.limits {
        work.rhs[l.dof] += l.sign * l.force;
    }
    for f in &work.dry {
        work.rhs[f.dof] += f.force;
    }
}
