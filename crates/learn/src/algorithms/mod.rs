//! The algorithms: how each one learns from a rollout, from top to bottom.
//!
//! An algorithm is a [`Learner`]: the parameters of its networks, its optimizer, and its own further state. It reads
//! the rollout as [`Experience`] and shares the work on gradients through [`Workers`]. Threads, files and the clock are
//! elsewhere. Every worker has a replica and updates it in the same way, so replicas share nothing during gradients and
//! stay equal bit for bit.

pub mod a2c;
pub mod acktr;
pub mod actor_critic;
pub mod loss;
mod on_policy;
pub mod parameters;
pub mod ppo;
pub mod sac;
pub(crate) mod saved;
pub mod schedule;

use crate::error::Error;
use crate::lanes::BLOCK;
use crate::nets::NetworkConfig;
use crate::nets::mlp::CHUNK;
use crate::nets::normalize::Normalizer;
use crate::policy::{Policy, PolicyMeta};
use crate::rewards::{Purpose, RewardConfig, RewardKind};
use crate::rollout::context::RolloutContext;
use crate::rollout::data::{Experience, Shape};
use crate::rollout::statistics::{Statistics, StatisticsConfig};
use crate::rollout::sums::Totals;
use actor_critic::ActionStd;
use loss::LossSums;
use marathon_envs::{Demonstrations, Spec};
use marathon_physics::lanes::Isa;
use parameters::Places;
pub use saved::{Numbers, Saved};
pub(crate) use saved::{load_adam, save_adam};
use schedule::Progress;
use std::ops::Range;

/// Algorithm that learns from the rollouts, with its own settings. In files, the section with these settings has its
/// name.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Algorithm {
    /// Proximal policy optimization.
    Ppo(ppo::Ppo),
    /// Advantage actor-critic.
    A2c(a2c::A2c),
    /// Actor-critic with the natural gradient and a trust region.
    Acktr(acktr::Acktr),
    /// Soft actor-critic, from a replay.
    Sac(sac::Sac),
}

impl Default for Algorithm {
    fn default() -> Self {
        Algorithm::Ppo(ppo::Ppo::default())
    }
}

/// The task and the settings for a new learner.
#[derive(Clone, Copy)]
pub struct Setup<'a> {
    /// The task.
    pub spec: &'a Spec,
    /// Instruction set.
    pub isa: Isa,
    /// Settings.
    pub common: SharedConfig<'a>,
    /// Bound of the sampled actions, which are then divided by it.
    pub action_clip: f64,
    /// Demonstrations to imitate, if this process has them.
    pub demonstrations: Option<&'a Demonstrations>,
}

impl<'a> Setup<'a> {
    /// The context of the rewards.
    pub fn purpose(&self) -> Purpose<'a> {
        let Self { spec, common, action_clip, demonstrations, .. } = *self;
        Purpose { spec, seed: common.seed, action_scale: 1.0 / action_clip as f32, demonstrations }
    }
}

/// Settings of a run that are not specific to the algorithm but visible to it.
#[derive(Clone, Copy)]
pub struct SharedConfig<'a> {
    /// Networks.
    pub network: &'a NetworkConfig,
    /// Reward signals.
    pub rewards: &'a [RewardConfig],
    /// Normalization of observations and rewards.
    pub statistics: &'a StatisticsConfig,
    /// Number of agents.
    pub agents: usize,
    /// Decisions per agent and rollout.
    pub horizon: usize,
    /// Seed.
    pub seed: u64,
}

impl SharedConfig<'_> {
    /// Agents per block.
    pub fn lanes(&self) -> usize {
        self.agents.min(BLOCK)
    }
    /// Number of blocks of agents.
    pub fn blocks(&self) -> usize {
        self.agents.div_ceil(BLOCK)
    }
    /// Blocks of samples per rollout.
    pub fn items(&self) -> usize {
        self.blocks() * self.horizon
    }
}

/// Memory that a run with an algorithm needs.
pub struct MemoryPlan {
    /// Number of parameters.
    pub parameters: usize,
    /// Numbers that a group of samples contributes besides the gradient.
    pub moments: usize,
    /// Items of the longest list for which a gradient is computed.
    pub items: usize,
    /// Data that is kept per decision.
    pub shape: Shape,
    /// Numbers that the algorithm keeps of earlier rollouts.
    pub replay: u64,
}

impl Algorithm {
    /// Names in configurations and on the command line.
    pub const NAMES: [&str; 4] = ["ppo", "a2c", "acktr", "sac"];

    /// Name of the algorithm.
    pub fn name(&self) -> &'static str {
        match self {
            Algorithm::Ppo(_) => "ppo",
            Algorithm::A2c(_) => "a2c",
            Algorithm::Acktr(_) => "acktr",
            Algorithm::Sac(_) => "sac",
        }
    }

    /// Creates a learner at the start of a run, for workers with `blocks[i]` blocks each.
    pub fn learner(&self, setup: &Setup<'_>, blocks: &[usize]) -> Box<dyn Learner> {
        match self {
            Algorithm::Ppo(settings) => Box::new(ppo::PpoRule::learner(*settings, setup)),
            Algorithm::A2c(settings) => Box::new(a2c::A2cRule::learner(*settings, setup)),
            Algorithm::Acktr(settings) => Box::new(acktr::AcktrRule::learner(*settings, setup)),
            Algorithm::Sac(settings) => Box::new(sac::SacLearner::new(*settings, setup, blocks)),
        }
    }

    /// Checks every setting, and what the algorithm requires of the other settings.
    ///
    /// # Errors
    /// Names the setting, its value and the values that are valid.
    pub fn validate(&self, common: &SharedConfig<'_>) -> Result<(), Error> {
        match self {
            Algorithm::Ppo(settings) => settings.validate(common),
            Algorithm::A2c(settings) => settings.validate(common),
            Algorithm::Acktr(settings) => settings.validate(common),
            Algorithm::Sac(settings) => settings.validate(common),
        }
    }

    /// Memory that a run needs.
    pub fn memory_plan(&self, setup: &Setup<'_>) -> MemoryPlan {
        match self {
            Algorithm::Ppo(settings) => settings.memory_plan(setup),
            Algorithm::A2c(settings) => settings.memory_plan(setup),
            Algorithm::Acktr(settings) => settings.memory_plan(setup),
            Algorithm::Sac(settings) => settings.memory_plan(setup),
        }
    }

    /// Text with the learning rates, for messages.
    pub fn rates(&self) -> String {
        match self {
            Algorithm::Ppo(ppo::Ppo { lr, value_lr, .. }) | Algorithm::Sac(sac::Sac { lr, value_lr, .. }) => {
                format!("lr is {lr:e}, value_lr {value_lr:e}")
            }
            Algorithm::A2c(a2c::A2c { lr, .. }) | Algorithm::Acktr(acktr::Acktr { lr, .. }) => format!("lr is {lr:e}"),
        }
    }

    /// Schedule of the learning rate.
    pub fn lr_schedule(&self) -> schedule::LrSchedule {
        match self {
            Algorithm::Ppo(settings) => settings.lr_schedule,
            Algorithm::A2c(settings) => settings.lr_schedule,
            Algorithm::Acktr(settings) => settings.lr_schedule,
            Algorithm::Sac(settings) => settings.lr_schedule,
        }
    }

    /// Bound of the actions drawn, which are then divided by it.
    pub fn action_clip(&self) -> f64 {
        match self {
            Algorithm::Ppo(settings) => settings.action_clip,
            Algorithm::A2c(settings) => settings.action_clip,
            Algorithm::Acktr(settings) => settings.action_clip,
            // it squashes them
            Algorithm::Sac(_) => 1.0,
        }
    }

    /// Mutable standard deviations of the actions, if they do not depend on the state.
    pub fn action_std_mut(&mut self) -> Option<&mut ActionStd> {
        match self {
            Algorithm::Ppo(settings) => Some(&mut settings.action_std),
            Algorithm::A2c(settings) => Some(&mut settings.action_std),
            Algorithm::Acktr(settings) => Some(&mut settings.action_std),
            Algorithm::Sac(_) => None,
        }
    }

    /// Whether other processes may play rollouts. A replay keeps rollouts with the agents, which rules that out.
    pub fn travels(&self) -> bool {
        !matches!(self, Algorithm::Sac(_))
    }
}

/// A learner. Every worker has a replica, and all replicas change in the same way.
pub trait Learner: Send {
    /// Creates a replica for another worker. It shares the data that all workers share.
    fn replica(&self) -> Box<dyn Learner>;
    /// Places of the networks in the parameters.
    fn places(&self) -> &Places;
    /// The parameters.
    fn params(&self) -> &[f32];
    /// The parameters. Their number must stay the same.
    fn params_mut(&mut self) -> &mut Vec<f32>;
    /// Data that is kept per decision.
    fn shape(&self) -> Shape;
    /// Networks and constants for a rollout.
    fn collecting(&self, statistics: &Statistics) -> RolloutContext<'_>;

    /// Learns from a rollout together with all other workers, and adds the objective to `sums`.
    fn update(&mut self, workers: &mut dyn Workers, experience: &Experience<'_>, now: Now<'_>, sums: &mut LossSums);
    /// Adapts the networks to another map of observations, so that their outputs for a raw observation stay the same.
    fn follow(&mut self, before: &Normalizer, after: &Normalizer);

    /// Numbers for reports, given the sums over the rollout and over its updates.
    fn describe(&self, totals: &Totals, sums: &LossSums) -> Description;
    /// The current policy.
    fn policy(&self, meta: PolicyMeta, normalizer: Normalizer) -> Policy;

    /// The full state, for resuming.
    fn save(&self) -> Saved;
    /// Restores a saved state.
    ///
    /// # Errors
    /// Names the entry that is missing or has the wrong length.
    fn load(&mut self, saved: &Saved) -> Result<(), Error>;
}

/// Context of an update.
#[derive(Clone, Copy)]
pub struct Now<'a> {
    /// Progress of the run.
    pub progress: &'a Progress,
    /// Statistics of observations and rewards.
    pub statistics: &'a Statistics,
}

/// Numbers of a learner for reports.
#[derive(Clone, Copy, Debug)]
pub struct Description {
    /// Learning rate of the policy.
    pub lr: f64,
    /// Minibatches that were skipped because their gradient was not finite.
    pub skipped: u64,
    /// Fraction of the variance of the returns that the value function explains.
    pub explained_variance: f64,
    /// Entropy of the policy, nats.
    pub entropy: f64,
    /// Mean standard deviation of the actions.
    pub std_mean: f64,
}

/// Contribution of a group of samples.
pub struct Partial {
    /// Gradient of all parameters.
    pub gradient: Vec<f32>,
    /// Further sums of the algorithm.
    pub moments: Vec<f32>,
    /// Sums of the objective.
    pub sums: LossSums,
}

impl Partial {
    /// Allocates parameters and moments.
    pub fn new(parameters: usize, moments: usize) -> Self {
        Self { gradient: vec![0.0; parameters], moments: vec![0.0; moments], sums: LossSums::default() }
    }
}

/// Receives a piece of the gradient: its network, its place among the parameters, and the numbers.
pub type ShowPiece<'s> = &'s mut dyn FnMut(usize, Range<usize>, &[f32]);

/// All workers of a run, as seen by one of them. All workers must make the same calls in the same order.
pub trait Workers {
    /// Splits a list of `items` items into groups: `work` fills the contribution of a group for a range of items. Then
    /// sums the gradients of all groups. Returns the sums of the objective.
    fn share_out(&mut self, items: usize, work: &mut dyn FnMut(Range<usize>, &mut Partial)) -> LossSums;
    /// Sums of squares of the summed gradient, for each network of [`Places`].
    fn squares(&self) -> Vec<f64>;
    /// Shows every piece of the summed gradient with its network and its place among the parameters. No piece spans two
    /// networks.
    fn pieces(&self, show: ShowPiece<'_>);
    /// Splits other work into `parts` parts. `work` also gets the groups' contributions to the last gradient, in order.
    /// Returns when all parts are done.
    fn divide(&mut self, parts: usize, work: &mut dyn FnMut(usize, &[&Partial]));
    /// Waits for all workers.
    fn wait(&self);
}

/// Maximum number of groups per list of samples. It bounds the memory for partial gradients and the threads that can
/// share a list.
pub const MAX_GROUPS: usize = 32;

/// Number of groups for a list of items.
pub fn group_count(items: usize) -> usize {
    items.div_ceil(CHUNK).clamp(1, MAX_GROUPS)
}

/// Part `i` of `0..n` when it is split into `parts` nearly equal ranges.
pub fn share(n: usize, parts: usize, i: usize) -> Range<usize> {
    n * i / parts..n * (i + 1) / parts
}

/// Checks of settings that several algorithms have.
pub(crate) mod check {
    use super::*;

    /// Refuses values that are not above zero.
    pub fn positive(list: &[(&'static str, f64)]) -> Result<(), Error> {
        // checked in single precision too, where most of them are used
        match list.iter().find(|(_, x)| !((*x as f32).is_finite() && *x > 0.0)) {
            Some((field, x)) => Err(Error::config(*field, x, "a positive number")),
            None => Ok(()),
        }
    }
    /// Refuses values outside 0 to below 1.
    pub fn fraction(field: &'static str, x: f64) -> Result<(), Error> {
        match (0.0..1.0).contains(&x) {
            true => Ok(()),
            false => Err(Error::config(field, x, "a number from 0 to below 1")),
        }
    }
    /// Refuses rewards other than the task's.
    pub fn task_alone(common: &SharedConfig<'_>, name: &str) -> Result<(), Error> {
        match common.rewards.iter().find(|reward| reward.kind != RewardKind::Task) {
            Some(reward) => {
                let expected = format!("the task's alone with {name}; ppo and a2c take others");
                Err(Error::config("rewards", reward.kind.name(), expected))
            }
            None => Ok(()),
        }
    }
}
