//! How near a retargeted clip comes to its recording.

use super::mapping::Mapping;
use super::target::Targets;
use crate::clip::Clip;
use crate::error::MotionError;
use crate::kinematics::Pose;
use crate::rotation::log;
use crate::skeleton::Animation;
use crate::worst::Worst;
use glam::DVec3;
use marathon_physics::Model;
use serde::Serialize;
use std::path::Path;

/// What retargeting has left of a recording: at the model's own proportions, limits and ground keep parts from where the
/// recording has them.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Fit {
    /// Mean distance of the mapping's parts from where the recording has them, as seen from the hips, m.
    pub position: f64,
    /// Mean angle of their orientations, rad; parts without a weight of their orientation do not count.
    pub rotation: f64,
    /// Furthest distance, m.
    pub furthest: Worst,
}

/// Compares a clip with the animation that [`retarget`](super::retarget) has made it from. The path is for messages.
///
/// # Errors
/// If the clip is not the model's, or has another number of frames than the animation.
pub fn fit(
    path: &Path,
    animation: &Animation,
    model: &Model,
    mapping: &Mapping,
    clip: &Clip,
) -> Result<Fit, MotionError> {
    clip.check_model(path, model)?;
    let count = animation.clip().frames();
    if clip.frames() != count {
        return Err(MotionError::value(path, "frames", clip.frames(), format!("{count}, as the recording has")));
    }
    let targets = Targets::new(model, mapping, animation);
    let mut fit = Fit::default();
    let (mut places, mut turns) = (0.0, 0.0);
    for i in 0..count {
        let (target, pose) = (targets.at(i as i64), Pose::of(model, clip.frame(i)));
        let place = |part: usize| {
            let part = &mapping.parts[part];
            pose.point(part.body, DVec3::from_array(part.local))
        };
        let hips = 0.5 * (place(mapping.hips[0]) + place(mapping.hips[1]));
        for (k, part) in mapping.parts.iter().enumerate() {
            let distance = ((place(k) - hips) - (target.pos[k] - target.hips)).length();
            fit.position += distance;
            places += 1.0;
            fit.furthest.meet(distance, i, || name(model, part.body));
            if part.rotation > 0.0 {
                fit.rotation += log(target.quat[k] * pose.quat[part.body].conjugate()).length();
                turns += 1.0;
            }
        }
    }
    fit.position /= f64::max(places, 1.0);
    fit.rotation /= f64::max(turns, 1.0);
    Ok(fit)
}

fn name(model: &Model, body: usize) -> String {
    model.bodies[body].name.clone()
}
