//! The paper's player controllers: characters in a plane that follow a commanded velocity and jump, and the
//! [Ant](AntController), which follows a velocity and a turn rate in space.
//!
//! A command is a velocity from -4 to 4 m/s. With `input=discrete`, it also has a jump, 0 or 1. `input` is the player's
//! device: buttons for left, right and jump, or a stick. If no caller sets commands, the task draws them from its
//! [schedule].
//!
//! | observation | content |
//! |---|---|
//! | the observation of the figure's own task | |
//! | `command` | commanded velocity, m/s; with `discrete` also the jump, 0 or 1 |
//! | `mean_velocity` | mean of the torso's velocity along x over this decision and the two before, m/s |
//! | `target_velocity` | follows the command at 5 m/s^2, m/s |
//! | `awaited` | with `discrete`: whether a commanded jump has not happened yet, 0 or 1 |
//!
//! r = exp(-4 e^2) + 4 - e + forward bonus + jump - late - effort + still, with e = abs(target - mean velocity).
//!
//! Bonus, jump and effort have the form of the original's controllers 001 to 004. `still` is ours, because the
//! original's figures would not stand still. The Walker also pays for a low torso. Every state earns more than a fall,
//! whatever the command, so falling never pays off.

mod ant;
mod commander;
mod figures;
pub mod schedule;

pub use ant::AntController;
pub use figures::Figure;

use marathon_physics::lanes::Real;

use super::fall_replay::FallReplay;
use super::hopper::HopperV0;
use super::idle;
use super::walker2d::Walker2dV1;
use crate::agent::options::Choice;
use crate::agent::senses::clamp;
use crate::agent::{
    Agent, CommandRange, Facts, Motors, Obs, OptionInfo, OptionSet, Options, Part, Scale, Senses, Share, Start, Terms,
    names,
};
use crate::episode_rng::EpisodeRng;
use schedule::Schedule;

/// Highest commanded speed, m/s. The original calls it 1.
pub const MAX_SPEED: f64 = 4.0;
/// Slots of the memory: the torso's velocity along x at the last three decisions, m/s. The original averages nine
/// physics steps.
const VELOCITIES: usize = 3;
/// Slot of the target velocity, m/s.
const TARGET: usize = VELOCITIES;
/// Slot of the decisions in the air since the center of mass rose at [`Figure::THROWN`].
const ALOFT: usize = TARGET + 1;
/// Slot of whether the last command had a jump, 0 or 1.
const TOLD: usize = ALOFT + 1;
/// Slot of whether a commanded jump has not happened yet, 0 or 1.
const WAITS: usize = TOLD + 1;
/// Slot of the fastest rise of the center of mass since the jump was commanded, m/s.
const ROSE: usize = WAITS + 1;
const MEMORY: usize = ROSE + 1;
/// Shortest flight that counts as a jump, s. Steps leave the ground for moments too.
const JUMPED: f64 = 0.1;
/// Rate at which the target velocity follows the command, m/s^2. Friction allows 9.8.
const RAMP: f64 = 5.0;
/// Groups of the observation after those of the figure's own task. The last one needs `discrete`.
const OBSERVED: [&str; 4] = ["command", "mean_velocity", "target_velocity", "awaited"];
/// Terms of the reward.
const TERMS: [&str; 8] = ["velocity", "pace", "uprightness", "jump", "late", "still", "height", "effort"];
/// Sharpness of the `velocity` term, s^2/m^2.
const SHARPNESS: f64 = 4.0;
/// Cost of a velocity error of 1 m/s.
const PRICE: f64 = 1.0;
/// Velocity error at which the `pace` term is 0, m/s: standing under a command to run.
const WORTHLESS: f64 = MAX_SPEED;
/// The `late` term per decision, until a standing figure has performed a commanded jump.
const LATE: f64 = -6.0;
/// Fraction of the `late` term that is waived once the center of mass has risen at 1 m/s. It rewards pushing off before
/// the policy has found the jump.
const RISEN: f64 = 0.6;
/// Reward of each half of standing still under a stop command.
const STILL: f64 = 1.5;
/// Mean squares of the parts' velocities at which the two halves drop to 1/e, m^2/s^2. The first half rewards coming to
/// rest, the second keeping still.
const STILLNESS_SCALES: [f64; 2] = [0.4, 0.04];

/// The Hopper with a commanded velocity.
pub type HopperController = Controller<HopperV0>;
/// The Walker with a commanded velocity.
pub type WalkerController = Controller<Walker2dV1>;

/// Input device of the player.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Input {
    /// Buttons: left, right, jump.
    Discrete,
    /// A stick: any velocity, no jump.
    Continuous,
}

impl Choice for Input {
    const EXPECTED: &'static str = "discrete or continuous";
    const NAMED: &'static [(Self, &'static str)] = &[(Input::Discrete, "discrete"), (Input::Continuous, "continuous")];
}

/// Source of the commands if no caller sets them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Commander {
    /// The task's own schedule.
    Schedule,
    /// A second role, which earns the runner's velocity error.
    Adversary,
}

impl Choice for Commander {
    const EXPECTED: &'static str = "schedule or adversary";
    const NAMED: &'static [(Self, &'static str)] =
        &[(Commander::Schedule, "schedule"), (Commander::Adversary, "adversary")];
}

crate::options! {
    /// Arguments of a figure in a plane with a commanded velocity.
    pub struct ControllerArguments {
        /// Input device of the player: `discrete` buttons for left, right and jump, or a `continuous` stick.
        input: Input = Input::Discrete,
        /// Schedule of the commands if no caller sets them: `repeats`, `anew`, `thirds`, `toggle` or `uniform`.
        schedule: Schedule = Schedule::Repeats,
        /// Source of the commands if no caller sets them: the `schedule`, or an `adversary` that learns too.
        commander: Commander = Commander::Schedule,
        /// Penalty of a fall. It replaces all other terms of that decision.
        fall_penalty: Scale = Scale(40.0),
        /// Fraction of the episodes that start 0.75 to 1.5 s before the last fall, once there is one (0 to 1).
        replay_falls_prob: Share = Share(0.0),
    }
}

/// A figure in a plane with a commanded velocity.
#[derive(Clone, Debug, Default)]
pub struct Controller<F> {
    figure: F,
    arguments: ControllerArguments,
}

impl<F: Figure> Controller<F> {
    /// Whether an adversary sets the commands.
    #[inline(always)]
    fn is_opposed(&self) -> bool {
        self.arguments.commander == Commander::Adversary
    }

    /// The stored states from before a fall.
    #[inline(always)]
    fn fall_replay(&self) -> FallReplay {
        let slot = if self.is_opposed() { commander::MEMORY } else { MEMORY };
        FallReplay {
            slot,
            share: self.arguments.replay_falls_prob.0,
            joints: [3 + F::MOTORS; 2],
            places: 1,
            also: None,
        }
    }

    /// Number `i` of the command. With `observing`, it is the command that applies from now on. Otherwise it is the one
    /// under which the last decision was made.
    #[inline(always)]
    fn told<T: Real>(&self, s: &Senses<T>, i: usize, observing: bool) -> T {
        match (self.is_opposed(), observing) {
            (false, _) => s.command(i),
            (true, true) => s.memory(commander::NEXT + i),
            (true, false) => s.memory(commander::PRESENT + i),
        }
    }

    /// Whether a jump is commanded, 0 or 1.
    #[inline(always)]
    fn jump<T: Real>(&self, s: &Senses<T>) -> T {
        match self.arguments.input {
            Input::Discrete => self.told(s, 1, false),
            Input::Continuous => T::zero(),
        }
    }
}

/// Rewards for standing still, 0 to 1 each. Each drops to 1/e when the mean square velocity of the first `parts` parts
/// reaches its value of `restless`, m^2/s^2.
#[inline(always)]
pub(super) fn stillness<T: Real, const N: usize>(s: &Senses<T>, parts: usize, restless: [f64; N]) -> [T; N] {
    let mut speed2 = T::zero();
    for part in (0..parts).map(Part) {
        let [x, y, z] = s.linear_velocity(part);
        speed2 += x.mul_add(x, y.mul_add(y, z * z));
    }
    restless.map(|most| (speed2 * T::lit(-1.0 / (most * parts as f64))).exp())
}

impl<F: Figure> Agent for Controller<F> {
    fn facts(&self) -> Facts {
        let (own, input) = (self.figure.facts(), self.arguments.input);
        let mut command = vec![CommandRange::new("velocity", -MAX_SPEED..=MAX_SPEED, "m/s")];
        if input == Input::Discrete {
            command.push(CommandRange::new("jump", 0.0..=1.0, ""));
        }
        let mut facts = Facts {
            id: F::ID.into(),
            summary: F::SUMMARY.into(),
            // the command, whether its jump is awaited, and two velocities
            observation: own.observation.map(|n| n + 2 * command.len() + 1),
            reward_terms: names(TERMS),
            info: names(["velocity_error"]),
            metrics: names(["forward", "velocity_error"]),
            parts: names(F::PARTS),
            command,
            memory: self.fall_replay().memory(),
            termination_reward: Some(-self.arguments.fall_penalty.0),
            ..own
        };
        if self.is_opposed() {
            let own = [&TERMS[..], &["fall"]].concat();
            let seen = OBSERVED.len() - usize::from(input == Input::Continuous);
            let seen = [F::OBSERVED, &OBSERVED[..seen]].concat();
            facts.roles = commander::roles(input, facts.actions.clone(), &seen, &own);
            facts.actions.extend(names(commander::actions(input)));
            facts.reward_terms = names(own.iter().chain(&commander::TERMS));
            let opposed = facts.model.spec(F::ID).and_then(|mut spec| {
                idle::add_actuators(&mut spec, "rootx", commander::actions(input))?;
                Ok(spec)
            });
            facts.model = opposed.into();
            (facts.observation, facts.termination_reward) = (None, None);
            facts.command = Vec::new();
            facts.info.extend(names(commander::actions(input)));
        }
        facts
    }

    fn options(&self) -> Vec<OptionInfo> {
        self.arguments.infos()
    }

    fn with_options(&self, options: &Options) -> Option<Self> {
        Some(Controller { figure: self.figure.clone(), arguments: self.arguments.with(options) })
    }

    fn reset(&self, start: &mut Start) {
        let fall_replay = self.fall_replay();
        fall_replay.carry(start);
        fall_replay.start(start);
        self.figure.reset(start);
    }

    fn command(&self, random: &mut EpisodeRng, step: usize, out: &mut [f64]) -> usize {
        self.arguments.schedule.draw(self.arguments.input, random, step, out)
    }

    #[inline(always)]
    fn begin<T: Real>(&self, s: &Senses<T>, memory: &mut [T]) {
        memory[..MEMORY].fill(s.linear_velocity(F::TORSO)[0]);
        memory[ALOFT..MEMORY].fill(T::zero());
        if self.is_opposed() {
            commander::begin(memory);
        }
    }

    #[inline(always)]
    fn remember<T: Real>(&self, s: &Senses<T>, memory: &mut [T]) {
        memory.copy_within(0..VELOCITIES - 1, 1);
        memory[0] = s.linear_velocity(F::TORSO)[0];
        let (told, jump) = if self.is_opposed() {
            commander::remember(self, s, memory);
            (memory[commander::PRESENT], memory[commander::PRESENT + 1])
        } else {
            (s.command(0), self.jump(s))
        };
        let most = RAMP * s.dt();
        memory[TARGET] += clamp(told - memory[TARGET], -most, most);
        let one = T::lit(1.0);
        let rises = s.center_of_mass_velocity()[2];
        let thrown = T::or(T::zero().lt(memory[ALOFT]), T::lit(F::THROWN).lt(rises));
        memory[ALOFT] = T::masked(T::and(T::zero().lt(F::leap(s)), thrown), memory[ALOFT] + one);
        let jumped = T::lit(JUMPED / s.dt() - 0.5).lt(memory[ALOFT]);
        // a new jump command starts a new wait
        let waits = memory[WAITS].max(one - memory[TOLD]);
        memory[WAITS] = T::select(jumped, T::zero(), jump * waits);
        let rose = memory[ROSE] * memory[TOLD];
        memory[ROSE] = jump * rose.max(rises);
        memory[TOLD] = jump;
        self.fall_replay().remember(s, memory, |_| {
            let felled = self.figure.terminated(s);
            [T::not(felled), felled]
        });
    }

    #[inline(always)]
    fn observe<T: Real>(&self, s: &Senses<T>, out: &mut Obs<T>) {
        self.figure.observe(s, out);
        out.group("command");
        out.scalar(self.told(s, 0, true));
        if self.arguments.input == Input::Discrete {
            out.scalar(self.told(s, 1, true));
        }
        out.group("mean_velocity");
        out.scalar(mean_velocity(s));
        out.group("target_velocity");
        out.scalar(s.memory(TARGET));
        if self.arguments.input == Input::Discrete {
            out.group("awaited");
            out.scalar(s.memory(WAITS));
        }
        if self.is_opposed() {
            commander::observe::<F, T>(s, out);
        }
    }

    #[inline(always)]
    fn step_reward<T: Real>(&self, s: &Senses<T>, terms: &mut Terms<T>) {
        let (zero, one) = (T::zero(), T::lit(1.0));
        let (told, velocity) = (self.told(s, 0, false), mean_velocity(s));
        let off = (s.memory(TARGET) - velocity).abs();
        terms.add("velocity", 1.0, (off * off * T::lit(-SHARPNESS)).exp());
        terms.add("pace", PRICE, T::lit(WORTHLESS) - off);
        terms.add("uprightness", 1.0, s.forward_bonus(F::TORSO));
        let jump = self.jump(s);
        let stands = (one - told.abs() * T::lit(10.0)).max(zero);
        let mut flies = jump * F::leap(s);
        if F::DRAWS_UP {
            let thrown = T::masked(zero.lt(s.memory(ALOFT)), one);
            flies *= thrown.max(one - stands);
        }
        terms.add("jump", 1.0, flies);
        let rose = clamp(s.memory(ROSE), 0.0, 1.0);
        terms.add("late", LATE, s.memory(WAITS) * stands * (one - rose * T::lit(RISEN)));
        // commanded to stand, without a jump
        let rest = stands * (one - jump);
        let [fidgets, stirs] = stillness(s, F::PARTS.len(), STILLNESS_SCALES);
        terms.add("still", STILL, rest * (fidgets + stirs));
        terms.add("height", -1.0, F::low(s));
        // the adversary's actions cost the figure no effort
        terms.add("effort", F::EFFORT, s.effort(Motors::from(F::MOTORS)));
        if self.is_opposed() {
            let fallen = self.figure.terminated(s);
            terms.add("fall", -self.arguments.fall_penalty.0, T::masked(fallen, one));
            commander::add_terms((told - velocity).abs(), fallen, terms);
        }
    }

    #[inline(always)]
    fn decides<T: Real>(&self, s: &Senses<T>, role: usize) -> T::Mask {
        if role == 0 || !self.is_opposed() { T::not(T::none()) } else { commander::decides(s) }
    }

    #[inline(always)]
    fn terminated<T: Real>(&self, s: &Senses<T>) -> T::Mask {
        self.figure.terminated(s)
    }

    #[inline(always)]
    fn info<T: Real>(&self, s: &Senses<T>, out: &mut Obs<T>) {
        out.scalar((self.told(s, 0, false) - mean_velocity(s)).abs());
        if self.is_opposed() {
            out.scalar(self.told(s, 0, false));
            if self.arguments.input == Input::Discrete {
                out.scalar(self.jump(s));
            }
        }
    }
}

/// Mean velocity of the torso along x over this decision and the two before, m/s.
#[inline(always)]
fn mean_velocity<T: Real>(s: &Senses<T>) -> T {
    (s.memory(0) + s.memory(1) + s.memory(2)) * T::lit(1.0 / 3.0)
}
