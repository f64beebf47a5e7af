//! Finds the height of the floor from the contacts of the feet.

use super::landmarks::Landmarks;
use super::up::Moment;
use crate::skeleton::SkeletonPose;

/// Largest vertical speed of the lowest joint in a contact, m/s.
const SLOW: f64 = 0.2;
/// Share of contacts that may be below the floor, because of noise.
const LOWEST: f64 = 0.1;
/// Shortest total contact time that is enough to find a floor, s. A joint also stands still at the top of a jump.
const SHORTEST: f64 = 0.1;
/// Distance of the contacts from the file's own floor up to which that floor counts, m. The exact height of the soles
/// is unknown.
const TRUSTED: f64 = 0.08;

/// Height of the floor of an upright recording that lasts `seconds`, m. The height is 0 if the contacts do not
/// contradict that.
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
