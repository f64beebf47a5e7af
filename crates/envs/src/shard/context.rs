//! What an agent is given from outside besides its actions.

use marathon_physics::Variation;

use crate::error::EnvError;

/// One agent's circumstances: its command, its ground, its constants, what pushes it. All of it belongs to snapshots.
///
/// [`AgentShard::context`](crate::AgentShard::context) is the way to it; what comes later joins here.
pub trait AgentContext {
    /// The command that the agent observed last, in the order of [`Spec::command`](crate::Spec::command).
    fn command(&self) -> Vec<f64>;
    /// Tells the agent what to do, in place of its own schedule, until changed, over all resets; `None` gives it back to the
    /// schedule, which has gone on meanwhile. The agent observes the command at the end of its next decision, or at the start
    /// of its next episode, and is rewarded for it from there on.
    ///
    /// # Errors
    /// If the number of values is not that of the command, or one is out of its range.
    fn set_command(&mut self, command: Option<&[f64]>) -> Result<(), EnvError>;
    /// Pushes a body until told otherwise or until the next episode: force, N, and torque, N m, in world axes at the body's
    /// center of mass.
    ///
    /// # Errors
    /// If there is no such body, or the numbers are not finite.
    fn push(&mut self, body: usize, force: [f64; 3], torque: [f64; 3]) -> Result<(), EnvError>;
    /// Gives the agent masses, friction, strength and gravity of its own, until changed, over all resets; starts that take
    /// physics ([`Start::settle`](crate::Start::settle)) are found without them.
    ///
    /// # Errors
    /// If a length is wrong, or a number makes no sense.
    fn vary(&mut self, variation: &Variation) -> Result<(), EnvError>;
    /// The agent's ground: elevations of the model's height field `field`, as [`AgentContext::set_ground`] takes them.
    ///
    /// # Errors
    /// If there is no such field.
    fn ground(&self, field: usize) -> Result<Vec<f32>, EnvError>;
    /// Gives the agent ground of its own: elevations, m above the zero of the model's height field `field`, row by row, the
    /// first of which has the smallest y. It lasts until changed, over all resets, unless the agent draws ground of its own
    /// ([`Start::set_ground`](crate::Start::set_ground)); starts that take physics are found on the model's own.
    ///
    /// # Errors
    /// If there is no such field, or the elevations are not finite numbers for each point of its grid.
    fn set_ground(&mut self, field: usize, elevations: &[f32]) -> Result<(), EnvError>;
}
