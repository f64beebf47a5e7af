//! Marathon Man told where to go: he walks, runs, turns and stands at a commanded speed and turn, in the style of clips.
//!
//! | observation | content |
//! |---|---|
//! | 0..2 | commanded speed, m/s, and turn, rad/s |
//! | 2..4 | sine and cosine of the angle from his heading to the commanded direction |
//! | 4..6 | target velocity, m/s |
//! | 6 | height of the butt, m |
//! | 7..13 | forward and up axis of the butt |
//! | 13..19 | velocity of the butt, m/s, and its angular velocity, rad/s |
//! | 19..40, 40..61 | angles of the 21 joints, rad, and their velocities, rad/s |
//! | 61..73 | feet and hands as seen from the butt, m |
//! | 73..79 | toe, toe and heel of the right and of the left foot on the ground, 0 or 1 |
//! | 79..82 | pace, m/s, cosine and sine of the gait's phase |
//! | 82..103 | how far the gait's next angles are from his own, rad |
//!
//! Vectors are in his heading, the direction along the ground in which the butt faces. The commanded direction turns as the
//! command says; where he cannot follow, it stays within [`MOST_BEHIND`] of his heading. The target velocity follows the commanded
//! one as fast as a person can.
//!
//! No clip leads him through the world. His [gait](super::gait) goes round as fast as his pace asks for, and the pace follows the
//! target velocity. An action of `pd` is a deviation from the gait.
//!
//! The task's reward is for velocity, heading and the gait. The style comes from a discriminator that learns from his clips
//! ([`STYLE`]): the task's [demonstrations](crate::ShardFactory::demonstrations) are what he would observe in them.

use std::f64::consts::{FRAC_PI_2, TAU};
use std::sync::LazyLock;

use marathon_physics::Model;
use marathon_physics::lanes::Real;

use super::super::controller::stillness;
use super::super::heading;
use super::super::imitation::{EARLY, StartAt, observe_body, sub, turned_to};
use super::super::relive::Relive;
use super::body::{
    ACTIONS, ANATOMY, BUTT, Control, DAMPING_TIME, END_EFFECTORS, FEET, FIRST_QPOS, JOINTS, PARTS, TOUCH, model, parts,
};
use super::clips::{self, STAND};
use super::gait::{beginning, gaits};
use super::{DECISION, FRAME_SKIP, SECONDS, decisions, observe_soles};
use crate::agent::options::Choice;
use crate::agent::senses::{clamp, hypot};
use crate::agent::{
    Agent, CommandRange, Ctrl, Facts, Following, Obs, OptionInfo, OptionSet, Options, ResetNoise, Scale, Seconds,
    Senses, Share, Start, Terms, names,
};
use crate::episode_rng::EpisodeRng;

/// Parts of the observation that tell style.
pub const STYLE: [&str; 7] =
    ["height", "orientation", "velocity", "angular_velocity", "joint_positions", "joint_velocities", "ends"];
/// What he moves like.
pub(super) const CLIPS: [&str; 5] = ["walk", "walk_left", "walk_right", "run", STAND];
/// Parts of the observation, in their order.
pub(super) const OBSERVED: [&str; 11] = [
    "command",
    "height",
    "orientation",
    "velocity",
    "angular_velocity",
    "joint_positions",
    "joint_velocities",
    "ends",
    "touch",
    "gait",
    "next_pose",
];
/// Terms of the reward.
pub(super) const TERMS: [&str; 7] = ["velocity", "pace", "drift", "heading", "gait", "tempo", "still"];
/// Number of the clip in which he stands.
const STANDS: usize = 4;
/// Numbers that he observes.
pub(super) const OBSERVATION: usize = 82 + JOINTS.len();
/// Fastest that he is told to go, m/s.
pub(super) const FASTEST: f64 = 3.0;
/// Sharpest that he is told to turn, rad/s.
pub(super) const SHARPEST: f64 = FRAC_PI_2;
/// Most that the commanded direction is off his heading, rad.
pub const MOST_BEHIND: f64 = 1.0;
/// How long a command holds, decisions.
pub(super) const HOLDS: [usize; 2] = [40, 240];
/// Share of `sharp` commands that are to rest, and how long they hold, decisions: who is told to stand for a second only never comes
/// to rest.
const RESTING: f64 = 0.2;
const RESTS: [usize; 2] = [80, 240];
/// Share of commands that are to stand, and of those that are to go straight on.
const STANDING: f64 = 0.15;
const STRAIGHT: f64 = 0.4;
/// Speeds from this share of the fastest on are extremes.
const EXTREME: f64 = 0.7;

/// Slots of the memory: cosine and sine of the commanded direction.
pub(super) const DIRECTION: usize = Following::SLOTS;
/// Slots of the velocity along the ground that he is to have now, m/s.
pub(super) const TARGET: usize = DIRECTION + 2;
/// Slots of the gait: the share of its cycle that is over, and the speed that it is for, m/s.
pub(super) const PHASE: usize = TARGET + 2;
pub(super) const PACE: usize = PHASE + 1;
/// Slots that count the episode's decisions, and that hold the row of the clips where it started.
const MADE: usize = PACE + 1;
pub(super) const BEGUN: usize = MADE + 1;
/// What leads the steered figure.
const HASTE: Haste =
    Haste { speeding: 4.0, slowing: 4.0, urging: 0.0, lead: 0.8, quick: false, turning: 0.4, least: 0.0 };
/// He slows down where he is told to be slower than his target by more than this, m/s: a turn bends the target, too.
const SLOWER: f64 = 0.3;
/// Most that a turn accelerates the target to the side, m/s^2: who turns sharply, runs slowly.
const SIDEWAYS: f64 = 2.5;
/// Most that the commanded direction asks him to accelerate to the side, m/s^2, while he is still faster than that.
const LEANING: f64 = 3.0;
/// Mean squares of the parts' velocities at which each half of what standing still is worth is down to 1/e, m^2/s^2: who shuffles is
/// to come to rest, and who rests to keep quite still.
const RESTLESS: [f64; 2] = [0.1, 0.01];
/// Most that the target aims beyond the command, m/s, and the least command for which it does.
const URGED: f64 = 0.5;
const URGES: f64 = 0.05;
/// The least pace is at most this many times the velocity that he is told, so that it fades where he is told hardly anything.
const LEAST_OF_TOLD: f64 = 4.0;

/// How fast what leads him changes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Haste {
    /// Most that the target velocity and the pace change, m/s^2.
    pub speeding: f64,
    /// The same while he slows down.
    pub slowing: f64,
    /// Where he is told to go, the target aims beyond the command by this share of what his velocity lacks, but by [`URGED`] at most, and
    /// never beyond [`FASTEST`]: he comes near a command at once, and takes as long again for the rest.
    pub urging: f64,
    /// Most that the pace is off his speed, m/s: a run does not lead who stands.
    pub lead: f64,
    /// The gait goes round as fast as for the target velocity, if that is faster than the pace: he starts with short, quick steps.
    pub quick: bool,
    /// Pace for a turn on the spot: that of a walk on a circle of this radius, m.
    pub turning: f64,
    /// Least pace where he is told to go or turn, m/s: the feet of a slower gait hardly leave the ground, and he stumbles over them.
    pub least: f64,
}

impl Haste {
    /// The speed whose steps are as quick as his are to be, m/s.
    #[inline(always)]
    pub fn cadence<T: Real>(self, memory: impl Fn(usize) -> T) -> T {
        let pace = memory(PACE);
        if self.quick { pace.max(hypot(memory(TARGET), memory(TARGET + 1))) } else { pace }
    }
}

/// What Marathon Man is told where nobody commands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Commands {
    /// Speeds and turns, each as likely.
    Even,
    /// Half of the time, shorter, the extremes: to stand, to run, and the sharpest turns; and rests.
    Sharp,
}

impl Choice for Commands {
    const EXPECTED: &'static str = "even or sharp";
    const NAMED: &'static [(Self, &'static str)] = &[(Commands::Even, "even"), (Commands::Sharp, "sharp")];
}

crate::options! {
    /// Arguments of Marathon Man told where to go.
    pub struct SteerArguments {
        /// What an action does: `pd` moves the target of a servo away from the gait's next pose, `pd_range` is the target within
        /// the joint's range, `torque` a share of the motor's strength, `servo` the target velocity of the original's drive.
        control: Control = Control::Pd,
        /// Most that an action of `pd` moves a target, rad.
        reach: Scale = Scale(1.0),
        /// Where an episode starts: at `random` decisions of the clips, standing: `first`, or `adaptive`: half of those that
        /// follow an early failure where that episode did, half of the others in a clip that fits the command.
        start: StartAt = StartAt::Random,
        /// What he is told where nobody commands: anything, `even`, or half of the time the extremes, `sharp`.
        commands: Commands = Commands::Even,
        /// What a fall costs.
        price: Scale = Scale(0.0),
        /// Share of the episodes that start 0.75 to 1.5 s before the last fall, once there is one: learners come to do better what
        /// felled them.
        relive: Share = Share(0.0),
        /// How long an episode is at most, s: the shorter, the more of them follow a fall.
        seconds: Seconds = Seconds(SECONDS),
    }
}

/// Where in the cycle of each clip the gait begins.
fn beginnings() -> &'static [f64; CLIPS.len()] {
    static BEGINNINGS: LazyLock<[f64; CLIPS.len()]> =
        LazyLock::new(|| CLIPS.map(|name| clips::shipped(name).map_or(0.0, |clip| beginning(&clip))));
    &BEGINNINGS
}

/// The clip in which someone moves most nearly as told.
fn fitting_clip(command: &[f64]) -> usize {
    let name = match (command[0], command[1]) {
        (speed, _) if speed > 2.0 => "run",
        (speed, turn) if speed < 0.4 && turn == 0.0 => STAND,
        (_, turn) if turn > 0.3 => "walk_left",
        (_, turn) if turn < -0.3 => "walk_right",
        _ => "walk",
    };
    CLIPS.iter().position(|clip| *clip == name).unwrap_or(0)
}

/// Marathon Man told where to go.
#[derive(Clone, Debug)]
pub struct Steer {
    pub(super) arguments: SteerArguments,
    pub(super) relive: Relive,
}

impl Default for Steer {
    fn default() -> Self {
        Self::of(SteerArguments::default(), BEGUN + 1)
    }
}

impl Steer {
    /// `relived`: the first variable of the falls that are lived again.
    pub(super) fn of(arguments: SteerArguments, relived: usize) -> Self {
        let relive = Relive {
            slot: relived,
            share: arguments.relive.0,
            joints: [FIRST_QPOS, FIRST_QPOS - 1].map(|first| first + JOINTS.len()),
            places: 2,
            also: Some(PHASE),
        };
        Steer { arguments, relive }
    }

    /// Angle from his heading to a direction, rad.
    #[inline(always)]
    pub(super) fn off<T: Real>(s: &Senses<T>, direction: [T; 2]) -> T {
        heading::off(s.heading(BUTT), direction)
    }

    /// Commanded direction.
    #[inline(always)]
    pub(super) fn direction<T: Real>(s: &Senses<T>) -> [T; 2] {
        [s.memory(DIRECTION), s.memory(DIRECTION + 1)]
    }

    /// How fast the center of mass moves along the ground, m/s.
    #[inline(always)]
    pub(super) fn speed<T: Real>(s: &Senses<T>) -> T {
        let [x, y, _] = s.center_of_mass_velocity();
        hypot(x, y)
    }

    /// Mean squares of the joints' distances from the gait, rad^2, and of the differences of their velocities from the gait's,
    /// rad^2/s^2, by DeepMimic's weights.
    #[inline(always)]
    fn out_of_step<T: Real>(s: &Senses<T>) -> [T; 2] {
        let (gaits, r) = (gaits(), s.readings());
        let [phase, pace] = [PHASE, PACE].map(|slot| s.memory(slot));
        // angles lead by their velocity times the lead, so a lead of 1 s gives the velocity
        let (now, led) = (gaits.moment(phase, pace, 0.0), gaits.moment(phase, pace, 1.0));
        let (mut sums, mut total) = ([T::zero(); 2], 0.0);
        for (i, joint) in JOINTS.iter().enumerate() {
            let angle = gaits.angle(&now, i);
            let off = [r.qpos(FIRST_QPOS + i) - angle, r.qvel(FIRST_QPOS - 1 + i) - (gaits.angle(&led, i) - angle)];
            for (sum, off) in sums.iter_mut().zip(off) {
                *sum = (off * off).mul_add(T::lit(joint.weight), *sum);
            }
            total += joint.weight;
        }
        sums.map(|sum| sum * T::lit(1.0 / total))
    }

    /// Where the gait will be after `dt` seconds.
    #[inline(always)]
    fn next_phase<T: Real>(phase: T, cadence: T, dt: f64) -> T {
        let next = gaits().frequency(cadence).mul_add(T::lit(dt), phase);
        next - next.floor()
    }

    /// Moves the commanded direction, the target velocity and the gait on by a decision, for velocities ahead and to the left, and
    /// a turn.
    #[inline(always)]
    pub(super) fn lead<T: Real>(s: &Senses<T>, memory: &mut [T], [told, left]: [T; 2], turn: T, haste: Haste) {
        let speed = Self::speed(s);
        // the direction turns no faster than someone of his speed can
        let sharpest = T::lit(LEANING).div(speed.max(T::lit(LEANING / SHARPEST)));
        let led = turn.max(-sharpest).min(sharpest);
        let by = |angle: T| led.mul_add(T::lit(s.dt()), angle);
        let direction = [memory[DIRECTION], memory[DIRECTION + 1]];
        let direction = heading::turned(s.heading(BUTT), direction, by, MOST_BEHIND);
        memory[DIRECTION..DIRECTION + 2].copy_from_slice(&direction);
        memory[PHASE] = Self::next_phase(memory[PHASE], haste.cadence(|slot| memory[slot]), s.dt());
        memory[MADE] += T::lit(1.0);
        // nobody changes a velocity of 3 m/s at once, or turns sharply at it
        let [speeding, slowing] = [haste.speeding, haste.slowing].map(|rate| T::lit(rate * s.dt()));
        let sharpest = T::lit(SIDEWAYS).div(turn.abs().max(T::lit(SIDEWAYS / FASTEST)));
        let told = told.min(sharpest);
        let slows = told.lt(hypot(memory[TARGET], memory[TARGET + 1]) - T::lit(SLOWER));
        let most = T::select(slows, slowing, speeding);
        let beside = [-(left * direction[1]), left * direction[0]];
        let short_of_told = |i: usize, velocity: T| told.mul_add(direction[i], -velocity) + beside[i];
        let [x, y, _] = s.center_of_mass_velocity();
        let lacks = [short_of_told(0, x), short_of_told(1, y)];
        // nobody is urged to go faster than he knows, and whoever stands is left in peace
        let asked = hypot(told, left);
        let most_urged = clamp(T::lit(FASTEST) - asked, 1e-6, URGED);
        let urging = T::masked(T::lit(URGES).lt(asked), T::lit(haste.urging));
        let urging = urging * most_urged.div((hypot(lacks[0], lacks[1]) * urging).max(most_urged));
        let missing = [0, 1].map(|i| lacks[i].mul_add(urging, short_of_told(i, memory[TARGET + i])));
        let share = most.div(hypot(missing[0], missing[1]).max(most));
        for i in 0..2 {
            memory[TARGET + i] = missing[i].mul_add(share, memory[TARGET + i]);
        }
        let turning = turn.abs() * T::lit(haste.turning);
        let least = (asked.max(turning) * T::lit(LEAST_OF_TOLD)).min(T::lit(haste.least));
        let pace = hypot(memory[TARGET], memory[TARGET + 1]).max(turning).max(least);
        let pace = speed + clamp(pace - speed, -haste.lead, haste.lead);
        memory[PACE] += (pace - memory[PACE]).max(-slowing).min(speeding);
    }

    /// Adds the terms of the reward for the velocity where `moves`, for none beside it where `holds`, and for the direction, the gait and
    /// stillness where `goes`. `told`: how much he is told to go or turn, 0 if he is to stand.
    #[inline(always)]
    pub(super) fn add_terms<T: Real>(s: &Senses<T>, [moves, holds, goes]: [T::Mask; 3], told: T, terms: &mut Terms<T>) {
        let slip = Self::slip(s, [s.memory(TARGET), s.memory(TARGET + 1)]);
        let angle = Self::off(s, Self::direction(s));
        let [pose, tempo] = Self::out_of_step(s);
        let mut add = |name, weight, counts, x: T| terms.add(name, weight, T::masked(counts, x.exp()));
        add("velocity", 0.3, moves, slip * slip * T::lit(-5.0));
        add("pace", 0.2, moves, slip * slip * T::lit(-0.5));
        add("drift", 0.05, holds, slip * slip * T::lit(-100.0));
        add("heading", 0.2, goes, angle * angle * T::lit(-4.0));
        add("gait", 0.2, goes, pose * T::lit(-5.0));
        add("tempo", 0.05, goes, tempo * T::lit(-1.0));
        let rest = T::and(goes, told.lt(T::lit(0.01)));
        let [shuffles, stirs] = stillness(s, PARTS.len(), RESTLESS);
        terms.add("still", 0.3, T::masked(rest, shuffles + stirs));
    }

    /// What he observes of the command, of himself and of what leads him, with vectors seen from a direction along the ground.
    /// `told`: the commanded speed and turn. `next`: the next angle of a hinge, given the gait's.
    /// `haste`: what leads him.
    #[inline(always)]
    pub(super) fn observe_going<T: Real>(
        s: &Senses<T>,
        facing: [T; 2],
        told: [T; 2],
        next: impl Fn(usize, T) -> T,
        haste: Haste,
        out: &mut Obs<T>,
    ) {
        let turned = turned_to(facing);
        out.group("command");
        for x in told {
            out.scalar(x);
        }
        for x in heading::beside(facing, Self::direction(s)) {
            out.scalar(x);
        }
        let [x, y, _] = turned([s.memory(TARGET), s.memory(TARGET + 1), T::zero()]);
        out.scalar(x);
        out.scalar(y);
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
        let gait = Self::next_pose(|slot| s.memory(slot), haste, s.dt(), 0.0);
        out.group("next_pose");
        for i in 0..JOINTS.len() {
            out.scalar(next(i, gait(i)) - s.readings().qpos(FIRST_QPOS + i));
        }
    }

    /// How much he is told to go and turn.
    #[inline(always)]
    pub(super) fn told<T: Real>(s: &Senses<T>) -> T {
        s.command(0).abs() + s.command(1).abs()
    }

    /// What he observes where nothing but the gait leads him: vectors are in his heading.
    #[inline(always)]
    pub(super) fn observe_along<T: Real>(s: &Senses<T>, out: &mut Obs<T>) {
        let told = [s.command(0), s.command(1)];
        Self::observe_going(s, s.heading(BUTT), told, |_, of_gait| of_gait, HASTE, out);
    }

    /// Angles of the gait's next pose, led by some seconds.
    #[inline(always)]
    pub(super) fn next_pose<T: Real>(
        memory: impl Fn(usize) -> T,
        haste: Haste,
        dt: f64,
        lead: f64,
    ) -> impl Fn(usize) -> T {
        let gaits = gaits();
        let (phase, pace) = (memory(PHASE), memory(PACE));
        let next = gaits.moment(Self::next_phase(phase, haste.cadence(memory), dt), pace, lead);
        move |joint| gaits.angle(&next, joint)
    }

    /// How far the velocity of the center of mass along the ground is from another, m/s.
    #[inline(always)]
    pub(super) fn slip<T: Real>(s: &Senses<T>, [x, y]: [T; 2]) -> T {
        let [vx, vy, _] = s.center_of_mass_velocity();
        hypot(vx - x, vy - y)
    }
}

impl Agent for Steer {
    fn facts(&self) -> Facts {
        Facts {
            id: "MarathonManSteer-v0".into(),
            summary: "a figure of 21 motors: walk, run, turn and stand as told, in the style of clips".into(),
            model: model(self.arguments.control).into(),
            frame_skip: FRAME_SKIP,
            max_episode_steps: decisions(self.arguments.seconds),
            observation: Some(OBSERVATION),
            actions: names(ACTIONS.map(|i| JOINTS[i].name)),
            reward_terms: names(TERMS),
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
            memory: self.relive.memory(),
            termination_reward: (self.arguments.price.0 > 0.0).then_some(-self.arguments.price.0),
            ..Facts::default()
        }
    }

    fn options(&self) -> Vec<OptionInfo> {
        self.arguments.infos()
    }

    fn with_options(&self, options: &Options) -> Option<Self> {
        Some(Self::of(self.arguments.with(options), self.relive.slot))
    }

    fn fits(&self, model: &Model) -> Result<(), String> {
        super::has_joints(model)
    }

    fn reset(&self, start: &mut Start) {
        self.relive.carry(start);
        let adaptive = self.arguments.start == StartAt::Adaptive;
        let [made, begun] = [MADE, BEGUN].map(|slot| start.previous[slot]);
        let early = made > 0.0 && made * DECISION < EARLY;
        let row = if adaptive && early && start.random.whole(0, 1) == 0 {
            begun as usize
        } else {
            let fitting = adaptive && start.random.whole(0, 1) == 0;
            let clip = match self.arguments.start {
                StartAt::First => STANDS,
                _ if fitting => fitting_clip(start.scheduled),
                _ => start.random.whole(0, CLIPS.len() - 1),
            };
            let rows = start.clips().nth(clip).expect("a row of clips for each clip");
            start.random.whole(rows.start, rows.end - 1)
        };
        let clip = start.clips().position(|rows| rows.contains(&row)).expect("the row is a clip's");
        start.start_in_clip(row);
        start.memory[PHASE] = (start.phase(row) - beginnings()[clip]).rem_euclid(1.0);
        start.memory[BEGUN] = row as f64;
        self.relive.start(start);
        start.add_noise(ResetNoise::MARATHON);
    }

    fn command(&self, random: &mut EpisodeRng, _: usize, out: &mut [f64]) -> usize {
        let sharp = self.arguments.commands == Commands::Sharp;
        if sharp && random.uniform(0.0, 1.0) < RESTING {
            out.fill(0.0);
            return random.whole(RESTS[0], RESTS[1]);
        }
        if sharp && random.whole(0, 1) == 0 {
            out[0] = [0.0, FASTEST, random.uniform(EXTREME * FASTEST, FASTEST)][random.whole(0, 2)];
            out[1] = [0.0, SHARPEST, -SHARPEST, random.around_zero(SHARPEST)][random.whole(0, 3)];
            return random.whole(HOLDS[0], HOLDS[1] / 2);
        }
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
                let next = Self::next_pose(|slot| c.memory[slot], HASTE, c.dt, DAMPING_TIME);
                for (i, joint) in ACTIONS.into_iter().enumerate() {
                    c.ctrl[i] = c.action[i].mul_add(reach, next(joint));
                }
            }
        }
    }

    #[inline(always)]
    fn begin<T: Real>(&self, s: &Senses<T>, memory: &mut [T]) {
        memory[DIRECTION..DIRECTION + 2].copy_from_slice(&s.heading(BUTT));
        let [x, y, _] = s.center_of_mass_velocity();
        memory[TARGET..TARGET + 2].copy_from_slice(&[x, y]);
        memory[PACE] = hypot(x, y).min(T::lit(FASTEST));
    }

    #[inline(always)]
    fn remember<T: Real>(&self, s: &Senses<T>, memory: &mut [T]) {
        Self::lead(s, memory, [s.command(0), T::zero()], s.command(1), HASTE);
        self.relive.remember(s, memory, |_| {
            let felled = on_the_ground(s);
            [T::not(felled), felled]
        });
    }

    #[inline(always)]
    fn observe<T: Real>(&self, s: &Senses<T>, out: &mut Obs<T>) {
        Self::observe_along(s, out);
    }

    #[inline(always)]
    fn step_reward<T: Real>(&self, s: &Senses<T>, terms: &mut Terms<T>) {
        Self::add_terms(s, [T::not(T::none()); 3], Self::told(s), terms);
    }

    #[inline(always)]
    fn terminated<T: Real>(&self, s: &Senses<T>) -> T::Mask {
        on_the_ground(s)
    }

    #[inline(always)]
    fn info<T: Real>(&self, s: &Senses<T>, out: &mut Obs<T>) {
        let direction = Self::direction(s);
        out.scalar(Self::slip(s, direction.map(|x| x * s.command(0))));
        let angle = Self::off(s, direction);
        out.scalar(angle.abs());
    }
}

/// Lanes in which anything but his feet touched the ground.
#[inline(always)]
pub(super) fn on_the_ground<T: Real>(s: &Senses<T>) -> T::Mask {
    let mut fallen = T::none();
    for part in parts() {
        if part != FEET[0] && part != FEET[1] {
            fallen = T::or(fallen, s.touched_ground(part));
        }
    }
    fallen
}
