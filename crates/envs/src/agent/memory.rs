//! Helpers for values that an agent keeps between decisions, for [`Agent::remember`](crate::Agent::remember).
//!
//! Each helper owns a range of slots in the agent's memory, which is zero at the start of every episode.

use marathon_physics::lanes::Real;

/// Bonus for the size of a step, paid at footfall and fading afterward. It is the original's phase bonus, which made
/// its humanoid walk instead of shuffle.
///
/// The range of the hips' flexion is tracked from one footfall of a side to the next. When a foot lands, or the other
/// one leaves the ground, the bonus is the range of that side's hip plus 0.1. It is 0 while both feet are down, or both
/// are in the air after a change. It fades by [`PhaseBonus::FADE`] per physics step.
///
/// There are two differences from the original. The bonus is evaluated once per decision instead of once per physics
/// step. The range is always `max - min`; the original subtracted in the wrong order when both were negative.
#[derive(Clone, Copy, Debug)]
pub struct PhaseBonus {
    /// Fraction of the bonus that remains after one decision.
    pub fade: f64,
    /// Whether stepping twice in a row on the same side earns nothing (the rule of the `-v1` humanoid).
    pub alternate: bool,
}

/// Inputs of the phase bonus.
#[derive(Clone, Copy, Debug)]
pub struct Stride<T: Real> {
    /// Whether a foot of this side is on the ground.
    pub left_down: T::Mask,
    /// Whether a foot of this side is on the ground.
    pub right_down: T::Mask,
    /// Flexion of the hip in quarter turns.
    pub left_flexion: T,
    /// Flexion of the hip in quarter turns.
    pub right_flexion: T,
}

impl PhaseBonus {
    /// Number of slots.
    pub const SLOTS: usize = 8;
    /// Slot of the bonus.
    pub const BONUS: usize = 0;
    /// Fraction of the bonus that remains after one physics step.
    pub const FADE: f64 = 0.9;
    /// Bonus of a step of size 0.
    pub const BASE: f64 = 0.1;

    /// A bonus for agents that decide every `frame_skip` physics steps.
    pub fn new(frame_skip: usize, alternate: bool) -> Self {
        let mut fade = 1.0;
        for _ in 0..frame_skip {
            fade *= Self::FADE;
        }
        PhaseBonus { fade, alternate }
    }

    /// Advances by one decision. `memory` is [`PhaseBonus::SLOTS`] long.
    #[inline(always)]
    pub fn update<T: Real>(&self, memory: &mut [T], stride: Stride<T>) {
        const LEFT_WAS_DOWN: usize = 1;
        const RIGHT_WAS_DOWN: usize = 2;
        const LEFT_MIN: usize = 3;
        const LEFT_MAX: usize = 4;
        const RIGHT_MIN: usize = 5;
        const RIGHT_MAX: usize = 6;
        const LAST_SIDE: usize = 7;

        let (zero, one, half) = (T::zero(), T::lit(1.0), T::lit(0.5));
        let Stride { left_down, right_down, left_flexion, right_flexion } = stride;
        let changed = T::or(
            T::xor(left_down, half.lt(memory[LEFT_WAS_DOWN])),
            T::xor(right_down, half.lt(memory[RIGHT_WAS_DOWN])),
        );
        memory[LEFT_WAS_DOWN] = T::masked(left_down, one);
        memory[RIGHT_WAS_DOWN] = T::masked(right_down, one);

        let left_min = memory[LEFT_MIN].min(left_flexion);
        let left_max = memory[LEFT_MAX].max(left_flexion);
        let right_min = memory[RIGHT_MIN].min(right_flexion);
        let right_max = memory[RIGHT_MAX].max(right_flexion);

        let both = T::and(left_down, right_down);
        let step = T::and(changed, T::not(both));
        let left_step = T::and(step, left_down);
        let right_step = T::and(step, T::and(right_down, T::not(left_down)));

        // the side that stepped last: 0 none, 1 left, 2 right
        let last = memory[LAST_SIDE];
        let again = T::or(
            T::and(left_step, (last - one).abs().lt(half)),
            T::and(right_step, (last - T::lit(2.0)).abs().lt(half)),
        );
        let range = T::masked(left_step, left_max - left_min) + T::masked(right_step, right_max - right_min);
        let earned = T::masked(T::or(left_step, right_step), range + T::lit(Self::BASE));
        let earned = if self.alternate { T::select(again, zero, earned) } else { earned };
        let faded = memory[Self::BONUS] * T::lit(self.fade);
        memory[Self::BONUS] = T::select(both, zero, T::select(changed, earned, faded));
        memory[LAST_SIDE] = T::select(left_step, one, T::select(right_step, T::lit(2.0), last));

        // a footfall restarts the range at the present flexion
        let (new_left, new_right) = (T::or(both, left_step), T::or(both, right_step));
        memory[LEFT_MIN] = T::select(new_left, left_flexion, left_min);
        memory[LEFT_MAX] = T::select(new_left, left_flexion, left_max);
        memory[RIGHT_MIN] = T::select(new_right, right_flexion, right_min);
        memory[RIGHT_MAX] = T::select(new_right, right_flexion, right_max);
    }
}

/// Mean of the last nine values, or fewer at the start of an episode: `GetAverageVelocity`. (The original did not clear
/// its buffer between episodes.)
#[derive(Clone, Copy, Debug)]
pub struct Average;

impl Average {
    /// Number of values in the mean.
    pub const WINDOW: usize = 9;
    /// Number of slots.
    pub const SLOTS: usize = Self::WINDOW + 2;
    /// Slot of the mean.
    pub const MEAN: usize = 0;

    /// Adds a value. `memory` is [`Average::SLOTS`] long.
    #[inline(always)]
    pub fn update<T: Real>(memory: &mut [T], value: T) {
        const COUNT: usize = 1;
        let count = (memory[COUNT] + T::lit(1.0)).min(T::lit(Self::WINDOW as f64));
        memory[COUNT] = count;
        // newest first; slots not yet filled are zero
        let mut sum = value;
        for i in (1..Self::WINDOW).rev() {
            memory[2 + i] = memory[1 + i];
        }
        memory[2] = value;
        for i in 1..Self::WINDOW {
            sum += memory[2 + i];
        }
        memory[Self::MEAN] = sum.div(count);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_average_runs_over_nine_values() {
        let mut memory = [0.0_f64; Average::SLOTS];
        for i in 1..=20 {
            Average::update(&mut memory, f64::from(i));
            let window: Vec<f64> = (1..=i).rev().take(9).map(f64::from).collect();
            let mean = window.iter().sum::<f64>() / window.len() as f64;
            assert!((memory[Average::MEAN] - mean).abs() < 1e-12, "after {i} values");
        }
    }

    /// A scripted walk with results checked by hand.
    #[test]
    fn the_phase_bonus_pays_for_the_range_of_the_landing_side() {
        let bonus = PhaseBonus { fade: 0.5, alternate: false };
        let mut m = [0.0_f64; PhaseBonus::SLOTS];
        let mut decide = |left_down, right_down, left_flexion, right_flexion| {
            bonus.update(&mut m, Stride { left_down, right_down, left_flexion, right_flexion });
            m[PhaseBonus::BONUS]
        };
        // standing: no bonus, and the ranges restart here
        assert_eq!(decide(true, true, 0.0, 0.0), 0.0);
        // the right foot leaves: the change pays the left side, whose hip moved by 0.1 since standing
        assert!((decide(true, false, -0.1, 0.2) - 0.2).abs() < 1e-12);
        // no change: the bonus fades
        assert!((decide(true, false, -0.2, 0.4) - 0.1).abs() < 1e-12);
        // the left foot leaves as the right lands: the right side earns its swing, from 0 to 0.4
        assert!((decide(false, true, -0.2, 0.3) - 0.5).abs() < 1e-12);
        // flight earns nothing
        assert_eq!(decide(false, false, 0.1, 0.1), 0.0);
        // the left foot lands: its hip swung from -0.2 (its reset was at -0.1) to 0.5
        assert!((decide(true, false, 0.5, 0.1) - 0.8).abs() < 1e-12);
    }

    #[test]
    fn hopping_on_one_side_earns_nothing_when_sides_must_alternate() {
        for (alternate, second) in [(false, true), (true, false)] {
            let bonus = PhaseBonus { fade: 0.5, alternate };
            let mut m = [0.0_f64; PhaseBonus::SLOTS];
            let mut decide = |left_down, left_flexion| {
                bonus.update(&mut m, Stride { left_down, right_down: false, left_flexion, right_flexion: 0.0 });
                m[PhaseBonus::BONUS]
            };
            assert!(decide(true, 0.2) > 0.0);
            assert_eq!(decide(false, 0.4), 0.0);
            assert_eq!(decide(true, 0.1) > 0.0, second);
        }
    }
}
