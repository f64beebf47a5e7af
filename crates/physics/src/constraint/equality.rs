//! Rows of equality constraints: bodies, joints and tendons tied together.

use crate::algebra::spatial::*;
use crate::lanes::{Real, kernel_fn};
use crate::rows::Source;
use crate::sim::{Cost, EqualitySpec, Frames, Length, Mount, Sim, Tie, impedance_at};
use crate::state::{Group, Work};

kernel_fn! {
    /// Writes the blocks of all equality constraints.
    pub(crate) fn equality_blocks<'a, T>(sim: &'a Sim<T>, group: &'a Group<T>, work: &'a mut Work<T>) {
        for spec in &sim.equalities {
            match &spec.tie {
                Tie::Bodies { points, frames } => bodies_block(sim, group, work, spec, points, frames.as_ref()),
                Tie::Lengths { follower, leader, poly } => {
                    lengths_block(sim, group, work, spec, follower, leader.as_ref(), poly);
                }
            }
        }
    }
}

/// Two connected points, and the links that carry them.
struct Ends<T: Real> {
    links: [Option<usize>; 2],
    /// The points, relative to the references of their links' trees.
    r: [V3<T>; 2],
    /// Velocities of the points, and angular velocities of the links.
    v: [V3<T>; 2],
    w: [V3<T>; 2],
    /// Accelerations of the points and links without joint accelerations.
    acc: [V3<T>; 2],
    spin: [V3<T>; 2],
    /// Vector from the second point to the first.
    gap: V3<T>,
}

impl<T: Real> Ends<T> {
    #[inline(always)]
    fn new(sim: &Sim<T>, group: &Group<T>, work: &Work<T>, points: &[Mount<T::Scalar>; 2]) -> Self {
        let z = [T::zero(); 3];
        let links = [points[0].link, points[1].link];
        let tree = |link: Option<usize>| link.map(|l| sim.links[l].tree);
        let same_tree = tree(links[0]) == tree(links[1]);
        let (mut r, mut v, mut w) = ([z; 2], [z; 2], [z; 2]);
        let (mut acc, mut spin, mut place) = ([z; 2], [z; 2], [z; 2]);
        for i in 0..2 {
            let Some(l) = links[i] else {
                place[i] = work.motion.still(&points[i]);
                continue;
            };
            r[i] = work.motion.arm(&points[i], l);
            // within a tree, adding the common reference would only lose digits
            place[i] = if same_tree { r[i] } else { add3(&r[i], &work.motion.reference[sim.links[l].tree]) };
            v[i] = cross_add(&ang(&work.motion.vel[l]), &r[i], &lin(&work.motion.vel[l]));
            w[i] = ang(&work.motion.vel[l]);
            let a = &work.motion.bias_acc[l];
            let at = cross_add(&w[i], &v[i], &cross_add(&ang(a), &r[i], &lin(a)));
            // the bias acceleration includes gravity
            acc[i] = add3(&at, &group.gravity(sim));
            spin[i] = ang(a);
        }
        Ends { links, r, v, w, acc, spin, gap: sub3(&place[0], &place[1]) }
    }
}

/// Row values of two connected bodies: three rows of positions, then three of orientations.
struct Violation<T: Real> {
    error: [T; 6],
    rate: [T; 6],
    /// Acceleration of the rows without joint accelerations. The reference compensates for it.
    drift: [T; 6],
    /// Derivative of the last three rows with respect to the relative angular velocity.
    turns: [V3<T>; 3],
}

impl<T: Real> Violation<T> {
    /// Rows of positions.
    #[inline(always)]
    fn of_places(ends: &Ends<T>) -> Self {
        let z = T::zero();
        let six = |v: V3<T>| [v[0], v[1], v[2], z, z, z];
        Violation {
            error: six(ends.gap),
            rate: six(sub3(&ends.v[0], &ends.v[1])),
            drift: six(sub3(&ends.acc[0], &ends.acc[1])),
            turns: [[z; 3]; 3],
        }
    }

    /// Adds the rows of orientations.
    #[inline(always)]
    fn orient(&mut self, work: &Work<T>, ends: &Ends<T>, points: &[Mount<T::Scalar>; 2], frames: &Frames<T::Scalar>) {
        let (z, one) = (T::zero(), T::lit(1.0));
        let frame = |i: usize| {
            let q = frames.quats[i].map(T::splat);
            work.motion.frame(&points[i]).map_or(q, |l| quat_mul(&rot_to_quat(&work.motion.rot[l]), &q))
        };
        let (q0, q1) = (frame(0), frame(1));
        let back = quat_conjugate(&q1);
        let scale = T::splat(frames.scale);
        let relative = quat_mul(&back, &q0);
        for i in 0..3 {
            self.error[3 + i] = relative[1 + i] * scale;
        }
        // derivative with respect to the relative angular velocity: vec(conj(q1) w q0) / 2
        for j in 0..3 {
            let mut axis = [z; 4];
            axis[1 + j] = one;
            let d = quat_mul(&quat_mul(&back, &axis), &q0);
            for i in 0..3 {
                self.turns[i][j] = d[1 + i] * scale * T::lit(0.5);
            }
        }
        // second derivative: vec(conj(q1) (-|w|^2 / 2, w' + w0 x w1) q0) / 2 for w = w0 - w1
        let turn = sub3(&ends.w[0], &ends.w[1]);
        let bend = cross_add(&ends.w[0], &ends.w[1], &sub3(&ends.spin[0], &ends.spin[1]));
        let e = [dot(&turn, &turn) * T::lit(-0.5), bend[0], bend[1], bend[2]];
        let second = quat_mul(&quat_mul(&back, &e), &q0);
        for i in 0..3 {
            self.rate[3 + i] = dot(&self.turns[i], &turn);
            self.drift[3 + i] = second[1 + i] * scale * T::lit(0.5);
        }
    }
}

/// Rows that keep two bodies together.
#[inline(always)]
fn bodies_block<T: Real>(
    sim: &Sim<T>,
    group: &Group<T>,
    work: &mut Work<T>,
    spec: &EqualitySpec<T::Scalar>,
    points: &[Mount<T::Scalar>; 2],
    frames: Option<&Frames<T::Scalar>>,
) {
    let (z, one) = (T::zero(), T::lit(1.0));
    if points[0].link.is_none() && points[1].link.is_none() {
        return;
    }
    let ends = Ends::new(sim, group, work, points);
    let mut violation = Violation::of_places(&ends);
    if let Some(frames) = frames {
        violation.orient(work, &ends, points, frames);
    }
    let Violation { error, rate, drift, mut turns } = violation;
    let dim = if frames.is_some() { 6 } else { 3 };
    let mut square = z;
    for k in 0..dim {
        square = error[k].mul_add(error[k], square);
    }
    let imp = impedance_at(&spec.soft, square.sqrt());
    let ratio = imp.div(one - imp);
    let (k, b) = (imp * T::splat(spec.soft.k), T::splat(spec.soft.b));
    let index = work.rows.blocks.add();
    let block = &mut work.rows.blocks[index];
    block.reset(Source::Equality(spec.index), Cost::Equal, dim);
    block.on = T::not(T::none());
    let Ends { links, r, .. } = ends;
    block.coupled = links[0].is_some() && links[1].is_some();
    for i in 0..dim {
        block.d[i] = ratio.div(T::splat(spec.diag[i / 3]));
        if let Some(weights) = group.weights() {
            block.d[i] *= weights.equalities[spec.index][i / 3];
        }
        block.u0[i] = rate[i].mul_add(b, k.mul_add(error[i], drift[i]));
    }
    // rows measure the first body against the second; the moving side comes second
    let flip = links[0].is_none();
    let sign = if flip { -one } else { one };
    let (second, first) = if flip { (1, 0) } else { (0, 1) };
    let mut lin = [[z; 3]; 3];
    for i in 0..3 {
        lin[i][i] = sign;
        for x in &mut turns[i] {
            *x *= sign;
        }
    }
    block.tie_points(lin, turns, [(links[first], r[first]), (links[second], r[second])], T::not(T::none()));
}

/// One row that keeps a length at a polynomial of another.
#[inline(always)]
fn lengths_block<T: Real>(
    sim: &Sim<T>,
    group: &Group<T>,
    work: &mut Work<T>,
    spec: &EqualitySpec<T::Scalar>,
    follower: &Length<T::Scalar>,
    leader: Option<&Length<T::Scalar>>,
    poly: &[T::Scalar; 5],
) {
    let z = T::zero();
    let (q1, v1) = length_and_velocity(group, work, follower);
    let (mut goal, mut slope) = (T::splat(poly[0]), z);
    let mut v = v1;
    if let Some(leader) = leader {
        let (q2, v2) = length_and_velocity(group, work, leader);
        goal = T::splat(poly[4]);
        for i in (0..4).rev() {
            slope = slope.mul_add(q2, goal);
            goal = goal.mul_add(q2, T::splat(poly[i]));
        }
        v = slope.neg_mul_add(v2, v1);
    }
    let error = q1 - goal;
    let imp = impedance_at(&spec.soft, error);
    let Work { rows, forces, .. } = work;
    let index = rows.blocks.add();
    let block = &mut rows.blocks[index];
    block.reset(Source::Equality(spec.index), Cost::Equal, 1);
    block.on = T::not(T::none());
    block.d[0] = imp.div((T::lit(1.0) - imp) * T::splat(spec.diag[0]));
    if let Some(weights) = group.weights() {
        block.d[0] *= weights.equalities[spec.index][0];
    }
    block.u0[0] = v.mul_add(T::splat(spec.soft.b), imp * T::splat(spec.soft.k) * error);
    let moments = &forces.tendon_moments[..];
    let follower = terms_of(sim, moments, follower);
    let leader = leader.into_iter().flat_map(|l| terms_of(sim, moments, l)).map(|(dof, coef)| (dof, -(slope * coef)));
    block.tie_joints(follower.chain(leader));
}

/// The degrees of freedom of a length and their coefficients.
#[inline(always)]
fn terms_of<'a, T: Real>(
    sim: &'a Sim<T>,
    moments: &'a [T],
    length: &'a Length<T::Scalar>,
) -> impl Iterator<Item = (usize, T)> + 'a {
    let terms = length.terms.iter().map(|t| (t.dof, T::splat(t.coef)));
    terms.chain(length.string.into_iter().flat_map(|t| sim.tendons[t].arms(moments)))
}

/// A length relative to its zero, and its velocity.
#[inline(always)]
fn length_and_velocity<T: Real>(group: &Group<T>, work: &Work<T>, length: &Length<T::Scalar>) -> (T, T) {
    if let Some(t) = length.string {
        return (work.forces.tendon_length[t] - T::splat(length.zero), work.forces.tendon_velocity[t]);
    }
    let (mut q, mut v) = (-T::splat(length.zero), T::zero());
    for t in &length.terms {
        q = T::splat(t.coef).mul_add(group.qpos[t.qpos], q);
        v = T::splat(t.coef).mul_add(group.qvel[t.dof], v);
    }
    (q, v)
}
