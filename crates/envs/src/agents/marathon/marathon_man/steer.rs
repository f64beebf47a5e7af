//! Marathon Man told where to go: he walks, runs, turns and stands at a commanded speed and turn, in the style of clips.
//!
//! | observation | content |
//! |---|---|
//! | 0..2 | commanded speed, m/s, and turn, rad/s |
//! | 2..4 | sine and cosine of the angle from his heading to the commanded direction |
//! | 4 | height of the butt, m |
//! | 5..11 | forward and up axis of the butt |
//! | 11..17 | velocity of the butt, m/s, and its angular velocity, rad/s |
//! | 17..38, 38..59 | angles of the 21 joints, rad, and their velocities, rad/s |
//! | 59..71 | feet and hands as seen from the butt, m |
//! | 71..77 | toe, toe and heel of the right and of the left foot on the ground, 0 or 1 |
//! | 77..80 | pace, m/s, cosine and sine of the gait's phase |
//! | 80..101 | how far the gait's next angles are from his own, rad |
//!
//! Vectors are in his heading, the direction along the ground in which the butt faces. The commanded direction turns as the
//! command says; where he cannot follow, it stays within [`MOST_BEHIND`] of his heading.
//!
//! No clip leads him through the world. His [gait](super::gait) goes round as fast as his pace asks for, and the pace follows the
//! command. An action of `pd` is a deviation from the gait.
//!
//! The task's reward is for velocity, heading and the gait. The style comes from a discriminator that learns from his clips
//! ([`STYLE`]): the task's [demonstrations](crate::ShardFactory::demonstrations) are what he would observe in them.

use std::f64::consts::{FRAC_PI_2, TAU};
use std::sync::LazyLock;

use marathon_physics::Model;
use marathon_physics::lanes::Real;

use super::super::imitation::{observe_body, sub, turned_to};
use super::body::{
    ACTIONS, ANATOMY, BUTT, Control, DAMPING_TIME, END_EFFECTORS, FEET, FIRST_QPOS, JOINTS, PARTS, TOUCH, model, parts,
};
use super::clips::{self, STAND};
use super::gait::{beginning, gaits};
use super::{FRAME_SKIP, MAX_EPISODE_STEPS, observe_soles};
use crate::agent::senses::{clamp, hypot};
use crate::agent::{
    Agent, CommandRange, Ctrl, Facts, Following, Obs, OptionInfo, OptionSet, Options, ResetNoise, Scale, Senses, Start,
    Terms, names,
};
use crate::episode_rng::EpisodeRng;

/// Parts of the observation that tell style.
pub const STYLE: [&str; 7] =
    ["height", "orientation", "velocity", "angular_velocity", "joint_positions", "joint_velocities", "ends"];
/// What he moves like.
const CLIPS: [&str; 5] = ["walk", "walk_left", "walk_right", "run", STAND];
/// Numbers that he observes.
const OBSERVATION: usize = 80 + JOINTS.len();
/// Fastest that he is told to go, m/s.
const FASTEST: f64 = 3.0;
/// Sharpest that he is told to turn, rad/s.
const SHARPEST: f64 = FRAC_PI_2;
/// Most that the commanded direction is off his heading, rad.
pub const MOST_BEHIND: f64 = 1.0;
/// How long a command holds, decisions.
const HOLDS: [usize; 2] = [40, 240];
/// Share of commands that are to stand, and of those that are to go straight on.
const STANDING: f64 = 0.15;
const STRAIGHT: f64 = 0.4;

/// Slots of the memory: cosine and sine of the commanded direction.
const DIRECTION: usize = Following::SLOTS;
/// Slots of the gait: the share of its cycle that is over, and the speed that it is for, m/s.
const PHASE: usize = DIRECTION + 2;
const PACE: usize = PHASE + 1;
/// How fast the pace changes, m/s^2, and how far it is from his speed at most, m/s: a run does not lead who stands.
const ACCELERATION: f64 = 4.0;
const LEAD: f64 = 0.8;
/// Pace for a turn on the spot: that of a walk on a circle of this radius, m.
const TURNING_RADIUS: f64 = 0.4;

crate::options! {
    /// Arguments of Marathon Man told where to go.
    pub struct SteerArguments {
        /// What an action does: `pd` moves the target of a servo away from the gait's next pose, `pd_range` is the target within
        /// the joint's range, `torque` a share of the motor's strength, `servo` the target velocity of the original's drive.
        control: Control = Control::Pd,
        /// Most that an action of `pd` moves a target, rad.
        reach: Scale = Scale(1.0),
    }
}

/// Where in the cycle of each clip the gait begins.
fn beginnings() -> &'static [f64; CLIPS.len()] {
    static BEGINNINGS: LazyLock<[f64; CLIPS.len()]> =
        LazyLock::new(|| CLIPS.map(|name| clips::shipped(name).map_or(0.0, |clip| beginning(&clip))));
    &BEGINNINGS
}

/// Marathon Man told where to go.
#[derive(Clone, Debug, Default)]
pub struct Steer {
    arguments: SteerArguments,
}

impl Steer {
    /// Angle from his heading to a direction, rad.
    #[inline(always)]
    fn off<T: Real>(s: &Senses<T>, [x, y]: [T; 2]) -> T {
        let [c, d] = s.heading(BUTT);
        c.mul_add(y, -(d * x)).atan2(c.mul_add(x, d * y))
    }

    /// Commanded direction.
    #[inline(always)]
    fn direction<T: Real>(s: &Senses<T>) -> [T; 2] {
        [s.memory(DIRECTION), s.memory(DIRECTION + 1)]
    }

    /// How fast the center of mass moves along the ground, m/s.
    #[inline(always)]
    fn speed<T: Real>(s: &Senses<T>) -> T {
        let [x, y, _] = s.center_of_mass_velocity();
        hypot(x, y)
    }

    /// Mean square of the joints' distances from the gait, by DeepMimic's weights, rad^2.
    #[inline(always)]
    fn out_of_step<T: Real>(s: &Senses<T>) -> T {
        let gaits = gaits();
        let now = gaits.moment(s.memory(PHASE), s.memory(PACE), 0.0);
        let (mut sum, mut total) = (T::zero(), 0.0);
        for (i, joint) in JOINTS.iter().enumerate() {
            let off = gaits.angle(&now, i) - s.readings().qpos(FIRST_QPOS + i);
            sum = (off * off).mul_add(T::lit(joint.weight), sum);
            total += joint.weight;
        }
        sum * T::lit(1.0 / total)
    }

    /// Where the gait will be after `dt` seconds.
    #[inline(always)]
    fn next_phase<T: Real>(phase: T, pace: T, dt: f64) -> T {
        let next = gaits().frequency(pace).mul_add(T::lit(dt), phase);
        next - next.floor()
    }

    /// How far the velocity of the center of mass along the ground is from the commanded one, m/s.
    #[inline(always)]
    fn slip<T: Real>(s: &Senses<T>) -> T {
        let ([vx, vy, _], [x, y], speed) = (s.center_of_mass_velocity(), Self::direction(s), s.command(0));
        hypot(speed.neg_mul_add(x, vx), speed.neg_mul_add(y, vy))
    }
}

impl Agent for Steer {
    fn facts(&self) -> Facts {
        Facts {
            id: "MarathonManSteer-v0".into(),
            summary: "a figure of 21 motors: walk, run, turn and stand as told, in the style of clips".into(),
            model: model(self.arguments.control).into(),
            frame_skip: FRAME_SKIP,
            max_episode_steps: MAX_EPISODE_STEPS,
            observation: Some(OBSERVATION),
            actions: names(ACTIONS.map(|i| JOINTS[i].name)),
            reward_terms: names(["velocity", "pace", "heading", "gait"]),
            info: names(["velocity_error", "heading_error"]),
            metrics: names(["forward", "velocity_error", "heading_error"]),
            parts: names(PARTS),
            touch_sites: names(TOUCH),
            command: vec![
                CommandRange::new("speed", 0.0..=FASTEST, "m/s"),
                CommandRange::new("turn", -SHARPEST..=SHARPEST, "rad/s"),
            ],
            clips: CLIPS.into_iter().filter_map(clips::shipped).collect(),
            follows_clips: false,
            memory: PACE + 1,
            termination_reward: None,
            ..Facts::default()
        }
    }

    fn options(&self) -> Vec<OptionInfo> {
        self.arguments.infos()
    }

    fn with_options(&self, options: &Options) -> Option<Self> {
        Some(Steer { arguments: self.arguments.with(options) })
    }

    fn fits(&self, model: &Model) -> Result<(), String> {
        super::has_joints(model)
    }

    fn reset(&self, start: &mut Start) {
        let clips: Vec<_> = start.clips().collect();
        let clip = start.random.whole(0, clips.len() - 1);
        let rows = clips[clip].clone();
        let row = start.random.whole(rows.start, rows.end - 1);
        start.start_in_clip(row);
        start.memory[PHASE] = (start.phase(row) - beginnings()[clip]).rem_euclid(1.0);
        start.add_noise(ResetNoise::MARATHON);
    }

    fn command(&self, random: &mut EpisodeRng, _: usize, out: &mut [f64]) -> usize {
        out[0] = if random.uniform(0.0, 1.0) < STANDING { 0.0 } else { random.uniform(0.0, FASTEST) };
        out[1] = if random.uniform(0.0, 1.0) < STRAIGHT { 0.0 } else { random.around_zero(SHARPEST) };
        random.whole(HOLDS[0], HOLDS[1])
    }

    #[inline(always)]
    fn ctrl<T: Real>(&self, c: &mut Ctrl<T>) {
        match self.arguments.control {
            Control::PdRange | Control::Torque | Control::Servo => c.ctrl.copy_from_slice(c.action),
            Control::Pd => {
                let reach = T::lit(self.arguments.reach.0);
                // the servo's damping, which slows every motion, is not to slow the gait
                let [phase, pace] = [PHASE, PACE].map(|slot| c.memory[slot]);
                let gaits = gaits();
                let next = gaits.moment(Self::next_phase(phase, pace, c.dt), pace, DAMPING_TIME);
                for (i, joint) in ACTIONS.into_iter().enumerate() {
                    c.ctrl[i] = c.action[i].mul_add(reach, gaits.angle(&next, joint));
                }
            }
        }
    }

    #[inline(always)]
    fn begin<T: Real>(&self, s: &Senses<T>, memory: &mut [T]) {
        memory[DIRECTION..DIRECTION + 2].copy_from_slice(&s.heading(BUTT));
        memory[PACE] = Self::speed(s).min(T::lit(FASTEST));
    }

    #[inline(always)]
    fn remember<T: Real>(&self, s: &Senses<T>, memory: &mut [T]) {
        let angle = Self::off(s, [memory[DIRECTION], memory[DIRECTION + 1]]);
        let turned = clamp(s.command(1).mul_add(T::lit(s.dt()), angle), -MOST_BEHIND, MOST_BEHIND);
        let ((sin, cos), [c, d]) = (turned.sin_cos(), s.heading(BUTT));
        memory[DIRECTION] = d.neg_mul_add(sin, c * cos);
        memory[DIRECTION + 1] = d.mul_add(cos, c * sin);
        memory[PHASE] = Self::next_phase(memory[PHASE], memory[PACE], s.dt());
        let (speed, most) = (Self::speed(s), ACCELERATION * s.dt());
        let asked = s.command(0).max(s.command(1).abs() * T::lit(TURNING_RADIUS));
        let asked = speed + clamp(asked - speed, -LEAD, LEAD);
        memory[PACE] += clamp(asked - memory[PACE], -most, most);
    }

    #[inline(always)]
    fn observe<T: Real>(&self, s: &Senses<T>, out: &mut Obs<T>) {
        let [cos, sin] = s.heading(BUTT);
        let turned = turned_to([cos, sin]);
        let [x, y] = Self::direction(s);
        out.group("command");
        out.scalar(s.command(0));
        out.scalar(s.command(1));
        out.scalar(cos.mul_add(y, -(sin * x)));
        out.scalar(cos.mul_add(x, sin * y));
        observe_body(s, &ANATOMY, &turned, out);
        out.group("ends");
        for part in END_EFFECTORS {
            out.vector(turned(sub(s.position(part), s.position(BUTT))));
        }
        observe_soles(s, out);
        let (phase, pace) = (s.memory(PHASE), s.memory(PACE));
        let (sin, cos) = (phase * T::lit(TAU)).sin_cos();
        out.group("gait");
        for x in [pace, cos, sin] {
            out.scalar(x);
        }
        let gaits = gaits();
        let next = gaits.moment(Self::next_phase(phase, pace, s.dt()), pace, 0.0);
        out.group("next_pose");
        for i in 0..JOINTS.len() {
            out.scalar(gaits.angle(&next, i) - s.readings().qpos(FIRST_QPOS + i));
        }
    }

    #[inline(always)]
    fn step_reward<T: Real>(&self, s: &Senses<T>, terms: &mut Terms<T>) {
        let slip = Self::slip(s);
        let angle = Self::off(s, Self::direction(s));
        terms.add("velocity", 0.35, (slip * slip * T::lit(-5.0)).exp());
        terms.add("pace", 0.25, (slip * slip * T::lit(-0.5)).exp());
        terms.add("heading", 0.2, (angle * angle * T::lit(-4.0)).exp());
        terms.add("gait", 0.2, (Self::out_of_step(s) * T::lit(-5.0)).exp());
    }

    #[inline(always)]
    fn terminated<T: Real>(&self, s: &Senses<T>) -> T::Mask {
        let mut fallen = T::none();
        for part in parts() {
            if part != FEET[0] && part != FEET[1] {
                fallen = T::or(fallen, s.touched_ground(part));
            }
        }
        fallen
    }

    #[inline(always)]
    fn info<T: Real>(&self, s: &Senses<T>, out: &mut Obs<T>) {
        out.scalar(Self::slip(s));
        let angle = Self::off(s, Self::direction(s));
        out.scalar(angle.abs());
    }
}
