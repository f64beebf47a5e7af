//! The servos of a robot: those of its model, and new ones in place of motors.

use marathon_motion::kinematics::Pose;
use marathon_physics::mjcf::MjcfError;
use marathon_physics::model::{Actuator as Compiled, Dynamics, JointType, Model};
use marathon_physics::spec::{Actuator, ModelSpec};

use super::stance::is_wheel;

/// Damping of a new servo, as a multiple of its stiffness, s.
const DAMPING: f64 = 0.03;
/// Largest product of a servo's own frequency and the time step; a stiffer servo would overshoot.
const QUICKEST: f64 = 0.6;
/// Least and largest change of a target by an action, rad.
const SCALES: [f64; 2] = [0.15, 0.6];
/// Ratio of stiffness to torque above which a servo is stiff, and its scale then, rad.
const STIFF: (f64, f64) = (3.0, 0.3);
/// Part of a joint's range at each end that targets keep away from.
const MARGIN: f64 = 0.05;
/// Torque of a joint without a limit, as a part of the robot's weight times its height.
const UNLIMITED: f64 = 0.3;

/// An actuator that moves a joint to a target.
#[derive(Clone, Debug, PartialEq)]
pub struct Servo {
    /// Coordinate of the joint.
    pub qpos: usize,
    /// Its velocity.
    pub dof: usize,
    /// Control that holds the standing pose.
    pub center: f64,
    /// Change of the control by an action of 1.
    pub scale: f64,
    /// Range of the control.
    pub range: [f64; 2],
    /// Largest torque, N m, or force, N.
    pub strength: f64,
    /// Stiffness at the joint, N m/rad or N/m.
    pub stiffness: f64,
}

/// The effect of an action.
#[derive(Clone, Debug, PartialEq)]
pub enum Drive {
    /// It moves the target of a servo.
    Servo(Servo),
    /// It sets the control: the center of its range, and half of its length.
    Direct([f64; 2]),
}

/// The joint of a motor on a hinge or slide that a servo may replace.
fn motor_joint(model: &Model, actuator: &Compiled) -> Option<usize> {
    let joint = actuator.joint().filter(|joint| model.joints[*joint].kind.dofs() == 1)?;
    let plain = actuator.bias == [0.0; 3] && actuator.gain[1..] == [0.0; 2] && actuator.gain[0] != 0.0;
    (plain && actuator.dynamics == Dynamics::None).then_some(joint)
}

/// Whether an actuator's control is the target of a joint.
fn servo_joint(model: &Model, actuator: &Compiled) -> Option<usize> {
    let joint = actuator.joint().filter(|joint| model.joints[*joint].kind.dofs() == 1)?;
    let [constant, length, _] = actuator.bias;
    let holds = constant == 0.0 && length < 0.0 && (actuator.gain[0] + length).abs() <= 1e-9 * length.abs();
    (holds && actuator.dynamics == Dynamics::None).then_some(joint)
}

/// Largest torque at a joint. Without a limit it follows from the robot's weight and height.
fn strength(model: &Model, actuator: &Compiled, joint: usize, height: f64) -> f64 {
    let gear = actuator.gear[0].abs();
    let most = |[low, high]: [f64; 2]| low.abs().max(high.abs());
    let by_control = (actuator.ctrl_limited && actuator.bias == [0.0; 3])
        .then(|| actuator.gain[0].abs() * gear * most(actuator.ctrl_range));
    let by_force = actuator.force_limited.then(|| gear * most(actuator.force_range));
    let by_joint = model.joints[joint].actuator_force_range.map(most);
    let limits = [by_control, by_force, by_joint].into_iter().flatten().filter(|x| *x > 0.0);
    limits.min_by(f64::total_cmp).unwrap_or_else(|| weight(model) * height * UNLIMITED)
}

/// Replaces the motors of a model, which have names, by servos `ratio` times as stiff as they are strong, per radian. Without
/// stiffness they stay. Returns how many there were.
pub fn replace_motors(spec: &mut ModelSpec, height: f64, ratio: f64) -> Result<usize, MjcfError> {
    if ratio == 0.0 {
        return Ok(0);
    }
    let model = spec.compile()?;
    let pose = Pose::of(&model, &model.qpos0);
    let mut replaced = 0;
    for actuator in &model.actuators {
        let Some(index) = motor_joint(&model, actuator) else { continue };
        let joint = &model.joints[index];
        // a wheel has no target to hold
        if is_wheel(&model, &pose, joint.body) {
            continue;
        }
        let dof = &model.dofs[joint.dof_adr];
        let most = strength(&model, actuator, index, height);
        // a servo much quicker than the steps would shake
        let inertia = 1.0 / dof.invweight0.max(1e-9);
        let stiffness = (ratio * most).min(inertia * (QUICKEST / model.opt.timestep).powi(2));
        let damping = (DAMPING * stiffness - dof.damping).max(0.0);
        let servo = Actuator::position(&actuator.name, stiffness)
            .joint(&joint.name)
            .gear(1.0)
            .set("kv", damping)
            .set("ctrllimited", false)
            .force_range([-most, most]);
        spec.replace(&actuator.name, servo)?;
        replaced += 1;
    }
    Ok(replaced)
}

/// Weight of all bodies, N.
fn weight(model: &Model) -> f64 {
    let [x, y, z] = model.opt.gravity;
    model.bodies.iter().map(|body| body.mass).sum::<f64>() * (x * x + y * y + z * z).sqrt()
}

/// The drives of a model's actuators around a standing pose. `wide`: actions move targets as far as they may, so that they can
/// ask for all of a servo's torque. `scale`: that of all servos, if it is given, rad.
pub fn drives(model: &Model, qpos: &[f64], height: f64, wide: bool, scale: Option<f64>) -> Vec<Drive> {
    let drive = |actuator: &Compiled| {
        let Some(index) = servo_joint(model, actuator) else {
            let [low, high] = if actuator.ctrl_limited { actuator.ctrl_range } else { [-1.0, 1.0] };
            return Drive::Direct([0.5 * (low + high), 0.5 * (high - low)]);
        };
        let (joint, gear) = (&model.joints[index], actuator.gear[0]);
        let stiffness = actuator.gain[0] * gear * gear;
        let strength = strength(model, actuator, index, height);
        let [low, high] = joint.range;
        let room = if joint.limited { 0.5 * (high - low) } else { f64::INFINITY };
        let found = match joint.kind {
            JointType::Slide => 0.1 * height,
            _ if wide => SCALES[1],
            _ if stiffness > STIFF.0 * strength => STIFF.1,
            _ => (0.5 * strength / stiffness).clamp(SCALES[0], SCALES[1]),
        };
        let scale = scale.unwrap_or(found.min(room)) * gear;
        let margin = MARGIN * (high - low);
        let mut range = if joint.limited {
            let ends = [(low + margin) * gear, (high - margin) * gear];
            [ends[0].min(ends[1]), ends[0].max(ends[1])]
        } else {
            [f64::NEG_INFINITY, f64::INFINITY]
        };
        if actuator.ctrl_limited {
            range = [range[0].max(actuator.ctrl_range[0]), range[1].min(actuator.ctrl_range[1])];
        }
        let center = (qpos[joint.qpos_adr] * gear).max(range[0]).min(range[1]);
        Drive::Servo(Servo { qpos: joint.qpos_adr, dof: joint.dof_adr, center, scale, range, strength, stiffness })
    };
    model.actuators.iter().map(drive).collect()
}
