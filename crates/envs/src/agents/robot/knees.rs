//! Bent knees for a standing pose without an author: a straight leg can neither push nor swing.

use glam::DVec3;
use marathon_motion::kinematics::Pose;
use marathon_physics::model::{JointType, Model};

use super::legs::legs;
use super::stance::Foot;

/// Angle below which a knee is straight, rad: a tenth of half a turn.
const STRAIGHT: f64 = 0.314;
/// Part of the root's height that it loses when the knees bend.
const LOWER: f64 = 0.05;
/// Part of a joint's range that the pose keeps from its ends.
const MARGIN: f64 = 0.05;

/// The joints of a leg that turn it in the plane of x and z.
struct Leg {
    hip: usize,
    knee: usize,
    ankle: Option<usize>,
}

/// Bends the straight knees of a pose. Returns their number.
pub fn bend(model: &Model, qpos: &mut [f64], root: usize, height: f64, feet: &[Foot]) -> usize {
    let pose = Pose::of(model, qpos);
    let mut bent = 0;
    for (foot, joints) in feet.iter().zip(legs(model, feet, root)) {
        let Some(leg) = leg(model, &pose, &joints) else { continue };
        let sole = DVec3::from_array(foot.place);
        let end = leg.ankle.map_or(sole, |ankle| pose.anchors[ankle]);
        let [thigh, shank] = [pose.anchors[leg.knee] - pose.anchors[leg.hip], end - pose.anchors[leg.knee]];
        let length = pose.anchors[leg.hip].z - sole.z;
        if thigh.angle_between(shank) > STRAIGHT || !(length > LOWER * height) {
            continue;
        }
        let angle = libm::acos(1.0 - LOWER * height / length);
        // ahead if the knee can, as a person's; back otherwise
        let ways = [angle, -angle].map(|angle| (angle, room(model, &pose, qpos, leg.knee, 2.0 * angle)));
        let [(ahead, forward), (back, backward)] = ways;
        let turn = if forward >= backward { ahead } else { back };
        let joints = [(Some(leg.hip), -turn), (Some(leg.knee), 2.0 * turn), (leg.ankle, -turn)];
        for (joint, turn) in joints.into_iter().filter_map(|(joint, turn)| Some((joint?, turn))) {
            let by = room(model, &pose, qpos, joint, turn).copysign(turn) * pose.axes[joint].y.signum();
            qpos[model.joints[joint].qpos_adr] += by;
        }
        bent += 1;
    }
    bent
}

fn leg(model: &Model, pose: &Pose, joints: &[usize]) -> Option<Leg> {
    let pitches = |joint: usize| model.joints[joint].kind == JointType::Hinge && pose.axes[joint].y.abs() > 0.7;
    match joints.iter().copied().filter(|joint| pitches(*joint)).collect::<Vec<_>>()[..] {
        [hip, knee] => Some(Leg { hip, knee, ankle: None }),
        [hip, knee, ankle, ..] => Some(Leg { hip, knee, ankle: Some(ankle) }),
        _ => None,
    }
}

/// The part of a turn about the y axis that a joint has room for, rad, without sign.
fn room(model: &Model, pose: &Pose, qpos: &[f64], joint: usize, turn: f64) -> f64 {
    let by = turn * pose.axes[joint].y.signum();
    let joint = &model.joints[joint];
    if !joint.limited {
        return turn.abs();
    }
    let ([low, high], q) = (joint.range, qpos[joint.qpos_adr]);
    let margin = MARGIN * (high - low);
    let free = if by > 0.0 { high - margin - q } else { q - low - margin };
    free.max(0.0).min(turn.abs())
}
