//! Ant: four legs, eight motors.
//!
//! | observation | content |
//! |---|---|
//! | 0..3 | velocity of the torso, m/s |
//! | 3..6, 6..9 | forward and up axis of the torso |
//! | 9..13 | left, right, third, fourth foot on the ground, 0 or 1 |
//! | 13..45 | rotations of hip and ankle of legs 4, 1, 2, 3: eight quaternions x y z w |
//! | 45..53 | velocities of the same joints, half turns per second |
//! | 53 | `-v1` only: height of the torso's center, m |
//!
//! `Ant-v0`: r = v/4 - 0.5 effort - 4 (joints at limit).
//! `Ant-v1`: r = V + (1 - mean effort) min(V, 0.3), V = 0.7 v / 8 m/s.
//! An episode is terminated when the Ant faces more than 54 degrees away from +x or lies on its back. Any part may
//! touch the ground.

use marathon_physics::lanes::Real;

use super::FASTEST;
use crate::agent::{Agent, Facts, Motors, Obs, Part, Senses, Terms, names};

const MODEL: &str = marathon_assets::text("agents/ant.xml");

/// Physics steps per decision: 500 Hz physics, 100 Hz control.
const FRAME_SKIP: usize = 5;
/// 10 seconds.
const MAX_EPISODE_STEPS: usize = 1000;

const ACTIONS: [&str; 8] = ["hip_4", "ankle_4", "hip_1", "ankle_1", "hip_2", "ankle_2", "hip_3", "ankle_3"];
const PARTS: [&str; 5] = ["torso_geom", "left_ankle_geom", "right_ankle_geom", "third_ankle_geom", "fourth_ankle_geom"];
pub(super) const TORSO: Part = Part::named(&PARTS, "torso_geom");
/// The feet, in the order of the touch sensors.
pub(super) const SOLES: [Part; 4] = [
    Part::named(&PARTS, FEET[0]),
    Part::named(&PARTS, FEET[1]),
    Part::named(&PARTS, FEET[2]),
    Part::named(&PARTS, FEET[3]),
];
const FEET: [&str; 4] = ["left_ankle_geom", "right_ankle_geom", "third_ankle_geom", "fourth_ankle_geom"];

/// Weight of the effort.
const EFFORT: f64 = -0.5;
/// Weight of the joints driven at their limit.
const JOINTS_AT_LIMIT: f64 = -4.0;
/// Forward bonus below which the ant has failed: 0.2 is 54 degrees away from +x.
const LEAST_FORWARD_BONUS: f64 = 0.2;

/// Weight of the speed in the `-v1` reward.
const V1_VELOCITY: f64 = 0.7;
/// Largest weight of the saved effort. It never exceeds the speed's term.
const V1_EFFORT: f64 = 0.3;

/// The paper's Ant.
#[derive(Clone, Copy, Debug, Default)]
pub struct AntV0;

impl Agent for AntV0 {
    fn facts(&self) -> Facts {
        Facts {
            id: "Ant-v0".into(),
            summary: "four legs: run forward, with little effort".into(),
            model: MODEL.into(),
            frame_skip: FRAME_SKIP,
            max_episode_steps: MAX_EPISODE_STEPS,
            observation: Some(53),
            actions: names(ACTIONS),
            reward_terms: names(["velocity", "effort", "joints_at_limit"]),
            parts: names(PARTS),
            feet: names(FEET),
            touch: names(FEET),
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
        terms.add("effort", EFFORT, s.effort(Motors::NONE));
        terms.add("joints_at_limit", JOINTS_AT_LIMIT, s.joints_at_limit_penalty(Motors::NONE));
    }

    #[inline(always)]
    fn terminated<T: Real>(&self, s: &Senses<T>) -> T::Mask {
        let astray = s.forward_bonus(TORSO).lt(T::lit(LEAST_FORWARD_BONUS));
        // the forward bonus does not detect roll
        let on_its_back = s.up(TORSO)[2].lt(T::zero());
        T::or(astray, on_its_back)
    }
}

/// Ant of the paper's Table 1. It also observes its height, and its reward is between 0 and 1.
#[derive(Clone, Copy, Debug, Default)]
pub struct AntV1;

impl Agent for AntV1 {
    fn facts(&self) -> Facts {
        Facts {
            id: "Ant-v1".into(),
            summary: "four legs, observes its height, reward between 0 and 1".into(),
            observation: Some(54),
            reward_terms: names(["velocity", "effort"]),
            ..AntV0.facts()
        }
    }

    #[inline(always)]
    fn observe<T: Real>(&self, s: &Senses<T>, out: &mut Obs<T>) {
        AntV0.observe(s, out);
        out.group("height");
        out.scalar(s.height(TORSO));
    }

    #[inline(always)]
    fn step_reward<T: Real>(&self, s: &Senses<T>, terms: &mut Terms<T>) {
        let velocity = s.normalized_velocity(TORSO, FASTEST) * T::lit(V1_VELOCITY);
        let saved = T::lit(1.0) - s.effort_mean(Motors::NONE);
        terms.add("velocity", 1.0, velocity);
        terms.add("effort", 1.0, saved * velocity.min(T::lit(V1_EFFORT)));
    }

    #[inline(always)]
    fn terminated<T: Real>(&self, s: &Senses<T>) -> T::Mask {
        AntV0.terminated(s)
    }
}
