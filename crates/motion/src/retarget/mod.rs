//! Retargeting: from the motion of a skeleton to that of a model.
//!
//! Rotating the model's bones like the skeleton's gives targets for orientations and positions at the model's own
//! proportions. Inverse kinematics over all frames at once then finds smooth joint angles that meet them within the
//! joint limits and above the ground. In the next solution, feet that stand on the ground are held there, and the
//! center of mass moves according to gravity and ground forces.

mod align;
mod balance;
mod band;
mod fit;
mod mapping;
mod own;
mod problem;
mod skeleton_poser;
mod target;
mod weight;

pub use fit::{Fit, fit};
pub use mapping::{Mapping, soles};
pub use skeleton_poser::SkeletonPoser;

use crate::clip::{About, Clip, Cycle};
use crate::contact;
use crate::error::MotionError;
use crate::ground::Touch;
use crate::kinematics::Pose;
use crate::layout::Layout;
use crate::limits;
use crate::rotation::wxyz;
use crate::self_collision::CapsulePair;
use crate::skeleton::Animation;
use glam::DVec3;
use marathon_physics::Model;
use marathon_physics::model::JointType;
use problem::Problem;
use std::path::Path;
use target::{Target, Targets};

/// Time beyond each end of a cycle, s. The next cycle continues there, so that the ends match.
const MARGIN: f64 = 0.4;
/// Number of solutions over all frames. From the second on, standing soles are held and parts do not overlap.
const PASSES: usize = 4;
/// Additional smoothing of the first solution. It unites different solutions of single frames.
const CALM: f64 = 8.0;
/// Maximum joint speed of people, rad/s.
const FASTEST: f64 = 25.0;

/// Retargets an animation to a model, frame for frame. A free root starts above the world's origin. The path is for
/// messages.
///
/// # Errors
/// If the model cannot hold the result, for example because it has no joints.
pub fn retarget(path: &Path, animation: &Animation, model: &Model, mapping: &Mapping) -> Result<Clip, MotionError> {
    // one function: the stages of retargeting in order
    if model.joints.is_empty() {
        return Err(MotionError::model(path, &model.name, "it has no joints"));
    }
    let clip = animation.clip();
    let dt = clip.dt();
    let targets = Targets::new(model, mapping, animation);
    let cycle = animation.cycle();
    // a cycle's last frame is followed by the first of the next
    let count = clip.frames() + usize::from(cycle.is_some());
    let margin = if cycle.is_some() { libm::ceil(MARGIN / dt) as usize } else { 0 };
    // the normal matrix and its two copies need most of the memory
    let band = 3.0 * 8.0 * (3 * model.nv * model.nv) as f64;
    limits::check_memory(path, band * (count + 2 * margin) as f64)?;
    let all: Vec<Target> = (0..count + 2 * margin).map(|i| targets.at(i as i64 - margin as i64)).collect();
    let (touches, capsule_pairs) = (Touch::all(model), CapsulePair::all(model));
    let layout = Layout::of(model);
    let cycle = cycle.map(|Cycle { pos: [x, y], yaw }| {
        let travel = targets.place(DVec3::new(x, y, 0.0));
        Cycle { pos: [travel.x, travel.y], yaw }
    });

    let mut held = vec![vec![false; touches.len()]; all.len()];
    let none = held.clone();
    let problem = |targets, held| Problem {
        model,
        mapping,
        touches: &touches,
        capsule_pairs: &[],
        targets,
        held,
        support: &[],
        dt,
        calm: CALM * mapping.smooth,
    };
    // frame after frame; twice around a cycle, so that its start matches its end
    let mut guess = vec![model.qpos0.clone()];
    let mut frames: Vec<Vec<f64>> = Vec::with_capacity(all.len());
    for round in 0..if cycle.is_some() { 2 } else { 1 } {
        frames.clear();
        for (i, target) in all.iter().enumerate() {
            start(model, target, &mut guess[0]);
            let iterations = if round == 0 && i == 0 { 100 } else { 20 };
            problem(std::slice::from_ref(target), &none[i..=i]).solve(&mut guess, iterations);
            frames.push(guess[0].clone());
        }
    }
    // a character with a fixed root is supported by its mount
    let travels = matches!(model.joints[0].kind, JointType::Free | JointType::Slide);
    let mut support = Vec::new();
    for pass in 0..PASSES {
        if let Some(cycle) = &cycle {
            repeat(cycle, &layout, &mut frames, margin);
        }
        if pass > 0 {
            held = contact::held(model, &touches, &mapping.soles, &frames, dt);
            if travels {
                support = weight::support(model, &touches, &frames);
            }
        }
        let rough = problem(&all, &none);
        let fine =
            Problem { capsule_pairs: &capsule_pairs, held: &held, support: &support, calm: mapping.smooth, ..rough };
        if pass == 0 {
            rough.solve(&mut frames, 25)
        } else {
            fine.solve(&mut frames, 25)
        };
    }

    // a limb that slips past another one may be too fast
    let mut calm = mapping.smooth;
    while calm > 0.0 && calm < CALM * mapping.smooth && fastest(model, &frames, dt) > FASTEST {
        calm *= 2.0;
        Problem { capsule_pairs: &capsule_pairs, held: &held, support: &support, calm, ..problem(&all, &none) }
            .solve(&mut frames, 25);
    }

    let mut frames = frames[margin..margin + count].to_vec();
    frames.iter_mut().for_each(|frame| clamp(model, frame));
    let about = About { model: model.name.clone(), fit: None, ..clip.about().clone() };
    let mut result = Clip::new(path, about, layout, dt, None, &frames)?;
    if let Some(cycle) = cycle {
        result = result.closed(path, cycle)?;
    }
    let result = contact::above_ground(path, model, &touches, &result)?;
    let first = Pose::of(model, result.frame(0)).pos[model.joints[0].body];
    result.moved(path, model, -first.with_z(0.0))
}

/// The highest speed of a hinge, rad/s.
fn fastest(model: &Model, frames: &[Vec<f64>], dt: f64) -> f64 {
    let hinges = model.joints.iter().filter(|joint| joint.kind == JointType::Hinge);
    let speeds = hinges
        .flat_map(|joint| frames.windows(2).map(|pair| (pair[1][joint.qpos_adr] - pair[0][joint.qpos_adr]).abs() / dt));
    speeds.fold(0.0, f64::max)
}

/// Sets the frames before and after a cycle from the cycle.
fn repeat(cycle: &Cycle, layout: &Layout, frames: &mut [Vec<f64>], margin: usize) {
    // the last inner frame is the first of the next cycle
    let count = frames.len() - 2 * margin - 1;
    for i in (0..margin).rev() {
        frames[i] = frames[i + count].clone();
        cycle.advance(layout, &mut frames[i], -1);
    }
    for i in margin + count..frames.len() {
        frames[i] = frames[i - count].clone();
        cycle.advance(layout, &mut frames[i], 1);
    }
}

/// Moves the first moving body to its target, if it is free.
fn start(model: &Model, target: &Target, qpos: &mut [f64]) {
    if model.joints[0].kind == JointType::Free {
        qpos[..3].copy_from_slice(&target.root.0.to_array());
        qpos[3..7].copy_from_slice(&wxyz(target.root.1.normalize()));
    }
}

/// Clamps every joint to its limits.
fn clamp(model: &Model, qpos: &mut [f64]) {
    for joint in model.joints.iter().filter(|joint| joint.limited) {
        if matches!(joint.kind, JointType::Hinge | JointType::Slide) {
            qpos[joint.qpos_adr] = qpos[joint.qpos_adr].clamp(joint.range[0], joint.range[1]);
        }
    }
}
