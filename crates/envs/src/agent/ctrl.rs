//! How an agent turns actions into controls.

use marathon_physics::lanes::Real;

use super::reference::{Frame, Reference};

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
