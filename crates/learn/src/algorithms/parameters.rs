//! What learning changes: parameters, optimizer, statistics, counters.
//!
//! Every worker holds a replica and applies the same updates to it, so nothing is shared while minibatches are
//! computed; the replicas stay equal bit for bit.

use crate::lanes::BLOCK;
use crate::lanes::noise::{PARAMETERS, SIGNALS, SplitMix};
use crate::nets::gaussian::Gaussian;
use crate::nets::init;
use crate::nets::mlp::Mlp;
use crate::nets::normalize::{Moments, Normalizer};
use crate::optim::adam::Adam;
use crate::rewards::{MAX_SIGNALS, SignalNets};
use crate::rollout::advantage::Discounts;
use crate::rollout::collect::{Acting, Rollout};
use crate::rollout::sums::BlockSums;
use crate::trainer::config::Algorithm;
use crate::trainer::config::PpoConfig;
use crate::trainer::config::{Init, Ratio};
use marathon_envs::Spec;
use marathon_physics::lanes::{Isa, Real};
use std::ops::{Deref, Range};

/// Gradient elements whose squares are summed together.
const NORM_BLOCK: usize = 1024;

/// Where the parameters of the two networks lie in one array; both parts are padded with zeros to rows of sixteen.
#[derive(Clone, Debug)]
pub struct Layout {
    /// Policy network.
    pub actor: Mlp,
    /// Value network.
    pub critic: Mlp,
    /// Logarithms of the standard deviations, after the policy network's parameters.
    pub log_std: Range<usize>,
    /// First parameter of the value network, which has an output for each stream of rewards.
    pub critic_start: usize,
    /// Whether each action has a probability ratio of its own.
    pub ratio: Ratio,
    /// Agents in a block: sixteen, or fewer, which the other lanes [mirror](crate::lanes::mirror).
    pub lanes: usize,
    /// The second value network and what else SAC has.
    pub twin: Option<Twin>,
    /// Networks of the reward signals, with the places of their parameters, which follow.
    pub signals: Vec<(SignalNets, Range<usize>)>,
    /// Length of the array.
    pub len: usize,
}

/// What only SAC has among the parameters.
#[derive(Clone, Debug)]
pub struct Twin {
    /// First parameter of the second value network.
    pub second: usize,
    /// The logarithm of the entropy's weight.
    pub alpha: usize,
}

impl Layout {
    /// For a task and a configuration.
    pub fn new(spec: &Spec, config: &PpoConfig) -> Self {
        let sizes = |hidden: &[usize], out| [&[spec.obs], hidden, &[out]].concat();
        let sac = matches!(config.algorithm, Algorithm::Sac(_));
        // SAC's policy gives deviations too, and its value networks see the action
        let outputs = if sac { 2 * spec.act } else { spec.act };
        let actor = Mlp::new(&sizes(&config.actor_hidden, outputs), config.activation);
        let critic = match sac {
            true => Mlp::new(&[&[spec.obs + spec.act], &config.critic_hidden[..], &[1]].concat(), config.activation),
            false => Mlp::new(&sizes(&config.critic_hidden, 1 + config.signals.len()), config.activation),
        };
        let log_std = actor.len()..actor.len() + spec.act;
        let critic_start = log_std.end.next_multiple_of(BLOCK);
        let mut len = (critic_start + critic.len()).next_multiple_of(BLOCK);
        let twin = sac.then(|| {
            let second = len;
            let alpha = (second + critic.len()).next_multiple_of(BLOCK);
            len = alpha + BLOCK;
            Twin { second, alpha }
        });
        let mut signals = Vec::new();
        for (i, signal) in config.signals.iter().enumerate() {
            let nets = SignalNets::new(spec, signal, &mut SplitMix::new(config.seed, SIGNALS + 2 * i as u64));
            let place = len..len + nets.count();
            len = place.end.next_multiple_of(BLOCK);
            signals.push((nets, place));
        }
        Self {
            actor,
            critic,
            log_std,
            critic_start,
            ratio: config.ratio,
            lanes: config.agents.min(BLOCK),
            twin,
            signals,
            len,
        }
    }
    /// The policy network's parameters.
    pub fn actor_params<'a>(&self, params: &'a [f32]) -> &'a [f32] {
        &params[..self.actor.len()]
    }
    /// The value network's parameters.
    pub fn critic_params<'a>(&self, params: &'a [f32]) -> &'a [f32] {
        &params[self.critic_start..self.critic_start + self.critic.len()]
    }
    /// The parameters of SAC's two value networks.
    pub fn critics<'a>(&self, params: &'a [f32]) -> [&'a [f32]; 2] {
        let second = self.twin.as_ref().map_or(self.critic_start, |twin| twin.second);
        [self.critic_start, second].map(|start| &params[start..start + self.critic.len()])
    }
    /// The same of their slow copies.
    pub fn critics_of_targets<'a>(&self, targets: &'a [f32]) -> [&'a [f32]; 2] {
        let second = self.twin.as_ref().map_or(0, |twin| twin.second - self.critic_start);
        [0, second].map(|start| &targets[start..start + self.critic.len()])
    }
    /// Streams of rewards: the task's and one for each signal.
    pub fn streams(&self) -> usize {
        1 + self.signals.len()
    }
    /// Where each network's parameters begin: the policy's, the value function's, the signals'.
    fn starts(&self) -> impl Iterator<Item = usize> + '_ {
        let twin = self.twin.iter().flat_map(|twin| [twin.second, twin.alpha]);
        [0, self.critic_start].into_iter().chain(twin).chain(self.signals.iter().map(|(_, place)| place.start))
    }
    /// Which network a piece of the array is in: 0 for the policy, 1 for the value function, then the signals.
    pub fn network(&self, piece: &Range<usize>) -> usize {
        self.starts().filter(|start| *start <= piece.start).count() - 1
    }
    /// Pieces of the array whose squares are summed together, none of them in two networks.
    pub fn norm_blocks(&self) -> Vec<Range<usize>> {
        let cut = |r: Range<usize>| r.clone().step_by(NORM_BLOCK).map(move |i| i..(i + NORM_BLOCK).min(r.end));
        let ends = self.starts().skip(1).chain([self.len]);
        self.starts().zip(ends).flat_map(|(start, end)| cut(start..end)).collect()
    }
}

/// The state of learning.
#[derive(Clone, Debug, PartialEq)]
pub struct Learner {
    /// Parameters of both networks, see [`Layout`].
    pub params: Vec<f32>,
    /// Slow copies of SAC's value networks.
    pub targets: Vec<f32>,
    /// Optimizer.
    pub adam: Adam,
    /// Learning rate of the policy.
    pub lr: f64,
    /// Statistics of raw observations.
    pub observations: Moments,
    /// Statistics of the discounted return.
    pub returns: Moments,
    /// Rollouts so far.
    pub iteration: u64,
    /// Agent-steps so far.
    pub steps: u64,
    /// Minibatches skipped because their gradient was not finite.
    pub skipped: u64,
}

impl Learner {
    /// At the start of a run.
    pub fn new(layout: &Layout, spec: &Spec, config: &PpoConfig) -> Self {
        let mut params = vec![0.0; layout.len];
        let mut random = SplitMix::new(config.seed, PARAMETERS);
        let (actor, critic) = params.split_at_mut(layout.critic_start);
        match config.initialization {
            Init::Orthogonal => {
                init::orthogonal(&layout.actor, actor, 0.01, &mut random);
                init::orthogonal(&layout.critic, critic, 1.0, &mut random);
            }
            Init::MlAgents => {
                init::ml_agents(&layout.actor, actor, |inputs| 0.2 / inputs.sqrt(), &mut random);
                // each stream of rewards has an output layer there
                init::ml_agents(&layout.critic, critic, |inputs| (2.0 / (inputs + 1.0)).sqrt(), &mut random);
            }
        }
        params[layout.log_std.clone()].fill(config.init_log_std as f32);
        for (i, (nets, place)) in layout.signals.iter().enumerate() {
            nets.init(&mut params[place.clone()], &mut SplitMix::new(config.seed, SIGNALS + 2 * i as u64 + 1));
        }
        let mut targets = Vec::new();
        if let (Some(twin), Algorithm::Sac(sac)) = (&layout.twin, &config.algorithm) {
            init::orthogonal(&layout.critic, &mut params[twin.second..], 1.0, &mut random);
            params[twin.alpha] = Real::ln(sac.init_alpha) as f32;
            targets = params[layout.critic_start..twin.alpha].to_vec();
        }
        let mut adam = Adam::new(layout.len, config.adam_epsilon);
        if let Algorithm::A2c(_) = config.algorithm {
            // its mean square starts at 1, or the first steps would be ten times the rate
            adam.v.fill(1.0);
        }
        Self {
            params,
            targets,
            adam,
            lr: config.lr,
            observations: Moments::new(spec.obs),
            returns: Moments::new(1),
            iteration: 0,
            steps: 0,
            skipped: 0,
        }
    }

    /// Current standard deviations.
    pub fn gaussian(&self, layout: &Layout) -> Gaussian<f32> {
        Gaussian::new(&self.params[layout.log_std.clone()])
    }

    /// Current map of observations.
    pub fn normalizer(&self, config: &PpoConfig) -> Normalizer {
        let clip = config.observation_clip as f32;
        if config.normalize_observations {
            Normalizer::new(self.observations.mean32(), self.observations.std(), clip)
        } else {
            Normalizer::identity(self.observations.mean.len(), clip)
        }
    }

    /// Factor of the rewards.
    pub fn reward_scale(&self, config: &PpoConfig) -> f64 {
        if config.scale_rewards { 1.0 / (self.returns.var[0] + 1e-8).sqrt().max(1e-3) } else { 1.0 }
    }

    /// Lets `f` act with what has been learned.
    pub fn acting<R>(&self, isa: Isa, layout: &Layout, config: &PpoConfig, f: impl FnOnce(&Acting<'_>) -> R) -> R {
        let mut gamma = [config.gamma; 1 + MAX_SIGNALS];
        gamma[1..].iter_mut().zip(&config.signals).for_each(|(gamma, signal)| *gamma = signal.gamma);
        let signals = layout.signals.iter().zip(&config.signals);
        let signals = signals.map(|((nets, place), s)| (nets, &self.params[place.clone()], s.strength));
        f(&Acting {
            isa,
            actor: (&layout.actor, layout.actor_params(&self.params)),
            critic: (&layout.critic, layout.critic_params(&self.params)),
            gaussian: &self.gaussian(layout),
            normalizer: &self.normalizer(config),
            signals: signals.collect(),
            ratio: layout.ratio,
            action_scale: config.action_scale(),
            squash: matches!(config.algorithm, Algorithm::Sac(_)),
            discounts: Discounts { gamma, lambda: config.gae_lambda },
            reward_scale: self.reward_scale(config) * config.reward_strength,
            return_center: self.returns.mean[0] as f32,
        })
    }

    /// Takes in the statistics of a rollout.
    pub fn absorb(&mut self, totals: &Totals, layout: &Layout, config: &PpoConfig) {
        // without normalization the deviations are from zero, not from the mean
        if config.normalize_observations {
            // the first rollout's are those that the weights at the start are meant for
            let followed = (config.follow_statistics && self.iteration > 0).then(|| self.normalizer(config));
            self.observations.merge(totals.samples, &totals.sums.observations, config.statistics_cap);
            if let Some(before) = followed {
                let after = self.normalizer(config);
                layout.actor.follow(&mut self.params[..layout.critic_start], &before, &after);
                layout.critic.follow(&mut self.params[layout.critic_start..], &before, &after);
            }
        }
        self.returns.merge(totals.samples, &[totals.sums.discounted], config.statistics_cap);
        self.iteration += 1;
        self.steps += totals.samples as u64;
    }
}

/// Sums over a whole rollout, added up in the order of the blocks.
#[derive(Clone, Debug, Default)]
pub struct Totals {
    /// Number of samples.
    pub samples: f64,
    /// The sums.
    pub sums: BlockSums,
}

impl Totals {
    /// Of the workers' rollouts, in order.
    pub fn new<R: Deref<Target = Rollout>>(rollouts: &[R], horizon: usize) -> Self {
        let mut t = Totals::default();
        for rollout in rollouts {
            t.samples += (rollout.sums.len() * horizon * rollout.lanes) as f64;
            rollout.sums.iter().for_each(|block| t.sums.add(block));
        }
        t
    }
    /// Takes in those of another rollout.
    pub fn add(&mut self, other: &Totals) {
        self.samples += other.samples;
        self.sums.add(&other.sums);
    }
    /// Mean and variance of the advantages.
    pub fn advantage(&self) -> (f64, f64) {
        self.moments(self.sums.advantages)
    }
    /// Part of the variance of the value targets of the task's reward that the value function had foreseen.
    pub fn explained_variance(&self) -> f64 {
        1.0 - self.moments(self.sums.errors).1 / self.moments(self.sums.targets).1.max(1e-12)
    }
    fn moments(&self, (sum, square): (f64, f64)) -> (f64, f64) {
        let mean = sum / self.samples;
        (mean, (square / self.samples - mean * mean).max(0.0))
    }
}
