//! The paper's `MarathonAgent`: what somebody writes who adds a creature or a task.
//!
//! An agent is a small value (usually a unit struct) that implements [`Agent`]: constant [`Facts`], and three functions
//! over [`Senses`]: what it sees, what it is rewarded for, when it has failed. They are generic over [`Real`], so one text
//! serves a single agent in double precision and sixteen agents in one vector register. Mark them `#[inline(always)]`
//! (everything that runs inside [`Real::enter`] must be) and let no lane look at another: there is no way to.

pub(crate) mod bindings;
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

use marathon_physics::Model;
use marathon_physics::lanes::Real;

use crate::episode_rng::EpisodeRng;

pub use command::CommandRange;
pub use ctrl::Ctrl;
pub(crate) use facts::FORWARD;
pub use facts::{Body, Controls, Facts, ModelSource, Motors, Part, ResetNoise, View, names};
pub use options::{OptionInfo, OptionSet, OptionValue, Options, Scale, Seconds, Share, Value};
pub use outputs::{Obs, Terms};
pub use reference::{Following, Frame};
pub use role::RoleFacts;
pub use senses::Senses;
pub use site::Site;
pub use start::Start;
pub use tolerance::{Sigmoid, Tolerance};

/// A creature with a task.
pub trait Agent: Send + Sync + 'static {
    /// Constant facts; the same at every call.
    fn facts(&self) -> Facts;

    /// Writes the observation, [`Facts::observation`] numbers.
    fn observe<T: Real>(&self, s: &Senses<T>, out: &mut Obs<T>);

    /// Adds the terms of the reward of the decision just made, in the order of [`Facts::reward_terms`].
    ///
    /// It is called once per decision, with the state that the decision led to. (The original computed a reward at every
    /// physics step and kept the last.)
    fn step_reward<T: Real>(&self, s: &Senses<T>, terms: &mut Terms<T>);

    /// Lanes whose agent has failed.
    fn terminated<T: Real>(&self, s: &Senses<T>) -> T::Mask;

    /// Lanes whose episode is over although nothing has failed, besides those at the time limit: at the end of a clip, or of a
    /// course.
    #[inline(always)]
    fn truncated<T: Real>(&self, s: &Senses<T>) -> T::Mask {
        let _ = s;
        T::none()
    }

    /// Puts the agent where an episode starts. It finds itself in the spawn pose with the spawn velocity; what it adds of
    /// chance comes from [`Start::random`]. It is a function of these alone, and may be called before the episode is due.
    fn reset(&self, start: &mut Start) {
        start.add_noise(ResetNoise::MARATHON);
    }

    /// The agent's own schedule: draws the command, [`Facts::command`], of observation number `step` of an episode, 0 at the
    /// start, and returns for how many decisions it holds. `out` is the command so far; at the start, the values nearest to 0.
    ///
    /// What it adds of chance comes from `random`, whose numbers belong to this agent's episode and step alone: whoever runs
    /// beside it, and wherever it was interrupted, it is told the same. A caller's
    /// [`set_command`](crate::VecEnv::set_command) goes before the schedule.
    fn command(&self, random: &mut EpisodeRng, step: usize, out: &mut [f64]) -> usize {
        let _ = (random, step, out);
        usize::MAX
    }

    /// Turns an action into the controls of the actuators: the place of scaling, delays and targets of servos. Without it, an
    /// action is the controls.
    #[inline(always)]
    fn ctrl<T: Real>(&self, c: &mut Ctrl<T>) {
        c.ctrl.copy_from_slice(c.action);
    }

    /// Lanes whose ground changes before the next decision is carried out: those that [`Agent::build`] is called for. It is
    /// asked once per decision, with what the agent remembers.
    #[inline(always)]
    fn builds<T: Real>(&self, memory: &[T]) -> T::Mask {
        let _ = memory;
        T::none()
    }

    /// Changes an agent's ground in mid-episode. It is a function of the site alone.
    fn build(&self, site: &mut Site) {
        let _ = site;
    }

    /// Lanes in which a role, numbered as in [`Facts::roles`], decides next. It is asked once per decision, with the state that
    /// the decision led to. A role that does not decide goes on with its last action, and what it earns meanwhile counts for
    /// its last decision. All roles decide at the start of an episode.
    #[inline(always)]
    fn decides<T: Real>(&self, s: &Senses<T>, role: usize) -> T::Mask {
        let _ = (s, role);
        T::not(T::none())
    }

    /// Lanes in which a role's part of the episode ends with the decision just made while others go on: those in which it has
    /// failed, and those in which it has not. What it earns later counts for nothing, and it is not to decide again before the
    /// next episode.
    #[inline(always)]
    fn leaves<T: Real>(&self, s: &Senses<T>, role: usize) -> [T::Mask; 2] {
        let _ = (s, role);
        [T::none(); 2]
    }

    /// Reports numbers that are neither observed nor rewarded, as many as [`Facts::info`] names: for a user's logs.
    #[inline(always)]
    fn info<T: Real>(&self, s: &Senses<T>, out: &mut Obs<T>) {
        let _ = (s, out);
    }

    /// Sets the agent's own variables at the start of an episode, where they are zero, or what [`Agent::reset`] has drawn
    /// ([`Start::memory`]).
    #[inline(always)]
    fn begin<T: Real>(&self, s: &Senses<T>, memory: &mut [T]) {
        let _ = (s, memory);
    }

    /// Updates the agent's own variables, [`Facts::memory`] of them per lane, once per decision, before `step_reward`
    /// reads them through [`Senses::memory`]. They start at zero, or at what [`Agent::reset`] and [`Agent::begin`] set, and
    /// belong to snapshots.
    #[inline(always)]
    fn remember<T: Real>(&self, s: &Senses<T>, memory: &mut [T]) {
        let _ = (s, memory);
    }

    /// The named arguments that it takes, with the values that it has, see [`options!`](crate::options!).
    fn options(&self) -> Vec<OptionInfo> {
        Vec::new()
    }

    /// The agent with other values for some of its arguments; `None` if it takes none.
    fn with_options(&self, options: &Options) -> Option<Self>
    where
        Self: Sized,
    {
        let _ = options;
        None
    }

    /// Whether it can do with a model that is not its own, if one of its arguments is a model.
    ///
    /// # Errors
    /// What was found and what was expected.
    fn fits(&self, model: &Model) -> Result<(), String> {
        let _ = model;
        Ok(())
    }
}
