//! Positions: link frames, motion axes and spatial inertias from `qpos`.

use crate::algebra::spatial::*;
use crate::lanes::Real;
use crate::model::JointType;
use crate::sim::{Link, LinkJoint, Sim};
use crate::state::{DofWork, Group, Work};

/// Computes every link's frame, its joints' motion axes and its spatial inertia.
///
/// Everything in a tree is in world axes about the origin of its root link. Children add to parents without a
/// transform, and single precision does not lose accuracy far from the world's origin.
#[inline(always)]
pub(crate) fn kinematics<T: Real>(sim: &Sim<T>, group: &Group<T>, work: &mut Work<T>) {
    let links = &sim.links[..];
    let n = links.len();
    let Work { motion, dofs, .. } = work;
    // slices of known length need no check per link
    let ((rots, mocap_rots), (places, mocap_places)) = (motion.rot.split_at_mut(n), motion.pos.split_at_mut(n));
    let inertias = &mut motion.inertia[..n];
    mocap_places.copy_from_slice(&group.mocap_pos);
    for (rot, quat) in mocap_rots.iter_mut().zip(&group.mocap_quat) {
        *rot = quat_to_rot(quat);
    }
    for (l, link) in links.iter().enumerate() {
        let joints = &sim.joints[link.joints.clone()];
        let anchors = &mut motion.anchor[link.joints.clone()];
        let (mut rot, mut pos) = match (link.parent, link.mocap) {
            (Some(p), _) => frame_at_parent(link, &rots[p], &places[p]),
            (None, None) => ([splat3(&link.rot[0]), splat3(&link.rot[1]), splat3(&link.rot[2])], splat3(&link.pos)),
            (None, Some(k)) => frame_at_parent(link, &mocap_rots[k], &mocap_places[k]),
        };
        for (joint, anchor) in joints.iter().zip(anchors.iter_mut()) {
            *anchor = apply_joint(joint, group, dofs, &mut rot, &mut pos);
        }
        if link.parent.is_none() {
            // the tree's reference point is known only now: move anchors and axes to it
            motion.reference[link.tree] = pos;
            for anchor in anchors.iter_mut() {
                *anchor = sub3(anchor, &pos);
            }
            pos = [T::zero(); 3];
        }
        for (joint, anchor) in joints.iter().zip(anchors.iter()) {
            finish_axes(joint, anchor, &rot, dofs);
        }
        (rots[l], places[l], inertias[l]) = (rot, pos, spatial_inertia(link, &rot, &pos));
    }
    if let Some(varied) = &group.varied {
        for (inertia, factor) in inertias.iter_mut().zip(&varied.mass) {
            for x in inertia {
                *x *= *factor;
            }
        }
    }
}

/// Frame of a link before its joints move it, from the frame of its parent.
#[inline(always)]
fn frame_at_parent<T: Real>(link: &Link<T::Scalar>, rot: &Rot<T>, pos: &V3<T>) -> (Rot<T>, V3<T>) {
    let pos = rotate_add(rot, &splat3(&link.pos), pos);
    (if link.rot_is_identity { *rot } else { compose(rot, &link.rot) }, pos)
}

/// Moves a link's frame by one joint and records the joint's axis direction. Returns the joint's anchor.
#[inline(always)]
fn apply_joint<T: Real>(
    joint: &LinkJoint<T::Scalar>,
    group: &Group<T>,
    dofs: &mut [DofWork<T>],
    rot: &mut Rot<T>,
    pos: &mut V3<T>,
) -> V3<T> {
    let (q, z, one) = (&group.qpos, T::zero(), T::lit(1.0));
    let a = joint.qpos;
    match joint.kind {
        JointType::Free => {
            *pos = [q[a], q[a + 1], q[a + 2]];
            *rot = quat_to_rot(&[q[a + 3], q[a + 4], q[a + 5], q[a + 6]]);
            *pos
        }
        JointType::Slide => {
            let dir = rotate(rot, &splat3(&joint.axis));
            let d = q[a] - T::splat(joint.q0);
            *pos = [d.mul_add(dir[0], pos[0]), d.mul_add(dir[1], pos[1]), d.mul_add(dir[2], pos[2])];
            dofs[joint.dof].axis = [z, z, z, dir[0], dir[1], dir[2]];
            *pos
        }
        JointType::Hinge => {
            let anchor = anchor_of(joint, rot, pos);
            let (s, c) = (q[a] - T::splat(joint.q0)).sin_cos();
            let dir;
            if let Some((k, negative)) = joint.aligned {
                // rotate the two other columns
                let s = if negative { -s } else { s };
                let x = rot[k];
                dir = if negative { [-x[0], -x[1], -x[2]] } else { x };
                let (i1, i2) = ((k + 1) % 3, (k + 2) % 3);
                let (c1, c2) = (rot[i1], rot[i2]);
                for i in 0..3 {
                    rot[i1][i] = c.mul_add(c1[i], s * c2[i]);
                    rot[i2][i] = s.neg_mul_add(c1[i], c * c2[i]);
                }
            } else {
                // Rodrigues' formula in the link's own frame
                let n: V3<T> = splat3(&joint.axis);
                dir = rotate(rot, &n);
                let t = one - c;
                let (tn, sn) = ([t * n[0], t * n[1], t * n[2]], [s * n[0], s * n[1], s * n[2]]);
                let c0 = [tn[0].mul_add(n[0], c), tn[0].mul_add(n[1], sn[2]), tn[0].mul_add(n[2], -sn[1])];
                let c1 = [tn[1].mul_add(n[0], -sn[2]), tn[1].mul_add(n[1], c), tn[1].mul_add(n[2], sn[0])];
                let c2 = [tn[2].mul_add(n[0], sn[1]), tn[2].mul_add(n[1], -sn[0]), tn[2].mul_add(n[2], c)];
                *rot = [rotate(rot, &c0), rotate(rot, &c1), rotate(rot, &c2)];
            }
            restore_anchor(joint, rot, pos, &anchor);
            dofs[joint.dof].axis = [dir[0], dir[1], dir[2], z, z, z];
            anchor
        }
        JointType::Ball => {
            let anchor = anchor_of(joint, rot, pos);
            let turn = quat_to_rot(&[q[a], q[a + 1], q[a + 2], q[a + 3]]);
            *rot = [rotate(rot, &turn[0]), rotate(rot, &turn[1]), rotate(rot, &turn[2])];
            restore_anchor(joint, rot, pos, &anchor);
            anchor
        }
    }
}

#[inline(always)]
fn anchor_of<T: Real>(joint: &LinkJoint<T::Scalar>, rot: &Rot<T>, pos: &V3<T>) -> V3<T> {
    if joint.centered { *pos } else { rotate_add(rot, &splat3(&joint.pos), pos) }
}

/// Moves a link so that a rotation leaves the joint's anchor in place.
#[inline(always)]
fn restore_anchor<T: Real>(joint: &LinkJoint<T::Scalar>, rot: &Rot<T>, pos: &mut V3<T>, anchor: &V3<T>) {
    if !joint.centered {
        *pos = sub3(anchor, &rotate(rot, &splat3(&joint.pos)));
    }
}

/// Computes a joint's motion axes from the link's orientation and the reference point.
#[inline(always)]
fn finish_axes<T: Real>(joint: &LinkJoint<T::Scalar>, anchor: &V3<T>, rot: &Rot<T>, dofs: &mut [DofWork<T>]) {
    let (z, one) = (T::zero(), T::lit(1.0));
    let d = joint.dof;
    match joint.kind {
        JointType::Slide => {}
        JointType::Hinge => {
            let s = &mut dofs[d].axis;
            let l = cross(anchor, &ang(s));
            s[3] = l[0];
            s[4] = l[1];
            s[5] = l[2];
        }
        JointType::Ball => {
            for k in 0..3 {
                let l = cross(anchor, &rot[k]);
                dofs[d + k].axis = [rot[k][0], rot[k][1], rot[k][2], l[0], l[1], l[2]];
            }
        }
        JointType::Free => {
            // translation along the world's axes, rotation about the link's own axes through the reference point
            for k in 0..3 {
                let mut e = [z; 6];
                e[3 + k] = one;
                dofs[d + k].axis = e;
                dofs[d + 3 + k].axis = [rot[k][0], rot[k][1], rot[k][2], z, z, z];
            }
        }
    }
}

/// A link's inertia about the tree's reference point in world axes.
#[inline(always)]
fn spatial_inertia<T: Real>(link: &Link<T::Scalar>, r: &Rot<T>, pos: &V3<T>) -> Inertia<T> {
    let c = rotate_add(r, &splat3(&link.com), pos);
    let m = T::splat(link.mass);
    let mc = [m * c[0], m * c[1], m * c[2]];
    let i = &link.inertia;
    // columns of R I
    let mut t = [[T::zero(); 3]; 3];
    if link.inertia_is_diagonal {
        for k in 0..3 {
            let d = T::splat(i[k]);
            t[k] = [r[k][0] * d, r[k][1] * d, r[k][2] * d];
        }
    } else {
        t[0] = rotate(r, &splat3(&[i[0], i[3], i[4]]));
        t[1] = rotate(r, &splat3(&[i[3], i[1], i[5]]));
        t[2] = rotate(r, &splat3(&[i[4], i[5], i[2]]));
    }
    let (xx, yy, zz) = (mc[0] * c[0], mc[1] * c[1], mc[2] * c[2]);
    [
        m,
        mc[0],
        mc[1],
        mc[2],
        turned(&t, r, 0, 0) + (yy + zz),
        turned(&t, r, 1, 1) + (xx + zz),
        turned(&t, r, 2, 2) + (xx + yy),
        mc[0].neg_mul_add(c[1], turned(&t, r, 0, 1)),
        mc[0].neg_mul_add(c[2], turned(&t, r, 0, 2)),
        mc[1].neg_mul_add(c[2], turned(&t, r, 1, 2)),
    ]
}

/// Entry (a, b) of R I R'.
#[inline(always)]
fn turned<T: Real>(t: &Rot<T>, r: &Rot<T>, a: usize, b: usize) -> T {
    t[0][a].mul_add(r[0][b], t[1][a].mul_add(r[1][b], t[2][a] * r[2][b]))
}

/// Velocities of the links, and the forces of the current motion (first half of a recursive Newton-Euler pass).
#[inline(always)]
pub(crate) fn velocities<T: Real>(sim: &Sim<T>, group: &Group<T>, work: &mut Work<T>) {
    let z = T::zero();
    let v = &group.qvel;
    let gravity = group.gravity(sim);
    let links = &sim.links[..];
    let n = links.len();
    let Work { motion, dofs, .. } = work;
    let (vels, bias_acc, bias_force) = (&mut motion.vel[..n], &mut motion.bias_acc[..n], &mut motion.bias_force[..n]);
    let inertias = &motion.inertia[..n];
    for (l, link) in links.iter().enumerate() {
        let (mut vel, mut acc) = match link.parent {
            Some(p) => (vels[p], bias_acc[p]),
            None => ([z; 6], [z, z, z, -gravity[0], -gravity[1], -gravity[2]]),
        };
        for joint in &sim.joints[link.joints.clone()] {
            let d = joint.dof;
            match joint.kind {
                JointType::Free => {
                    // translation first: its axes are fixed in the world
                    for k in 0..3 {
                        vel[3 + k] += v[d + k];
                    }
                    let s = ball_motion(dofs, v, d + 3);
                    add_motion(&s, &mut vel, &mut acc);
                }
                JointType::Ball => {
                    let s = ball_motion(dofs, v, d);
                    add_motion(&s, &mut vel, &mut acc);
                }
                JointType::Slide => {
                    let (s, v) = (&dofs[d].axis, v[d]);
                    let turn = cross(&ang(&vel), &lin(s));
                    for k in 0..3 {
                        acc[3 + k] = turn[k].mul_add(v, acc[3 + k]);
                        vel[3 + k] = s[3 + k].mul_add(v, vel[3 + k]);
                    }
                }
                JointType::Hinge => {
                    let (s, v) = (&dofs[d].axis, v[d]);
                    let rate = cross_motion(&vel, s);
                    acc = axpy6(&rate, v, &acc);
                    vel = axpy6(s, v, &vel);
                }
            }
        }
        (vels[l], bias_acc[l]) = (vel, acc);
        let f = inertia_mul(&inertias[l], &acc);
        let h = inertia_mul(&inertias[l], &vel);
        // v x* h: the momentum that moves along
        let t = cross_add(&ang(&vel), &ang(&h), &cross_add(&lin(&vel), &lin(&h), &ang(&f)));
        let f = cross_add(&ang(&vel), &lin(&h), &lin(&f));
        bias_force[l] = [t[0], t[1], t[2], f[0], f[1], f[2]];
    }
}

/// Motion of three rotational degrees of freedom together.
#[inline(always)]
fn ball_motion<T: Real>(dofs: &[DofWork<T>], v: &[T], d: usize) -> V6<T> {
    let s = axpy6(&dofs[d].axis, v[d], &[T::zero(); 6]);
    let s = axpy6(&dofs[d + 1].axis, v[d + 1], &s);
    axpy6(&dofs[d + 2].axis, v[d + 2], &s)
}

#[inline(always)]
fn add_motion<T: Real>(s: &V6<T>, vel: &mut V6<T>, acc: &mut V6<T>) {
    let rate = cross_motion(vel, s);
    for k in 0..6 {
        acc[k] += rate[k];
        vel[k] += s[k];
    }
}
