//! Figures in a plane that are told how fast to go, and to jump: the paper's player controllers.
//!
//! A command is a velocity from -4 to 4 m/s, and with the input `discrete` also a jump, 0 or 1. `input` says what a player has
//! in hand: buttons for left, right and jump, or a stick. What nobody commands, the task's own [schedule] does.
//!
//! | observation | content |
//! |---|---|
//! | what the figure's own task observes | |
//! | `command` | commanded velocity, m/s; with `discrete` also the jump, 0 or 1 |
//! | `mean_velocity` | mean of the torso's velocity along x at this decision and the two before, m/s |
//!
//! r = clamp(1 - 0.3 abs(commanded - mean velocity), -1, 1) + forward bonus + jump - effort + still. The first three terms and
//! the price of the effort are those of the original's controllers 001 to 004. `still` is ours: the original's figures would not
//! stand still.

pub mod hopper;
pub mod schedule;
pub mod walker;

use marathon_physics::lanes::Real;

use crate::agent::options::OptionValue;
use crate::agent::senses::clamp;
use crate::agent::{CommandRange, Obs, Part, Senses, Terms, Value};
use schedule::Schedule;

/// Fastest that a figure is told to go, m/s: what the original calls 1.
pub const FASTEST: f64 = 4.0;
/// Slots of the memory: the torso's velocity along x at the last three decisions, m/s. The original takes the mean of nine
/// physics steps.
const MEMORY: usize = 3;
/// Price of a difference of 1 m/s: 1.2 per 4 m/s in the original.
const PRICE: f64 = 1.2 / FASTEST;
/// Worth of standing still as told, and the mean square of the parts' velocities at which it is worth 1/e of that, m^2/s^2.
const STILL: f64 = 0.5;
const RESTLESS: f64 = 0.04;

/// What a player has in hand.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Input {
    /// Buttons: left, right, jump.
    Discrete,
    /// A stick: any velocity, no jump.
    Continuous,
}

const INPUTS: [(Input, &str); 2] = [(Input::Discrete, "discrete"), (Input::Continuous, "continuous")];

impl OptionValue for Input {
    const EXPECTED: &'static str = "discrete or continuous";
    fn value(&self) -> Value {
        INPUTS.into_iter().find(|(input, _)| input == self).map_or("discrete", |(_, name)| name).into()
    }
    fn read(value: &Value) -> Option<Self> {
        INPUTS.into_iter().find(|(_, name)| Value::from(*name) == *value).map(|(input, _)| input)
    }
}

crate::options! {
    /// Arguments of a figure in a plane that is told how fast to go.
    pub struct ControllerArguments {
        /// What a player has in hand: `discrete` buttons for left, right and jump, or a `continuous` stick.
        input: Input = Input::Discrete,
        /// What it is told where nobody commands: `repeats`, `anew`, `thirds`, `toggle` or `uniform`.
        schedule: Schedule = Schedule::Repeats,
    }
}

impl ControllerArguments {
    /// Ranges of the command.
    fn command(&self) -> Vec<CommandRange> {
        let mut command = vec![CommandRange::new("velocity", -FASTEST..=FASTEST, "m/s")];
        if self.input == Input::Discrete {
            command.push(CommandRange::new("jump", 0.0..=1.0, ""));
        }
        command
    }

    /// Whether it is told to jump, 0 or 1.
    #[inline(always)]
    fn jump<T: Real>(&self, s: &Senses<T>) -> T {
        match self.input {
            Input::Discrete => s.command(1),
            Input::Continuous => T::zero(),
        }
    }

    /// Observes the command and the mean velocity.
    #[inline(always)]
    fn observe<T: Real>(&self, s: &Senses<T>, out: &mut Obs<T>) {
        out.group("command");
        out.scalar(s.command(0));
        if self.input == Input::Discrete {
            out.scalar(s.command(1));
        }
        out.group("mean_velocity");
        out.scalar(mean_velocity(s));
    }

    /// Adds the terms that all figures have. `foot` is the height of its lowest foot if all feet are off the ground, or else
    /// nothing.
    #[inline(always)]
    fn reward<T: Real>(
        &self,
        s: &Senses<T>,
        torso: Part,
        parts: impl Iterator<Item = Part>,
        leap: T,
        terms: &mut Terms<T>,
    ) {
        let (zero, one) = (T::zero(), T::lit(1.0));
        let off = (s.command(0) - mean_velocity(s)).abs();
        terms.add("velocity", 1.0, clamp(off.neg_mul_add(T::lit(PRICE), one), -1.0, 1.0));
        terms.add("uprightness", 1.0, s.forward_bonus(torso));
        terms.add("jump", 1.0, self.jump(s) * leap);
        let (mut speed2, mut count) = (zero, 0.0);
        for part in parts {
            let [x, y, z] = s.linear_velocity(part);
            speed2 += x.mul_add(x, y.mul_add(y, z * z));
            count += 1.0;
        }
        let still = (speed2 * T::lit(-1.0 / (RESTLESS * count))).exp();
        // told to go nowhere and not to jump
        let told = s.command(0).abs().max(self.jump(s));
        let rest = (one - told * T::lit(10.0)).max(zero);
        terms.add("still", STILL, rest * still);
    }
}

/// Mean velocity of the torso along x at this decision and the two before, m/s.
#[inline(always)]
fn mean_velocity<T: Real>(s: &Senses<T>) -> T {
    (s.memory(0) + s.memory(1) + s.memory(2)) * T::lit(1.0 / 3.0)
}

/// An episode begins: there have been no other velocities.
#[inline(always)]
fn begin<T: Real>(s: &Senses<T>, torso: Part, memory: &mut [T]) {
    memory[..MEMORY].fill(s.linear_velocity(torso)[0]);
}

/// A decision has been made.
#[inline(always)]
fn remember<T: Real>(s: &Senses<T>, torso: Part, memory: &mut [T]) {
    memory.copy_within(0..MEMORY - 1, 1);
    memory[0] = s.linear_velocity(torso)[0];
}
