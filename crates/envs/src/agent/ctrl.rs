//! The conversion of actions into controls.

use marathon_physics::lanes::Real;

use super::reference::{Frame, Reference};

/// Inputs and outputs of [`Agent::ctrl`](crate::Agent::ctrl), which converts an action into the controls of the
/// actuators.
pub struct Ctrl<'a, T: Real> {
    /// The action, one number per actuator, see [`Facts::controls`](crate::Facts::controls).
    pub action: &'a [T],
    /// Output: the control of each actuator until the next decision. For a motor, it is a fraction of the strength; for
    /// a position servo, the target.
    pub ctrl: &'a mut [T],
    /// The agent's memory, see [`Agent::remember`](crate::Agent::remember).
    pub memory: &'a mut [T],
    /// The command that the agent observed.
    pub command: &'a [T],
    /// Configuration in MuJoCo's layout.
    pub qpos: &'a [T],
    /// Velocity in MuJoCo's layout.
    pub qvel: &'a [T],
    /// Seconds between decisions.
    pub dt: f64,
    pub(crate) reference: Option<&'a Reference<T>>,
}

impl<T: Real> Ctrl<'_, T> {
    /// The frame of the agent's clip `ahead` decisions from now, at most [`MOST_AHEAD`](super::reference::MOST_AHEAD).
    /// The present decision leads to frame 1.
    ///
    /// # Panics
    /// If the facts name no clip, or `ahead` is too large.
    #[inline(always)]
    pub fn reference(&self, ahead: usize) -> Frame<'_, T> {
        self.reference.expect("the facts name clips").frame(self.memory, ahead)
    }
}
