//! A single reward at the end of an episode: the distance covered by the feet (`MarathonManSparse` of the Marathon
//! Environments 2).
//!
//! The original pays the normalized x of the foot's last contact and does not state the normalization. Here 20 m earn
//! 1, which is a walk of 1 m/s for 20 s.

use std::ops::Range;

use marathon_physics::lanes::Real;

use super::super::imitation;
use super::body::{BUTT, FEET, TOUCH, TRUNK};
use crate::agent::{Senses, Terms};

/// Name of the only term.
pub(super) const TERM: &str = "distance";
/// Distance that earns 1, m.
const WAY: f64 = 20.0;
/// Touch sensors of the right and of the left foot.
const SENSORS: [Range<usize>; 2] = [0..TOUCH.len() / 2, TOUCH.len() / 2..TOUCH.len()];
/// Slot of the memory: x of the butt at the start of the episode, m.
const FROM: usize = imitation::MEMORY;
/// Slot of the memory: x of the last foot contact, m.
const STEP: usize = FROM + 1;
/// Memory size with this reward.
pub(super) const MEMORY: usize = STEP + 1;

/// Initializes the slots at the start of an episode.
#[inline(always)]
pub(super) fn begin<T: Real>(s: &Senses<T>, memory: &mut [T]) {
    let [x, ..] = s.position(BUTT);
    memory[FROM] = x;
    memory[STEP] = x;
}

/// Updates the last foot contact after a decision. If both feet are on the ground, the one in front counts.
#[inline(always)]
pub(super) fn remember<T: Real>(s: &Senses<T>, memory: &mut [T]) {
    let nowhere = T::lit(-1e9);
    let mut front = nowhere;
    for (foot, sensors) in FEET.into_iter().zip(SENSORS) {
        let ([x, ..], mut force) = (s.position(foot), T::zero());
        for i in sensors {
            force += s.touch_force(i);
        }
        let ahead = T::and(T::zero().lt(force), front.lt(x));
        front = T::select(ahead, x, front);
    }
    memory[STEP] = T::select(nowhere.lt(front), front, memory[STEP]);
}

/// Adds the term at the end of the episode, however it ends.
#[inline(always)]
pub(super) fn add<T: Real>(s: &Senses<T>, terms: &mut Terms<T>) {
    let over = T::or(T::or(s.time_is_up(), s.clip_over()), imitation::fallen(s, &TRUNK));
    let way = (s.memory(STEP) - s.memory(FROM)) * T::lit(1.0 / WAY);
    terms.add(TERM, 1.0, T::masked(over, way));
}
