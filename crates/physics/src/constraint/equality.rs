//! Equality constraints: bodies, joints and tendons tied together.

use crate::lanes::{Real, kernel_fn};
use crate::model::{EqualityKind, Model};
use crate::readings::rot_to_quat;
use crate::rigid::{self, BodyMount, quat_to_rot};
use crate::sim::{Mount, Sim};
use crate::solver::block::{Cost, Source};
use crate::solver::softness::{Softness, impedance_at, softness};
use crate::spatial::*;
use crate::tendon::TendonSpec;
use crate::work::{Group, Work};

/// An equality constraint as the kernels see it.
#[derive(Clone, Debug)]
pub(crate) struct EqualitySpec<C> {
    /// Index in the model.
    index: usize,
    tie: Tie<C>,
    soft: Softness<C>,
    /// Approximate inverse inertia seen by the rows of positions and by those of orientations.
    diag: [C; 2],
    /// See [`rigid::is_hard`].
    pub hard: bool,
}

#[derive(Clone, Debug)]
enum Tie<C> {
    /// Points (and with `frames` orientations) of two bodies.
    Bodies { points: [Mount<C>; 2], frames: Option<Frames<C>> },
    /// A length, and one that it follows by a polynomial.
    Lengths { follower: Length<C>, leader: Option<Length<C>>, poly: [C; 5] },
}

/// What a weld holds besides points.
#[derive(Clone, Copy, Debug)]
struct Frames<C> {
    /// Orientations of the frames on their links (in the world for static bodies).
    quats: [[C; 4]; 2],
    /// Weight of the angular error.
    scale: C,
}

/// A joint's position or a tendon's length, measured from the reference configuration.
#[derive(Clone, Debug)]
struct Length<C> {
    terms: Vec<Term<C>>,
    zero: C,
}

/// One joint's share of a length.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Term<C> {
    pub qpos: usize,
    pub dof: usize,
    pub coef: C,
}

/// Prepares the constraints that hold from the start.
pub(crate) fn equalities<T: Real>(
    model: &Model,
    mounts: &[BodyMount],
    link_of: &[Option<usize>],
    tendons: &[TendonSpec<T::Scalar>],
) -> Vec<EqualitySpec<T::Scalar>> {
    let c = T::scalar;
    let joint = |j: usize| {
        let j = &model.joints[j];
        let term = Term { qpos: j.qpos_adr, dof: j.dof_adr, coef: c(1.0) };
        Length { terms: vec![term], zero: c(model.qpos0[j.qpos_adr]) }
    };
    let tendon = |t: usize| Length { terms: tendons[t].terms.clone(), zero: c(model.tendons[t].length0) };
    let mut out = Vec::new();
    for (index, e) in model.equalities.iter().enumerate().filter(|(_, e)| e.active) {
        let dof_weight = |j: usize| model.dofs[model.joints[j].dof_adr].invweight0;
        let tendon_weight = |t: usize| model.tendons[t].invweight0;
        let (tie, diag) = match &e.kind {
            EqualityKind::Connect { bodies, anchors, .. } => (
                tie_bodies::<T>(mounts, link_of, bodies, anchors, None),
                rigid::inverse_weights(model, mounts, *bodies),
            ),
            EqualityKind::Weld { bodies, anchors, quats, torquescale, .. } => {
                let tie = tie_bodies::<T>(mounts, link_of, bodies, anchors, Some((quats, *torquescale)));
                (tie, rigid::inverse_weights(model, mounts, *bodies))
            }
            EqualityKind::Joint { joint1, joint2, polycoef } => (
                Tie::Lengths { follower: joint(*joint1), leader: joint2.map(joint), poly: polycoef.map(c) },
                [dof_weight(*joint1) + joint2.map_or(0.0, dof_weight); 2],
            ),
            EqualityKind::Tendon { tendon1, tendon2, polycoef } => (
                Tie::Lengths { follower: tendon(*tendon1), leader: tendon2.map(tendon), poly: polycoef.map(c) },
                [tendon_weight(*tendon1) + tendon2.map_or(0.0, tendon_weight); 2],
            ),
        };
        let soft = softness::<T>(model, &e.solref, &e.solimp, 0.0, diag[0]);
        let hard = match &e.kind {
            EqualityKind::Connect { bodies, .. } | EqualityKind::Weld { bodies, .. } => {
                rigid::is_hard(model, mounts, *bodies, diag[0])
            }
            _ => false,
        };
        out.push(EqualitySpec { index, hard, tie, soft, diag: diag.map(|x| c(x.max(1e-15))) });
    }
    out
}

fn tie_bodies<T: Real>(
    mounts: &[BodyMount],
    link_of: &[Option<usize>],
    bodies: &[usize; 2],
    anchors: &[[f64; 3]; 2],
    frames: Option<(&[[f64; 4]; 2], f64)>,
) -> Tie<T::Scalar> {
    let c = T::scalar;
    let point = |i: usize| {
        let m = &mounts[bodies[i]];
        let (pos, _) = rigid::compose(&(m.pos, m.rot), &(anchors[i], quat_to_rot(&[1.0, 0.0, 0.0, 0.0])));
        Mount { link: link_of[m.body], pos: pos.map(c), rot: m.rot.map(|r| r.map(c)) }
    };
    let frames = frames.map(|(quats, scale)| {
        let on_link = |i: usize| quat_mul(&rot_to_quat(&mounts[bodies[i]].rot), &quats[i]).map(c);
        Frames { quats: [on_link(0), on_link(1)], scale: c(scale) }
    });
    Tie::Bodies { points: [point(0), point(1)], frames }
}

kernel_fn! {
    /// Writes the blocks of all equality constraints.
    pub(crate) fn equality_blocks<'a, T>(sim: &'a Sim<T>, group: &'a Group<T>, work: &'a mut Work<T>) {
        for spec in &sim.equalities {
            match &spec.tie {
                Tie::Bodies { points, frames } => bodies_block(sim, group, work, spec, points, frames.as_ref()),
                Tie::Lengths { follower, leader, poly } => {
                    lengths_block(group, work, spec, follower, leader.as_ref(), poly);
                }
            }
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
    let links = [points[0].link, points[1].link];
    // points of one link keep their distance, but not the direction of the gap between them
    if links == [None; 2] {
        return;
    }
    let tree = |link: Option<usize>| link.map(|l| sim.links[l].tree);
    let same_tree = tree(links[0]) == tree(links[1]);
    // points relative to their trees' references, and the difference of the places
    let mut r = [[z; 3]; 2];
    let mut v = [[z; 3]; 2];
    let mut w = [[z; 3]; 2];
    let mut place = [[z; 3]; 2];
    for i in 0..2 {
        match links[i] {
            None => place[i] = splat3(&points[i].pos),
            Some(l) => {
                r[i] = work.arm(&points[i], l);
                // within a tree the common reference would only cost digits
                place[i] = if same_tree { r[i] } else { add3(&r[i], &work.reference[sim.links[l].tree]) };
                v[i] = cross_add(&ang(&work.vel[l]), &r[i], &lin(&work.vel[l]));
                w[i] = ang(&work.vel[l]);
            }
        }
    }
    // what the rows would accelerate by without any joint acceleration: the reference makes up for it
    let mut drift = [z; 6];
    let (mut here, mut spin) = ([[z; 3]; 2], [[z; 3]; 2]);
    for i in 0..2 {
        if let Some(l) = links[i] {
            let a = &work.bias_acc[l];
            let at = cross_add(&w[i], &v[i], &cross_add(&ang(a), &r[i], &lin(a)));
            // the bias acceleration has gravity in it
            here[i] = add3(&at, &group.gravity(sim));
            spin[i] = ang(a);
        }
    }
    drift[..3].copy_from_slice(&sub3(&here[0], &here[1]));
    let mut error = [z; 6];
    let mut rate = [z; 6];
    let (gap, speed, turn) = (sub3(&place[0], &place[1]), sub3(&v[0], &v[1]), sub3(&w[0], &w[1]));
    error[..3].copy_from_slice(&gap);
    rate[..3].copy_from_slice(&speed);
    let mut turns = [[z; 3]; 3];
    let dim = if frames.is_some() { 6 } else { 3 };
    if let Some(Frames { quats, scale }) = frames {
        let frame = |i: usize| {
            let q = quats[i].map(T::splat);
            links[i].map_or(q, |l| quat_mul(&rot_to_quat(&work.rot[l]), &q))
        };
        let (q0, q1) = (frame(0), frame(1));
        let back = quat_conjugate(&q1);
        let scale = T::splat(*scale);
        let relative = quat_mul(&back, &q0);
        for i in 0..3 {
            error[3 + i] = relative[1 + i] * scale;
        }
        // derivative with respect to the relative angular velocity: vec(conj(q1) w q0) / 2
        for j in 0..3 {
            let mut axis = [z; 4];
            axis[1 + j] = one;
            let d = quat_mul(&quat_mul(&back, &axis), &q0);
            for i in 0..3 {
                turns[i][j] = d[1 + i] * scale * T::lit(0.5);
            }
        }
        // second derivative: vec(conj(q1) (-|w|^2 / 2, w' + w0 x w1) q0) / 2 for w = w0 - w1
        let bend = cross_add(&w[0], &w[1], &sub3(&spin[0], &spin[1]));
        let e = [dot(&turn, &turn) * T::lit(-0.5), bend[0], bend[1], bend[2]];
        let second = quat_mul(&quat_mul(&back, &e), &q0);
        for i in 0..3 {
            rate[3 + i] = dot(&turns[i], &turn);
            drift[3 + i] = second[1 + i] * scale * T::lit(0.5);
        }
    }
    let mut square = z;
    for k in 0..dim {
        square = error[k].mul_add(error[k], square);
    }
    let imp = impedance_at(&spec.soft, square.sqrt());
    let ratio = imp.div(one - imp);
    let (k, b) = (imp * T::splat(spec.soft.k), T::splat(spec.soft.b));
    let index = work.blocks.add();
    let block = &mut work.blocks[index];
    block.reset(Source::Equality(spec.index), Cost::Equal, dim);
    block.on = T::not(T::none());
    block.coupled = links[0].is_some() && links[1].is_some();
    for i in 0..dim {
        block.d[i] = ratio.div(T::splat(spec.diag[i / 3]));
        block.u0[i] = rate[i].mul_add(b, k.mul_add(error[i], drift[i]));
    }
    // rows measure the first body against the second; the side that moves comes second
    let flip = links[0].is_none();
    let sign = if flip { -one } else { one };
    let (second, first) = if flip { (1, 0) } else { (0, 1) };
    let all = T::not(T::none());
    let mut lin = [[z; 3]; 3];
    for i in 0..3 {
        lin[i][i] = sign;
        for x in &mut turns[i] {
            *x *= sign;
        }
    }
    block.tie_points(lin, turns, [(links[first], r[first]), (links[second], r[second])], all);
}

/// One row that keeps a length at a polynomial of another.
#[inline(always)]
fn lengths_block<T: Real>(
    group: &Group<T>,
    work: &mut Work<T>,
    spec: &EqualitySpec<T::Scalar>,
    follower: &Length<T::Scalar>,
    leader: Option<&Length<T::Scalar>>,
    poly: &[T::Scalar; 5],
) {
    let z = T::zero();
    let (q1, v1) = measure(group, follower);
    let (mut goal, mut slope) = (T::splat(poly[0]), z);
    let mut v = v1;
    if let Some(leader) = leader {
        let (q2, v2) = measure(group, leader);
        goal = T::splat(poly[4]);
        for i in (0..4).rev() {
            slope = slope.mul_add(q2, goal);
            goal = goal.mul_add(q2, T::splat(poly[i]));
        }
        v = slope.neg_mul_add(v2, v1);
    }
    let error = q1 - goal;
    let imp = impedance_at(&spec.soft, error);
    let index = work.blocks.add();
    let block = &mut work.blocks[index];
    block.reset(Source::Equality(spec.index), Cost::Equal, 1);
    block.on = T::not(T::none());
    block.d[0] = imp.div((T::lit(1.0) - imp) * T::splat(spec.diag[0]));
    block.u0[0] = v.mul_add(T::splat(spec.soft.b), imp * T::splat(spec.soft.k) * error);
    let follower = follower.terms.iter().map(|t| (t.dof, T::splat(t.coef)));
    let leader = leader.into_iter().flat_map(|l| &l.terms).map(|t| (t.dof, -(slope * T::splat(t.coef))));
    block.tie_joints(follower.chain(leader));
}

/// A length from its zero, and its velocity.
#[inline(always)]
fn measure<T: Real>(group: &Group<T>, length: &Length<T::Scalar>) -> (T, T) {
    let (mut q, mut v) = (-T::splat(length.zero), T::zero());
    for t in &length.terms {
        q = T::splat(t.coef).mul_add(group.qpos[t.qpos], q);
        v = T::splat(t.coef).mul_add(group.qvel[t.dof], v);
    }
    (q, v)
}
