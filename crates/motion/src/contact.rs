//! Ground contacts over time.

use crate::clip::Clip;
use crate::error::MotionError;
use crate::ground::Touch;
use crate::kinematics::Pose;
use glam::DVec3;
use marathon_physics::Model;
use std::path::Path;

/// Maximum height of a sole's lowest point in a contact, m.
const HEIGHT: f64 = 0.03;
/// Maximum horizontal speed of a sole's lowest point in a contact, m/s.
const SPEED: f64 = 0.6;
/// Minimum duration of a contact, s.
const SHORTEST: f64 = 0.05;

/// Whether each of these bodies stands on the ground, frame by frame: a point of it is less than 3 cm above the ground
/// and slower than 0.6 m/s along it, for 0.05 s or more. The path is for messages. The clip's phases are those of
/// [`Clip::phase`].
///
/// # Errors
/// If the clip is for another model.
pub fn contacts(path: &Path, clip: &Clip, model: &Model, soles: &[usize]) -> Result<Vec<Vec<bool>>, MotionError> {
    clip.check_model(path, model)?;
    let touches = Touch::all(model);
    // in a loop, both ends are adjacent
    let beside = if clip.cycle().is_some() { clip.frames() as i64 } else { 0 };
    let frames: Vec<Vec<f64>> = (-beside..clip.frames() as i64 + beside).map(|i| clip.frame_at(i)).collect();
    let held = held(model, &touches, soles, &frames, clip.dt());
    let stands =
        |held: &Vec<bool>, sole: &usize| touches.iter().zip(held).any(|(touch, held)| *held && touch.body == *sole);
    let within = held.iter().skip(beside as usize).take(clip.frames());
    Ok(within.map(|held| soles.iter().map(|sole| stands(held, sole)).collect()).collect())
}

/// Per frame and touch: whether a sole stands on the ground there.
pub(crate) fn held(model: &Model, touches: &[Touch], soles: &[usize], frames: &[Vec<f64>], dt: f64) -> Vec<Vec<bool>> {
    let poses: Vec<Pose> = frames.iter().map(|frame| Pose::of(model, frame)).collect();
    let mut held = vec![vec![false; touches.len()]; frames.len()];
    for (k, touch) in touches.iter().enumerate().filter(|(_, touch)| soles.contains(&touch.body)) {
        let low = |i: usize| touch.lowest(&poses[i]);
        for i in 0..frames.len() {
            let (before, after) = (i.saturating_sub(1), (i + 1).min(frames.len() - 1));
            let seconds = (after - before).max(1) as f64 * dt;
            let way =
                slide(touch, &poses[before], &poses[i]).length() + slide(touch, &poses[i], &poses[after]).length();
            held[i][k] = low(i).z < HEIGHT && way / seconds < SPEED;
        }
        let shortest = libm::ceil(SHORTEST / dt) as usize;
        let mut begin = 0;
        while begin < frames.len() {
            let state = held[begin][k];
            let end = (begin..frames.len()).find(|i| held[*i][k] != state).unwrap_or(frames.len());
            if state && end - begin < shortest && begin > 0 && end < frames.len() {
                (begin..end).for_each(|i| held[i][k] = false);
            }
            begin = end;
        }
    }
    held
}

/// Sliding of a touch's lowest point along the ground until the next frame, m. Rolling does not count.
pub(crate) fn slide(touch: &Touch, now: &Pose, next: &Pose) -> DVec3 {
    let lowest = touch.lowest(now);
    let local = now.quat[touch.body].conjugate() * (lowest - now.pos[touch.body]);
    (next.point(touch.body, local) - lowest).with_z(0.0)
}

/// Calls `each` for every ground contact of a touch, with the touch's index, the first frame, and the sliding of its
/// lowest point from frame to frame.
pub(crate) fn stances(
    touches: &[Touch],
    held: &[Vec<bool>],
    poses: &[Pose],
    mut each: impl FnMut(usize, usize, &[DVec3]),
) {
    for (k, touch) in touches.iter().enumerate() {
        let mut begin = 0;
        while begin < poses.len() {
            let state = held[begin][k];
            let end = (begin..poses.len()).find(|i| held[*i][k] != state).unwrap_or(poses.len());
            if state {
                let steps: Vec<DVec3> = (begin + 1..end).map(|i| slide(touch, &poses[i - 1], &poses[i])).collect();
                each(k, begin, &steps);
            }
            begin = end;
        }
    }
}

/// The height of a pose's lowest point above the ground, m. Negative below it.
pub(crate) fn clearance(touches: &[Touch], pose: &Pose) -> f64 {
    touches.iter().map(|touch| touch.lowest(pose).z).fold(f64::INFINITY, f64::min)
}

/// Lifts the whole clip so that nothing is below the ground.
pub(crate) fn above_ground(path: &Path, model: &Model, touches: &[Touch], clip: &Clip) -> Result<Clip, MotionError> {
    let depth = (0..clip.frames()).map(|i| -clearance(touches, &Pose::of(model, clip.frame(i)))).fold(0.0, f64::max);
    clip.moved(path, model, DVec3::Z * depth)
}
