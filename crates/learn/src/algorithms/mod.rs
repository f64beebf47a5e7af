//! The algorithms: what each does with a rollout, from top to bottom.
//!
//! An algorithm is a [`Learner`]: its networks' parameters, its optimizer, and whatever else it alone has. It sees the
//! rollout as [`Experience`] and the machine as [`Workers`], who share out the work on gradients; threads, files and the
//! clock are elsewhere. Every worker has a replica and changes it alike, so nothing is shared while gradients are computed;
//! the replicas stay equal bit for bit.

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
use actor_critic::Deviations;
use loss::LossSums;
use marathon_envs::{Demonstrations, Spec};
use marathon_physics::lanes::Isa;
use parameters::Places;
pub use saved::{Numbers, Saved};
pub(crate) use saved::{load_adam, save_adam};
use schedule::Progress;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// What learns from the rollouts, with the settings that are its own.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
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

/// What an algorithm is to learn, and with what.
#[derive(Clone, Copy)]
pub struct Setup<'a> {
    /// The task.
    pub spec: &'a Spec,
    /// Instruction set.
    pub isa: Isa,
    /// Settings.
    pub common: Common<'a>,
    /// Bound of the actions drawn, which are then divided by it.
    pub action_clip: f64,
    /// What is to be imitated, if it is known here.
    pub demonstrations: Option<&'a Demonstrations>,
}

impl<'a> Setup<'a> {
    /// What the rewards are for.
    pub fn purpose(&self) -> Purpose<'a> {
        let Self { spec, common, action_clip, demonstrations, .. } = *self;
        Purpose { spec, seed: common.seed, action_scale: 1.0 / action_clip as f32, demonstrations }
    }
}

/// The settings of a run that are not the algorithm's own, but that it sees.
#[derive(Clone, Copy)]
pub struct Common<'a> {
    /// Networks.
    pub network: &'a NetworkConfig,
    /// Rewards.
    pub rewards: &'a [RewardConfig],
    /// How observations and rewards are normalized.
    pub statistics: &'a StatisticsConfig,
    /// Agents that act side by side.
    pub agents: usize,
    /// Decisions of each in a rollout.
    pub horizon: usize,
    /// Seed.
    pub seed: u64,
}

impl Common<'_> {
    /// Agents of a block.
    pub fn lanes(&self) -> usize {
        self.agents.min(BLOCK)
    }
    /// Blocks of agents.
    pub fn blocks(&self) -> usize {
        self.agents.div_ceil(BLOCK)
    }
    /// Blocks of samples in a rollout.
    pub fn items(&self) -> usize {
        self.blocks() * self.horizon
    }
}

/// What a run with an algorithm needs of memory.
pub struct Needs {
    /// Parameters.
    pub parameters: usize,
    /// Numbers beside the gradient that a group of samples contributes.
    pub moments: usize,
    /// Items of the longest list that a gradient is computed on.
    pub items: usize,
    /// What is kept of a decision.
    pub shape: Shape,
    /// Numbers of what the algorithm keeps of earlier rollouts.
    pub replay: u64,
}

impl Algorithm {
    /// Names in configurations and on the command line.
    pub const NAMES: [&str; 4] = ["ppo", "a2c", "acktr", "sac"];

    /// Its name.
    pub fn name(&self) -> &'static str {
        match self {
            Algorithm::Ppo(_) => "ppo",
            Algorithm::A2c(_) => "a2c",
            Algorithm::Acktr(_) => "acktr",
            Algorithm::Sac(_) => "sac",
        }
    }

    /// A learner at the start of a run, for workers that have so many blocks each.
    pub fn learner(&self, setup: &Setup<'_>, blocks: &[usize]) -> Box<dyn Learner> {
        match self {
            Algorithm::Ppo(settings) => Box::new(ppo::PpoRule::learner(*settings, setup)),
            Algorithm::A2c(settings) => Box::new(a2c::A2cRule::learner(*settings, setup)),
            Algorithm::Acktr(settings) => Box::new(acktr::AcktrRule::learner(*settings, setup)),
            Algorithm::Sac(settings) => Box::new(sac::SacLearner::new(*settings, setup, blocks)),
        }
    }

    /// Checks every setting, and what the algorithm demands of the others.
    ///
    /// # Errors
    /// Names the setting, its value and the values that are valid.
    pub fn validate(&self, common: &Common<'_>) -> Result<(), Error> {
        match self {
            Algorithm::Ppo(settings) => settings.validate(common),
            Algorithm::A2c(settings) => settings.validate(common),
            Algorithm::Acktr(settings) => settings.validate(common),
            Algorithm::Sac(settings) => settings.validate(common),
        }
    }

    /// What a run needs.
    pub fn needs(&self, setup: &Setup<'_>) -> Needs {
        match self {
            Algorithm::Ppo(settings) => settings.needs(setup),
            Algorithm::A2c(settings) => settings.needs(setup),
            Algorithm::Acktr(settings) => settings.needs(setup),
            Algorithm::Sac(settings) => settings.needs(setup),
        }
    }

    /// Its learning rates, for messages.
    pub fn rates(&self) -> String {
        match self {
            Algorithm::Ppo(ppo::Ppo { lr, value_lr, .. }) | Algorithm::Sac(sac::Sac { lr, value_lr, .. }) => {
                format!("lr is {lr:e}, value_lr {value_lr:e}")
            }
            Algorithm::A2c(a2c::A2c { lr, .. }) | Algorithm::Acktr(acktr::Acktr { lr, .. }) => format!("lr is {lr:e}"),
        }
    }

    /// How the learning rate moves.
    pub fn schedule(&self) -> schedule::Schedule {
        match self {
            Algorithm::Ppo(settings) => settings.schedule,
            Algorithm::A2c(settings) => settings.schedule,
            Algorithm::Acktr(settings) => settings.schedule,
            Algorithm::Sac(settings) => settings.schedule,
        }
    }

    /// Standard deviations of the actions, where they do not depend on the state.
    pub fn deviations_mut(&mut self) -> Option<&mut Deviations> {
        match self {
            Algorithm::Ppo(settings) => Some(&mut settings.deviations),
            Algorithm::A2c(settings) => Some(&mut settings.deviations),
            Algorithm::Acktr(settings) => Some(&mut settings.deviations),
            Algorithm::Sac(_) => None,
        }
    }

    /// Whether rollouts may be played elsewhere: not if they are kept, with the agents.
    pub fn travels(&self) -> bool {
        !matches!(self, Algorithm::Sac(_))
    }
}

/// What learns: every worker has a replica, and all change alike.
pub trait Learner: Send {
    /// Another worker's, which shares what all workers share.
    fn replica(&self) -> Box<dyn Learner>;
    /// Where its parameters lie.
    fn places(&self) -> &Places;
    /// Its parameters.
    fn params(&self) -> &[f32];
    /// Its parameters, as many.
    fn params_mut(&mut self) -> &mut Vec<f32>;
    /// What is to be kept of a decision.
    fn shape(&self) -> Shape;
    /// What a horizon is played with.
    fn collecting(&self, statistics: &Statistics) -> RolloutContext<'_>;

    /// Learns from a rollout together with all other workers, and adds up what the objective was.
    fn update(&mut self, workers: &mut dyn Workers, experience: &Experience<'_>, now: Now<'_>, sums: &mut LossSums);
    /// Lets the networks make of an observation what they did with another map of observations.
    fn follow(&mut self, before: &Normalizer, after: &Normalizer);

    /// What reports say of it, after a rollout with such sums and updates with such sums.
    fn describe(&self, totals: &Totals, sums: &LossSums) -> Description;
    /// The policy to act with.
    fn policy(&self, meta: PolicyMeta, normalizer: Normalizer) -> Policy;

    /// All that it needs to go on.
    fn save(&self) -> Saved;
    /// Takes that back.
    ///
    /// # Errors
    /// Names what is missing or of another length.
    fn load(&mut self, saved: &Saved) -> Result<(), Error>;
}

/// The moment of an update.
#[derive(Clone, Copy)]
pub struct Now<'a> {
    /// How far the run is.
    pub progress: &'a Progress,
    /// Statistics of observations and rewards.
    pub statistics: &'a Statistics,
}

/// What reports say of a learner.
#[derive(Clone, Copy, Debug)]
pub struct Description {
    /// Learning rate of the policy.
    pub lr: f64,
    /// Minibatches left out because their gradient was not finite.
    pub skipped: u64,
    /// Part of the returns' variance that the value function foresaw.
    pub explained_variance: f64,
    /// Entropy of the policy, nats.
    pub entropy: f64,
    /// Mean standard deviation of the actions.
    pub std_mean: f64,
}

/// What a group of samples contributes.
pub struct Partial {
    /// Gradient of all parameters.
    pub gradient: Vec<f32>,
    /// Whatever else the algorithm sums.
    pub moments: Vec<f32>,
    /// Sums of the objective.
    pub sums: LossSums,
}

impl Partial {
    /// Room for parameters and moments.
    pub fn new(parameters: usize, moments: usize) -> Self {
        Self { gradient: vec![0.0; parameters], moments: vec![0.0; moments], sums: LossSums::default() }
    }
}

/// Sees a piece of the gradient: its network, its place among the parameters, and the numbers.
pub type ShowPiece<'s> = &'s mut dyn FnMut(usize, Range<usize>, &[f32]);

/// All workers of a run, from the view of one of them. What one calls, all call, in the same order.
pub trait Workers {
    /// Shares a list of so many items out in groups: `work` fills a group's part, for the items of a range. Then the
    /// gradients of all groups are summed. Returns the sums of the objective.
    fn share_out(&mut self, items: usize, work: &mut dyn FnMut(Range<usize>, &mut Partial)) -> LossSums;
    /// Sums of the squares of that gradient, for each network of [`Places`].
    fn squares(&self) -> Vec<f64>;
    /// Shows every piece of that gradient with its network and its place among the parameters; no piece is in two networks.
    fn pieces(&self, show: ShowPiece<'_>);
    /// Shares `parts` parts of another piece of work out, with what the groups of the last gradient contributed, in order;
    /// returns when all are done.
    fn divide(&mut self, parts: usize, work: &mut dyn FnMut(usize, &[&Partial]));
    /// Waits for all workers.
    fn wait(&self);
}

/// Most groups of a list of samples: bounds the memory for partial gradients and the threads that can share a list.
pub const MAX_GROUPS: usize = 32;

/// Groups that a list of items is split into.
pub fn group_count(items: usize) -> usize {
    items.div_ceil(CHUNK).clamp(1, MAX_GROUPS)
}

/// Part `i` of `0..n` split into `parts` nearly equal runs.
pub fn share(n: usize, parts: usize, i: usize) -> Range<usize> {
    n * i / parts..n * (i + 1) / parts
}

/// Checks of settings that several algorithms have.
pub(crate) mod check {
    use super::*;

    /// Refuses what is not above zero.
    pub fn positive(list: &[(&'static str, f64)]) -> Result<(), Error> {
        // in single precision, too, in which most of them are used
        match list.iter().find(|(_, x)| !((*x as f32).is_finite() && *x > 0.0)) {
            Some((field, x)) => Err(Error::config(field, x, "a positive number")),
            None => Ok(()),
        }
    }
    /// Refuses what is not from 0 to below 1.
    pub fn fraction(field: &'static str, x: f64) -> Result<(), Error> {
        match (0.0..1.0).contains(&x) {
            true => Ok(()),
            false => Err(Error::config(field, x, "a number from 0 to below 1")),
        }
    }
    /// Refuses rewards beside the task's.
    pub fn task_alone(common: &Common<'_>, name: &str) -> Result<(), Error> {
        match common.rewards.iter().find(|reward| reward.kind != RewardKind::Task) {
            Some(reward) => {
                let expected = format!("the task's alone with {name}; ppo and a2c take others");
                Err(Error::config("rewards", reward.kind.name(), expected))
            }
            None => Ok(()),
        }
    }
}
