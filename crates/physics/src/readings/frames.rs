//! Frames of bodies, geoms, sites and cameras: their relative poses and motions.

use super::Readings;
use crate::algebra::spatial::*;
use crate::lanes::Real;
use crate::model::{JointType, SensorObject, TrackMode};
use crate::sim::Mount;

impl<T: Real> Readings<'_, T> {
    /// Pose of an object on its link. `None` for objects without a frame, and for cameras that turn by themselves.
    #[inline(always)]
    pub(super) fn mount_of(&self, object: SensorObject) -> Option<Mount<T::Scalar>> {
        match object {
            SensorObject::Body(b) => Some(self.sim.coms[b].clone()),
            SensorObject::XBody(b) => Some(self.sim.bodies[b].clone()),
            SensorObject::Geom(g) => Some(self.sim.geoms[g].clone()),
            SensorObject::Site(s) => Some(self.sim.sites[s].clone()),
            SensorObject::Camera(c) => {
                let camera = &self.sim.model.cameras[c];
                let body = &self.sim.bodies[camera.body];
                if camera.mode != TrackMode::Fixed {
                    return None;
                }
                let pos = camera.pos.map(T::scalar);
                let rot = quat_to_rot(&camera.quat.map(T::scalar));
                Some(Mount {
                    link: body.link,
                    mocap: body.mocap,
                    pos: rotate_add(&body.rot, &pos, &body.pos),
                    rot: [rotate(&body.rot, &rot[0]), rotate(&body.rot, &rot[1]), rotate(&body.rot, &rot[2])],
                })
            }
            _ => None,
        }
    }

    /// Vector from one frame's origin to another's, world axes. Within a tree it does not lose precision far from the
    /// origin.
    #[inline(always)]
    pub(super) fn separation(&self, from: &Mount<T::Scalar>, to: &Mount<T::Scalar>) -> V3<T> {
        match to.link {
            None => self.arm_from(from, None, &self.work.motion.still(to)),
            Some(l) => self.arm_from(from, Some(self.sim.links[l].tree), &self.work.motion.arm(to, l)),
        }
    }

    /// Vector from a frame's origin to a point that is relative to the reference point of a tree, or in the world.
    #[inline(always)]
    pub(super) fn arm_from(&self, from: &Mount<T::Scalar>, tree: Option<usize>, point: &V3<T>) -> V3<T> {
        let (start, start_tree) = match from.link {
            None => (self.work.motion.still(from), None),
            Some(l) => (self.work.motion.arm(from, l), Some(self.sim.links[l].tree)),
        };
        let arm = sub3(point, &start);
        if tree == start_tree {
            return arm;
        }
        let origin = [T::zero(); 3];
        let to = tree.map_or(origin, |t| self.work.motion.reference[t]);
        let back = start_tree.map_or(origin, |t| self.work.motion.reference[t]);
        add3(&arm, &sub3(&to, &back))
    }

    /// A vector in a frame's own axes.
    #[inline(always)]
    pub(super) fn in_axes(&self, m: &Mount<T::Scalar>, v: &V3<T>) -> V3<T> {
        into_axes(&self.work.motion.axes(m), v)
    }

    /// Orientation of an object as the product of the quaternions from the root outward, as in MuJoCo. Its sign follows
    /// from the state's quaternions.
    #[inline(always)]
    pub(super) fn quat_of(&self, object: SensorObject) -> Option<[T; 4]> {
        let m = &self.sim.model;
        let (body, local) = match object {
            SensorObject::Body(b) => (b, m.bodies[b].iquat),
            SensorObject::XBody(b) => (b, [1.0, 0.0, 0.0, 0.0]),
            SensorObject::Geom(g) => (m.geoms[g].body, m.geoms[g].quat),
            SensorObject::Site(s) => (m.sites[s].body, m.sites[s].quat),
            SensorObject::Camera(c) if m.cameras[c].mode == TrackMode::Fixed => (m.cameras[c].body, m.cameras[c].quat),
            _ => return None,
        };
        Some(quat_mul(&self.body_quat(body), &literal(&local)))
    }

    /// Orientation of a body's frame.
    #[inline(always)]
    fn body_quat(&self, body: usize) -> [T; 4] {
        let m = &self.sim.model;
        let mut path = Vec::new();
        let mut b = body;
        while b != 0 {
            path.push(b);
            b = m.bodies[b].parent;
        }
        let mut q = literal(&[1.0, 0.0, 0.0, 0.0]);
        for &b in path.iter().rev() {
            let body = &m.bodies[b];
            q = match self.sim.bodies[b].mocap {
                Some(k) if body.mocap => self.group.mocap_quat[k],
                _ => quat_mul(&q, &literal(&body.quat)),
            };
            for j in body.joint_start..body.joint_start + body.joint_count {
                let joint = &m.joints[j];
                match joint.kind {
                    JointType::Free => q = self.joint_quat(joint.qpos_adr + 3),
                    JointType::Ball => q = quat_mul(&q, &self.joint_quat(joint.qpos_adr)),
                    JointType::Hinge => {
                        let turn = self.group.qpos[joint.qpos_adr] - T::splat(self.sim.joints[j].q0);
                        let (s, c) = (turn * T::lit(0.5)).sin_cos();
                        let a = joint.axis;
                        q = quat_mul(&q, &[c, s * T::lit(a[0]), s * T::lit(a[1]), s * T::lit(a[2])]);
                    }
                    JointType::Slide => {}
                }
            }
        }
        normalized(&q)
    }

    /// The quaternion at an address of `qpos`, normalized.
    #[inline(always)]
    pub(super) fn joint_quat(&self, at: usize) -> [T; 4] {
        let q = &self.group.qpos;
        normalized(&[q[at], q[at + 1], q[at + 2], q[at + 3]])
    }

    /// Velocity of a frame's origin and its angular velocity, relative to another frame (which may move and turn).
    #[inline(always)]
    pub(super) fn relative_velocity(&self, m: &Mount<T::Scalar>, from: &Mount<T::Scalar>) -> (V3<T>, V3<T>) {
        let turning = self.mount_spin(from);
        let v = sub3(&self.mount_velocity(m), &self.mount_velocity(from));
        // velocity of a point at rest due to the rotation of the reference frame
        let v = cross_add(&self.separation(from, m), &turning, &v);
        let w = sub3(&self.mount_spin(m), &turning);
        let axes = self.work.motion.axes(from);
        (into_axes(&axes, &v), into_axes(&axes, &w))
    }
}

/// Constant quaternion.
#[inline(always)]
fn literal<T: Real>(q: &[f64; 4]) -> [T; 4] {
    [T::lit(q[0]), T::lit(q[1]), T::lit(q[2]), T::lit(q[3])]
}

#[inline(always)]
fn normalized<T: Real>(q: &[T; 4]) -> [T; 4] {
    let inv = q[0].mul_add(q[0], q[1].mul_add(q[1], q[2].mul_add(q[2], q[3] * q[3]))).sqrt().recip();
    [q[0] * inv, q[1] * inv, q[2] * inv, q[3] * inv]
}
