//! The Ant with a commanded velocity (ahead and to the left) and turn rate.
//!
//! Vectors are in axes with x along the heading of the torso and z up.
//!
//! | observation | content |
//! |---|---|
//! | 0..3 | commanded speed ahead and to the left, m/s, and turn rate, rad/s |
//! | 3, 4 | sine and cosine of the angle from the heading to the commanded direction |
//! | 5 | height of the torso, m |
//! | 6..9 | up axis of the torso |
//! | 9..12, 12..15 | velocity of the torso, m/s, and its angular velocity, rad/s |
//! | 15..19 | ground contact of the feet, 0 or 1 |
//! | 19..27, 27..35 | angles of the joints, rad, and their velocities, rad/s |
//!
//! The commanded direction is the heading at the start, and turns at the commanded rate. It waits when the Ant cannot
//! follow.
//!
//! With e the velocity error and a the angle to the commanded direction: r = exp(-4 e^2) - 0.5 e + 0.5 exp(-4 a^2) -
//! 0.5 abs(a) + 0.3 still - 0.05 effort. An episode is terminated when the Ant lies on its back.

use std::f64::consts::FRAC_PI_2;

use marathon_physics::lanes::Real;

use super::super::ant::AntV0;
use super::super::heading;
use super::super::imitation::turned_to;
use crate::agent::senses::hypot;
use crate::agent::{Agent, CommandRange, Facts, Motors, Obs, Part, Senses, Terms, names};
use crate::episode_rng::EpisodeRng;

/// All geoms. The torso and the feet come first, as in the Ant's own task.
const PARTS: [&str; 13] = [
    "torso_geom",
    "left_ankle_geom",
    "right_ankle_geom",
    "third_ankle_geom",
    "fourth_ankle_geom",
    "aux_1_geom",
    "left_leg_geom",
    "aux_2_geom",
    "right_leg_geom",
    "aux_3_geom",
    "back_leg_geom",
    "aux_4_geom",
    "rightback_leg_geom",
];
const TORSO: Part = Part::named(&PARTS, "torso_geom");
/// Index of the first hinge in `qpos`.
const QPOS: usize = 7;
/// Index of the first hinge in `qvel`.
const QVEL: usize = 6;
const HINGES: usize = 8;
/// Size of the observation.
const OBSERVATION: usize = 19 + 2 * HINGES;
/// 20 seconds.
const MAX_EPISODE_STEPS: usize = 2000;
/// Highest commanded speed ahead or back, m/s.
const MAX_SPEED: f64 = 3.0;
/// Highest commanded speed to a side, m/s.
const MAX_TURN_ACCELERATION: f64 = 2.0;
/// Highest commanded turn rate, rad/s.
const MAX_TURN: f64 = FRAC_PI_2;
/// Largest angle between the commanded direction and the heading, rad.
const MAX_HEADING_LAG: f64 = 1.0;
/// Shortest and longest duration of a command, decisions.
const HOLDS: [usize; 2] = [100, 400];
/// Fraction of commands that are to stand.
const STANDING: f64 = 0.15;
/// Of the other commands, the fraction without a side step, and the fraction without a turn.
const STRAIGHT: f64 = 0.4;
/// Shortest and longest duration of a command to stand, decisions.
const RESTS: [usize; 2] = [200, 800];
/// Reward of each part of standing still.
const STILL: f64 = 0.3;
/// Mean squares of the parts' velocities at which each part drops to 1/e, m^2/s^2. The first part rewards coming to
/// rest, the last keeping still.
const STILLNESS_SCALES: [f64; 3] = [0.4, 0.04, 0.004];

/// The Ant with commands.
#[derive(Clone, Copy, Debug, Default)]
pub struct AntController;

impl AntController {
    /// Commanded direction.
    #[inline(always)]
    fn direction<T: Real>(s: &Senses<T>) -> [T; 2] {
        [s.memory(0), s.memory(1)]
    }

    /// Distance of the center of mass's velocity along the ground from the commanded one, m/s.
    #[inline(always)]
    fn slip<T: Real>(s: &Senses<T>) -> T {
        let [x, y, _] = s.center_of_mass_velocity();
        let [left, ahead] = heading::beside(Self::direction(s), [x, y]);
        hypot(ahead - s.command(0), left - s.command(1))
    }

    /// Angle from the heading to the commanded direction, rad.
    #[inline(always)]
    fn off<T: Real>(s: &Senses<T>) -> T {
        heading::off(s.heading(TORSO), Self::direction(s))
    }
}

impl Agent for AntController {
    fn facts(&self) -> Facts {
        Facts {
            id: "AntController-v0".into(),
            summary: "four legs: go ahead, back and sideways, and turn, as commanded".into(),
            max_episode_steps: MAX_EPISODE_STEPS,
            observation: Some(OBSERVATION),
            reward_terms: names(["velocity", "pace", "heading", "off", "still", "effort"]),
            info: names(["velocity_error", "heading_error"]),
            metrics: names(["forward", "velocity_error", "heading_error"]),
            parts: names(PARTS),
            command: vec![
                CommandRange::new("speed", -MAX_SPEED..=MAX_SPEED, "m/s"),
                CommandRange::new("left", -MAX_TURN_ACCELERATION..=MAX_TURN_ACCELERATION, "m/s"),
                CommandRange::new("turn", -MAX_TURN..=MAX_TURN, "rad/s"),
            ],
            memory: 2,
            ..AntV0.facts()
        }
    }

    fn command(&self, random: &mut EpisodeRng, _: usize, out: &mut [f64]) -> usize {
        let moves = random.uniform(0.0, 1.0) >= STANDING;
        let [sideways, turns] = [(); 2].map(|()| moves && random.uniform(0.0, 1.0) >= STRAIGHT);
        out[0] = if moves { random.around_zero(MAX_SPEED) } else { 0.0 };
        out[1] = if sideways { random.around_zero(MAX_TURN_ACCELERATION) } else { 0.0 };
        out[2] = if turns { random.around_zero(MAX_TURN) } else { 0.0 };
        let [least, most] = if moves { HOLDS } else { RESTS };
        random.whole(least, most)
    }

    #[inline(always)]
    fn begin<T: Real>(&self, s: &Senses<T>, memory: &mut [T]) {
        memory.copy_from_slice(&s.heading(TORSO));
    }

    #[inline(always)]
    fn remember<T: Real>(&self, s: &Senses<T>, memory: &mut [T]) {
        let turn = |angle: T| s.command(2).mul_add(T::lit(s.dt()), angle);
        let direction = heading::turned(s.heading(TORSO), [memory[0], memory[1]], turn, MAX_HEADING_LAG);
        memory.copy_from_slice(&direction);
    }

    #[inline(always)]
    fn observe<T: Real>(&self, s: &Senses<T>, out: &mut Obs<T>) {
        let facing = s.heading(TORSO);
        let turned = turned_to(facing);
        out.group("command");
        for i in 0..3 {
            out.scalar(s.command(i));
        }
        for x in heading::beside(facing, Self::direction(s)) {
            out.scalar(x);
        }
        out.group("height");
        out.scalar(s.height(TORSO));
        out.group("up");
        out.vector(turned(s.up(TORSO)));
        out.group("velocity");
        out.vector(turned(s.linear_velocity(TORSO)));
        out.group("angular_velocity");
        out.vector(turned(s.angular_velocity(TORSO)));
        out.group("touch");
        out.touch_sensors(s);
        out.group("joint_positions");
        for i in 0..HINGES {
            out.scalar(s.readings().qpos(QPOS + i));
        }
        out.group("joint_velocities");
        for i in 0..HINGES {
            out.scalar(s.readings().qvel(QVEL + i));
        }
    }

    #[inline(always)]
    fn step_reward<T: Real>(&self, s: &Senses<T>, terms: &mut Terms<T>) {
        let (slip, angle) = (Self::slip(s), Self::off(s));
        terms.add("velocity", 1.0, (slip * slip * T::lit(-4.0)).exp());
        terms.add("pace", -0.5, slip);
        terms.add("heading", 0.5, (angle * angle * T::lit(-4.0)).exp());
        terms.add("off", -0.5, angle.abs());
        // commanded to stand without a turn
        let told = s.command(0).abs().max(s.command(1).abs()).max(s.command(2).abs());
        let rest = told.neg_mul_add(T::lit(10.0), T::lit(1.0)).max(T::zero());
        let [fidgets, rests, stirs] = super::stillness(s, PARTS.len(), STILLNESS_SCALES);
        terms.add("still", STILL, rest * (fidgets + rests + stirs));
        terms.add("effort", -0.05, s.effort_mean(Motors::NONE));
    }

    #[inline(always)]
    fn terminated<T: Real>(&self, s: &Senses<T>) -> T::Mask {
        s.up(TORSO)[2].lt(T::zero())
    }

    #[inline(always)]
    fn info<T: Real>(&self, s: &Senses<T>, out: &mut Obs<T>) {
        out.scalar(Self::slip(s));
        out.scalar(Self::off(s).abs());
    }
}
