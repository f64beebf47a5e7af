//! Recordings of known motions: the shipped clips of Marathon Man as BVH files, with various rest poses, axes and
//! floors.

use super::{model, shipped};
use glam::{DMat3, DQuat, DVec3};
use marathon_motion::Clip;
use marathon_motion::kinematics::Pose;
use marathon_physics::Model;

/// Joints by name, parent, and the body that sets their rotation, in file order.
pub const JOINTS: [(&str, Option<usize>, &str); 19] = [
    ("Hips", None, "butt"),
    ("Spine", Some(0), "lower_waist"),
    ("Spine1", Some(1), "torso"),
    ("Neck", Some(2), "torso"),
    ("Head", Some(3), "torso"),
    ("LeftArm", Some(2), "left_upper_arm"),
    ("LeftForeArm", Some(5), "left_larm"),
    ("LeftHand", Some(6), "left_hand"),
    ("RightArm", Some(2), "right_upper_arm"),
    ("RightForeArm", Some(8), "right_larm"),
    ("RightHand", Some(9), "right_hand"),
    ("LeftUpLeg", Some(0), "left_thigh"),
    ("LeftLeg", Some(11), "left_shin"),
    ("LeftFoot", Some(12), "left_foot"),
    ("LeftToeBase", Some(13), "left_foot"),
    ("RightUpLeg", Some(0), "right_thigh"),
    ("RightLeg", Some(15), "right_shin"),
    ("RightFoot", Some(16), "right_foot"),
    ("RightToeBase", Some(17), "right_foot"),
];

/// The left and the right hip.
pub const HIPS: [usize; 2] = [11, 15];
/// The joints of the arms.
pub const ARMS: std::ops::Range<usize> = 5..11;

/// The rest pose of a file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Rest {
    /// Every joint's axes equal the world's in the standing pose.
    Standing,
    /// Every bone lies along this axis of its own frame.
    Along(DVec3),
    /// The pelvis is rotated about the vertical by this angle, degrees.
    Twisted(f64),
}

/// The file's axes and floor.
#[derive(Clone, Copy, Debug)]
pub struct Layout {
    pub rest: Rest,
    /// Rotation from the model's axes, z up, to the file's.
    pub world: DQuat,
    /// Whether the rest pose is rotated, too.
    pub rest_turned: bool,
    /// Height of the floor, m.
    pub floor: f64,
    /// Meters per unit of the file.
    pub unit: f64,
}

/// y up, in centimeters, on a floor at 0.
pub fn usual() -> Layout {
    Layout { rest: Rest::Standing, world: y_up(), rest_turned: true, floor: 0.0, unit: 0.01 }
}

/// z up to y up.
pub fn y_up() -> DQuat {
    DQuat::from_rotation_x(-std::f64::consts::FRAC_PI_2)
}

/// The true positions of the joints, and the true rotations of the bodies from the reference pose.
pub struct Truth {
    model: Model,
    pub clip: Clip,
}

impl Truth {
    pub fn of(name: &str) -> Self {
        Truth { model: model("marathon_man"), clip: shipped("marathon_man", name) }
    }

    /// A body by name. The hand is a part of the forearm.
    fn body(&self, name: &str) -> usize {
        let name = name.replace("hand", "larm");
        self.model.bodies.iter().position(|body| body.name == name).expect("a body")
    }

    /// Position of each joint.
    pub fn places(&self, pose: &Pose) -> Vec<DVec3> {
        let anchor = |body: &str| {
            let body = self.body(body);
            let at = self.model.joints[self.model.bodies[body].joint_start].pos;
            pose.point(body, DVec3::from_array(at))
        };
        let of = |body: &str, local: [f64; 3]| pose.point(self.body(body), DVec3::from_array(local));
        let geom = |name: &str| {
            let geom = self.model.geoms.iter().find(|geom| geom.name == name).expect("a geom");
            pose.point(geom.body, DVec3::from_array(geom.pos))
        };
        JOINTS
            .iter()
            .map(|(name, _, body)| match *name {
                "Hips" => 0.5 * (anchor("left_thigh") + anchor("right_thigh")),
                // a joint is at the anchor of its body
                "Spine" => anchor("butt"),
                "Spine1" => anchor("lower_waist"),
                "Neck" => of("torso", [0.0, 0.0, 0.1]),
                "Head" => of("torso", [0.0, 0.0, 0.2]),
                "LeftToeBase" => of("left_foot", [0.13, 0.0, -0.055]),
                "RightToeBase" => of("right_foot", [0.13, 0.0, -0.055]),
                "LeftHand" | "RightHand" => geom(body),
                _ => anchor(body),
            })
            .collect()
    }

    /// Rotation of each joint from the reference pose.
    pub fn turns(&self, pose: &Pose) -> Vec<DQuat> {
        let rest = self.rest();
        JOINTS.iter().map(|(_, _, body)| pose.quat[self.body(body)] * rest.quat[self.body(body)].conjugate()).collect()
    }

    pub fn rest(&self) -> Pose {
        Pose::of(&self.model, &self.model.qpos0)
    }

    pub fn pose(&self, frame: usize) -> Pose {
        Pose::of(&self.model, self.clip.frame(frame))
    }

    /// The clip as a BVH file.
    pub fn bvh(&self, layout: &Layout) -> String {
        let rest = self.places(&self.rest());
        let ends = |i: usize| JOINTS.iter().position(|(_, parent, _)| *parent == Some(i));
        // the axes of each joint in the model's axes, in the standing pose
        let own: Vec<DQuat> = (0..JOINTS.len())
            .map(|i| {
                let base = if layout.rest_turned { layout.world.conjugate() } else { DQuat::IDENTITY };
                match layout.rest {
                    Rest::Standing => base,
                    Rest::Twisted(degrees) if i == 0 => DQuat::from_rotation_z(degrees.to_radians()) * base,
                    Rest::Twisted(_) => base,
                    Rest::Along(axis) => {
                        let next = match JOINTS[i].0 {
                            "Hips" => Some(1),
                            "Spine1" => Some(3),
                            _ => ends(i),
                        };
                        let way = next.map_or(DVec3::Z, |next| rest[next] - rest[i]).normalize();
                        frame(axis, way, 0.7 * i as f64)
                    }
                }
            })
            .collect();
        let offset =
            |i: usize| JOINTS[i].1.map_or(DVec3::ZERO, |up| own[up].conjugate() * (rest[i] - rest[up]) / layout.unit);
        let mut out = String::from("HIERARCHY\n");
        fn joint(i: usize, out: &mut String, offset: &dyn Fn(usize) -> DVec3) {
            let (word, places) = if i == 0 { ("ROOT", "6 Xposition Yposition Zposition") } else { ("JOINT", "3") };
            let at = offset(i);
            out.push_str(&format!("{word} {} {{ OFFSET {:.6} {:.6} {:.6}\n", JOINTS[i].0, at.x, at.y, at.z));
            out.push_str(&format!("CHANNELS {places} Zrotation Yrotation Xrotation\n"));
            let children: Vec<usize> = (0..JOINTS.len()).filter(|k| JOINTS[*k].1 == Some(i)).collect();
            children.iter().for_each(|child| joint(*child, out, offset));
            if children.is_empty() {
                out.push_str("End Site { OFFSET 0 0 0 }\n");
            }
            out.push_str("}\n");
        }
        joint(0, &mut out, &offset);
        let count = self.clip.frames();
        out.push_str(&format!("MOTION\nFrames: {count}\nFrame Time: {}\n", self.clip.dt()));
        for i in 0..count {
            let pose = self.pose(i);
            let turns = self.turns(&pose);
            let up = layout.world * DVec3::Z;
            let root = (layout.world * self.places(&pose)[0] + layout.floor * up) / layout.unit;
            let world: Vec<DQuat> = (0..JOINTS.len()).map(|i| layout.world * turns[i] * own[i]).collect();
            let mut row = vec![root.x, root.y, root.z];
            for (k, (_, parent, _)) in JOINTS.iter().enumerate() {
                let local = parent.map_or(world[k], |parent| world[parent].conjugate() * world[k]);
                let (z, y, x) = local.to_euler(glam::EulerRot::ZYX);
                row.extend([z, y, x].map(f64::to_degrees));
            }
            out.push_str(&row.iter().map(|x| format!("{x:.5}")).collect::<Vec<_>>().join(" "));
            out.push('\n');
        }
        out
    }
}

/// A frame whose `axis` points along `way`, rotated about it by an angle.
fn frame(axis: DVec3, way: DVec3, angle: f64) -> DQuat {
    let side = |v: DVec3| v.any_orthonormal_vector();
    let basis = |a: DVec3| DMat3::from_cols(a, side(a), a.cross(side(a)));
    let turn = DQuat::from_mat3(&(basis(way) * basis(axis).transpose()));
    DQuat::from_axis_angle(way, angle) * turn
}
