//! The [`Agent`] trait, the paper's `MarathonAgent`. Implement it to add a creature or a task.
//!
//! An agent is a small value, usually a unit struct. It has constant [`Facts`] and three functions over [`Senses`]:
//! observation, reward and termination.
//!
//! The functions are generic over [`Real`]. The same code serves a single agent in double precision and sixteen agents
//! in one vector register. Mark them `#[inline(always)]`, as everything that runs inside [`Real::enter`] must be. Lanes
//! are independent: there is no way to read another lane.

pub(crate) mod bindings;
mod clips;
mod command;
mod ctrl;
mod facts;
pub mod memory;
pub mod options;
mod outputs;
pub mod reference;
mod role;
pub mod senses;
mod site;
mod start;
pub mod tolerance;
mod value;

use marathon_physics::Model;
use marathon_physics::lanes::Real;

use crate::episode_rng::EpisodeRng;

pub use clips::{Clips, NamedClip};
pub use command::CommandRange;
pub use ctrl::Ctrl;
pub use facts::{Body, Controls, Facts, ModelSource, Motors, Part, ResetNoise, View, names};
pub(crate) use facts::{FORWARD, find};
pub use options::{OptionInfo, OptionSet, OptionValue, Options, Scale, Seconds, Share};
pub use outputs::{Obs, Terms};
pub use reference::{Following, Frame};
pub use role::RoleFacts;
pub use senses::Senses;
pub use site::Site;
pub use start::Start;
pub use tolerance::{Sigmoid, Tolerance};
pub use value::Value;

/// A creature with a task.
pub trait Agent: Send + Sync + 'static {
    /// Constant facts. Every call returns the same.
    fn facts(&self) -> Facts;

    /// Writes the observation: [`Facts::observation`] numbers.
    fn observe<T: Real>(&self, s: &Senses<T>, out: &mut Obs<T>);

    /// Adds the terms of the reward for the last decision, in the order of [`Facts::reward_terms`].
    ///
    /// It is called once per decision, with the state after it. (The original computed a reward at every physics step
    /// and kept the last one.)
    fn step_reward<T: Real>(&self, s: &Senses<T>, terms: &mut Terms<T>);

    /// Lanes in which the episode is terminated because the agent has failed.
    fn terminated<T: Real>(&self, s: &Senses<T>) -> T::Mask;

    /// Lanes in which the episode is truncated before the time limit, for example at the end of a clip or of a course.
    #[inline(always)]
    fn truncated<T: Real>(&self, s: &Senses<T>) -> T::Mask {
        let _ = s;
        T::none()
    }

    /// Sets the start state of an episode. `start` holds the spawn pose and velocity. Draw random numbers from
    /// [`Start::random`] only. The result must be a function of `start`, because it may be computed before the episode
    /// is due.
    fn reset(&self, start: &mut Start) {
        start.add_noise(ResetNoise::MARATHON);
    }

    /// The agent's schedule of commands. It writes the command ([`Facts::command`]) for observation `step` of an
    /// episode, 0 at the start, and returns for how many decisions it holds. `out` holds the last command, at the start
    /// the values nearest to 0.
    ///
    /// Draw random numbers from `random` only. They depend on the agent, the episode and the step, so other agents and
    /// interruptions do not change the commands. A caller's [`set_command`](crate::VecEnv::set_command) overrides the
    /// schedule.
    fn command(&self, random: &mut EpisodeRng, step: usize, out: &mut [f64]) -> usize {
        let _ = (random, step, out);
        usize::MAX
    }

    /// Converts an action into the controls of the actuators, for example to scale, delay or set targets of servos. By
    /// default, the action is the controls.
    #[inline(always)]
    fn ctrl<T: Real>(&self, c: &mut Ctrl<T>) {
        c.ctrl.copy_from_slice(c.action);
    }

    /// Lanes whose ground changes before the next decision is executed. [`Agent::build`] is called for them. It is
    /// called once per decision, with the agent's memory.
    #[inline(always)]
    fn builds<T: Real>(&self, memory: &[T]) -> T::Mask {
        let _ = memory;
        T::none()
    }

    /// Changes an agent's ground during an episode. The result depends on the site only.
    fn build(&self, site: &mut Site) {
        let _ = site;
    }

    /// Lanes in which a role, numbered as in [`Facts::roles`], acts next. It is called once per decision, with the
    /// state after it.
    ///
    /// A role that does not act keeps its last action, and its rewards meanwhile count for that action. All roles act
    /// at the start of an episode.
    #[inline(always)]
    fn decides<T: Real>(&self, s: &Senses<T>, role: usize) -> T::Mask {
        let _ = (s, role);
        T::not(T::none())
    }

    /// Lanes in which the last decision ends the episode for a role while others continue: first those in which the
    /// role failed, then those in which it did not. It earns nothing afterwards and must not act again before the next
    /// episode.
    #[inline(always)]
    fn leaves<T: Real>(&self, s: &Senses<T>, role: usize) -> [T::Mask; 2] {
        let _ = (s, role);
        [T::none(); 2]
    }

    /// Writes [`Facts::info`] numbers for a user's logs. They are neither observed nor rewarded.
    #[inline(always)]
    fn info<T: Real>(&self, s: &Senses<T>, out: &mut Obs<T>) {
        let _ = (s, out);
    }

    /// Initializes the agent's memory at the start of an episode. It holds zeros, or the values that [`Agent::reset`]
    /// has set ([`Start::memory`]).
    #[inline(always)]
    fn begin<T: Real>(&self, s: &Senses<T>, memory: &mut [T]) {
        let _ = (s, memory);
    }

    /// Updates the agent's memory ([`Facts::memory`] numbers per lane) once per decision, before `step_reward` reads it
    /// through [`Senses::memory`]. The memory is part of snapshots.
    #[inline(always)]
    fn remember<T: Real>(&self, s: &Senses<T>, memory: &mut [T]) {
        let _ = (s, memory);
    }

    /// The agent's named arguments with their values, see [`options!`](crate::options!).
    fn options(&self) -> Vec<OptionInfo> {
        Vec::new()
    }

    /// A copy of the agent with other values of some arguments. `None` if the agent has no arguments.
    fn with_options(&self, options: &Options) -> Option<Self>
    where
        Self: Sized,
    {
        let _ = options;
        None
    }

    /// Checks a model that replaces the agent's own, for agents with a model among their arguments.
    ///
    /// # Errors
    /// The error has the value found and the value expected.
    fn fits(&self, model: &Model) -> Result<(), String> {
        let _ = model;
        Ok(())
    }
}
