//! Frames of centers of mass, geoms and sites as MuJoCo's kinematics takes them (`mjtSameFrame`, set by its compiler).
//!
//! A frame that is almost its body's frame, or almost the body's inertial frame, counts as that frame. Almost means less than a
//! millionth, in meters and in entries of the quaternion. Geoms of meshes come this close: the center of a symmetric mesh is not exactly zero.

use super::vector::{cross, scale, sub};
use super::{Model, Quat, Vec3};

/// Frames closer than this count as equal; MuJoCo's `kFrameEps`.
const FRAME_EPS: f64 = 1e-6;

const IDENTITY: Quat = [1.0, 0.0, 0.0, 0.0];

impl Model {
    /// Position and orientation of a body's inertial frame in its body frame.
    pub(crate) fn inertial_frame(&self, body: usize) -> (Vec3, Quat) {
        let body = &self.bodies[body];
        near_body(body.ipos, body.iquat).unwrap_or((body.ipos, body.iquat))
    }

    /// Position and orientation of a geom in its body's frame.
    pub(crate) fn geom_frame(&self, geom: usize) -> (Vec3, Quat) {
        let geom = &self.geoms[geom];
        self.frame_on(geom.body, geom.pos, geom.quat)
    }

    /// Position and orientation of a site in its body's frame.
    pub(crate) fn site_frame(&self, site: usize) -> (Vec3, Quat) {
        let site = &self.sites[site];
        self.frame_on(site.body, site.pos, site.quat)
    }

    /// Whether a body's place in the tree allows MuJoCo to take its mass matrix for diagonal: it has no children, hangs on the world or
    /// on a static child of it, and its center of mass is in its own frame.
    pub(crate) fn stands_alone(&self, body: usize) -> bool {
        let own = &self.bodies[body];
        let parent = &self.bodies[own.parent];
        near_body(own.ipos, own.iquat) == Some(([0.0; 3], IDENTITY))
            && (own.parent == 0 || (parent.parent == 0 && parent.dof_count == 0))
            && self.bodies.get(body + 1).is_none_or(|next| next.parent != body)
    }

    fn frame_on(&self, body: usize, pos: Vec3, quat: Quat) -> (Vec3, Quat) {
        if let Some(frame) = near_body(pos, quat) {
            return frame;
        }
        let own = &self.bodies[body];
        if !small(between(own.iquat, quat)) {
            return (pos, quat);
        }
        let (at, turned) = self.inertial_frame(body);
        (if small(sub(pos, own.ipos)) { at } else { pos }, turned)
    }
}

/// A frame whose axes are those of the body, and perhaps its origin, too.
fn near_body(pos: Vec3, quat: Quat) -> Option<(Vec3, Quat)> {
    let [_, x, y, z] = quat;
    small([x, y, z]).then_some((if small(pos) { [0.0; 3] } else { pos }, IDENTITY))
}

/// Whether a vector or rotation counts as zero.
pub(crate) fn small(v: Vec3) -> bool {
    v.iter().all(|x| x.abs() < FRAME_EPS)
}

/// Vector part of the rotation from one orientation to another: half their angle, if that is small.
fn between(from: Quat, to: Quat) -> Vec3 {
    let (a, b) = ([from[1], from[2], from[3]], [to[1], to[2], to[3]]);
    sub(sub(scale(b, from[0]), scale(a, to[0])), cross(a, b))
}
