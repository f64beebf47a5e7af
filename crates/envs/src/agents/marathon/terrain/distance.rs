//! The levels `distance`: courses become harder after long runs and easier after short ones.

use super::regret;
use super::{FARTHEST, LEVEL};

/// Way that makes the next course harder, and way that makes it easier, m, and by how much.
const FAR: f64 = 16.0;
const NEAR: f64 = 8.0;
const RUNG: f64 = 0.05;

/// Level of the next course, 0 to 1, after an episode that has left the course's variables `previous`; 0 for the first one.
pub(super) fn next_level(previous: &[f64]) -> f64 {
    let change = match regret::way_of_runner(previous).unwrap_or(previous[FARTHEST]) {
        far if far >= FAR => RUNG,
        near if near < NEAR => -RUNG,
        _ => 0.0,
    };
    (previous[LEVEL] + change).clamp(0.0, 1.0)
}
