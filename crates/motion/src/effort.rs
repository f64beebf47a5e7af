//! The motor torques of a clip, and the forces that neither motors nor ground can supply.

use crate::clip::Clip;
use crate::contact::clearance;
use crate::dynamics::{self, Motion};
use crate::error::MotionError;
use crate::ground::Touch;
use crate::kinematics::Pose;
use crate::peak::Peak;
use glam::DVec3;
use marathon_physics::Model;
use marathon_physics::model::{Actuator, JointType};
use serde::Serialize;
use std::path::Path;

/// Height below which the ground can push, m. Contacts of motion capture are not more precise.
const NEAR: f64 = 0.02;
/// Coefficient of friction. The cone has four edges.
const FRICTION: f64 = 1.0;
/// Force (relative to the weight) and torque (relative to the weight times 1 m) on undriven degrees of freedom that
/// cost as much as a whole motor.
const ROOT: f64 = 0.02;
/// Cost of contact forces, in motors per weight of the character. It matters only between otherwise equal solutions.
const SPARE: f64 = 1e-3;
/// Iterations over the contact forces.
const SWEEPS: usize = 200;
/// Averaging window of forces, s. Contacts start and end between frames, at unknown instants.
const WINDOW: f64 = 0.1;
/// Minimum duration of a flight, s.
const FLIGHT: f64 = 0.1;
/// Minimum height of all bodies in a flight, m.
const CLEAR: f64 = 0.05;

/// Load of one joint's motors in a clip.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Effort {
    /// The joint.
    pub joint: String,
    /// Torque or force that the clip needs, N m or N, in the frame with the highest load relative to the strength.
    pub needed: f64,
    /// Strength of the motors in this direction.
    pub strength: f64,
    /// The frame.
    pub frame: usize,
    /// Fraction of the frames in which the motors are too weak.
    pub beyond: f64,
}

/// A period without ground contact.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Flight {
    /// First frame.
    pub from: usize,
    /// Last frame.
    pub to: usize,
    /// Mean acceleration of the center of mass, m/s^2. In a real flight it equals gravity.
    pub acceleration: [f64; 3],
    /// Angular momentum about the center of mass at the start, kg m^2/s.
    pub momentum: [f64; 3],
    /// Change of the angular momentum until the end, kg m^2/s. In a real flight it is zero.
    pub gained: [f64; 3],
}

/// Loads of a clip.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Efforts {
    /// Joints by load relative to their strength, the highest first.
    pub joints: Vec<Effort>,
    /// Largest force at the root that neither motors nor ground supply, relative to the weight.
    pub missing: Peak,
    /// Largest moment at the root that neither motors nor ground supply, relative to the weight times 1 m.
    pub unbalanced: Peak,
    /// Flights of 0.1 s or more.
    pub flights: Vec<Flight>,
}

/// Computes the torques of a clip, as means over 0.1 s: inverse dynamics of its frames, minus the possible forces at
/// points near the ground. These forces lie in a friction cone of coefficient 1. Of all forces that support the
/// character, those with the lowest motor load are chosen. Accelerations are central differences of the clip's
/// velocities. The path is for messages.
///
/// # Errors
/// If the clip is for another model, or the model has tendons, equality constraints, drag, or springs in ball joints.
pub fn efforts(path: &Path, clip: &Clip, model: &Model) -> Result<Efforts, MotionError> {
    clip.check_model(path, model)?;
    if let Some(what) = dynamics::unsupported(model) {
        return Err(MotionError::model(path, &model.name, format!("inverse dynamics does not support {what}")));
    }
    let touches = Touch::all(model);
    let strengths = strengths(model);
    let weight = model.bodies.iter().map(|body| body.mass).sum::<f64>() * 9.81;
    let root = model.joints.first().map_or(0, |joint| joint.body);
    // undriven degrees of freedom: those that move the root, and those that rotate it
    let of_root = |i: usize| model.dofs[i].body == root;
    let linear = |i: usize| {
        let joint = &model.joints[model.dofs[i].joint];
        joint.kind == JointType::Slide || joint.kind == JointType::Free && i - joint.dof_adr < 3
    };
    let (lifts, turns): (Vec<usize>, Vec<usize>) = (0..model.nv).filter(|i| of_root(*i)).partition(|i| linear(*i));
    let mut states = Vec::with_capacity(clip.frames());
    let mut needs = Vec::with_capacity(clip.frames());
    for i in 0..clip.frames() {
        let (qpos, qvel, qacc) = (clip.frame(i), clip.velocity(i), clip.acceleration(i));
        let pose = Pose::of(model, qpos);
        let near: Vec<&Touch> = touches.iter().filter(|touch| touch.lowest(&pose).z < NEAR).collect();
        states.push((clearance(&touches, &pose) > CLEAR, Motion::of(model, qpos, qvel, &qacc).momentum(model)));
        let mut forces = dynamics::inverse(model, qpos, qvel, &qacc);
        carry(model, &pose, &near, &strengths, weight, &mut forces);
        needs.push(forces);
    }
    let [mut missing, mut unbalanced] = [Peak::default(), Peak::default()];
    let mut hardest: Vec<Option<(f64, Effort)>> = vec![None; model.nv];
    let mut beyond = vec![0usize; model.nv];
    let half = libm::round(0.5 * WINDOW / clip.dt()) as usize;
    for i in 0..clip.frames() {
        let window = &needs[i.saturating_sub(half)..(i + half + 1).min(needs.len())];
        let mean = |dof: usize| window.iter().map(|forces| forces[dof]).sum::<f64>() / window.len() as f64;
        for (peak, dofs) in [(&mut missing, &lifts), (&mut unbalanced, &turns)] {
            let left = dofs.iter().map(|dof| mean(*dof) * mean(*dof)).sum::<f64>();
            peak.update(left.sqrt() / weight, i, || model.bodies[root].name.clone());
        }
        for dof in 0..model.nv {
            let Some([low, high]) = strengths[dof] else { continue };
            let force = mean(dof);
            let strength = if force < 0.0 { -low } else { high };
            let share = force.abs() / strength.max(1e-9);
            beyond[dof] += usize::from(share > 1.0);
            if hardest[dof].as_ref().is_none_or(|(most, _)| share > *most) {
                let joint = model.joints[model.dofs[dof].joint].name.clone();
                hardest[dof] = Some((share, Effort { joint, needed: force.abs(), strength, frame: i, beyond: 0.0 }));
            }
        }
    }
    let with_share = |(dof, found): (usize, Option<(f64, Effort)>)| {
        let share = beyond[dof] as f64 / clip.frames() as f64;
        found.map(|(most, effort)| (most, Effort { beyond: share, ..effort }))
    };
    let mut joints: Vec<(f64, Effort)> = hardest.into_iter().enumerate().filter_map(with_share).collect();
    joints.sort_by(|a, b| b.0.total_cmp(&a.0));
    let joints = joints.into_iter().map(|(_, effort)| effort).collect();
    Ok(Efforts { joints, missing, unbalanced, flights: flights(&states, clip.dt()) })
}

/// Flights in frames with the height condition and the momentum.
fn flights(states: &[(bool, (DVec3, DVec3, DVec3))], dt: f64) -> Vec<Flight> {
    let mut flights = Vec::new();
    let mut begin = 0;
    while begin < states.len() {
        let end = (begin..states.len()).find(|i| !states[*i].0).unwrap_or(states.len());
        // velocities at the ends depend on neighboring frames with ground contact
        if end >= begin + 4 && (end - begin - 3) as f64 * dt >= FLIGHT {
            let (from, to) = (begin + 1, end - 2);
            let ((_, v0, l0), (_, v1, l1)) = (states[from].1, states[to].1);
            let acceleration = ((v1 - v0) / ((to - from) as f64 * dt)).to_array();
            flights.push(Flight { from, to, acceleration, momentum: l0.to_array(), gained: (l1 - l0).to_array() });
        }
        begin = end + 1;
    }
    flights
}

/// Per degree of freedom: the lowest and the highest force of its motors, if it has motors.
fn strengths(model: &Model) -> Vec<Option<[f64; 2]>> {
    let mut strengths = vec![None; model.nv];
    for actuator in &model.actuators {
        let Some(joint) = actuator.joint().map(|joint| &model.joints[joint]) else { continue };
        let [low, high] = range(actuator);
        for (i, gear) in actuator.gear.iter().take(joint.kind.dofs()).enumerate().filter(|(_, gear)| **gear != 0.0) {
            let ends = [gear * low, gear * high];
            let sum = strengths[joint.dof_adr + i].get_or_insert([0.0, 0.0]);
            sum[0] += f64::min(ends[0], ends[1]);
            sum[1] += f64::max(ends[0], ends[1]);
        }
    }
    strengths
}

/// Force range of an actuator, infinite without bounds.
fn range(actuator: &Actuator) -> [f64; 2] {
    let motor = actuator.bias == [0.0; 3] && actuator.gain[1..] == [0.0; 2] && actuator.ctrl_limited;
    match (actuator.force_limited, motor) {
        (true, _) => actuator.force_range,
        (false, true) => {
            let ends = actuator.ctrl_range.map(|ctrl| actuator.gain[0] * ctrl);
            [f64::min(ends[0], ends[1]), f64::max(ends[0], ends[1])]
        }
        (false, false) => [f64::NEG_INFINITY, f64::INFINITY],
    }
}

/// Subtracts possible ground forces from generalized forces: nonnegative least squares, by coordinate descent.
fn carry(model: &Model, pose: &Pose, near: &[&Touch], strengths: &[Option<[f64; 2]>], weight: f64, forces: &mut [f64]) {
    let scale: Vec<f64> = strengths
        .iter()
        .map(|strength| match strength {
            Some([low, high]) => 1.0 / f64::max(-low, *high).clamp(1e-6, 1e9),
            None => 1.0 / (ROOT * weight),
        })
        .collect();
    let mut edges: Vec<(Vec<f64>, f64)> = Vec::new();
    for touch in near {
        for side in [DVec3::X, DVec3::Y, DVec3::NEG_X, DVec3::NEG_Y] {
            // in weights of the character
            let push = weight * (DVec3::Z + FRICTION * side);
            let mut column = vec![0.0; model.nv];
            pose.motions(model, touch.body, touch.lowest(pose), |dof, _, shift| column[dof] += shift.dot(push));
            for joint in &model.joints {
                dynamics::to_body_axes(joint, pose.quat[joint.body], &mut column);
            }
            let square = column.iter().zip(&scale).map(|(c, s)| (c * s) * (c * s)).sum::<f64>() + SPARE * SPARE;
            edges.push((column, square));
        }
    }
    let mut push = vec![0.0_f64; edges.len()];
    for _ in 0..SWEEPS {
        for ((column, square), push) in edges.iter().zip(&mut push) {
            let along: f64 = column.iter().zip(forces.iter()).zip(&scale).map(|((c, f), s)| c * s * f * s).sum();
            let next = (*push + (along - SPARE * SPARE * *push) / square).max(0.0);
            let by = next - *push;
            forces.iter_mut().zip(column).for_each(|(force, c)| *force -= by * c);
            *push = next;
        }
    }
}
