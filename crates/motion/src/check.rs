//! Checks of a clip: joint limits, ground, overlaps, jumps, foot sliding.

use crate::clip::{Clip, Nearness};
use crate::contact::{self, clearance};
use crate::effort::{Efforts, efforts};
use crate::error::MotionError;
use crate::ground::Touch;
use crate::kinematics::Pose;
use crate::peak::Peak;
use crate::self_collision::CapsulePair;
use glam::DVec3;
use marathon_physics::Model;
use marathon_physics::model::JointType;
use serde::Serialize;
use std::path::Path;

/// Measurements of a clip.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Report {
    /// Frames.
    pub frames: usize,
    /// Length, s.
    pub seconds: f64,
    /// Largest violation of a joint limit, rad or m.
    pub limit: Peak,
    /// Largest depth below the ground, m.
    pub depth: Peak,
    /// Largest overlap of two colliding bodies, m.
    pub overlap: Peak,
    /// Highest speed of a hinge or of a free body's rotation, rad/s.
    pub speed: Peak,
    /// Highest speed of a slide or of a free body, m/s.
    pub travel: Peak,
    /// Largest change of a hinge's speed from frame to frame, rad/s.
    pub jump: Peak,
    /// Height of the lowest point over all frames, m.
    pub height: f64,
    /// Largest distance that a sole slides in one ground contact, m.
    pub slide: Peak,
    /// Mean horizontal speed of the standing soles, m/s.
    pub slide_speed: f64,
    /// Fraction of the frames in which a sole stands.
    pub standing: f64,
    /// The clip's distance from its recording, as its file states it.
    pub fit: Option<Nearness>,
    /// Motor and ground forces that the clip needs. `None` for models without supported inverse dynamics.
    pub efforts: Option<Efforts>,
}

/// Bounds above which a value of [`Report`] causes a warning.
mod bound {
    /// rad or m.
    pub const LIMIT: f64 = 1e-3;
    /// m.
    pub const DEPTH: f64 = 1e-3;
    /// m.
    pub const OVERLAP: f64 = 5e-3;
    /// rad/s.
    pub const SPEED: f64 = 30.0;
    /// m/s; sprinters reach 12.
    pub const TRAVEL: f64 = 15.0;
    /// m.
    pub const HEIGHT: f64 = 0.05;
    /// rad/s in a sixtieth of a second.
    pub const JUMP: f64 = 25.0;
    /// m; per step, the distance that people notice.
    pub const SLIDE: f64 = 0.03;
    /// Fraction of the weight without support, and of gravity that a flight does not follow.
    pub const MISSING: f64 = 0.5;
    /// Weight times m.
    pub const UNBALANCED: f64 = 0.15;
    /// Number of joints in the notes.
    pub const HARDEST: usize = 3;
    /// kg m^2/s.
    pub const GAINED: f64 = 5.0;
}

/// Measures a clip of a model. `soles` are the indices of the bodies that stand. The path is for messages.
///
/// # Errors
/// If the clip is for another model.
pub fn check(path: &Path, clip: &Clip, model: &Model, soles: &[usize]) -> Result<Report, MotionError> {
    clip.check_model(path, model)?;
    let count = clip.frames() + usize::from(clip.cycle().is_some());
    let frames: Vec<Vec<f64>> = (0..count as i64).map(|i| clip.frame_at(i)).collect();
    let poses: Vec<Pose> = frames.iter().map(|frame| Pose::of(model, frame)).collect();
    let (touches, capsule_pairs) = (Touch::all(model), CapsulePair::all(model));
    let mut report = Report {
        frames: clip.frames(),
        seconds: clip.duration(),
        limit: Peak::default(),
        depth: Peak::default(),
        overlap: Peak::default(),
        speed: Peak::default(),
        travel: Peak::default(),
        jump: Peak::default(),
        height: f64::INFINITY,
        slide: Peak::default(),
        slide_speed: 0.0,
        standing: 0.0,
        fit: clip.about().fit,
        efforts: efforts(path, clip, model).ok(),
    };
    let body = |i: usize| model.bodies[i].name.clone();
    for (i, (frame, pose)) in frames.iter().zip(&poses).enumerate() {
        for joint in model.joints.iter().filter(|joint| joint.limited && joint.kind != JointType::Ball) {
            let at = frame[joint.qpos_adr];
            let beyond = (joint.range[0] - at).max(at - joint.range[1]);
            report.limit.update(beyond, i, || joint.name.clone());
        }
        let clearance = clearance(&touches, pose);
        report.height = report.height.min(clearance);
        report.depth.update(-clearance, i, || {
            let lowest = touches.iter().min_by(|a, b| a.lowest(pose).z.total_cmp(&b.lowest(pose).z));
            lowest.map_or(String::new(), |touch| body(touch.body))
        });
        for pair in &capsule_pairs {
            let separation = pair.separation(pose);
            report.overlap.update(-separation.distance, i, || {
                format!("{} and {}", body(separation.bodies[0]), body(separation.bodies[1]))
            });
        }
    }
    for joint in model.joints.iter().filter(|joint| matches!(joint.kind, JointType::Free | JointType::Slide)) {
        for (i, pair) in frames.windows(2).enumerate() {
            let [from, to] = [&pair[0], &pair[1]].map(|frame| &frame[joint.qpos_adr..]);
            if joint.kind == JointType::Slide {
                report.travel.update((to[0] - from[0]).abs() / clip.dt(), i, || joint.name.clone());
                continue;
            }
            let way = DVec3::from_slice(to) - DVec3::from_slice(from);
            report.travel.update(way.length() / clip.dt(), i, || joint.name.clone());
            let same: f64 = from[3..7].iter().zip(&to[3..7]).map(|(a, b)| a * b).sum();
            let turn = 2.0 * same.abs().min(1.0).acos();
            report.speed.update(turn / clip.dt(), i, || joint.name.clone());
        }
    }
    for joint in model.joints.iter().filter(|joint| joint.kind == JointType::Hinge) {
        let speed = |i: usize| (frames[i + 1][joint.qpos_adr] - frames[i][joint.qpos_adr]) / clip.dt();
        for i in 0..count - 1 {
            report.speed.update(speed(i).abs(), i, || joint.name.clone());
            if i > 0 {
                report.jump.update((speed(i) - speed(i - 1)).abs() / (60.0 * clip.dt()), i, || joint.name.clone());
            }
        }
    }
    slides(model, &touches, soles, &poses, &frames, clip.dt(), &mut report);
    Ok(report)
}

/// Sliding of soles, contact by contact.
fn slides(
    model: &Model,
    touches: &[Touch],
    soles: &[usize],
    poses: &[Pose],
    frames: &[Vec<f64>],
    dt: f64,
    report: &mut Report,
) {
    let held = contact::held(model, touches, soles, frames, dt);
    let (mut way, mut seconds) = (0.0, 0.0);
    contact::stances(touches, &held, poses, |k, begin, steps| {
        let mut slid = DVec3::ZERO;
        for (i, step) in steps.iter().enumerate() {
            slid += *step;
            report.slide.update(slid.length(), begin + i, || model.bodies[touches[k].body].name.clone());
            way += step.length();
            seconds += dt;
        }
    });
    report.slide_speed = if seconds > 0.0 { way / seconds } else { 0.0 };
    let standing = held.iter().filter(|touches| touches.contains(&true)).count();
    report.standing = standing as f64 / held.len() as f64;
}

impl Report {
    /// Warnings for the user, one sentence each. Empty if the clip is fine.
    pub fn warnings(&self) -> Vec<String> {
        let mut out = Vec::new();
        let mut warn = |peak: &Peak, bound: f64, text: String| {
            if peak.value > bound {
                out.push(format!("frame {}: {text}", peak.frame));
            }
        };
        let Report { limit, depth, overlap, speed, travel, jump, slide, .. } = self;
        warn(limit, bound::LIMIT, format!("{} is {:.3} rad beyond its limit", limit.name, limit.value));
        warn(depth, bound::DEPTH, format!("{} is {:.1} mm below the ground", depth.name, 1e3 * depth.value));
        warn(overlap, bound::OVERLAP, format!("{} overlap by {:.1} mm", overlap.name, 1e3 * overlap.value));
        warn(speed, bound::SPEED, format!("{} turns at {:.0} rad/s", speed.name, speed.value));
        warn(travel, bound::TRAVEL, format!("{} moves at {:.0} m/s", travel.name, travel.value));
        warn(jump, bound::JUMP, format!("{} jumps by {:.0} rad/s", jump.name, jump.value));
        let far = self.fit.and_then(|fit| fit.warning());
        warn(slide, bound::SLIDE, format!("{} has slid {:.1} cm while it stands", slide.name, 1e2 * slide.value));
        if self.height > bound::HEIGHT {
            out.push(format!("no frame touches the ground: the lowest point is {:.1} cm above it", 1e2 * self.height));
        }
        out.extend(
            far.map(|text| format!("{text}: it is another motion, or the recording was read in a wrong direction")),
        );
        out
    }

    /// Physical inconsistencies, one sentence each: torques beyond the motors, and forces without a source. Motion
    /// capture always has some, so a clip can be fine nevertheless.
    pub fn notes(&self) -> Vec<String> {
        let Some(Efforts { joints, missing, unbalanced, flights }) = &self.efforts else { return Vec::new() };
        let mut out = Vec::new();
        for effort in joints.iter().filter(|effort| effort.beyond > 0.0).take(bound::HARDEST) {
            out.push(format!(
                "frame {}: {} takes {:.0} of {:.0} N m; its motor is too weak in {:.0} % of the frames",
                effort.frame,
                effort.joint,
                effort.needed,
                effort.strength,
                1e2 * effort.beyond
            ));
        }
        if missing.value > bound::MISSING {
            let share = 1e2 * missing.value;
            out.push(format!("frame {}: {share:.0} % of the weight has no support", missing.frame));
        }
        if unbalanced.value > bound::UNBALANCED {
            let (frame, moment) = (unbalanced.frame, unbalanced.value);
            out.push(format!("frame {frame}: a moment of the weight times {moment:.2} m has no support"));
        }
        for flight in flights {
            let [x, y, z] = flight.acceleration;
            let off = (DVec3::new(x, y, z + 9.81) / 9.81).length();
            let gained = DVec3::from_array(flight.gained).length();
            if off > bound::MISSING || gained > bound::GAINED {
                out.push(format!(
                    "frames {} to {}: the flight falls by {:.1} m/s^2 and gains {gained:.0} kg m^2/s of angular momentum, from {:.0}",
                    flight.from,
                    flight.to,
                    -z,
                    DVec3::from_array(flight.momentum).length()
                ));
            }
        }
        out
    }
}
