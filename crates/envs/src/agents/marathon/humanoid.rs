//! Humanoid: two legs, a waist and two arms in space, 21 motors.
//!
//! | observation | content |
//! |---|---|
//! | 0..3 | velocity of the butt, m/s |
//! | 3..6, 6..9 | forward and up axis of the butt |
//! | 9..12, 12..15 | forward and up axis of the torso |
//! | 15..19 | left left, right left, right right, left right foot capsule on the ground, 0 or 1 |
//! | 19..67 | rotations of lower waist, butt, right thigh, shin, foot, left thigh, shin, foot, right upper arm, forearm, left upper arm, forearm: twelve quaternions x y z w |
//! | 67..88 | velocities of the 21 joints in the order of the actions, half turns per second |
//! | 88..92 | `-v1` only: heights of the four foot capsules in the order of the sensors, m |
//!
//! `Humanoid-v0`: r = v/4, upright bonuses of torso, lower waist and butt (/6 each), their forward bonuses (/4, /6, /6),
//! phase bonus; less 1.2 m - height, min(0.5, thighs turned out), 4 (joints at limit), 0.05 effort. v and height are the
//! torso's; hip flexion and knees are free of effort.
//! `Humanoid-v1`: r = V + 0.02 (upright + forward + phase + height + limbs) + (1 - mean effort) min(V, 0.4),
//! V = 0.4 v / 10 m/s.
//! An episode is terminated when any part but feet and shins touches the ground.

use marathon_physics::lanes::Real;

use crate::agent::memory::{PhaseBonus, Stride};
use crate::agent::senses::unit;
use crate::agent::{Agent, Facts, Motors, Obs, Part, Senses, Terms, names};

const MODEL: &str = marathon_assets::text("agents/humanoid.xml");

/// Physics steps per decision: 200 Hz physics, 40 Hz control.
const FRAME_SKIP: usize = 5;
/// 25 seconds.
const MAX_EPISODE_STEPS: usize = 1000;

const ACTIONS: [&str; 21] = [
    "abdomen_y",
    "abdomen_z",
    "abdomen_x",
    "right_hip_x",
    "right_hip_z",
    "right_hip_y",
    "right_knee",
    "right_ankle_x",
    "right_ankle_y",
    "left_hip_x",
    "left_hip_z",
    "left_hip_y",
    "left_knee",
    "left_ankle_x",
    "left_ankle_y",
    "right_shoulder1",
    "right_shoulder2",
    "right_elbow",
    "left_shoulder1",
    "left_shoulder2",
    "left_elbow",
];
/// The motors of a stride. Their effort costs nothing.
const STRIDE: Motors = Motors::named(&ACTIONS, &["right_hip_y", "right_knee", "left_hip_y", "left_knee"]);

const PARTS: [&str; 9] = [
    "torso",
    "lower_waist",
    "butt",
    "left_thigh",
    "right_thigh",
    "left_left_foot",
    "right_left_foot",
    "right_right_foot",
    "left_right_foot",
];
const TORSO: Part = Part::named(&PARTS, "torso");
const WAIST: Part = Part::named(&PARTS, "lower_waist");
/// "Pelvis" in the paper.
const BUTT: Part = Part::named(&PARTS, "butt");
const LEFT_THIGH: Part = Part::named(&PARTS, "left_thigh");
const RIGHT_THIGH: Part = Part::named(&PARTS, "right_thigh");
/// The soles, in the order of the touch sensors.
const SOLES: [Part; 4] = [
    Part::named(&PARTS, "left_left_foot"),
    Part::named(&PARTS, "right_left_foot"),
    Part::named(&PARTS, "right_right_foot"),
    Part::named(&PARTS, "left_right_foot"),
];
const TOUCH: [&str; 4] = ["left_left_foot", "right_left_foot", "right_right_foot", "left_right_foot"];
/// The shins count as feet because they protrude through the feet's capsules at the ankles.
const FEET: [&str; 6] =
    ["left_left_foot", "right_left_foot", "right_right_foot", "left_right_foot", "left_shin", "right_shin"];

/// Height of the torso's center below which there is a penalty, m. Standing, it is 1.285.
const HEIGHT: f64 = 1.2;
/// Weight of the effort.
const EFFORT: f64 = -0.05;
/// Weight of the joints driven at their limit.
const JOINTS_AT_LIMIT: f64 = -4.0;
/// Largest penalty for thighs turned outward.
const LARGEST_LIMB_PENALTY: f64 = 0.5;

/// Speed at which the speed term of the `-v1` reward is full, m/s: the original's track of 250 m in 25 s.
const V1_FASTEST: f64 = 10.0;
/// Weight of the speed in the `-v1` reward.
const V1_VELOCITY: f64 = 0.4;
/// Weight of each of the five bonuses of posture and gait.
const V1_BONUS: f64 = 0.02;
/// Largest weight of the saved effort. It never exceeds the speed's term.
const V1_EFFORT: f64 = 0.4;

/// The paper's Humanoid.
#[derive(Clone, Copy, Debug, Default)]
pub struct HumanoidV0;

impl Agent for HumanoidV0 {
    fn facts(&self) -> Facts {
        Facts {
            id: "Humanoid-v0".into(),
            summary: "a figure of 21 motors: walk forward upright, in long steps, with little effort".into(),
            model: MODEL.into(),
            frame_skip: FRAME_SKIP,
            max_episode_steps: MAX_EPISODE_STEPS,
            observation: Some(88),
            actions: names(ACTIONS),
            reward_terms: names([
                "velocity",
                "uprightness",
                "facing",
                "phase",
                "height",
                "limbs",
                "joints_at_limit",
                "effort",
            ]),
            parts: names(PARTS),
            feet: names(FEET),
            touch: names(TOUCH),
            memory: PhaseBonus::SLOTS,
            ..Facts::default()
        }
    }

    #[inline(always)]
    fn observe<T: Real>(&self, s: &Senses<T>, out: &mut Obs<T>) {
        out.group("velocity");
        out.vector(s.linear_velocity(BUTT));
        out.group("forward");
        out.vector(s.forward(BUTT));
        out.group("up");
        out.vector(s.up(BUTT));
        out.group("torso_forward");
        out.vector(s.forward(TORSO));
        out.group("torso_up");
        out.vector(s.up(TORSO));
        out.group("touch");
        out.touch_sensors(s);
        out.group("joint_rotations");
        out.joint_rotations(s);
        out.group("joint_velocities");
        out.joint_velocities(s);
    }

    #[inline(always)]
    fn remember<T: Real>(&self, s: &Senses<T>, memory: &mut [T]) {
        PhaseBonus::new(FRAME_SKIP, false).update(memory, stride(s));
    }

    #[inline(always)]
    fn step_reward<T: Real>(&self, s: &Senses<T>, terms: &mut Terms<T>) {
        let (quarter, sixth) = (T::lit(1.0 / 4.0), T::lit(1.0 / 6.0));
        let upright = s.upright_bonus(TORSO) + s.upright_bonus(WAIST) + s.upright_bonus(BUTT);
        let facing = s.forward_bonus(TORSO) * quarter + s.forward_bonus(WAIST) * sixth + s.forward_bonus(BUTT) * sixth;
        terms.add("velocity", 1.0, s.velocity(TORSO));
        terms.add("uprightness", 1.0 / 6.0, upright);
        terms.add("facing", 1.0, facing);
        terms.add("phase", 1.0, s.memory(PhaseBonus::BONUS));
        terms.add("height", -1.0, s.height_penalty(TORSO, HEIGHT));
        terms.add("limbs", -1.0, turned_out(s).min(T::lit(LARGEST_LIMB_PENALTY)));
        terms.add("joints_at_limit", JOINTS_AT_LIMIT, s.joints_at_limit_penalty(Motors::NONE));
        terms.add("effort", EFFORT, s.effort(STRIDE));
    }

    #[inline(always)]
    fn terminated<T: Real>(&self, s: &Senses<T>) -> T::Mask {
        s.terminate_on_non_foot_contact()
    }
}

/// Humanoid of the paper's Table 1. It also observes the heights of its feet, its reward is between 0 and 1, and its
/// phase bonus requires alternating feet.
#[derive(Clone, Copy, Debug, Default)]
pub struct HumanoidV1;

impl Agent for HumanoidV1 {
    fn facts(&self) -> Facts {
        Facts {
            id: "Humanoid-v1".into(),
            summary: "a figure of 21 motors, observes its feet, reward between 0 and 1".into(),
            observation: Some(92),
            reward_terms: names(["velocity", "uprightness", "facing", "phase", "height", "limbs", "effort"]),
            ..HumanoidV0.facts()
        }
    }

    #[inline(always)]
    fn observe<T: Real>(&self, s: &Senses<T>, out: &mut Obs<T>) {
        HumanoidV0.observe(s, out);
        out.group("foot_heights");
        for sole in SOLES {
            out.scalar(s.height(sole));
        }
    }

    #[inline(always)]
    fn remember<T: Real>(&self, s: &Senses<T>, memory: &mut [T]) {
        PhaseBonus::new(FRAME_SKIP, true).update(memory, stride(s));
    }

    #[inline(always)]
    fn step_reward<T: Real>(&self, s: &Senses<T>, terms: &mut Terms<T>) {
        const THIRD: f64 = 1.0 / 3.0;
        let one = T::lit(1.0);
        let upright =
            s.upright_bonus_of(TORSO, THIRD) + s.upright_bonus_of(WAIST, THIRD) + s.upright_bonus_of(BUTT, THIRD);
        let facing =
            s.forward_bonus_of(TORSO, THIRD) + s.forward_bonus_of(WAIST, THIRD) + s.forward_bonus_of(BUTT, THIRD);
        let velocity = s.normalized_velocity(TORSO, V1_FASTEST) * T::lit(V1_VELOCITY);
        let saved = one - s.effort_mean(STRIDE);
        terms.add("velocity", 1.0, velocity);
        terms.add("uprightness", V1_BONUS, unit(upright));
        terms.add("facing", V1_BONUS, unit(facing));
        terms.add("phase", V1_BONUS, unit(s.memory(PhaseBonus::BONUS)));
        terms.add("height", V1_BONUS, unit(one - s.height_penalty(TORSO, HEIGHT)));
        terms.add("limbs", V1_BONUS, unit(one - turned_out(s)));
        terms.add("effort", 1.0, saved * velocity.min(T::lit(V1_EFFORT)));
    }

    #[inline(always)]
    fn terminated<T: Real>(&self, s: &Senses<T>) -> T::Mask {
        HumanoidV0.terminated(s)
    }
}

/// Rotation of the thighs inward or outward, summed over both sides.
#[inline(always)]
fn turned_out<T: Real>(s: &Senses<T>) -> T {
    s.left_bonus(LEFT_THIGH).abs() + s.right_bonus(RIGHT_THIGH).abs()
}

/// Inputs of the phase bonus.
#[inline(always)]
fn stride<T: Real>(s: &Senses<T>) -> Stride<T> {
    Stride {
        left_down: T::or(s.touch(0), s.touch(1)),
        right_down: T::or(s.touch(2), s.touch(3)),
        left_flexion: s.flexion(LEFT_THIGH),
        right_flexion: s.flexion(RIGHT_THIGH),
    }
}
