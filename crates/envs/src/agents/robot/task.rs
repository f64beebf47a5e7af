//! The task of a robot: observation, reward and end of an episode.
//!
//! With the error e of the root's velocity along the ground (its speed upward counts, too), the error w of the turn rate, and the
//! fastest commands v and t:
//!
//! | term | weight | form |
//! |---|---|---|
//! | `velocity` | 2 | exp(-(e / (v / 2))^2) |
//! | `turn` | 1 | exp(-(w / (t / 2))^2), tilting velocities count, too |
//! | `upright` | 0.5 | exp(-tilt^2 / 0.2) |
//! | `posture` | 0.5 | exp(-mean((q - q0)^2 / spread^2)); narrow at rest |
//! | `steps` | 1 | mean over the feet: height in the swing, contact without slip in the stance; only with a clock |
//! | `slip` | -0.2 | mean squared speed of feet on the ground |
//! | `jerk` | -0.3 | mean squared change of the action |
//! | `torque` | -0.1 | mean squared torque |
//! | `contact` | -0.5 | number of other geoms on the ground |

use std::f64::consts::{PI, TAU};

use marathon_physics::lanes::Real;

use super::arguments::{RobotArguments, Task};
use super::rig::{ID, Rig};
use super::servos::Drive;
use super::stance::Root;
use crate::agent::options::OptionSet;
use crate::agent::senses::angle;
use crate::agent::{
    Agent, CommandRange, Controls, Ctrl, Facts, Obs, OptionInfo, Options, ResetNoise, Senses, Start, Terms, View, names,
};
use crate::episode_rng::EpisodeRng;

/// 20 seconds.
const EPISODE: f64 = 20.0;
/// Share of a turn of the clock that a foot stands.
const STANCE: f64 = 0.6;
/// Part of the fastest command below which a robot is to stand.
const REST: f64 = 0.1;
/// Shortest and longest duration of a command, s.
const HOLDS: [f64; 2] = [2.0, 6.0];
/// Fraction of commands to stand, and of those straight ahead or back.
const KINDS: [f64; 2] = [0.15, 0.3];
/// Fastest command back, as a part of that ahead.
const BACK: f64 = 0.5;
/// Height of the root, as a part of its own, below which it has fallen.
const LOW: f64 = 0.5;
/// Factor of joint velocities in the observation.
const SLOWED: f64 = 0.05;
/// Standard deviation of the posture at rest, as a part of that in motion.
const AT_REST: f64 = 0.4;
/// Noise at the start: joint positions, rad, and velocities, rad/s and m/s.
const NOISE: ResetNoise = ResetNoise { joint_position: 0.05, joint_velocity: 0.1, root_velocity: 0.1 };

/// Slots of the memory: phase of the clock in turns, mean squared change of the action, and from here on the action itself.
const PHASE: usize = 0;
const JERK: usize = 1;
const LAST: usize = 2;

/// A robot with its rig.
pub struct Robot {
    pub rig: Rig,
    arguments: RobotArguments,
    /// Cosine of the tilt that counts as a fall.
    fallen: f64,
}

impl Robot {
    pub fn new(rig: Rig, arguments: RobotArguments) -> Robot {
        let fallen = libm::cos(arguments.fall_tilt.0.min(180.0).to_radians());
        Robot { rig, arguments, fallen }
    }

    /// Axes of the root in the standing pose's sense: ahead, to the left and up.
    #[inline(always)]
    fn axes<T: Real>(&self, s: &Senses<T>) -> [[T; 3]; 3] {
        let axes = s.readings().body_axes(self.rig.body);
        let [ahead, up] = self.rig.axes.map(|axis| {
            let mut out = [T::zero(); 3];
            for (k, out) in out.iter_mut().enumerate() {
                *out = axes[0][k]
                    .mul_add(T::lit(axis[0]), axes[1][k].mul_add(T::lit(axis[1]), axes[2][k] * T::lit(axis[2])));
            }
            out
        });
        let left = [
            up[1].mul_add(ahead[2], -(up[2] * ahead[1])),
            up[2].mul_add(ahead[0], -(up[0] * ahead[2])),
            up[0].mul_add(ahead[1], -(up[1] * ahead[0])),
        ];
        [ahead, left, up]
    }

    /// Lanes whose command is to stand.
    #[inline(always)]
    fn rests<T: Real>(&self, command: impl Fn(usize) -> T) -> T::Mask {
        let mut rests = T::not(T::none());
        for i in 0..self.commands() {
            rests = T::and(rests, command(i).abs().lt(T::lit(REST * self.rig.fastest[i].max(1e-9))));
        }
        rests
    }

    /// Numbers of the command: one in the plane, three otherwise.
    fn commands(&self) -> usize {
        match self.rig.root {
            _ if self.arguments.task == Task::Stand => 0,
            Root::Planar { .. } => 1,
            Root::Free { .. } => 3,
        }
    }

    #[inline(always)]
    fn commanded<T: Real>(&self, s: &Senses<T>, i: usize) -> T {
        if i < self.commands() { s.command(i) } else { T::zero() }
    }
}

#[inline(always)]
fn along<T: Real>(axis: &[T; 3], v: &[T; 3]) -> T {
    axis[0].mul_add(v[0], axis[1].mul_add(v[1], axis[2] * v[2]))
}

#[inline(always)]
fn bell<T: Real>(square: T) -> T {
    (-square).exp()
}

impl Agent for Robot {
    fn facts(&self) -> Facts {
        let rig = &self.rig;
        let dt = rig.dt();
        let range = |name: &str, most: f64, unit: &str| CommandRange::new(name, -most..=most, unit);
        let [ahead, side, turn] = rig.fastest;
        let speed = CommandRange::new("speed", -BACK * ahead..=ahead, "m/s");
        let command = [speed, range("left", side, "m/s"), range("turn", turn, "rad/s")];
        let clock = if rig.clock { 2 } else { 0 };
        let mut terms = vec!["velocity", "turn", "upright", "posture"];
        if rig.clock {
            terms.push("steps");
        }
        if !rig.feet.is_empty() {
            terms.push("slip");
        }
        terms.extend(["jerk", "torque"]);
        if !rig.shell.is_empty() {
            terms.push("contact");
        }
        Facts {
            id: ID.into(),
            summary: "any robot: follow velocity commands".into(),
            model: rig.source.clone(),
            frame_skip: rig.frame_skip,
            max_episode_steps: (EPISODE / dt).round() as usize,
            observation: Some(self.commands() + 9 + 2 * rig.joints.len() + rig.drives.len() + clock),
            controls: Controls::Nominal,
            reward_terms: names(terms),
            info: names(["velocity_error", "turn_error"]),
            metrics: names(["forward", "velocity_error", "turn_error"]),
            command: command.into_iter().take(self.commands()).collect(),
            memory: LAST + rig.drives.len(),
            view: View { actuators: true, ..View::default() },
            termination_reward: Some(-1.0),
            ..Facts::default()
        }
    }

    fn options(&self) -> Vec<OptionInfo> {
        self.arguments.infos()
    }

    fn with_options(&self, _: &Options) -> Option<Self> {
        None
    }

    fn reset(&self, start: &mut Start) {
        start.add_noise(NOISE);
    }

    fn command(&self, random: &mut EpisodeRng, _: usize, out: &mut [f64]) -> usize {
        let dt = self.rig.dt();
        let [stands, straight] = KINDS;
        let kind = random.uniform(0.0, 1.0);
        for (i, out) in out.iter_mut().enumerate() {
            let most = self.rig.fastest[i];
            let drawn = random.uniform(if i == 0 { -BACK * most } else { -most }, most);
            let kept = kind >= stands && (i == 0 || kind >= stands + straight);
            *out = if kept { drawn } else { 0.0 };
        }
        let [least, most] = HOLDS.map(|time| (time / dt).round() as usize);
        random.whole(least, most)
    }

    #[inline(always)]
    fn ctrl<T: Real>(&self, c: &mut Ctrl<T>) {
        for (i, drive) in self.rig.drives.iter().enumerate() {
            c.ctrl[i] = match drive {
                Drive::Servo(servo) => {
                    let target = c.action[i].mul_add(T::lit(servo.scale), T::lit(servo.center));
                    target.max(T::lit(servo.range[0])).min(T::lit(servo.range[1]))
                }
                Drive::Direct([center, half]) => c.action[i].mul_add(T::lit(*half), T::lit(*center)),
            };
        }
    }

    #[inline(always)]
    fn remember<T: Real>(&self, s: &Senses<T>, memory: &mut [T]) {
        let turn = memory[PHASE] + T::lit(self.rig.step_rate * s.dt());
        let rests = self.rests(|i| s.command(i));
        memory[PHASE] = T::select(rests, T::zero(), turn - turn.floor());
        let mut jerk = T::zero();
        for i in 0..self.rig.drives.len() {
            let change = s.action(i) - memory[LAST + i];
            jerk = change.mul_add(change, jerk);
            memory[LAST + i] = s.action(i);
        }
        memory[JERK] = jerk * T::lit(1.0 / self.rig.drives.len() as f64);
    }

    #[inline(always)]
    fn observe<T: Real>(&self, s: &Senses<T>, out: &mut Obs<T>) {
        let (r, pace) = (s.readings(), T::lit(1.0 / self.rig.pace()));
        let axes = self.axes(s);
        if self.commands() > 0 {
            out.group("command");
        }
        for i in 0..self.commands() {
            out.scalar(if i < 2 { s.command(i) * pace } else { s.command(i) });
        }
        let (velocity, spin) = (r.body_velocity(self.rig.body), r.body_angular_velocity(self.rig.body));
        out.group("velocity");
        axes.iter().for_each(|axis| out.scalar(along(axis, &velocity) * pace));
        out.group("angular_velocity");
        axes.iter().for_each(|axis| out.scalar(along(axis, &spin)));
        out.group("up");
        axes.iter().for_each(|axis| out.scalar(axis[2]));
        out.group("joint_positions");
        for [qpos, _] in &self.rig.joints {
            out.scalar(r.qpos(*qpos) - T::lit(self.rig.qpos[*qpos]));
        }
        out.group("joint_velocities");
        for [_, dof] in &self.rig.joints {
            out.scalar(r.qvel(*dof) * T::lit(SLOWED));
        }
        out.group("last_action");
        for i in 0..self.rig.drives.len() {
            out.scalar(s.memory(LAST + i));
        }
        if self.rig.clock {
            out.group("clock");
            let rests = self.rests(|i| s.command(i));
            let (sin, cos) = (s.memory(PHASE) * T::lit(TAU)).sin_cos();
            out.scalar(T::select(rests, T::zero(), sin));
            out.scalar(T::select(rests, T::zero(), cos));
        }
    }

    #[inline(always)]
    fn step_reward<T: Real>(&self, s: &Senses<T>, terms: &mut Terms<T>) {
        let (rig, r) = (&self.rig, s.readings());
        let (zero, one) = (T::zero(), T::lit(1.0));
        let [error, turn_error] = self.errors(s);
        let [_, _, up] = self.axes(s);
        let velocity = r.body_velocity(rig.body);
        let spin = r.body_angular_velocity(rig.body);
        let rests = self.rests(|i| self.commanded(s, i));

        let [fastest, _, turn] = rig.fastest;
        let width = 1.0 / (0.5 * fastest.max(0.3 * rig.pace())).powi(2);
        let square = error.mul_add(error, velocity[2] * velocity[2]);
        terms.add("velocity", 2.0, bell(square * T::lit(width)));
        let tilting = spin[0].mul_add(spin[0], spin[1] * spin[1]);
        let width = 1.0 / (0.5 * turn.max(1.0)).powi(2);
        let square = turn_error.mul_add(turn_error, tilting * T::lit(0.1));
        terms.add("turn", 1.0, bell(square * T::lit(width)));
        let tilt = angle(up, [zero, zero, one]);
        terms.add("upright", 0.5, bell(tilt * tilt * T::lit(5.0)));

        let (mut posture, mut joints, mut torque) = (zero, 0, zero);
        for (i, (drive, spread)) in rig.drives.iter().zip(&rig.spreads).enumerate() {
            let Drive::Servo(servo) = drive else { continue };
            let off = (r.qpos(servo.qpos) - T::lit(rig.qpos[servo.qpos])) * T::lit(1.0 / spread);
            posture = off.mul_add(off, posture);
            let gear = rig.model.actuators[i].gear[0].abs();
            let effort = r.actuator_force(i) * T::lit(gear / servo.strength);
            torque = effort.mul_add(effort, torque);
            joints += 1;
        }
        let mean = T::lit(1.0 / f64::from(joints.max(1)));
        let narrow = T::select(rests, T::lit(1.0 / (AT_REST * AT_REST)), one);
        terms.add("posture", 0.5, bell(posture * mean * narrow));

        let (mut steps, mut slip) = (zero, zero);
        for (foot, late) in &rig.feet {
            let mut down = T::none();
            if !s.fresh() {
                for geom in &foot.geoms {
                    down = T::or(down, r.touching(*geom));
                }
            }
            let (sole, moves) = self.sole(s, foot.body, &foot.sole);
            let slide = moves[0].mul_add(moves[0], moves[1] * moves[1]) * T::lit(1.0 / (rig.gravity * rig.height));
            let slide = slide.min(T::lit(1.0));
            slip += T::masked(down, slide);
            let turn = s.memory(PHASE) + T::lit(*late);
            let turn = turn - turn.floor();
            let swings = T::and(T::not(rests), T::lit(STANCE).lt(turn));
            let arc = ((turn - T::lit(STANCE)) * T::lit(PI / (1.0 - STANCE))).sin_cos().0;
            let off = (sole[2] - T::lit(rig.ground) - arc * T::lit(rig.step_height)) * T::lit(2.0 / rig.step_height);
            let stance = T::masked(down, bell(slide * T::lit(20.0)));
            steps += T::select(swings, bell(off * off), stance);
        }
        let feet = T::lit(1.0 / rig.feet.len().max(1) as f64);
        if rig.clock {
            terms.add("steps", 1.0, steps * feet);
        }
        if !rig.feet.is_empty() {
            terms.add("slip", -0.2, slip * feet);
        }
        terms.add("jerk", -0.3, s.memory(JERK));
        terms.add("torque", -0.1, torque * mean);
        if !rig.shell.is_empty() {
            let mut hits = zero;
            if !s.fresh() {
                for geom in &rig.shell {
                    hits += T::masked(r.touching(*geom), one);
                }
            }
            terms.add("contact", -0.5, hits);
        }
    }

    #[inline(always)]
    fn terminated<T: Real>(&self, s: &Senses<T>) -> T::Mask {
        // what lies on the ground cannot fall
        if self.rig.feet.is_empty() {
            return T::none();
        }
        let [_, _, up] = self.axes(s);
        let tilted = up[2].lt(T::lit(self.fallen));
        let height = s.readings().body_pos(self.rig.body)[2] - T::lit(self.rig.ground);
        T::or(tilted, height.lt(T::lit(LOW * self.rig.height)))
    }

    #[inline(always)]
    fn info<T: Real>(&self, s: &Senses<T>, out: &mut Obs<T>) {
        let [error, turn] = self.errors(s);
        out.scalar(error);
        out.scalar(turn.abs());
    }
}

impl Robot {
    /// Errors of the velocity along the ground, m/s, and of the turn rate, rad/s.
    #[inline(always)]
    fn errors<T: Real>(&self, s: &Senses<T>) -> [T; 2] {
        let (r, [ahead, ..]) = (s.readings(), self.axes(s));
        let velocity = r.body_velocity(self.rig.body);
        let length = ahead[0].mul_add(ahead[0], ahead[1] * ahead[1]).sqrt().max(T::lit(1e-6)).recip();
        let [c, d] = [ahead[0] * length, ahead[1] * length];
        let forward = c.mul_add(velocity[0], d * velocity[1]) - self.commanded(s, 0);
        let left = c.mul_add(velocity[1], -(d * velocity[0])) - self.commanded(s, 1);
        let turn = r.body_angular_velocity(self.rig.body)[2] - self.commanded(s, 2);
        [forward.mul_add(forward, left * left).sqrt(), turn]
    }

    /// Place and velocity of a point of a body.
    #[inline(always)]
    fn sole<T: Real>(&self, s: &Senses<T>, body: usize, at: &[f64; 3]) -> ([T; 3], [T; 3]) {
        let r = s.readings();
        let (pos, axes) = (r.body_pos(body), r.body_axes(body));
        let (velocity, spin) = (r.body_velocity(body), r.body_angular_velocity(body));
        let mut arm = [T::zero(); 3];
        for (k, arm) in arm.iter_mut().enumerate() {
            *arm = axes[0][k].mul_add(T::lit(at[0]), axes[1][k].mul_add(T::lit(at[1]), axes[2][k] * T::lit(at[2])));
        }
        let moves = [
            velocity[0] + spin[1].mul_add(arm[2], -(spin[2] * arm[1])),
            velocity[1] + spin[2].mul_add(arm[0], -(spin[0] * arm[2])),
            velocity[2] + spin[0].mul_add(arm[1], -(spin[1] * arm[0])),
        ];
        ([pos[0] + arm[0], pos[1] + arm[1], pos[2] + arm[2]], moves)
    }
}
