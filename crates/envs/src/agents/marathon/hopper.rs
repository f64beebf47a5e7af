//! Hopper: one leg in a plane, four motors.
//!
//! | observation | content |
//! |---|---|
//! | 0..3 | velocity of the torso, m/s |
//! | 3..6, 6..9 | forward and up axis of the torso |
//! | 9 | foot on the ground, 0 or 1 |
//! | 10..26 | rotations of waist, hip, knee, ankle: four quaternions x y z w |
//! | 26..30 | velocities of the same joints, half turns per second |
//! | 30 | height of the foot's center, m |
//!
//! `Hopper-v0`: r = v/4 + forward bonus - 0.3 effort - 4 (joints at limit), all of the torso.
//! `Hopper-v1`: r = V + 0.05 upright + (1 - mean effort) min(V, 0.25), V = 0.7 v / 8 m/s.
//! An episode is terminated when any part but foot and calf touches the ground.

use marathon_physics::lanes::Real;

use super::FASTEST;
use crate::agent::senses::unit;
use crate::agent::{Agent, Facts, Motors, Obs, Part, Senses, Terms, names};

const MODEL: &str = marathon_assets::text("agents/hopper.xml");

/// Physics steps per decision: 200 Hz physics, 50 Hz control.
const FRAME_SKIP: usize = 4;
/// 20 seconds.
const MAX_EPISODE_STEPS: usize = 1000;

const ACTIONS: [&str; 4] = ["waist", "hip", "knee", "ankle"];
const PARTS: [&str; 2] = ["torso", "foot"];
/// The root part. The original calls it "pelvis" and maps it to the torso.
pub(super) const TORSO: Part = Part::named(&PARTS, "torso");
pub(super) const FOOT: Part = Part::named(&PARTS, "foot");
/// The calf counts as a foot because it protrudes through the sole's capsule at the ankle.
const FEET: [&str; 2] = ["foot", "calf"];

/// Weight of the effort.
const EFFORT: f64 = -0.3;
/// Weight of the joints driven at their limit.
const JOINTS_AT_LIMIT: f64 = -4.0;

/// Weight of the speed in the `-v1` reward.
const V1_VELOCITY: f64 = 0.7;
/// Weight of the posture.
const V1_UPRIGHT: f64 = 0.05;
/// Largest weight of the saved effort. It never exceeds the speed's term.
const V1_EFFORT: f64 = 0.25;

/// The paper's Hopper.
#[derive(Clone, Copy, Debug, Default)]
pub struct HopperV0;

impl Agent for HopperV0 {
    fn facts(&self) -> Facts {
        Facts {
            id: "Hopper-v0".into(),
            summary: "one leg in a plane: run forward upright, with little effort".into(),
            model: MODEL.into(),
            frame_skip: FRAME_SKIP,
            max_episode_steps: MAX_EPISODE_STEPS,
            observation: Some(31),
            actions: names(ACTIONS),
            reward_terms: names(["velocity", "uprightness", "effort", "joints_at_limit"]),
            parts: names(PARTS),
            feet: names(FEET),
            touch: names(["foot"]),
            ..Facts::default()
        }
    }

    #[inline(always)]
    fn observe<T: Real>(&self, s: &Senses<T>, out: &mut Obs<T>) {
        observe_body(s, out);
        out.group("foot_height");
        out.scalar(s.height(FOOT));
    }

    #[inline(always)]
    fn step_reward<T: Real>(&self, s: &Senses<T>, terms: &mut Terms<T>) {
        terms.add("velocity", 1.0, s.velocity(TORSO));
        terms.add("uprightness", 1.0, s.forward_bonus(TORSO));
        terms.add("effort", EFFORT, s.effort(Motors::NONE));
        terms.add("joints_at_limit", JOINTS_AT_LIMIT, s.joints_at_limit_penalty(Motors::NONE));
    }

    #[inline(always)]
    fn terminated<T: Real>(&self, s: &Senses<T>) -> T::Mask {
        s.terminate_on_non_foot_contact()
    }
}

/// Writes the Hopper's observation without the height of its foot.
#[inline(always)]
pub(super) fn observe_body<T: Real>(s: &Senses<T>, out: &mut Obs<T>) {
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

/// Hopper of the paper's Table 1: the same observation, and a reward between 0 and 1.
#[derive(Clone, Copy, Debug, Default)]
pub struct HopperV1;

impl Agent for HopperV1 {
    fn facts(&self) -> Facts {
        Facts {
            id: "Hopper-v1".into(),
            summary: "one leg in a plane, reward between 0 and 1".into(),
            reward_terms: names(["velocity", "uprightness", "effort"]),
            ..HopperV0.facts()
        }
    }

    #[inline(always)]
    fn observe<T: Real>(&self, s: &Senses<T>, out: &mut Obs<T>) {
        HopperV0.observe(s, out);
    }

    #[inline(always)]
    fn step_reward<T: Real>(&self, s: &Senses<T>, terms: &mut Terms<T>) {
        let velocity = s.normalized_velocity(TORSO, FASTEST) * T::lit(V1_VELOCITY);
        let saved = T::lit(1.0) - s.effort_mean(Motors::NONE);
        terms.add("velocity", 1.0, velocity);
        terms.add("uprightness", V1_UPRIGHT, unit(s.forward_bonus_of(TORSO, 1.0)));
        terms.add("effort", 1.0, saved * velocity.min(T::lit(V1_EFFORT)));
    }

    #[inline(always)]
    fn terminated<T: Real>(&self, s: &Senses<T>) -> T::Mask {
        HopperV0.terminated(s)
    }
}
