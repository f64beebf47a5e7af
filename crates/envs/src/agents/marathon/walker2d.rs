//! Walker2d: two legs in a plane, six motors.
//!
//! | observation | content |
//! |---|---|
//! | 0..3 | velocity of the torso, m/s |
//! | 3..6, 6..9 | forward and up axis of the torso |
//! | 9..11 | left, right foot on the ground, 0 or 1 |
//! | 11..35 | rotations of right hip, knee, ankle, left hip, knee, ankle: six quaternions x y z w |
//! | 35..41 | velocities of the same joints, half turns per second |
//! | 41..43 | `-v1` only: heights of left and right foot's centers, m |
//!
//! `Walker2d-v0`: r = v/4 + forward bonus - (1.1 m - height) - 0.1 effort, all of the torso.
//! `Walker2d-v1`: r = V + 0.05 upright + 0.05 (1 - (1.1 m - height)) + (1 - mean effort) min(V, 0.4), V = 0.4 v / 8 m/s.
//! An episode is terminated when any part but feet and lower legs touches the ground.

use marathon_physics::lanes::Real;

use super::FASTEST;
use crate::agent::senses::unit;
use crate::agent::{Agent, Facts, Motors, Obs, Part, Senses, Terms, names};

const MODEL: &str = marathon_assets::text("agents/walker2d.xml");

/// Physics steps per decision: 400 Hz physics, 100 Hz control.
const FRAME_SKIP: usize = 4;
/// 10 seconds.
const MAX_EPISODE_STEPS: usize = 1000;

const ACTIONS: [&str; 6] = ["right_hip", "right_knee", "right_ankle", "left_hip", "left_knee", "left_ankle"];
const PARTS: [&str; 3] = ["torso", "left_foot", "right_foot"];
pub(super) const TORSO: Part = Part::named(&PARTS, "torso");
pub(super) const LEFT_FOOT: Part = Part::named(&PARTS, "left_foot");
pub(super) const RIGHT_FOOT: Part = Part::named(&PARTS, "right_foot");
/// The lower legs count as feet because they protrude through the feet's capsules at the ankles.
const FEET: [&str; 4] = ["right_leg", "left_leg", "right_foot", "left_foot"];

/// Height of the torso's center below which there is a penalty, m. Standing, it is 1.3.
pub(super) const HEIGHT: f64 = 1.1;
/// Weight of the effort.
const EFFORT: f64 = -0.1;

/// Weight of the speed in the `-v1` reward.
const V1_VELOCITY: f64 = 0.4;
/// Weight of the posture.
const V1_UPRIGHT: f64 = 0.05;
/// Weight of the height.
const V1_HEIGHT: f64 = 0.05;
/// Largest weight of the saved effort. It never exceeds the speed's term.
const V1_EFFORT: f64 = 0.4;

/// The paper's Walker.
#[derive(Clone, Copy, Debug, Default)]
pub struct Walker2dV0;

impl Agent for Walker2dV0 {
    fn facts(&self) -> Facts {
        Facts {
            id: "Walker2d-v0".into(),
            summary: "two legs in a plane: run forward upright and tall, with little effort".into(),
            model: MODEL.into(),
            frame_skip: FRAME_SKIP,
            max_episode_steps: MAX_EPISODE_STEPS,
            observation: Some(41),
            actions: names(ACTIONS),
            reward_terms: names(["velocity", "uprightness", "height", "effort"]),
            parts: names(PARTS),
            feet: names(FEET),
            touch: names(["left_foot", "right_foot"]),
            ..Facts::default()
        }
    }

    #[inline(always)]
    fn observe<T: Real>(&self, s: &Senses<T>, out: &mut Obs<T>) {
        out.group("velocity");
        out.vector(s.linear_velocity(TORSO));
        out.group("forward");
        out.vector(s.forward(TORSO));
        out.group("up");
        out.vector(s.up(TORSO));
        out.group("touch");
        out.touch_sensors(s);
        out.group("joint_rotations");
        out.joint_rotations(s);
        out.group("joint_velocities");
        out.joint_velocities(s);
    }

    #[inline(always)]
    fn step_reward<T: Real>(&self, s: &Senses<T>, terms: &mut Terms<T>) {
        terms.add("velocity", 1.0, s.velocity(TORSO));
        terms.add("uprightness", 1.0, s.forward_bonus(TORSO));
        terms.add("height", -1.0, s.height_penalty(TORSO, HEIGHT));
        terms.add("effort", EFFORT, s.effort(Motors::NONE));
    }

    #[inline(always)]
    fn terminated<T: Real>(&self, s: &Senses<T>) -> T::Mask {
        s.terminate_on_non_foot_contact()
    }
}

/// Walker of the paper's Table 1. It also observes the heights of its feet, and its reward is between 0 and 1.
#[derive(Clone, Copy, Debug, Default)]
pub struct Walker2dV1;

impl Agent for Walker2dV1 {
    fn facts(&self) -> Facts {
        Facts {
            id: "Walker2d-v1".into(),
            summary: "two legs in a plane, observes its feet, reward between 0 and 1".into(),
            observation: Some(43),
            ..Walker2dV0.facts()
        }
    }

    #[inline(always)]
    fn observe<T: Real>(&self, s: &Senses<T>, out: &mut Obs<T>) {
        Walker2dV0.observe(s, out);
        out.group("foot_heights");
        out.scalar(s.height(LEFT_FOOT));
        out.scalar(s.height(RIGHT_FOOT));
    }

    #[inline(always)]
    fn step_reward<T: Real>(&self, s: &Senses<T>, terms: &mut Terms<T>) {
        let one = T::lit(1.0);
        let velocity = s.normalized_velocity(TORSO, FASTEST) * T::lit(V1_VELOCITY);
        let saved = one - s.effort_mean(Motors::NONE);
        terms.add("velocity", 1.0, velocity);
        terms.add("uprightness", V1_UPRIGHT, unit(s.forward_bonus_of(TORSO, 1.0)));
        terms.add("height", V1_HEIGHT, unit(one - s.height_penalty(TORSO, HEIGHT)));
        terms.add("effort", 1.0, saved * velocity.min(T::lit(V1_EFFORT)));
    }

    #[inline(always)]
    fn terminated<T: Real>(&self, s: &Senses<T>) -> T::Mask {
        Walker2dV0.terminated(s)
    }
}
