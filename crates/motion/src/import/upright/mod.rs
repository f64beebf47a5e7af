//! Converts a recording from its file's axes and unit to an upright character in meters, on a floor at z = 0.
//!
//! Files do not reliably state their unit, the up axis, the height of the floor, or the standing pose. This module
//! finds all four from the bones and the motion.

mod floor;
mod landmarks;
mod neutral;
mod up;

pub use up::Up;

use super::raw::Raw;
use super::{Reading, Recording, unit};
use crate::error::MotionError;
use crate::limits;
use crate::rotation::{quat, wxyz};
use crate::skeleton::{Animation, Keyframe, Skeleton};
use glam::{DQuat, DVec3};
use landmarks::Landmarks;
use std::path::Path;
use up::Moment;

/// Limit on the moments that are sampled from a recording.
const MOMENTS: usize = 1500;

/// Converts the recording to an animation, with notes on the properties found.
pub(super) fn settle(path: &Path, mut raw: Raw, wraps: bool, reading: &Reading) -> Result<Recording, MotionError> {
    let count = raw.keyframes.len();
    if count < 2 {
        return Err(MotionError::value(path, "frames", count, "two or more"));
    }
    limits::check_seconds(path, raw.dt * count as f64)?;
    let dt = raw.dt;
    let marks = Landmarks::of(&raw.skeleton, &reading.known_as);
    let rest = raw.skeleton.rest();
    let extent = |axis: DVec3| {
        let heights = rest.pos.iter().map(|pos| pos.dot(axis));
        heights.clone().fold(f64::NEG_INFINITY, f64::max) - heights.fold(f64::INFINITY, f64::min)
    };
    let rest_up = marks.as_ref().and_then(|marks| neutral::upward(marks, &rest));
    let stature = match &marks {
        Some(marks) => marks.stature(&raw.skeleton),
        None => extent(DVec3::X).max(extent(DVec3::Y)).max(extent(DVec3::Z)),
    };
    if !(stature > 0.0 && stature < 1e9) {
        let found = format!("a skeleton {stature} tall");
        return Err(MotionError::value(
            path,
            "skeleton",
            found,
            "joints of a figure, which do not all lie in one point",
        ));
    }

    let mut notes = std::mem::take(&mut raw.notes);
    let conventional =
        if marks.is_none() && raw.trust_y < 0.5 && extent(DVec3::Z) > 1.2 * extent(DVec3::Y) { Up::Z } else { Up::Y };
    let up = match (&marks, reading.up) {
        (_, Some(up)) => up,
        (Some(marks), None) => {
            let moments = moments(&raw.skeleton, &raw.keyframes);
            up::estimate(marks, &moments, stature, dt, rest_up.map(Up::nearest), raw.trust_y)
        }
        (None, None) => conventional,
    };
    if reading.up.is_none() && up != Up::Y {
        notes.push(format!("{up} points up, as the motion shows; --up y|z|... says otherwise"));
    }

    // convert to upright, in meters
    let unit = unit(stature);
    let upright = up.upright();
    for bone in &mut raw.skeleton.bones {
        bone.offset = bone.offset.map(|x| unit * x);
    }
    for keyframe in &mut raw.keyframes {
        keyframe.root = (upright * (unit * DVec3::from_array(keyframe.root))).to_array();
        turn_first(&mut keyframe.rotations[0], upright);
    }
    let moments = if marks.is_some() { moments(&raw.skeleton, &raw.keyframes) } else { Vec::new() };
    let rested = match rest_up.map(|up| (Up::nearest(up), up)) {
        // an axis close to the trunk's direction is meant to be vertical
        Some((axis, trunk)) if axis.axis().dot(trunk) > 0.85 => axis.upright(),
        Some((_, trunk)) => DQuat::from_rotation_arc(trunk, DVec3::Z),
        None => upright,
    };
    turn_first(&mut raw.skeleton.bones[0].rest, rested);
    if let Some(marks) = &marks {
        let rests = rest_up.is_some() && neutral::agrees(&raw.skeleton, marks, &moments, dt, &raw.skeleton.rest());
        if !rests {
            match neutral::standing(&raw.skeleton, marks, &moments, dt) {
                Some(standing) => raw.skeleton = standing,
                None => notes.push(
                    "the rest pose does not stand, and the motion does not tell how the figure stands; check the picture"
                        .into(),
                ),
            }
        }
    }

    notes.extend(lowered(marks.as_ref(), &moments, unit * stature, dt, &mut raw.keyframes, reading));
    let Raw { about, skeleton, keyframes, .. } = raw;
    let animation = Animation::new(path, about, skeleton, dt, wraps, &keyframes)?;
    Ok(Recording { animation, notes })
}

/// Moves an upright recording in meters so that its floor is at 0. Returns a note if the file's floor is elsewhere.
pub(super) fn ground(skeleton: &Skeleton, keyframes: &mut [Keyframe], dt: f64, reading: &Reading) -> Option<String> {
    let marks = Landmarks::of(skeleton, &reading.known_as).filter(|_| keyframes.len() > 1);
    let moments = if marks.is_some() { moments(skeleton, keyframes) } else { Vec::new() };
    let stature = marks.as_ref().map_or(1.0, |marks| marks.stature(skeleton));
    lowered(marks.as_ref(), &moments, stature, dt, keyframes, reading)
}

fn lowered(
    marks: Option<&Landmarks>,
    moments: &[Moment],
    stature: f64,
    dt: f64,
    keyframes: &mut [Keyframe],
    reading: &Reading,
) -> Option<String> {
    let seconds = dt * keyframes.len().saturating_sub(1) as f64;
    let found = || marks.map_or(0.0, |marks| floor::estimate(marks, moments, stature, dt, seconds));
    let floor = reading.floor.unwrap_or_else(found);
    if floor != 0.0 {
        keyframes.iter_mut().for_each(|keyframe| keyframe.root[2] -= floor);
    }
    let note = format!("the floor is at {floor:.2} m, as the contacts show; --floor METERS says otherwise");
    (reading.floor.is_none() && floor != 0.0).then_some(note)
}

fn turn_first(turn: &mut [f64; 4], by: DQuat) {
    *turn = wxyz((by * quat(turn)).normalize());
}

/// Moments spread evenly over the whole recording.
fn moments(skeleton: &Skeleton, keyframes: &[Keyframe]) -> Vec<Moment> {
    let pairs = keyframes.len() - 1;
    let step = pairs.div_ceil(MOMENTS).max(1);
    let pose = |i: usize| {
        let turns: Vec<DQuat> = keyframes[i].rotations.iter().map(|turn| quat(turn)).collect();
        skeleton.pose(DVec3::from_array(keyframes[i].root), &turns)
    };
    (0..pairs).step_by(step).map(|i| Moment { now: pose(i), next: pose(i + 1) }).collect()
}
