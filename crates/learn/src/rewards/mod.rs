//! The rewards that a policy learns from: the task's own and intrinsic ones. As in ML-Agents, each has its own
//! discount, strength and stream of values. You can combine any number of them.
//!
//! Rewards for novelty, [curiosity] and [random network distillation](rnd), have their own networks. These compute a
//! reward for each step of a rollout ([`RewardModel::reward`]), and learn from the same minibatches as policy and value
//! function ([`RewardModel::gradient`]). The reward fades where they have learned. A reward for [imitation](discriminator)
//! learns to distinguish the agent's decisions from demonstrated ones. To add a kind of reward, implement [`Reward`].

pub mod curiosity;
pub mod discriminator;
pub mod document;
mod kernels;
pub mod rnd;

use crate::error::Error;
use crate::lanes::noise::{SIGNALS, SplitMix};
use crate::nets::normalize::Normalizer;
use curiosity::Curiosity;
use discriminator::{Discriminator, Imitation};
use marathon_envs::{Demonstrations, Spec};
use marathon_physics::lanes::Isa;
use rnd::Rnd;
use serde::{Deserialize, Serialize};
use std::ops::Range;
use std::sync::Arc;

/// Kind of a reward.
#[derive(Clone, Debug, PartialEq)]
pub enum RewardKind {
    /// The task's reward.
    Task,
    /// The error of a prediction of the next features from the current ones and the action. Features are those that
    /// determine the action (Pathak et al., "Curiosity-driven exploration by self-supervised prediction", 2017).
    Curiosity(Novelty),
    /// The error of a network that learns the output of a fixed random network (Burda et al., "Exploration by random
    /// network distillation", 2018).
    Rnd(Novelty),
    /// Failure of a network to distinguish the agent's decisions from demonstrated ones.
    Imitation(Imitation),
}

impl RewardKind {
    /// All names, in the order in which rewards are learned from.
    pub const NAMES: [&str; 5] = ["task", "curiosity", "rnd", "gail", "amp"];

    /// Name in configurations and reports.
    pub fn name(&self) -> &'static str {
        match self {
            RewardKind::Task => "task",
            RewardKind::Curiosity(_) => "curiosity",
            RewardKind::Rnd(_) => "rnd",
            RewardKind::Imitation(imitation) => imitation.form.name(),
        }
    }
    /// Widths of the hidden layers of its networks and their learning rate, if it has networks.
    pub fn networks(&self) -> Option<(&[usize], f64)> {
        match self {
            RewardKind::Task => None,
            RewardKind::Curiosity(Novelty { hidden, lr }) | RewardKind::Rnd(Novelty { hidden, lr }) => {
                Some((hidden, *lr))
            }
            RewardKind::Imitation(Imitation { hidden, lr, .. }) => Some((hidden, *lr)),
        }
    }
    /// The imitation settings, if this reward is imitation.
    pub fn imitation(&self) -> Option<&Imitation> {
        match self {
            RewardKind::Imitation(settings) => Some(settings),
            _ => None,
        }
    }
    /// Mutable access to the imitation settings, if this reward is imitation.
    pub fn imitation_mut(&mut self) -> Option<&mut Imitation> {
        match self {
            RewardKind::Imitation(settings) => Some(settings),
            _ => None,
        }
    }
}

/// Networks of a reward for novelty. The defaults are ML-Agents'.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Novelty {
    /// Widths of the network that computes features of an observation. The last is the number of features.
    pub hidden: Vec<usize>,
    /// Learning rate.
    pub lr: f64,
}

impl Default for Novelty {
    fn default() -> Self {
        Self { hidden: vec![128, 128], lr: 3e-4 }
    }
}

/// A reward; the defaults are ML-Agents'.
#[derive(Clone, Debug, PartialEq)]
pub struct RewardConfig {
    /// Kind of the reward.
    pub kind: RewardKind,
    /// Factor of the reward. For the task's reward it matters only with other rewards.
    pub strength: f64,
    /// Discount per decision. Rewards for novelty do not end with an episode: the value function estimates the rest.
    pub gamma: f64,
}

impl RewardConfig {
    /// A reward with ML-Agents' defaults.
    pub fn new(kind: RewardKind) -> Self {
        Self { kind, strength: 1.0, gamma: 0.99 }
    }

    /// A field of this reward.
    fn field(&self, name: &str) -> String {
        format!("{}.{name}", self.kind.name())
    }

    /// Checks every field.
    ///
    /// # Errors
    /// Names the field, its value and the values that are valid.
    pub fn validate(&self) -> Result<(), Error> {
        let positive = |field, x: f64| match (x as f32).is_finite() && x > 0.0 {
            true => Ok(()),
            false => Err(Error::config(self.field(field), x, "a positive number")),
        };
        positive("strength", self.strength)?;
        if !(0.0..=1.0).contains(&self.gamma) {
            return Err(Error::config(self.field("gamma"), self.gamma, "a number between 0 and 1"));
        }
        let Some((hidden, lr)) = self.kind.networks() else { return Ok(()) };
        positive("lr", lr)?;
        if hidden.is_empty() || hidden.len() > 64 || hidden.iter().any(|w| !(1..=4096).contains(w)) {
            return Err(Error::config(
                self.field("hidden"),
                format!("{hidden:?}"),
                "1 to 64 widths between 1 and 4096",
            ));
        }
        self.kind.imitation().map_or(Ok(()), Imitation::validate).map_err(|error| error.within(self.kind.name()))
    }
}

/// A block of steps: rows of sixteen, normalized.
#[derive(Clone, Copy)]
pub struct Step<'a, S> {
    /// Observations, `[obs][16]`.
    pub obs: &'a [S],
    /// Actions as drawn, `[action][16]`.
    pub action: &'a [S],
    /// Next observations, before a reset.
    pub next: &'a [S],
}

/// An intrinsic reward, computed by networks.
pub trait Reward: Send + Sync {
    /// Number of trained parameters.
    fn count(&self) -> usize;
    /// Initializes the parameters.
    fn init(&self, params: &mut [f32], random: &mut SplitMix);
    /// Creates the networks with their work space, one for each worker.
    fn reward_model(&self) -> Box<dyn RewardModel>;
    /// Whether the reward continues beyond the end of an episode.
    fn ignores_done(&self) -> bool {
        true
    }
    /// Upper bound of the reward of a step, after the factor `strength`.
    fn bound(&self) -> f64 {
        1.0
    }
}

/// The networks of a [`Reward`] with their work space.
pub trait RewardModel: Send {
    /// Computes rewards of at most [`CHUNK`](crate::nets::mlp::CHUNK) blocks of steps, a row of sixteen each.
    fn reward(&mut self, isa: Isa, params: &[f32], steps: &[Step<'_, f32>], out: &mut [f32]);
    /// Overwrites `gradient` with that of the networks' loss, summed over the steps.
    fn gradient(
        &mut self,
        isa: Isa,
        params: &[f32],
        steps: &[Step<'_, f32>],
        minibatch: &Minibatch<'_>,
        gradient: &mut [f32],
    );
}

/// Context of the steps that a [`RewardModel`] learns from.
#[derive(Clone, Copy)]
pub struct Minibatch<'a> {
    /// Map that normalized their observations.
    pub normalizer: &'a Normalizer,
    /// Index of the minibatch in the run.
    pub batch: u64,
    /// Indices of the steps in the rollout.
    pub items: &'a [u32],
}

/// Context for the rewards of a run.
#[derive(Clone, Copy)]
pub struct Purpose<'a> {
    /// The task.
    pub spec: &'a Spec,
    /// Seed of the run.
    pub seed: u64,
    /// Factor that maps sampled actions to [-1, 1], before they are clipped.
    pub action_scale: f32,
    /// Demonstrations to imitate, if this process has them.
    pub demonstrations: Option<&'a Demonstrations>,
}

/// A stream of rewards.
#[derive(Clone)]
pub struct Stream {
    /// Factor.
    pub strength: f64,
    /// Discount per decision.
    pub gamma: f64,
    /// Whether it continues beyond the end of an episode.
    pub ignores_done: bool,
    /// Its networks, unless it is the task's reward.
    pub networks: Option<Networks>,
}

/// Networks of a reward, as part of a learner's parameters.
#[derive(Clone)]
pub struct Networks {
    /// The networks.
    pub reward: Arc<dyn Reward>,
    /// Place of their parameters.
    pub place: Range<usize>,
    /// Their learning rate.
    pub lr: f64,
}

impl Stream {
    /// Creates the streams of the configured rewards for an agent. `place` reserves places for parameters. Parameters
    /// that are not trained depend on the seed.
    pub fn all(
        rewards: &[RewardConfig],
        purpose: Purpose<'_>,
        mut place: impl FnMut(usize) -> Range<usize>,
    ) -> Vec<Self> {
        let Purpose { spec, seed, .. } = purpose;
        let mut random = streams_of_random_numbers(seed);
        let (obs, act) = (spec.obs, spec.act);
        let stream = |config: &RewardConfig| {
            let networks = config.kind.networks().map(|(hidden, lr)| {
                let [fixed, _] = &mut random.next().expect("the iterator is endless");
                let reward: Arc<dyn Reward> = match &config.kind {
                    RewardKind::Rnd(_) => Arc::new(Rnd::new(obs, hidden, fixed)),
                    RewardKind::Imitation(settings) => {
                        let sees = settings.sees(spec).unwrap_or_else(|_| (0..obs).collect());
                        Arc::new(Discriminator::new(settings, sees, purpose))
                    }
                    _ => Arc::new(Curiosity::new(obs, act, hidden)),
                };
                Networks { place: place(reward.count()), reward, lr }
            });
            let ignores_done = networks.as_ref().is_some_and(|nets| nets.reward.ignores_done());
            Stream { strength: config.strength, gamma: config.gamma, ignores_done, networks }
        };
        rewards.iter().map(stream).collect()
    }

    /// Initializes the parameters of all networks.
    pub fn init(streams: &[Stream], params: &mut [f32], seed: u64) {
        let networks = streams.iter().filter_map(|stream| stream.networks.as_ref());
        for (networks, [_, mut random]) in networks.zip(streams_of_random_numbers(seed)) {
            networks.reward.init(&mut params[networks.place.clone()], &mut random);
        }
    }
}

/// Random numbers for each reward with networks: for fixed parameters, and for trained ones.
fn streams_of_random_numbers(seed: u64) -> impl Iterator<Item = [SplitMix; 2]> {
    (0..).map(move |i: u64| [2 * i, 2 * i + 1].map(|n| SplitMix::new(seed, SIGNALS + n)))
}
