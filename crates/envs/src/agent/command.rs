//! What an agent can be told to do, and how it turns actions into controls.

use std::ops::RangeInclusive;

use marathon_physics::lanes::Real;

use super::reference::{Frame, Reference};

/// One number of an agent's command, see [`Facts::command`](crate::Facts::command).
#[derive(Clone, Debug, PartialEq)]
pub struct CommandRange {
    /// Name, such as `velocity`.
    pub name: String,
    /// Lowest value.
    pub low: f64,
    /// Highest value.
    pub high: f64,
    /// Unit, such as `m/s`; empty for a pure number.
    pub unit: String,
}

impl CommandRange {
    /// A number of this name within a range of a unit.
    pub fn new(name: &str, range: RangeInclusive<f64>, unit: &str) -> Self {
        CommandRange { name: name.into(), low: *range.start(), high: *range.end(), unit: unit.into() }
    }

    /// Whether it is a speed, which a stick pushed ahead commands.
    pub fn is_speed(&self) -> bool {
        self.unit == "m/s"
    }

    /// Whether it is a turn.
    pub fn is_turn(&self) -> bool {
        self.unit == "rad/s"
    }

    /// Whether it is a button: a number from 0 to 1 without a unit.
    pub fn is_button(&self) -> bool {
        self.unit.is_empty() && self.low == 0.0 && self.high == 1.0
    }

    /// The value nearest to zero: what an agent is told before anybody tells it anything.
    pub fn rest(&self) -> f64 {
        0.0_f64.max(self.low).min(self.high)
    }
}

/// Where an agent turns its action into the controls of its actuators, see [`Agent::ctrl`](crate::Agent::ctrl).
pub struct Ctrl<'a, T: Real> {
    /// The action, as [`Facts::controls`](crate::Facts::controls) says; a number per actuator.
    pub action: &'a [T],
    /// Control of each actuator until the next decision, to be written: a motor's share of its strength, the target of a
    /// position servo.
    pub ctrl: &'a mut [T],
    /// The agent's own variables, see [`Agent::remember`](crate::Agent::remember).
    pub memory: &'a mut [T],
    /// The command that the agent observed.
    pub command: &'a [T],
    /// Configuration, MuJoCo's layout.
    pub qpos: &'a [T],
    /// Velocity, MuJoCo's layout.
    pub qvel: &'a [T],
    /// Seconds between decisions.
    pub dt: f64,
    pub(crate) reference: Option<&'a Reference<T>>,
}

impl<T: Real> Ctrl<'_, T> {
    /// What the clip that the agent follows shows `ahead` decisions from now, at most
    /// [`MOST_AHEAD`](super::reference::MOST_AHEAD); the decision to be made leads to the next.
    ///
    /// # Panics
    /// If its facts name no clip, or it is asked for more.
    #[inline(always)]
    pub fn reference(&self, ahead: usize) -> Frame<'_, T> {
        self.reference.expect("the facts name clips").frame(self.memory, ahead)
    }
}
