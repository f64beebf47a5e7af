//! Marathon Man steered: it walks, runs, turns and stands at a commanded speed and turn rate, in the style of motion
//! clips.
//!
//! | observation | content |
//! |---|---|
//! | 0..2 | commanded speed, m/s, and turn rate, rad/s |
//! | 2..4 | sine and cosine of the angle from the heading to the commanded direction |
//! | 4..6 | target velocity, m/s |
//! | 6 | height of the butt, m |
//! | 7..13 | forward and up axis of the butt |
//! | 13..19 | velocity of the butt, m/s, and its angular velocity, rad/s |
//! | 19..40, 40..61 | angles of the 21 joints, rad, and their velocities, rad/s |
//! | 61..73 | feet and hands relative to the butt, m |
//! | 73..79 | ground contact of toe, toe and heel of the right and of the left foot, 0 or 1 |
//! | 79..82 | pace, m/s, cosine and sine of the gait's phase |
//! | 82..103 | the gait's next joint angles minus the character's own, rad |
//!
//! Vectors are expressed in the heading: the ground direction in which the butt faces.
//!
//! # Mechanism
//!
//! A command passes through three reference signals, updated once per decision by `Guide::lead`:
//!
//! 1. The *commanded direction* turns at the commanded rate. It stays within [`MAX_HEADING_LAG`] of the heading, so it
//!    waits for a character that cannot follow.
//! 2. The *target velocity* moves toward the commanded velocity with a limited acceleration.
//! 3. The *pace* is the speed for which the [gait](super::gait) is generated. It follows the target speed and stays
//!    near the body's own speed. The pace sets how fast the gait's phase advances.
//!
//! The gait is a periodic reference pose. No clip prescribes where the character is. An action of `pd` is a deviation
//! from the gait's next pose.
//!
//! The task's reward covers velocity, heading and gait. The style comes from a discriminator trained on the clips (AMP;
//! [`STYLE`]). The task's [demonstrations](crate::ShardFactory::demonstrations) are the observations that the clips
//! would produce.

mod signals;

use std::f64::consts::{FRAC_PI_2, TAU};
use std::path::Path;
use std::sync::{Arc, LazyLock};

use marathon_physics::Model;
use marathon_physics::lanes::Real;

use super::super::controller::stillness;
use super::super::fall_replay::FallReplay;
use super::super::heading;
use super::super::imitation::{EARLY, StartAt, observe_body, sub, turned_to};
use super::body::{
    ACTIONS, ANATOMY, BUTT, Control, DAMPING_TIME, END_EFFECTORS, FEET, FIRST_QPOS, JOINTS, PARTS, TOUCH, model, parts,
    set_targets,
};
use super::clips::{self, STAND};
use super::gait::{Footwork, Gaits, beginning, gaits};
use super::{DECISION, FRAME_SKIP, SECONDS, decisions, observe_soles};
use crate::agent::options::Choice;
use crate::agent::senses::{clamp, hypot};
use crate::agent::{
    Agent, Clips, CommandRange, Ctrl, Facts, Following, Obs, OptionInfo, OptionSet, Options, ResetNoise, Scale,
    Seconds, Senses, Share, Start, Terms, names,
};
use crate::episode_rng::EpisodeRng;

/// Parts of the observation that the style discriminator uses.
pub const STYLE: [&str; 7] =
    ["height", "orientation", "velocity", "angular_velocity", "joint_positions", "joint_velocities", "ends"];
/// Clips that define the style.
pub(super) const CLIPS: [&str; 5] = ["walk", "walk_left", "walk_right", "run", STAND];
/// Parts of the observation, in order.
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
/// Index of the standing clip.
const STANDS: usize = 4;
/// Size of the observation.
pub(super) const OBSERVATION: usize = 82 + JOINTS.len();
/// Highest commanded speed, m/s.
pub(super) const MAX_SPEED: f64 = 3.0;
/// Highest commanded turn rate, rad/s.
pub(super) const MAX_TURN: f64 = FRAC_PI_2;
/// Largest angle between the commanded direction and the heading, rad.
pub const MAX_HEADING_LAG: f64 = 1.0;
/// Shortest and longest duration of a command, decisions.
pub(super) const HOLDS: [usize; 2] = [40, 240];
/// Fraction of `sharp` commands that are to stand, and their shortest and longest duration, decisions. After a stop
/// command of only a second, the character would never come to rest.
const RESTING: f64 = 0.2;
const RESTS: [usize; 2] = [80, 240];
/// Fraction of commands that are to stand.
const STANDING: f64 = 0.15;
/// Fraction of commands without a turn.
const STRAIGHT: f64 = 0.4;
/// Extreme speeds start at this fraction of the highest one.
const EXTREME: f64 = 0.7;

/// Slots of the memory: cosine and sine of the commanded direction.
pub(super) const DIRECTION: usize = Following::SLOTS;
/// Slots of the target velocity along the ground, m/s.
pub(super) const TARGET: usize = DIRECTION + 2;
/// Slot of the gait's phase, the completed fraction of its cycle.
pub(super) const PHASE: usize = TARGET + 2;
/// Slot of the pace, the speed for which the gait is generated, m/s.
pub(super) const PACE: usize = PHASE + 1;
/// Slot that counts the episode's decisions.
const DECISIONS: usize = PACE + 1;
/// Slot of the clip row in which the episode started.
pub(super) const START_ROW: usize = DECISIONS + 1;
/// Rates and limits of the steered task.
const PACE_LIMITS: PaceLimits = PaceLimits {
    acceleration: 4.0,
    deceleration: 4.0,
    overshoot: 0.0,
    max_lead: 0.8,
    quick_steps: false,
    turn_radius: 0.4,
    min_pace: 0.0,
    footwork: None,
};
/// The deceleration limit applies when the command is slower than the target by more than this, m/s. Turning changes
/// the target velocity too.
const SLOWING_MARGIN: f64 = 0.3;
/// Largest lateral acceleration of the target in a turn, m/s^2. It caps the target speed in sharp turns.
const MAX_TURN_ACCELERATION: f64 = 2.5;
/// Largest lateral acceleration that a turning commanded direction implies at the body's own speed, m/s^2. It slows the
/// turn down while the body is still too fast.
const MAX_HEADING_ACCELERATION: f64 = 3.0;
/// Mean squares of the parts' velocities at which the two halves of the `still` term drop to 1/e, m^2/s^2. The first
/// half rewards coming to rest, the second rewards keeping still.
const STILLNESS_SCALES: [f64; 2] = [0.1, 0.01];
/// Largest overshoot of the target beyond the command, m/s.
const MAX_OVERSHOOT: f64 = 0.5;
/// Smallest command that is overshot, m/s.
const MIN_OVERSHOT_COMMAND: f64 = 0.05;
/// Slots of a gait's footwork: stride, velocity to the left, m/s, and turn rate, rad/s.
pub(super) const FOOTWORK_SLOTS: usize = 3;
/// Cadence of a step to a side, as the speed of a walk, per velocity to the side. Short, quick steps keep the feet from
/// crossing.
const CADENCE_ASIDE: f64 = 2.5;
/// Largest change rate of the turn that the gait shows, rad/s^2.
const MAX_TWIST_RATE: f64 = 8.0;
/// Upper limit of the least pace, as a multiple of the commanded velocity. The least pace fades out with small
/// commands.
const MIN_PACE_PER_COMMAND: f64 = 4.0;

/// Rates and limits of the reference signals: target velocity, pace and gait.
#[derive(Clone, Copy, Debug)]
pub(super) struct PaceLimits {
    /// Largest rate of change of the target velocity and the pace, m/s^2.
    pub acceleration: f64,
    /// The same while slowing down, m/s^2.
    pub deceleration: f64,
    /// Overshoot of the target beyond a command to move, as a fraction of the velocity error. It is at most [`MAX_OVERSHOOT`],
    /// and the target never exceeds [`MAX_SPEED`]. Without it, the body gets close to a command quickly and takes as long
    /// again for the rest.
    pub overshoot: f64,
    /// Largest difference between the pace and the body's speed, m/s. A standing body must not be driven by a running
    /// gait.
    pub max_lead: f64,
    /// Whether the gait cycles at the rate of the target speed if that exceeds the pace. The character then starts with
    /// short, quick steps.
    pub quick_steps: bool,
    /// Pace of a turn on the spot, given as the radius of a circle that is walked at the same turn rate, m.
    pub turn_radius: f64,
    /// Least pace under a command to move or turn, m/s. A slower gait hardly lifts the feet, and the character
    /// stumbles.
    pub min_pace: f64,
    /// First slot of the gait's [footwork](Footwork), `FOOTWORK_SLOTS` of them. Without it, all gaits lead straight on.
    pub footwork: Option<usize>,
}

/// Reference signals of a commanded character.
#[derive(Clone, Debug)]
pub(super) struct Guide {
    pub limits: PaceLimits,
    pub gaits: Arc<Gaits>,
}

impl Guide {
    /// The speed whose step frequency the gait uses, m/s.
    #[inline(always)]
    pub fn cadence<T: Real>(&self, memory: impl Fn(usize) -> T) -> T {
        let (limits, pace) = (self.limits, memory(PACE));
        let pace = if limits.quick_steps { pace.max(hypot(memory(TARGET), memory(TARGET + 1))) } else { pace };
        limits.footwork.map_or(pace, |slot| pace.max(memory(slot + 1).abs() * T::lit(CADENCE_ASIDE)))
    }

    /// The gait's footwork.
    #[inline(always)]
    pub fn footwork<T: Real>(&self, memory: impl Fn(usize) -> T) -> Footwork<T> {
        let Some(slot) = self.limits.footwork else { return Footwork::straight() };
        let [stride, left, turn] = [0, 1, 2].map(|i| memory(slot + i));
        Footwork::new(stride, left, turn, self.gaits.frequency(self.cadence(memory)))
    }
}

/// How commands are drawn when no caller sets them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Commands {
    /// Speeds and turns are drawn uniformly.
    Even,
    /// Adds long stops. Half of the other commands are shorter and extreme: stand, run, and the sharpest turns.
    Sharp,
}

impl Choice for Commands {
    const EXPECTED: &'static str = "even or sharp";
    const NAMED: &'static [(Self, &'static str)] = &[(Commands::Even, "even"), (Commands::Sharp, "sharp")];
}

crate::options! {
    /// Arguments of the steered task.
    pub struct SteerArguments {
        /// Meaning of an action: `pd` offsets a servo's target from the gait's next pose; `pd_range` sets the target
        /// within the joint's range; `torque` is a fraction of the motor's strength; `servo` sets the target velocity
        /// of the original's drive.
        control: Control = Control::Pd,
        /// Largest offset of a servo's target by an action of `pd`, rad.
        action_scale: Scale = Scale(1.0),
        /// Largest angle of a servo's target by `pd`, rad. With 1, it cannot bend a hip or a knee by more than about 60 degrees.
        max_target: Scale = Scale(3.0),
        /// Start of an episode: `random` decisions of the clips, `first` (standing), or `adaptive`. With `adaptive`,
        /// half of the episodes after an early failure start where the failed one did. Half of the others start in a
        /// clip that fits the command.
        start: StartAt = StartAt::Random,
        /// Commands that are drawn when no caller sets them: `even` (uniform), or `sharp` (half of them extreme).
        commands: Commands = Commands::Even,
        /// Penalty of a fall.
        fall_penalty: Scale = Scale(0.0),
        /// Fraction of training episodes that start 0.75 to 1.5 s before the last fall, once there is one. They let the
        /// policy practice what made it fall.
        replay_falls_prob: Share = Share(0.0),
        /// Longest episode, s. With shorter episodes, more of them follow a fall.
        seconds: Seconds = Seconds(SECONDS),
        /// Looping clip that the gait at a walk is made from.
        walk: Clips = Clips::named("walk"),
        /// The same at a run.
        run: Clips = Clips::named("run"),
    }
}

/// Phase of each clip's cycle at which the gait's cycle begins.
fn beginnings() -> &'static [f64; CLIPS.len()] {
    static BEGINNINGS: LazyLock<[f64; CLIPS.len()]> =
        LazyLock::new(|| CLIPS.map(|name| clips::shipped(name).map_or(0.0, |clip| beginning(&clip))));
    &BEGINNINGS
}

/// The clip whose motion is closest to a command.
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

/// The steered Marathon Man.
#[derive(Clone, Debug)]
pub struct Steer {
    pub(super) arguments: SteerArguments,
    pub(super) guide: Guide,
    pub(super) fall_replay: FallReplay,
}

impl Default for Steer {
    fn default() -> Self {
        Self::of(SteerArguments::default(), PACE_LIMITS, START_ROW + 1)
    }
}

impl Steer {
    /// `relived`: the first memory slot of the replayed falls.
    pub(super) fn of(arguments: SteerArguments, limits: PaceLimits, relived: usize) -> Self {
        // `fits` reports clips that are no gaits
        let gaits = Self::gaits(&arguments).unwrap_or_else(|_| gaits().clone());
        let fall_replay = FallReplay {
            slot: relived,
            share: arguments.replay_falls_prob.0,
            joints: [FIRST_QPOS, FIRST_QPOS - 1].map(|first| first + JOINTS.len()),
            places: 2,
            also: Some(PHASE),
        };
        Steer { arguments, guide: Guide { limits, gaits }, fall_replay }
    }

    /// The gaits of the arguments' clips.
    fn gaits(arguments: &SteerArguments) -> Result<Arc<Gaits>, String> {
        let ours = SteerArguments::default();
        if (&arguments.walk, &arguments.run) == (&ours.walk, &ours.run) {
            return Ok(gaits().clone());
        }
        let [walk, run] = [("walk", &arguments.walk), ("run", &arguments.run)].map(|(option, clips)| {
            clips::check(option, clips, &clips::names(), true)?;
            match &clips::find(clips)[..] {
                [clip] => Ok(clip.clone()),
                found => Err(format!("option {option} has {} clips, expected one", found.len())),
            }
        });
        Ok(Gaits::of(&*walk?, &*run?)?.into())
    }
}

impl Agent for Steer {
    fn facts(&self) -> Facts {
        Facts {
            id: "MarathonManSteer-v0".into(),
            summary: "a figure of 21 motors: walk, run, turn and stand as commanded, in the style of clips".into(),
            model: model(self.arguments.control),
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
                CommandRange::new("speed", 0.0..=MAX_SPEED, "m/s"),
                CommandRange::new("turn", -MAX_TURN..=MAX_TURN, "rad/s"),
            ],
            clips: CLIPS.into_iter().filter_map(clips::shipped).collect(),
            follows_clips: false,
            memory: self.fall_replay.memory(),
            termination_reward: (self.arguments.fall_penalty.0 > 0.0).then_some(-self.arguments.fall_penalty.0),
            ..Facts::default()
        }
    }

    fn options(&self) -> Vec<OptionInfo> {
        self.arguments.infos()
    }

    fn with_options(&self, options: &Options) -> Option<Self> {
        Some(Self::of(self.arguments.with(options), self.guide.limits, self.fall_replay.slot))
    }

    fn fits(&self, model: &Model) -> Result<(), String> {
        for clip in clips::find(&self.arguments.walk).into_iter().chain(clips::find(&self.arguments.run)) {
            clip.check_model(Path::new(&clip.about().name), model).map_err(|error| error.to_string())?;
        }
        Self::gaits(&self.arguments)?;
        super::has_joints(model)
    }

    fn reset(&self, start: &mut Start) {
        self.fall_replay.carry(start);
        let adaptive = self.arguments.start == StartAt::Adaptive;
        let [made, begun] = [DECISIONS, START_ROW].map(|slot| start.previous[slot]);
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
        start.memory[START_ROW] = row as f64;
        self.fall_replay.start(start);
        start.add_noise(ResetNoise::MARATHON);
    }

    fn command(&self, random: &mut EpisodeRng, _: usize, out: &mut [f64]) -> usize {
        let sharp = self.arguments.commands == Commands::Sharp;
        if sharp && random.uniform(0.0, 1.0) < RESTING {
            out.fill(0.0);
            return random.whole(RESTS[0], RESTS[1]);
        }
        if sharp && random.whole(0, 1) == 0 {
            out[0] = [0.0, MAX_SPEED, random.uniform(EXTREME * MAX_SPEED, MAX_SPEED)][random.whole(0, 2)];
            out[1] = [0.0, MAX_TURN, -MAX_TURN, random.around_zero(MAX_TURN)][random.whole(0, 3)];
            return random.whole(HOLDS[0], HOLDS[1] / 2);
        }
        out[0] = if random.uniform(0.0, 1.0) < STANDING { 0.0 } else { random.uniform(0.0, MAX_SPEED) };
        out[1] = if random.uniform(0.0, 1.0) < STRAIGHT { 0.0 } else { random.around_zero(MAX_TURN) };
        random.whole(HOLDS[0], HOLDS[1])
    }

    #[inline(always)]
    fn ctrl<T: Real>(&self, c: &mut Ctrl<T>) {
        match self.arguments.control {
            Control::PdRange | Control::Torque | Control::Servo => c.ctrl.copy_from_slice(c.action),
            Control::Pd => {
                let SteerArguments { action_scale, max_target, .. } = self.arguments;
                // compensate the servo's damping, which would slow the gait
                let next = self.guide.next_pose(|slot| c.memory[slot], c.dt, DAMPING_TIME);
                set_targets(c.ctrl, c.action, action_scale, T::lit(max_target.0), std::array::from_fn(next));
            }
        }
    }

    #[inline(always)]
    fn begin<T: Real>(&self, s: &Senses<T>, memory: &mut [T]) {
        memory[DIRECTION..DIRECTION + 2].copy_from_slice(&s.heading(BUTT));
        let [x, y, _] = s.center_of_mass_velocity();
        memory[TARGET..TARGET + 2].copy_from_slice(&[x, y]);
        memory[PACE] = hypot(x, y).min(T::lit(MAX_SPEED));
    }

    #[inline(always)]
    fn remember<T: Real>(&self, s: &Senses<T>, memory: &mut [T]) {
        self.guide.lead(s, memory, [s.command(0), T::zero()], s.command(1));
        self.fall_replay.remember(s, memory, |_| {
            let felled = on_the_ground(s);
            [T::not(felled), felled]
        });
    }

    #[inline(always)]
    fn observe<T: Real>(&self, s: &Senses<T>, out: &mut Obs<T>) {
        self.guide.observe_along(s, out);
    }

    #[inline(always)]
    fn step_reward<T: Real>(&self, s: &Senses<T>, terms: &mut Terms<T>) {
        self.guide.add_terms(s, [T::not(T::none()); 3], Self::told(s), terms);
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

/// Lanes in which any part but the feet touched the ground.
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
