//! Rewards for following a clip.
//!
//! - `deepmimic`: the reward of all characters that imitate a clip (`imitation.rs`).
//! - `paper`: the reward of ActiveRagdollStyleTransfer 0.002.124. A distance `d` of at most `n` earns `((n - d)/n)^n`.
//!   The original's velocities were 5 times too large on both sides; here they are correct.
//! - `sparse`: the distance covered by the feet, paid once at the end of the episode.

use std::f64::consts::FRAC_1_PI;

use marathon_physics::lanes::Real;

use super::super::imitation::{self, TERMS, angle2, norm2, sub};
use super::body::{ANATOMY, BUTT, PAPER_END_EFFECTORS, TOUCH, parts};
use super::sparse;
use crate::agent::options::Choice;
use crate::agent::senses::clamp;
use crate::agent::{Senses, Terms};

/// Selects the reward.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reward {
    /// The reward of DeepMimic (Peng et al., 2018).
    DeepMimic,
    /// The reward of the paper.
    Paper,
    /// Distance covered by the feet, at the end of the episode.
    Sparse,
}

impl Choice for Reward {
    const EXPECTED: &'static str = "deepmimic, paper or sparse";
    const NAMED: &'static [(Self, &'static str)] =
        &[(Reward::DeepMimic, "deepmimic"), (Reward::Paper, "paper"), (Reward::Sparse, "sparse")];
}

/// Terms of the paper's reward that depend on a distance: name, weight, distance at which the term is 0.
const PAPER: [(&str, f64, i32); 4] = [
    ("rotation", 0.585, 17),
    ("center_of_mass_velocity", 0.09, 3),
    ("end_effectors", 0.135, 8),
    ("center_of_mass", 0.09, 5),
];
/// Weight of each of the other two terms: touch sensors that match the clip, and motors below their limit.
const PAPER_REST: f64 = 0.09;
/// An episode ends when the paper's terms sum to less than this.
const PAPER_LEAST: f64 = 0.334;

impl Reward {
    /// Names of the terms.
    pub fn terms(self) -> Vec<&'static str> {
        match self {
            Reward::DeepMimic => TERMS.map(|(name, ..)| name).to_vec(),
            Reward::Paper => PAPER.map(|(name, ..)| name).into_iter().chain(["touch", "joints_at_limit"]).collect(),
            Reward::Sparse => vec![sparse::TERM],
        }
    }

    /// Adds the terms. `sharpness` applies to `deepmimic` only.
    #[inline(always)]
    pub fn add<T: Real>(self, s: &Senses<T>, sharpness: f64, terms: &mut Terms<T>) {
        match self {
            Reward::DeepMimic => imitation::add_terms(s, &ANATOMY, sharpness, terms),
            Reward::Paper => {
                for ((name, weight, _), worth) in PAPER.into_iter().zip(paper_worths(s)) {
                    terms.add(name, weight, worth);
                }
                terms.add("touch", PAPER_REST, touch_alike(s));
                let mut driven = T::zero();
                for i in 0..s.action_count() {
                    driven += T::select(s.action(i).abs().lt(T::lit(1.0)), T::zero(), T::lit(1.0));
                }
                terms.add("joints_at_limit", PAPER_REST, driven.neg_mul_add(T::lit(1.0 / 21.0), T::lit(1.0)));
            }
            Reward::Sparse => sparse::add(s, terms),
        }
    }
}

/// Values of the paper's distance terms.
#[inline(always)]
fn paper_worths<T: Real>(s: &Senses<T>) -> [T; 4] {
    let clip = s.reference(0);
    let mut rotation = T::zero();
    for part in parts() {
        // squared angle in units of half turns
        rotation = angle2(s, part).mul_add(T::lit(FRAC_1_PI * FRAC_1_PI), rotation);
    }
    let gap = sub(s.position(BUTT), clip.position(BUTT));
    let mut ends = T::zero();
    for part in PAPER_END_EFFECTORS {
        ends += norm2(sub(sub(s.position(part), clip.position(part)), gap));
    }
    let velocity = norm2(sub(s.center_of_mass_velocity(), clip.center_of_mass_velocity()));
    let position = norm2(sub(s.center_of_mass(), clip.center_of_mass()));
    let mut worths = [rotation, velocity, ends, position];
    for (d, (_, _, most)) in worths.iter_mut().zip(PAPER) {
        let near = clamp(d.neg_mul_add(T::lit(1.0 / f64::from(most)), T::lit(1.0)), 0.0, 1.0);
        *d = T::lit(1.0);
        for _ in 0..most {
            *d *= near;
        }
    }
    worths
}

/// Fraction of the touch sensors that agree with the clip.
#[inline(always)]
fn touch_alike<T: Real>(s: &Senses<T>) -> T {
    let clip = s.reference(0);
    let mut alike = T::zero();
    for i in 0..TOUCH.len() {
        let differs = T::xor(T::zero().lt(s.touch_force(i)), clip.touch(i));
        alike += T::select(differs, T::zero(), T::lit(1.0 / TOUCH.len() as f64));
    }
    alike
}

/// Lanes in which the paper ends the episode.
#[inline(always)]
pub(super) fn too_far<T: Real>(s: &Senses<T>) -> T::Mask {
    let mut sum = touch_alike(s) * T::lit(PAPER_REST);
    for ((_, weight, _), worth) in PAPER.into_iter().zip(paper_worths(s)) {
        sum = worth.mul_add(T::lit(weight), sum);
    }
    sum.lt(T::lit(PAPER_LEAST))
}
