//! The height of the floor, found from the contacts of the feet.

use super::landmarks::Landmarks;
use super::up::Moment;
use crate::skeleton::SkeletonPose;

/// Fastest fall or rise of the lowest joint that counts as a contact, m/s.
const SLOW: f64 = 0.2;
/// Share of the contacts that may be lower than the floor: noise.
const LOWEST: f64 = 0.1;
/// Shortest time of contacts that tells of a floor, s: at the top of a jump, too, nothing falls or rises.
const SHORTEST: f64 = 0.1;
/// The file's own floor counts if the contacts are nearer to it than this, m: nobody knows the soles better.
const TRUSTED: f64 = 0.08;

/// Height of the floor of an upright recording, m; 0 if the contacts do not contradict it. The recording lasts `seconds`.
pub(super) fn estimate(marks: &Landmarks, moments: &[Moment], stature: f64, dt: f64, seconds: f64) -> f64 {
    let low = |pose: &SkeletonPose| {
        marks.touching().map(|(joint, height)| pose.pos[joint].z - height * stature).fold(f64::INFINITY, f64::min)
    };
    let heights = moments.iter().map(|moment| (low(&moment.now), low(&moment.next)));
    let mut contacts: Vec<f64> =
        heights.filter(|(now, next)| (next - now).abs() < SLOW * dt).map(|(now, _)| now).collect();
    contacts.sort_by(f64::total_cmp);
    if seconds * contacts.len() as f64 / (moments.len() as f64) < SHORTEST.min(0.5 * seconds) {
        return 0.0;
    }
    match contacts.get((LOWEST * contacts.len() as f64) as usize) {
        Some(floor) if floor.abs() > TRUSTED => *floor,
        _ => 0.0,
    }
}
