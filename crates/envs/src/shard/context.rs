//! Inputs of an agent besides its actions.

use marathon_physics::{Obstacle, Variation};

use crate::error::EnvError;

/// Inputs of one agent: command, ground, obstacles, constants and pushes. All of them are part of snapshots.
///
/// Get it from [`AgentShard::context`](crate::AgentShard::context).
pub trait AgentContext {
    /// The last observed command, in the order of [`Spec::command`](crate::Spec::command).
    fn command(&self) -> Vec<f64>;
    /// Sets a command that overrides the agent's schedule until changed, also across resets. `None` returns to the
    /// schedule, which continues in the meantime. The agent observes the command at the end of its next decision, or at
    /// the start of its next episode. The reward uses it from then on.
    ///
    /// # Errors
    /// If the number of values is wrong, or a value is out of its range.
    fn set_command(&mut self, command: Option<&[f64]>) -> Result<(), EnvError>;
    /// Pushes a body until changed or until the next episode: force, N, and torque, N m, in world axes at the body's
    /// center of mass.
    ///
    /// # Errors
    /// If there is no such body, or the numbers are not finite.
    fn push(&mut self, body: usize, force: [f64; 3], torque: [f64; 3]) -> Result<(), EnvError>;
    /// Sets the agent's masses, friction, strength and gravity until changed, also across resets. Starts that need
    /// physics ([`Start::settle`](crate::Start::settle)) are computed without them.
    ///
    /// # Errors
    /// If a length is wrong, or a number is out of its range.
    fn vary(&mut self, variation: &Variation) -> Result<(), EnvError>;
    /// The agent's ground: heights of the model's height field `field`, as in [`AgentContext::set_ground`].
    ///
    /// # Errors
    /// If there is no such field.
    fn ground(&self, field: usize) -> Result<Vec<f32>, EnvError>;
    /// Sets the agent's ground: heights above the zero of the model's height field `field`, m, in rows of increasing y.
    /// It lasts until changed, also across resets, unless the agent draws its own ground
    /// ([`Start::set_ground`](crate::Start::set_ground)). Starts that need physics are computed on the model's ground.
    ///
    /// # Errors
    /// If there is no such field, or the heights are not finite numbers for each point of its grid.
    fn set_ground(&mut self, field: usize, elevations: &[f32]) -> Result<(), EnvError>;
    /// The agent's obstacles, where they are now.
    fn obstacles(&self) -> Vec<Obstacle>;
    /// Sets the agent's obstacles: solids that it touches and cannot move. They keep their velocities until they are set
    /// again, also across resets. Starts that need physics are computed without them.
    ///
    /// # Errors
    /// If the model has no geom for obstacles
    /// ([`ModelSpec::add_obstacles`](marathon_physics::spec::ModelSpec::add_obstacles)), there are too many, or a number is
    /// out of its range.
    fn set_obstacles(&mut self, obstacles: &[Obstacle]) -> Result<(), EnvError>;
}
