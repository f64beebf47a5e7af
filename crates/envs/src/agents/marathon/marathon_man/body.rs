//! The character's parts, joints and motors, and its model for each kind of control.

use std::sync::LazyLock;

use marathon_physics::Model;
use marathon_physics::lanes::Real;
use marathon_physics::mjcf::MjcfError;
use marathon_physics::spec::{Actuator, Kind, ModelSpec};

use super::super::imitation::Anatomy;
use crate::agent::options::Choice;
use crate::agent::{ModelSource, Part, Scale, find};

/// The model with motors.
const MODEL: &str = marathon_assets::text("agents/marathon_man.xml");

/// The tracked parts, in the original's order.
pub const PARTS: [&str; 17] = [
    "butt",
    "lower_waist",
    "torso",
    "upper_waist",
    "head",
    "right_thigh",
    "right_shin",
    "right_right_foot",
    "left_thigh",
    "left_shin",
    "left_left_foot",
    "right_upper_arm",
    "right_larm",
    "right_hand",
    "left_upper_arm",
    "left_larm",
    "left_hand",
];
/// The root part of observations.
pub const BUTT: Part = Part::named(&PARTS, "butt");
const TORSO: Part = Part::named(&PARTS, "torso");
const HEAD: Part = Part::named(&PARTS, "head");
const RIGHT_FOOT: Part = Part::named(&PARTS, "right_right_foot");
const LEFT_FOOT: Part = Part::named(&PARTS, "left_left_foot");
const RIGHT_HAND: Part = Part::named(&PARTS, "right_hand");
const LEFT_HAND: Part = Part::named(&PARTS, "left_hand");
/// Both feet.
pub const FEET: [Part; 2] = [RIGHT_FOOT, LEFT_FOOT];
/// DeepMimic's end effectors.
pub const END_EFFECTORS: [Part; 4] = [RIGHT_FOOT, LEFT_FOOT, RIGHT_HAND, LEFT_HAND];
/// The original's end effectors.
pub const PAPER_END_EFFECTORS: [Part; 5] = [RIGHT_FOOT, LEFT_FOOT, RIGHT_HAND, LEFT_HAND, TORSO];
/// Parts that must not touch the ground, unless the clip has them there.
pub const TRUNK: [Part; 5] =
    [TORSO, HEAD, BUTT, Part::named(&PARTS, "lower_waist"), Part::named(&PARTS, "upper_waist")];

/// All tracked parts.
pub fn parts() -> impl Iterator<Item = Part> {
    (0..PARTS.len()).map(Part)
}

/// Sites with touch sensors.
pub const TOUCH: [&str; 6] =
    ["right_foot_toe_l", "right_foot_toe_r", "right_foot_heel", "left_foot_toe_l", "left_foot_toe_r", "left_foot_heel"];

/// A hinge with its motor.
pub struct Joint {
    /// Name of the joint and of its motor.
    pub name: &'static str,
    /// Weight of the joint in DeepMimic's pose and velocity errors, before normalization.
    pub weight: f64,
    /// Stiffness of the servo, N m/rad. Its damping, N m s/rad, is a tenth of this number.
    pub stiffness: f64,
    /// Strength of the motor, N m.
    pub strength: f64,
    /// Strength in the original, N m.
    pub original: f64,
}

const fn joint(name: &'static str, weight: f64, stiffness: f64, strength: f64, original: f64) -> Joint {
    Joint { name, weight, stiffness, strength, original }
}

/// The hinges in the order of `qpos`, after the free joint.
///
/// The weights are DeepMimic's. So are stiffness and strength, scaled by the mass from 45 to 82 kg (DeepMimic: 1000 in
/// the chest, 500 in hip and knee, 400 in ankle and shoulder, 300 in the elbow).
pub const JOINTS: [Joint; 21] = [
    joint("abdomen_z", 0.5, 1820.0, 180.0, 40.0),
    joint("abdomen_y", 0.5, 1820.0, 360.0, 40.0),
    joint("abdomen_x", 0.5, 1820.0, 360.0, 40.0),
    joint("right_hip_y", 0.5, 910.0, 360.0, 120.0),
    joint("right_hip_x", 0.5, 910.0, 240.0, 40.0),
    joint("right_hip_z", 0.5, 910.0, 120.0, 40.0),
    joint("right_knee", 0.3, 910.0, 270.0, 80.0),
    joint("right_ankle_y", 0.2, 730.0, 160.0, 20.0),
    joint("right_ankle_z", 0.2, 730.0, 80.0, 20.0),
    joint("left_hip_y", 0.5, 910.0, 360.0, 120.0),
    joint("left_hip_x", 0.5, 910.0, 240.0, 40.0),
    joint("left_hip_z", 0.5, 910.0, 120.0, 40.0),
    joint("left_knee", 0.3, 910.0, 270.0, 80.0),
    joint("left_ankle_y", 0.2, 730.0, 160.0, 20.0),
    joint("left_ankle_z", 0.2, 730.0, 80.0, 20.0),
    joint("right_shoulder_y", 0.3, 730.0, 180.0, 20.0),
    joint("right_shoulder_x", 0.3, 730.0, 180.0, 20.0),
    joint("right_elbow", 0.2, 550.0, 110.0, 40.0),
    joint("left_shoulder_y", 0.3, 730.0, 180.0, 20.0),
    joint("left_shoulder_x", 0.3, 730.0, 180.0, 20.0),
    joint("left_elbow", 0.2, 550.0, 110.0, 40.0),
];

/// Index of a hinge in [`JOINTS`]. In a `const`, an unknown name is a compile error.
pub const fn hinge(name: &str) -> usize {
    find(&NAMES, name)
}

/// Names of the joints.
const NAMES: [&str; JOINTS.len()] = {
    let (mut names, mut i) = ([""; JOINTS.len()], 0);
    while i < JOINTS.len() {
        names[i] = JOINTS[i].name;
        i += 1;
    }
    names
};

/// The data that the reward needs.
pub const ANATOMY: Anatomy = Anatomy {
    root: BUTT,
    parts: PARTS.len(),
    ends: &END_EFFECTORS,
    weights: &WEIGHTS,
    // butt, waist, and twice hip, knee, ankle, shoulder and elbow
    total: 1.0 + 0.5 + 2.0 * (0.5 + 0.3 + 0.2 + 0.3 + 0.2),
    qpos: FIRST_QPOS,
    qvel: FIRST_QVEL,
};

/// Weights of the joints.
const WEIGHTS: [f64; JOINTS.len()] = {
    let (mut weights, mut i) = ([0.0; JOINTS.len()], 0);
    while i < JOINTS.len() {
        weights[i] = JOINTS[i].weight;
        i += 1;
    }
    weights
};

/// Ratio of a servo's damping to its stiffness, s (DeepMimic's).
pub const DAMPING_TIME: f64 = 0.1;
/// Index of the first hinge in `qpos`.
pub const FIRST_QPOS: usize = 7;
/// Index of the first hinge in `qvel`.
pub const FIRST_QVEL: usize = 6;

/// The motors in the original's order, as indices into [`JOINTS`].
pub const ACTIONS: [usize; 21] = [2, 1, 0, 3, 5, 4, 6, 7, 8, 9, 11, 10, 12, 13, 14, 16, 15, 17, 19, 18, 20];

/// Meaning of an action.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Control {
    /// Offset of a servo's target from the clip's next pose.
    Pd,
    /// Target of a servo, within the joint's range.
    PdRange,
    /// Fraction of the motor's strength.
    Torque,
    /// Target velocity of the original's weak drive.
    Servo,
}

impl Choice for Control {
    const EXPECTED: &'static str = "pd, pd_range, torque or servo";
    const NAMED: &'static [(Self, &'static str)] =
        &[(Control::Pd, "pd"), (Control::PdRange, "pd_range"), (Control::Torque, "torque"), (Control::Servo, "servo")];
}

/// Sets the targets of the servos: each action offsets the next pose of its joint by up to `action_scale`. A target is an angle of at
/// most `limit`, both rad.
#[inline(always)]
pub fn set_targets<T: Real>(ctrl: &mut [T], action: &[T], action_scale: Scale, limit: T, poses: [T; JOINTS.len()]) {
    for (i, joint) in ACTIONS.into_iter().enumerate() {
        let target = action[i].mul_add(T::lit(action_scale.0), poses[joint]);
        ctrl[i] = target.max(-limit).min(limit);
    }
}

/// The model with the actuators for a kind of control.
pub fn model(control: Control) -> ModelSource {
    // the registry reads the facts of every task at the start, so the edits are made once, when they are needed
    static PD: LazyLock<ModelSource> = LazyLock::new(|| with_servos(Control::Pd).into());
    static PD_RANGE: LazyLock<ModelSource> = LazyLock::new(|| with_servos(Control::PdRange).into());
    static SERVO: LazyLock<ModelSource> = LazyLock::new(|| with_servos(Control::Servo).into());
    match control {
        Control::Pd => PD.clone(),
        Control::PdRange => PD_RANGE.clone(),
        Control::Torque => MODEL.into(),
        Control::Servo => SERVO.clone(),
    }
}

/// The model with servos in place of its motors, and without the original's drive, which they replace.
fn with_servos(control: Control) -> Result<ModelSpec, MjcfError> {
    let mut spec = ModelSpec::from_xml_str(MODEL, "marathon_man")?;
    spec.default_mut("main", "joint")?.unset("damping")?.unset("stiffness")?;
    let ranges = (control == Control::PdRange).then(middles_and_halves).transpose()?;
    for i in ACTIONS {
        let Joint { name, stiffness, strength, original, .. } = &JOINTS[i];
        spec.remove(Kind::Actuator, name)?;
        let servo = Actuator::general(name).joint(name).set("biastype", "affine");
        spec.add(match control {
            // the drive has a spring and a damper of 1; its force limit is the author's 2.5 times the strength
            Control::Servo => {
                let bound = 2.5 * original;
                servo.set("gainprm", *original).set("biasprm", [0.0, -1.0, -1.0]).force_range([-bound, bound])
            }
            _ => {
                let [middle, reach] = ranges.as_ref().map_or([0.0, 1.0], |ranges| ranges[i]);
                let (gain, bias) = (stiffness * reach, stiffness * middle);
                // its controls are angles, not the fractions of the motors
                let servo = if control == Control::Pd { servo.set("ctrllimited", false) } else { servo };
                let law = servo.set("gainprm", gain).set("biasprm", [bias, -stiffness, -(DAMPING_TIME * stiffness)]);
                law.force_range([-strength, *strength])
            }
        })?;
    }
    Ok(spec)
}

/// Middle of each joint's range and half its width, rad.
fn middles_and_halves() -> Result<[[f64; 2]; 21], MjcfError> {
    let model = Model::from_xml_str(MODEL, "marathon_man")?;
    Ok(std::array::from_fn(|i| {
        let [low, high] = model.joints[1 + i].range;
        [0.5 * (low + high), 0.5 * (high - low)]
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The tables above match the model.
    #[test]
    fn joints_and_motors_are_the_models() {
        for control in [Control::Pd, Control::PdRange, Control::Torque, Control::Servo] {
            let model = super::model(control).spec("marathon_man").and_then(|spec| spec.compile()).unwrap();
            let names: Vec<&str> = model.joints[1..].iter().map(|joint| joint.name.as_str()).collect();
            assert_eq!(names, JOINTS.each_ref().map(|joint| joint.name));
            for (actuator, joint) in model.actuators.iter().zip(ACTIONS) {
                assert_eq!(actuator.name, JOINTS[joint].name);
                assert_eq!(actuator.ctrl_limited, control != Control::Pd, "targets are angles");
                if control == Control::Torque {
                    assert_eq!(actuator.gear[0], JOINTS[joint].strength);
                } else {
                    assert!(actuator.force_limited);
                    assert_eq!(actuator.force_range[1] == JOINTS[joint].strength, control != Control::Servo);
                }
            }
            let mass: f64 = model.bodies.iter().map(|body| body.mass).sum();
            assert!((mass - 82.01).abs() < 1e-9);
            let damped = model.dofs[6..].iter().all(|dof| dof.damping == 1.0);
            assert_eq!(damped, control == Control::Torque);
        }
    }
}
