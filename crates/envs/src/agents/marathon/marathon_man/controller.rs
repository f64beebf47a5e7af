//! Marathon Man under a player's control. It does what [`Steer`] does, steps aside, jumps and does backflips on a
//! button, and gets up after a fall.
//!
//! | observation | content |
//! |---|---|
//! | 0..103 | the observation of `MarathonManSteer-v0`; in a [skill](super::skills), vectors are expressed in the clip's heading, and `next_pose` is the clip's |
//! | 103..107 | in a skill: sine and cosine of the clip's phase as an angle, and of twice the angle |
//! | 107..110 | in a skill: from the character's butt to the clip's, m |
//! | 110..113 | commanded velocity to the left, m/s; jump; backflip |
//! | 113..117 | active skill: jump, backflip, getting up from the belly, from the back |
//! | 117..124 | in a skill, one decision ahead: height of the clip's butt above the character's, m, its forward and up axis |
//! | 124..152 | the same four decisions ahead, and the clip's joint angles minus the character's |
//!
//! # Mechanism
//!
//! Two controllers share the action, which always offsets servo targets. Outside skills, the targets come from the gait
//! of `Steer`, and the reward is that of `MarathonManSteer-v0`. In a skill, they come from the skill's clip, and the
//! reward is DeepMimic's. Getting up also earns a term for the height of the butt. The memory decides which of the two
//! is active, so one policy covers both.

use std::f64::consts::PI;

use marathon_physics::Model;
use marathon_physics::lanes::Real;

use super::super::imitation::{self, StartAt, sub, turned_to};
use super::body::{
    ACTIONS, ANATOMY, BUTT, Control, DAMPING_TIME, FEET, FIRST_QPOS, FIRST_QVEL, JOINTS, PARTS, TOUCH, model,
    set_targets,
};
use super::clips::{self, ALL};
use super::skills::{BACKFLIP, FROM_A_STAND, JUMP, RISEN, SKILLS, SLOTS, Skills, carriage};
use super::steer::{
    CLIPS, Commands, DIRECTION, FOOTWORK_SLOTS, MAX_SPEED, MAX_TURN, OBSERVATION, PACE, PaceLimits, START_ROW, Steer,
    SteerArguments, TARGET, TERMS,
};
use super::{FRAME_SKIP, SECONDS, decisions};
use crate::agent::senses::{clamp, hypot};
use crate::agent::{
    Agent, Clips, CommandRange, Ctrl, Facts, Obs, OptionInfo, OptionSet, Options, ResetNoise, Scale, Seconds, Senses,
    Share, Start, Terms, names,
};
use crate::episode_rng::EpisodeRng;

/// Highest commanded speed to a side, m/s.
const ASIDE: f64 = 0.8;
/// Rates and limits of the reference signals. They are higher than in the steered task, but for the deceleration: a run that
/// ends abruptly makes the character fall.
const PACE_LIMITS: PaceLimits = PaceLimits {
    acceleration: 7.0,
    deceleration: 4.0,
    overshoot: 0.5,
    max_lead: 1.2,
    quick_steps: true,
    turn_radius: 0.6,
    min_pace: 0.8,
    footwork: Some(FOOTWORK),
};
/// How far ahead the clip is observed, decisions.
const AHEAD: usize = 4;
/// The skills' memory slots, after those of the steered task.
const SKILL: Skills = Skills { slot: START_ROW + 1 };
/// Slot that holds whether a fall ends the episode.
const ENDS_ON_FALL: usize = SKILL.slot + SLOTS;
/// Slots of the gait's footwork.
const FOOTWORK: usize = ENDS_ON_FALL + 1;
/// Number of slots without those of [replayed falls](super::super::fall_replay).
const MEMORY: usize = FOOTWORK + FOOTWORK_SLOTS;
/// Fraction of the episodes that start within a skill.
const SKILLED: f64 = 0.45;
/// Mean distance of the parts from the clip that ends an episode without locomotion, m.
const TOO_FAR: f64 = 0.5;
/// Height of the center of a foot on the ground, m.
const STANDING_FOOT: f64 = 0.06;
/// Reward per meter of jump height, 1/m.
const LEAP: f64 = 5.0;
/// Jump height above which the reward stays constant, m.
const HIGH: f64 = 0.3;
/// Reward for a butt as high as that of a character that is up.
const RISE: f64 = 0.3;
/// Fractions of the commands that are jumps, backflips and side steps.
const JUMPING: f64 = 0.15;
const FLIPPING: f64 = 0.12;
const STEPPING: f64 = 0.2;
/// Shortest duration of a `sharp` side step, decisions.
const SHORTEST_STEP: usize = 16;
/// Fraction of the `sharp` commands that are keys of a keyboard, and the shortest and longest duration of one, decisions.
const KEYS: f64 = 0.25;
const KEY_HOLDS: [usize; 2] = [8, 48];
/// Fraction of these commands in which a button is pressed.
const PRESSED: f64 = 0.2;
/// Smallest and largest velocity change by the push at the start of an episode, m/s.
const PUSH_SPEED: [f64; 2] = [2.0, 5.0];

crate::options! {
    /// Arguments of Marathon Man under a player's control.
    pub struct ControllerArguments {
        /// Largest offset of a servo's target by an action, rad.
        action_scale: Scale = Scale(1.0),
        /// Largest angle of a servo's target, rad. With 1, it cannot bend a hip or a knee by more than about 60 degrees.
        max_target: Scale = Scale(3.0),
        /// The same outside skills, where the gait sets the targets, rad. Above `max_target` it has no effect.
        gait_max_target: Scale = Scale(3.0),
        /// Start of an episode: `random` decisions of the clips and skills, `first` (standing), or `adaptive` (as in
        /// the steered task).
        start: StartAt = StartAt::Random,
        /// Commands that are drawn when no caller sets them: `even` (uniform), or `sharp` (half of them extreme).
        commands: Commands = Commands::Even,
        /// Clips to use, `all` or some of them. They set where episodes start and which commands are drawn. Without
        /// getting-up clips, a fall ends the episode. Without locomotion clips, the end of a skill ends it.
        clip: Clips = Clips::named(ALL),
        /// Fraction of training episodes that end at a fall instead of waiting until the character is up (0 to 1).
        /// Episodes that start lying never do.
        end_on_fall_prob: Share = Share(0.0),
        /// Fraction of the locomotion episodes that start with a push that makes the character fall (0 to 1). These
        /// episodes continue after falls, so the policy sees how falls end.
        start_pushed_prob: Share = Share(0.0),
        /// Penalty of a failure that ends the episode.
        fall_penalty: Scale = Scale(0.0),
        /// Fraction of the locomotion episodes that start 0.75 to 1.5 s before the last fall, once there is one (0 to
        /// 1).
        replay_falls_prob: Share = Share(0.0),
        /// Looping clip that the gait at a walk is made from.
        walk: Clips = Clips::named("walk"),
        /// The same at a run.
        run: Clips = Clips::named("run"),
    }
}

/// Clips of the locomotion, then those of the skills.
fn known_clips() -> Vec<&'static str> {
    CLIPS.into_iter().chain(SKILLS.map(|skill| skill.clip)).collect()
}

/// Skills and gaits that the task includes, by the clips in use.
#[derive(Clone, Copy, Debug)]
struct Does {
    /// Locomotion: walking, running and standing.
    gait: bool,
    /// Which skills.
    skills: [bool; SKILLS.len()],
}

impl Does {
    /// Whether at least one way of getting up is included. If not, a fall ends the episode.
    fn rises(self) -> bool {
        self.skills[FROM_A_STAND..].contains(&true)
    }
}

/// Marathon Man under a player's control.
#[derive(Clone, Debug)]
pub struct Controller {
    arguments: ControllerArguments,
    does: Does,
    /// The steered task, used for locomotion.
    steer: Steer,
}

impl Default for Controller {
    fn default() -> Self {
        Self::of(ControllerArguments::default())
    }
}

impl Controller {
    fn of(arguments: ControllerArguments) -> Self {
        let all = clips::is_all(&arguments.clip);
        let named = |name: &str| all || arguments.clip.iter().any(|clip| clip.name() == name);
        let does = Does { gait: CLIPS.into_iter().any(named), skills: SKILLS.map(|skill| named(skill.clip)) };
        let ControllerArguments { action_scale, max_target, start, commands, replay_falls_prob, walk, run, .. } =
            arguments.clone();
        let steer = Steer::of(
            SteerArguments {
                action_scale,
                max_target,
                start,
                commands,
                replay_falls_prob,
                walk,
                run,
                ..SteerArguments::default()
            },
            PACE_LIMITS,
            MEMORY,
        );
        Controller { arguments, does, steer }
    }
}

impl Agent for Controller {
    fn facts(&self) -> Facts {
        Facts {
            id: "MarathonManController-v0".into(),
            summary:
                "a figure of 21 motors: walk and run as commanded, jump, backflip and get up, in the style of clips"
                    .into(),
            model: model(Control::Pd),
            frame_skip: FRAME_SKIP,
            max_episode_steps: decisions(Seconds(SECONDS)),
            observation: Some(OBSERVATION + 4 + 3 + 3 + SKILLS.len() + 7 + 7 + JOINTS.len()),
            actions: names(ACTIONS.map(|i| JOINTS[i].name)),
            reward_terms: names(TERMS.iter().chain(&["skill", "leap", "rise"])),
            info: names(["velocity_error", "heading_error", "skill", "rising"]),
            metrics: names(["forward", "velocity_error", "heading_error"]),
            parts: names(PARTS),
            touch_sites: names(TOUCH),
            feet: names(FEET.map(|part| PARTS[part.0])),
            command: vec![
                CommandRange::new("speed", 0.0..=MAX_SPEED, "m/s"),
                CommandRange::new("left", -ASIDE..=ASIDE, "m/s"),
                CommandRange::new("turn", -MAX_TURN..=MAX_TURN, "rad/s"),
                CommandRange::new("jump", 0.0..=1.0, ""),
                CommandRange::new("backflip", 0.0..=1.0, ""),
            ],
            clips: known_clips().into_iter().filter_map(clips::shipped).collect(),
            follows_clips: false,
            memory: self.steer.fall_replay.memory(),
            termination_reward: (self.arguments.fall_penalty.0 > 0.0).then_some(-self.arguments.fall_penalty.0),
            ..Facts::default()
        }
    }

    fn options(&self) -> Vec<OptionInfo> {
        self.arguments.infos()
    }

    fn with_options(&self, options: &Options) -> Option<Self> {
        Some(Self::of(self.arguments.with(options)))
    }

    fn fits(&self, model: &Model) -> Result<(), String> {
        clips::check("clip", &self.arguments.clip, &known_clips(), false)?;
        self.steer.fits(model)
    }

    fn reset(&self, start: &mut Start) {
        let Does { gait, skills } = self.does;
        let known: Vec<usize> = (0..SKILLS.len()).filter(|i| skills[*i]).collect();
        let first = self.arguments.start == StartAt::First;
        let ends_on_fall = f64::from(u8::from(start.random.uniform(0.0, 1.0) < self.arguments.end_on_fall_prob.0));
        if gait && (first || known.is_empty() || start.random.uniform(0.0, 1.0) >= SKILLED) {
            self.steer.reset(start);
            start.memory[ENDS_ON_FALL] = ends_on_fall;
            if start.random.uniform(0.0, 1.0) < self.arguments.start_pushed_prob.0 {
                let angle = start.random.around_zero(PI);
                let speed = start.random.uniform(PUSH_SPEED[0], PUSH_SPEED[1]);
                start.qvel[0] += speed * libm::cos(angle);
                start.qvel[1] += speed * libm::sin(angle);
                start.memory[ENDS_ON_FALL] = 0.0;
            }
            return;
        }
        self.steer.fall_replay.carry(start);
        let skill = known[start.random.whole(0, known.len() - 1)];
        let rows = start.clips().nth(CLIPS.len() + skill).expect("a row of clips for each clip");
        let [first, last] = SKILLS[skill].rows.map(|row| (rows.start + row).min(rows.end - 1));
        let row = if self.arguments.start == StartAt::First { first } else { start.random.whole(first, last - 1) };
        start.start_in_clip(row);
        start.memory[SKILL.slot] = (1 + skill) as f64;
        start.memory[START_ROW] = 0.0;
        start.memory[ENDS_ON_FALL] = if skill < FROM_A_STAND { ends_on_fall } else { 0.0 };
        start.add_noise(ResetNoise::MARATHON);
    }

    fn command(&self, random: &mut EpisodeRng, step: usize, out: &mut [f64]) -> usize {
        if self.arguments.commands == Commands::Sharp && random.uniform(0.0, 1.0) < KEYS {
            // any key may be down while another one is
            let axes = [[0.0, 0.0, MAX_SPEED], [-ASIDE, 0.0, ASIDE], [-MAX_TURN, 0.0, MAX_TURN]];
            let [speed, left, turn] = axes.map(|values| values[random.whole(0, 2)]);
            let [jump, backflip] = [JUMP, BACKFLIP].map(|skill| {
                let pressed = random.uniform(0.0, 1.0) < PRESSED;
                f64::from(u8::from(pressed && self.does.skills[skill]))
            });
            out.copy_from_slice(&[speed, left, turn, jump, backflip]);
            return random.whole(KEY_HOLDS[0], KEY_HOLDS[1]);
        }
        let mut going = [0.0; 2];
        let mut hold = self.steer.command(random, step, &mut going);
        let (mut left, mut jump, mut backflip) = (0.0, 0.0, 0.0);
        let kind = random.uniform(0.0, 1.0);
        if kind < JUMPING && self.does.skills[JUMP] {
            (jump, hold) = (1.0, random.whole(20, 40));
        } else if (JUMPING..JUMPING + FLIPPING).contains(&kind) && self.does.skills[BACKFLIP] {
            (going, backflip, hold) = ([0.0; 2], 1.0, random.whole(40, 120));
        } else if (JUMPING + FLIPPING..JUMPING + FLIPPING + STEPPING).contains(&kind) {
            // a player holds a side step on the spot, against a turn, or while running
            left = random.around_zero(ASIDE);
            let [goes, turns] = [0, 1].map(|_| random.whole(0, 1) == 0);
            going = [random.uniform(0.0, MAX_SPEED), random.around_zero(MAX_TURN)];
            if self.arguments.commands == Commands::Sharp {
                // most keys are pressed fully or not at all, and not for long
                [left, going[0], going[1]] = [(left, ASIDE), (going[0], MAX_SPEED), (going[1], MAX_TURN)]
                    .map(|(x, most): (f64, f64)| if random.whole(0, 2) > 0 { most.copysign(x) } else { x });
                hold = random.whole(SHORTEST_STEP, hold);
            }
            going = [if goes { going[0] } else { 0.0 }, if turns { going[1] } else { 0.0 }];
        }
        out.copy_from_slice(&[going[0], left, going[1], jump, backflip]);
        hold
    }

    #[inline(always)]
    fn ctrl<T: Real>(&self, c: &mut Ctrl<T>) {
        let (on, clip) = (SKILL.on(c.memory), c.reference(1));
        let gait = self.steer.guide.next_pose(|slot| c.memory[slot], c.dt, DAMPING_TIME);
        let mut targets = [T::zero(); JOINTS.len()];
        for (joint, target) in targets.iter_mut().enumerate() {
            let of_clip = clip.qvel(FIRST_QVEL + joint).mul_add(T::lit(DAMPING_TIME), clip.qpos(FIRST_QPOS + joint));
            *target = T::select(on, of_clip, gait(joint));
        }
        let ControllerArguments { action_scale, max_target, gait_max_target, .. } = self.arguments;
        let of_gait = max_target.0.min(gait_max_target.0);
        set_targets(c.ctrl, c.action, action_scale, T::select(on, T::lit(max_target.0), T::lit(of_gait)), targets);
    }

    #[inline(always)]
    fn begin<T: Real>(&self, s: &Senses<T>, memory: &mut [T]) {
        let begins = [0, 1, 2, 3].map(|i| memory[i]);
        self.steer.begin(s, memory);
        memory[..4].copy_from_slice(&begins);
        for (i, x) in SKILL.facing(s, memory).into_iter().enumerate() {
            memory[DIRECTION + i] = x;
        }
        memory[FOOTWORK] = T::lit(1.0);
    }

    #[inline(always)]
    fn remember<T: Real>(&self, s: &Senses<T>, memory: &mut [T]) {
        let [speed, left, turn, jump, backflip] = told(s);
        let before = [DIRECTION, DIRECTION + 1].map(|slot| memory[slot]);
        self.steer.guide.lead(s, memory, [speed, left], turn);
        let rose = SKILL.rises(memory);
        let was_on = SKILL.remember(s, memory, [jump, backflip]);
        let on = SKILL.on(memory);
        // the direction survives a skill, and the target velocity survives a jump; after getting up, the direction is
        // the heading
        let (heading, [x, y, _]) = (s.heading(BUTT), s.center_of_mass_velocity());
        let risen = T::and(rose, T::not(on));
        let led = T::or(T::not(on), SKILL.is(memory, JUMP));
        for i in 0..2 {
            let kept = T::select(T::or(on, was_on), before[i], memory[DIRECTION + i]);
            memory[DIRECTION + i] = T::select(risen, heading[i], kept);
            memory[TARGET + i] = T::select(led, memory[TARGET + i], [x, y][i]);
        }
        memory[PACE] = T::select(on, hypot(x, y).min(T::lit(MAX_SPEED)), memory[PACE]);
        self.steer.fall_replay.remember(s, memory, |memory| {
            let felled = T::and(SKILL.rises(memory), T::not(rose));
            [T::not(T::or(on, SKILL.leaps(memory))), felled]
        });
    }

    #[inline(always)]
    fn observe<T: Real>(&self, s: &Senses<T>, out: &mut Obs<T>) {
        let all = memory(s);
        let on = SKILL.on(&all);
        let facing = SKILL.facing(s, &all);
        let (turned, next, r) = (turned_to(facing), s.reference(1), s.readings());
        let pose = |i, of_gait| T::select(on, next.qpos(FIRST_QPOS + i), of_gait);
        let [speed, left, turn, jump, backflip] = told(s);
        self.steer.guide.observe_going(s, facing, [speed, turn], pose, out);
        out.group("phase");
        for x in s.reference(0).phase_angles() {
            out.scalar(T::masked(on, x));
        }
        out.group("place_in_clip");
        let gap = turned(sub(s.reference(0).position(BUTT), s.position(BUTT)));
        out.vector(gap.map(|x| T::masked(on, x)));
        out.group("buttons");
        for x in [left, jump, backflip] {
            out.scalar(x);
        }
        out.group("skill");
        for i in 0..SKILLS.len() {
            let is = if i == JUMP { SKILL.jumps(&all) } else { SKILL.is(&all, i) };
            out.scalar(T::masked(is, T::lit(1.0)));
        }
        let masked = |[x, y, z]: [T; 3]| [x, y, z].map(|x| T::masked(on, x));
        for (name, ahead) in [("in_1", 1), ("in_4", AHEAD)] {
            let clip = s.reference(ahead);
            let (forward, up, height) = carriage(&clip);
            out.group(name);
            out.scalar(T::masked(on, height - s.position(BUTT)[2]));
            out.vector(masked(turned(forward)));
            out.vector(masked(turned(up)));
        }
        let clip = s.reference(AHEAD);
        out.group("later_pose");
        for i in 0..JOINTS.len() {
            out.scalar(T::masked(on, clip.qpos(FIRST_QPOS + i) - r.qpos(FIRST_QPOS + i)));
        }
    }

    #[inline(always)]
    fn step_reward<T: Real>(&self, s: &Senses<T>, terms: &mut Terms<T>) {
        let all = memory(s);
        let [speed, left, turn, ..] = told(s);
        let moved = left.abs() + turn.abs() + speed;
        let (jumps, gait) = (SKILL.is(&all, JUMP), T::not(SKILL.on(&all)));
        // a jump may land elsewhere than the clip; rewarding `drift` in a turn taught turning on one point, and falling
        let moves = T::or(gait, jumps);
        let straight = turn.abs().lt(T::lit(0.01));
        self.steer.guide.add_terms(s, [moves, T::and(moves, straight), gait], moved, terms);
        let [similar, posture] = imitation::similarity(s, &ANATOMY);
        terms.add("skill", 1.0, SKILL.worth(&all) * T::select(jumps, posture, similar));
        // the pose of a small hop scores almost like a jump, so reward height
        let [right, left] = FEET.map(|foot| s.height(foot));
        let high = clamp(right.min(left) - T::lit(STANDING_FOOT), 0.0, HIGH);
        terms.add("leap", LEAP, T::masked(SKILL.jumps(&all), high));
        let risen = clamp(s.height(BUTT) * T::lit(1.0 / RISEN), 0.0, 1.0);
        terms.add("rise", RISE, T::masked(SKILL.rises(&all), risen));
    }

    #[inline(always)]
    fn terminated<T: Real>(&self, s: &Senses<T>) -> T::Mask {
        let all = memory(s);
        let rises = SKILL.rises(&all);
        let mut over = SKILL.stuck(&all);
        // getting up began in this decision, so the character just fell
        let ends_on_fall = T::or(
            T::lit(0.5).lt(s.memory(ENDS_ON_FALL)),
            if self.does.rises() { T::none() } else { T::not(T::none()) },
        );
        over = T::or(over, T::and(ends_on_fall, T::and(rises, T::not(T::lit(0.5).lt(s.memory(SKILL.slot + 1))))));
        if !self.does.gait {
            let far = T::lit(TOO_FAR).lt(imitation::distance(s, &ANATOMY, true));
            over = T::or(over, T::and(SKILL.on(&all), far));
        }
        over
    }

    #[inline(always)]
    fn truncated<T: Real>(&self, s: &Senses<T>) -> T::Mask {
        if self.does.gait { T::none() } else { T::not(T::lit(0.5).lt(s.memory(SKILL.slot))) }
    }

    #[inline(always)]
    fn info<T: Real>(&self, s: &Senses<T>, out: &mut Obs<T>) {
        let direction = Steer::direction(s);
        let [c, d] = direction;
        let [speed, left, ..] = told(s);
        out.scalar(Steer::slip(s, [speed * c - left * d, speed.mul_add(d, left * c)]));
        out.scalar(Steer::off(s, direction).abs());
        let all = memory(s);
        out.scalar(SKILL.number(&all));
        out.scalar(T::masked(SKILL.rises(&all), T::lit(1.0)));
    }
}

/// The part of the command that applies now: speed, left, turn, jump, backflip. A backflip needs a standing start.
/// While a backflip is commanded, speed, step, turn and jump therefore count as 0, also in the observation. The policy
/// was trained on such commands.
#[inline(always)]
fn told<T: Real>(s: &Senses<T>) -> [T; 5] {
    let backflip = s.command(4);
    let flips = T::lit(0.5).lt(backflip);
    let [speed, left, turn, jump] = [0, 1, 2, 3].map(|i| T::masked(T::not(flips), s.command(i)));
    [speed, left, turn, jump, backflip]
}

/// The agent's memory.
#[inline(always)]
fn memory<T: Real>(s: &Senses<T>) -> [T; MEMORY] {
    std::array::from_fn(|i| s.memory(i))
}
