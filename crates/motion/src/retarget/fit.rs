//! Difference between a retargeted clip and its recording.

use super::mapping::Mapping;
use super::target::Targets;
use crate::clip::{Clip, Nearness};
use crate::error::MotionError;
use crate::kinematics::Pose;
use crate::peak::Peak;
use crate::rotation::log;
use crate::skeleton::Animation;
use glam::DVec3;
use marathon_physics::Model;
use serde::Serialize;
use std::path::Path;

/// Result of retargeting: the model's own proportions, limits and ground keep parts from matching the recording
/// exactly.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Fit {
    /// Mean distance of the mapping's parts from their targets, relative to the hips, m.
    pub position: f64,
    /// Mean angle of their orientations, rad, without parts whose orientation has no weight.
    pub rotation: f64,
    /// Mean angle between the clip and the recording, for the trunk and the bones between parts, rad. It does not
    /// depend on the skeleton's rest pose.
    pub bones: f64,
    /// Largest distance, m.
    pub furthest: Peak,
    /// Largest angle of a part whose orientation has a large weight, such as the trunk, the thighs and the feet, rad.
    pub most_turned: Peak,
}

/// Weight above which an orientation counts for [`Fit::most_turned`], 1/rad.
const COUNTS: f64 = 0.3;
/// Angle of such a part above which a limb or the trunk is probably mapped wrongly, rad.
const CROSSED: f64 = 70.0 * std::f64::consts::PI / 180.0;

/// Length below which a bone has no clear direction, m.
const SHORT: f64 = 0.03;

impl Fit {
    /// Warnings for the user, one sentence each. There are none if the clip is close to its recording.
    pub fn warnings(&self) -> Vec<String> {
        let remedy = "look at the picture; if the character lies, sinks or faces aside, pass --up or --floor";
        let bones = Nearness { position: 0.0, rotation: self.bones };
        let near = Nearness { position: self.position, rotation: self.rotation }.warning();
        let bones = bones.warning().map(|_| {
            format!("its bones differ from the recording's by {:.0} degrees on average", self.bones.to_degrees())
        });
        let peak = &self.most_turned;
        let crossed = (peak.value > CROSSED).then(|| {
            let degrees = peak.value.to_degrees();
            format!("frame {}: {} is turned by {degrees:.0} degrees from the recording's", peak.frame, peak.name)
        });
        near.into_iter().chain(bones).chain(crossed).map(|text| format!("{text}; {remedy}")).collect()
    }

    /// The part of the fit that the clip's file stores.
    pub fn nearness(&self) -> Nearness {
        let round = |value: f64| libm::round(value * 1e4) / 1e4;
        Nearness { position: round(self.position), rotation: round(self.rotation.max(self.bones)) }
    }
}

/// Compares a clip with the animation that [`retarget`](super::retarget) created it from. The path is for messages.
///
/// # Errors
/// If the clip is for another model, or has another number of frames than the animation.
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
    let (mut places, mut turns, mut bones) = (0.0, 0.0, 0.0);
    let pairs = targets.bones();
    for i in 0..count {
        let (target, pose) = (targets.at(i as i64), Pose::of(model, clip.frame(i)));
        let place = |part: usize| {
            let part = &mapping.parts[part];
            pose.point(part.body, DVec3::from_array(part.local))
        };
        for (ours, theirs) in targets.directions(&pairs, i as i64, &pose) {
            if ours.length() > SHORT && theirs.length() > SHORT {
                fit.bones += libm::atan2(ours.cross(theirs).length(), ours.dot(theirs));
                bones += 1.0;
            }
        }
        let hips = 0.5 * (place(mapping.hips[0]) + place(mapping.hips[1]));
        for (k, part) in mapping.parts.iter().enumerate() {
            let distance = ((place(k) - hips) - (target.pos[k] - target.hips)).length();
            fit.position += distance;
            places += 1.0;
            fit.furthest.update(distance, i, || name(model, part.body));
            if part.rotation > 0.0 {
                let angle = log(target.quat[k] * pose.quat[part.body].conjugate()).length();
                fit.rotation += angle;
                turns += 1.0;
                if part.rotation >= COUNTS {
                    fit.most_turned.update(angle, i, || name(model, part.body));
                }
            }
        }
    }
    fit.bones /= f64::max(bones, 1.0);
    fit.position /= f64::max(places, 1.0);
    fit.rotation /= f64::max(turns, 1.0);
    Ok(fit)
}

fn name(model: &Model, body: usize) -> String {
    model.bodies[body].name.clone()
}
