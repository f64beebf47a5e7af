//! DeepMimic's humanoid: JSON with 44 numbers per frame.
//!
//! `{"Loop": "wrap" | "none", "Frames": [[dt, root position (3), root quaternion (4), joints...], ...]}`, with a
//! quaternion `[w, x, y, z]` per spherical joint, and an angle about z, rad, per knee and elbow. Axes: x forward, y up,
//! z to the right. A frame's first number is the time to the next frame. In a looping motion the last frame repeats the
//! first one, farther on.

use super::{Reading, Recording, Up, upright};
use crate::clip::About;
use crate::error::MotionError;
use crate::limits;
use crate::skeleton::{Animation, Bone, Keyframe, Skeleton};
use serde::Deserialize;
use std::path::Path;

/// A joint of DeepMimic's character: name, parent, offset, and whether it has a quaternion, an angle or nothing.
type Joint = (&'static str, Option<usize>, [f64; 3], Numbers);

#[derive(Clone, Copy, PartialEq)]
enum Numbers {
    Quaternion,
    Angle,
    Nothing,
}
use Numbers::{Angle, Nothing, Quaternion};

/// The character in DeepMimic's axes, m: `data/characters/humanoid3d.txt` of DeepMimic, which is a quarter of pybullet's
/// `humanoid/humanoid.urdf`.
const JOINTS: [Joint; 15] = [
    ("root", None, [0.0, 0.0, 0.0], Quaternion),
    ("chest", Some(0), [0.0, 0.236151, 0.0], Quaternion),
    ("neck", Some(1), [0.0, 0.223894, 0.0], Quaternion),
    ("right_hip", Some(0), [0.0, 0.0, 0.084887], Quaternion),
    ("right_knee", Some(3), [0.0, -0.421546, 0.0], Angle),
    ("right_ankle", Some(4), [0.0, -0.40987, 0.0], Quaternion),
    ("right_shoulder", Some(1), [-0.02405, 0.2435, 0.18311], Quaternion),
    ("right_elbow", Some(6), [0.0, -0.274788, 0.0], Angle),
    ("right_wrist", Some(7), [0.0, -0.258947, 0.0], Nothing),
    ("left_hip", Some(0), [0.0, 0.0, -0.084887], Quaternion),
    ("left_knee", Some(9), [0.0, -0.421546, 0.0], Angle),
    ("left_ankle", Some(10), [0.0, -0.40987, 0.0], Quaternion),
    ("left_shoulder", Some(1), [-0.02405, 0.2435, -0.18311], Quaternion),
    ("left_elbow", Some(12), [0.0, -0.274788, 0.0], Angle),
    ("left_wrist", Some(13), [0.0, -0.258947, 0.0], Nothing),
];
/// Numbers of a frame.
const WIDTH: usize = 44;

/// The contents of a file before validation. Files also name the joints of each side, which are fixed here.
#[derive(Deserialize)]
struct Document {
    #[serde(rename = "Loop", default)]
    looping: Option<String>,
    #[serde(rename = "Frames")]
    frames: Vec<Vec<f64>>,
}

/// Reads a motion of DeepMimic's humanoid. The path is for messages and names the motion.
///
/// # Errors
/// If the text is not such a motion: the message names the line or the frame.
pub fn deepmimic(path: &Path, bytes: &[u8]) -> Result<Animation, MotionError> {
    Ok(read(path, bytes, &Reading::default())?.animation)
}

pub(super) fn read(path: &Path, bytes: &[u8], reading: &Reading) -> Result<Recording, MotionError> {
    if let Some(up) = reading.up.filter(|up| *up != Up::Y) {
        return Err(MotionError::value(path, "up", up, "y, the up axis of all files of DeepMimic"));
    }
    let file: Document = limits::read_json(path, bytes)?;
    let looping = match file.looping.as_deref() {
        Some("wrap") => true,
        None | Some("none") => false,
        Some(other) => return Err(MotionError::value(path, "Loop", format!("{other:?}"), "\"wrap\" or \"none\"")),
    };
    let count = file.frames.len();
    if count < 2 {
        return Err(MotionError::value(path, "Frames", format!("{count} frames"), "two or more"));
    }
    let between = &file.frames[..count - 1];
    limits::check_seconds(path, between.iter().filter_map(|frame| frame.first()).sum())?;
    let keyframes: Vec<Keyframe> =
        file.frames.iter().enumerate().map(|(i, frame)| keyframe(path, i, frame)).collect::<Result<_, _>>()?;
    let (dt, mut keyframes) = even(path, &file.frames, keyframes)?;
    let bones = JOINTS.map(|(name, parent, offset, _)| Bone {
        name: name.into(),
        parent,
        offset: z_up(offset),
        rest: [1.0, 0.0, 0.0, 0.0],
    });
    let name = path.file_stem().map_or(String::new(), |stem| stem.to_string_lossy().into_owned());
    let about = About {
        name: name.trim_start_matches("humanoid3d_").into(),
        model: "DeepMimic humanoid3d".into(),
        ..About::default()
    };
    let skeleton = Skeleton { bones: bones.into() };
    let notes = upright::ground(&skeleton, &mut keyframes, dt, reading);
    let animation = Animation::new(path, about, skeleton, dt, looping, &keyframes)?;
    Ok(Recording { animation, notes: notes.into_iter().collect() })
}

/// Converts a vector to axes with z up.
fn z_up([x, y, z]: [f64; 3]) -> [f64; 3] {
    [x, -z, y]
}

fn keyframe(path: &Path, i: usize, frame: &[f64]) -> Result<Keyframe, MotionError> {
    if frame.len() != WIDTH {
        return Err(MotionError::frame(path, i, format!("found {} numbers, expected {WIDTH}", frame.len())));
    }
    let mut rotations = Vec::with_capacity(JOINTS.len());
    let mut at = 4;
    for (_, _, _, numbers) in JOINTS {
        let rotation = match numbers {
            Quaternion => {
                at += 4;
                [frame[at - 4], frame[at - 3], frame[at - 2], frame[at - 1]]
            }
            Angle => {
                at += 1;
                [libm::cos(0.5 * frame[at - 1]), 0.0, 0.0, libm::sin(0.5 * frame[at - 1])]
            }
            Nothing => [1.0, 0.0, 0.0, 0.0],
        };
        // some of DeepMimic's files have blended quaternions that are not normalized
        let length = rotation.iter().map(|x| x * x).sum::<f64>().sqrt();
        if !((0.5..=1.5).contains(&length)) {
            let problem = format!("the quaternion that ends at number {at} is {length:.3} long, expected unit length");
            return Err(MotionError::frame(path, i, problem));
        }
        let [w, axis @ ..] = rotation.map(|x| x / length);
        let [x, y, z] = z_up(axis);
        rotations.push([w, x, y, z]);
    }
    Ok(Keyframe { root: z_up([frame[1], frame[2], frame[3]]), rotations })
}

/// The keyframes at equal steps, taken from the first frame, and this step, s. The last frame's time is ignored,
/// because no frame follows.
fn even(path: &Path, frames: &[Vec<f64>], keyframes: Vec<Keyframe>) -> Result<(f64, Vec<Keyframe>), MotionError> {
    let between = &frames[..frames.len().saturating_sub(1)];
    if let Some(i) = between.iter().position(|frame| !(1e-4..=10.0).contains(&frame[0])) {
        let problem = format!("lasts {} s, expected 0.0001 to 10", frames[i][0]);
        return Err(MotionError::frame(path, i, problem));
    }
    let dt = frames.first().map_or(0.0, |frame| frame[0]);
    if let Some(i) = between.iter().position(|frame| frame[0] > 100.0 * dt) {
        let problem = format!("lasts {} s, expected up to 100 times the first frame's {dt} s", frames[i][0]);
        return Err(MotionError::frame(path, i, problem));
    }
    if between.iter().all(|frame| (frame[0] - dt).abs() < 0.02 * dt) {
        return Ok((dt, keyframes));
    }
    let seconds: f64 = between.iter().map(|frame| frame[0]).sum();
    limits::check_frames(path, seconds / dt, 4 * JOINTS.len() + 7)?;
    let (mut out, mut begin) = (Vec::new(), 0.0);
    for (i, frame) in between.iter().enumerate() {
        let end = begin + frame[0];
        while out.len() as f64 * dt < end - 1e-6 {
            let share = ((out.len() as f64 * dt - begin) / frame[0]).max(0.0);
            out.push(keyframes[i].blended(&keyframes[i + 1], share));
        }
        begin = end;
    }
    out.extend(keyframes.last().cloned());
    Ok((dt, out))
}
