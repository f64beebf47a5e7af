//! Mappings for skeletons that are a model's own, such as those of generated skins: a joint for each body, in its place.

use super::align::place;
use super::mapping::{Mapping, Part};
use crate::kinematics::Pose;
use crate::rotation::{about_z, wxyz};
use crate::skeleton::Skeleton;
use glam::DVec3;
use marathon_physics::Model;
use marathon_physics::model::JointType;
use std::f64::consts::FRAC_PI_2;

/// Largest distance between a joint and its body, as a fraction of the model's extent.
const CLOSE: f64 = 0.02;

impl Mapping {
    /// The mapping in which every body with a joint follows the skeleton's joint of its name, if the skeleton is the model's
    /// own: the tree of the model's first joint, with each joint in its place at rest. The skeleton may face any direction. If
    /// its places do not tell, it faces -y, as a glTF file does that is turned upright.
    pub fn own(skeleton: &Skeleton, model: &Model) -> Option<Self> {
        let root = model.bodies[model.joints.first()?.body].root_id;
        let jointed = |body: &usize| model.bodies[*body].root_id == root && model.bodies[*body].joint_count > 0;
        let part = |body: usize| {
            let name = &model.bodies[body].name;
            let mut joints = (0..skeleton.bones.len()).filter(|bone| skeleton.bones[*bone].name == *name);
            let joint = joints.next().filter(|_| joints.next().is_none())?;
            let first = &model.joints[model.bodies[body].joint_start];
            let local = if first.kind == JointType::Free { [0.0; 3] } else { first.pos };
            Some(Part { body, local, whole: true, joint, toward: None, rotation: 1.0, position: 0.0, rest: None })
        };
        let mut parts: Vec<Part> = (1..model.bodies.len()).filter(jointed).map(part).collect::<Option<_>>()?;

        let (rest, source) = (Pose::of(model, &model.qpos0), skeleton.rest());
        let first = |list: &[DVec3]| list.iter().map(|p| *p - list[0]).collect::<Vec<_>>();
        let ours = first(&parts.iter().map(|part| place(&rest, part)).collect::<Vec<_>>());
        let theirs = first(&parts.iter().map(|part| source.pos[part.joint]).collect::<Vec<_>>());
        let (mut sin, mut cos) = (0.0, 0.0);
        for (a, b) in ours.iter().zip(&theirs) {
            sin += a.x * b.y - a.y * b.x;
            cos += a.x * b.x + a.y * b.y;
        }
        let extent = ours.iter().map(|p| p.length()).fold(1e-3, f64::max);
        let level = (sin * sin + cos * cos).sqrt() > 1e-6 * extent * extent;
        let turn = about_z(if level { libm::atan2(sin, cos) } else { -FRAC_PI_2 });
        let fits = ours.iter().zip(&theirs).all(|(a, b)| (turn * *a).distance(*b) <= CLOSE * extent);
        parts.iter_mut().for_each(|part| part.rest = Some(wxyz(turn)));
        (fits && !parts.is_empty()).then(|| Mapping {
            parts,
            hips: [0, 0],
            soles: Vec::new(),
            smooth: 1.0,
            balance: 1.0,
        })
    }
}
