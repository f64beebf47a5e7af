//! The trainer's configuration as one list of settings.

use super::config::{MAX_STEPS, RunConfig, TrainConfig};
use crate::algorithms::actor_critic::Deviations;
use crate::algorithms::schedule::{Moving, Schedule};
use crate::algorithms::{a2c, acktr, ppo, sac};
use crate::error::Error;
use crate::lanes::BLOCK;
use crate::nets::NetworkConfig;
use crate::nets::activation::Activation;
use crate::nets::gaussian::Ratio;
use crate::nets::init::Init;
use crate::rewards::{Novelty, RewardConfig, RewardKind};
use crate::rollout::statistics::StatisticsConfig;
use serde::{Deserialize, Serialize};

/// What only A2C has; the defaults are those of the paper's comparison (OpenAI Baselines with the weight of the value
/// loss and the rate that its authors chose).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct A2c {
    /// Weight of the value function's squared error.
    pub value_coef: f64,
    /// Decay of RMSProp's mean square.
    pub rms_decay: f64,
    /// Added to the mean square under the root.
    pub rms_epsilon: f64,
}

impl Default for A2c {
    fn default() -> Self {
        Self { value_coef: 0.25, rms_decay: 0.99, rms_epsilon: 1e-5 }
    }
}

/// What only ACKTR has; the defaults are those of OpenAI Baselines.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Acktr {
    /// Weight of the value function's squared error.
    pub value_coef: f64,
    /// Divergence that a step may cause, nats; in the value network half the mean squared change.
    pub kl_clip: f64,
    /// Decay of the sum of steps.
    pub momentum: f64,
    /// Added to the Fisher matrix.
    pub damping: f64,
    /// Decay of the running means of the factors.
    pub stats_decay: f64,
    /// Updates from one inversion of the factors to the next; the first so many updates invert every time.
    pub inverse_every: u64,
}

impl Default for Acktr {
    fn default() -> Self {
        Self { value_coef: 0.5, kl_clip: 1e-3, momentum: 0.9, damping: 0.01, stats_decay: 0.99, inverse_every: 10 }
    }
}

/// What only SAC has.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Sac {
    /// Agent-steps that are kept, rounded down to whole decisions of all agents.
    pub replay: usize,
    /// Agent-steps before the first update.
    pub warmup: u64,
    /// Samples of an update, a multiple of 16.
    pub batch: usize,
    /// Updates after each rollout.
    pub updates: usize,
    /// Part of the way that the slow value networks go in an update.
    pub tau: f64,
    /// Rewards that count before the value of the state that they lead to.
    pub n_step: usize,
    /// Weight of the entropy at the start.
    pub init_alpha: f64,
}

impl Default for Sac {
    fn default() -> Self {
        Self { replay: 1_000_000, warmup: 10_000, batch: 256, updates: 32, tau: 0.005, n_step: 1, init_alpha: 0.2 }
    }
}

/// What rewards novelty.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum SignalKind {
    /// [`RewardKind::Curiosity`].
    Curiosity,
    /// [`RewardKind::Rnd`].
    Rnd,
}

impl SignalKind {
    /// Name in configurations and reports.
    pub fn name(self) -> &'static str {
        match self {
            SignalKind::Curiosity => "curiosity",
            SignalKind::Rnd => "rnd",
        }
    }
}

/// A reward signal; the defaults are ML-Agents'.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Signal {
    /// What rewards novelty.
    pub kind: SignalKind,
    /// Factor of the reward.
    pub strength: f64,
    /// Discount per decision. Such rewards do not end with an episode: its last state is worth what the value function
    /// says.
    pub gamma: f64,
    /// Widths of the network that makes features of an observation; the last is their number.
    pub hidden: Vec<usize>,
    /// Learning rate of the signal's networks.
    pub lr: f64,
}

impl Signal {
    /// With ML-Agents' defaults.
    pub fn new(kind: SignalKind) -> Self {
        Self { kind, strength: 1.0, gamma: 0.99, hidden: vec![128, 128], lr: 3e-4 }
    }
}

/// What learns from the rollouts, with the settings that are its own.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Algorithm {
    /// Proximal policy optimization.
    #[default]
    Ppo,
    /// Advantage actor-critic. Of the settings below, `epochs` and `minibatches` are 1, and those of the clip ranges and
    /// of the adaptive schedule mean nothing.
    A2c(A2c),
    /// Actor-critic with the natural gradient and a trust region; as A2C, and `max_grad_norm` means nothing either.
    Acktr(Acktr),
    /// Soft actor-critic, from a replay; the settings of rollouts' epochs, clip ranges, deviations and the adaptive schedule
    /// mean nothing.
    Sac(Sac),
}

impl Algorithm {
    /// Names in configurations and on the command line.
    pub const NAMES: [&str; 4] = ["ppo", "a2c", "acktr", "sac"];

    /// Its name.
    pub fn name(&self) -> &'static str {
        match self {
            Algorithm::Ppo => "ppo",
            Algorithm::A2c(_) => "a2c",
            Algorithm::Acktr(_) => "acktr",
            Algorithm::Sac(_) => "sac",
        }
    }
}

/// Settings of training; those of PPO, and an [`Algorithm`] that may be another. Every field has a default, so a file
/// names only what it changes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PpoConfig {
    /// What learns from the rollouts.
    pub algorithm: Algorithm,
    /// Agents that act side by side: a multiple of 16, or 1, 2, 4 or 8, which cost as much as 16.
    pub agents: usize,
    /// Decisions of each agent per rollout.
    pub horizon: usize,
    /// Rollouts of one iteration, each learned from by itself: what is reported and saved together.
    pub rollouts: usize,
    /// Parts that the rollout is split into in every epoch. A part of fewer than 256 samples per thread leaves threads idle.
    pub minibatches: usize,
    /// Passes over each rollout.
    pub epochs: usize,
    /// Agent-steps of the whole run; training ends with the first rollout that reaches them.
    pub total_steps: u64,

    /// Widths of the policy's hidden layers.
    pub actor_hidden: Vec<usize>,
    /// Widths of the value function's hidden layers.
    pub critic_hidden: Vec<usize>,
    /// Activation of all hidden layers.
    pub activation: Activation,
    /// What the networks start from.
    pub initialization: Init,

    /// Learning rate of the policy (where the adaptive schedule starts).
    pub lr: f64,
    /// Learning rate of the value function.
    pub value_lr: f64,
    /// How the policy's learning rate moves.
    pub schedule: Schedule,
    /// Divergence per update that the adaptive schedule aims at, at the start, nats.
    pub target_kl: f64,
    /// The same at the end, reached linearly; the same as at the start by default. Small steps at the end settle a gait.
    pub final_target_kl: Option<f64>,
    /// Bounds of the adaptive schedule.
    pub lr_range: [f64; 2],
    /// Added to the root of Adam's second moment: how small a gradient may be and still count.
    pub adam_epsilon: f64,
    /// Bound of the gradient's norm, for each network by itself.
    pub max_grad_norm: f64,

    /// Discount per decision.
    pub gamma: f64,
    /// Factor of the task's reward, which matters beside those of signals.
    pub reward_strength: f64,
    /// Rewards for novelty beside the task's own, each kind at most once; with PPO and A2C.
    pub signals: Vec<Signal>,
    /// Decay of generalized advantage estimation.
    pub gae_lambda: f64,
    /// Whose probability ratio is clipped.
    pub ratio: Ratio,
    /// Clip range of the probability ratio at the start.
    pub clip: f64,
    /// Clip range of the probability ratio at the end, reached linearly; the same as at the start by default.
    pub final_clip: Option<f64>,
    /// Clip range of the value's change (in units of the scaled return) at the start; it shrinks as that of the ratio does.
    /// None by default.
    pub value_clip: Option<f64>,
    /// Weight of the entropy bonus at the start.
    pub entropy_coef: f64,
    /// Weight of the entropy bonus at the end, reached linearly; the same as at the start by default.
    pub final_entropy_coef: Option<f64>,

    /// Bound of the actions drawn, which are then divided by it; standard deviations are those before that. ML-Agents has 3:
    /// with a larger number the same step of the optimizer moves the actions less. Without effect with SAC.
    pub action_clip: f64,
    /// Logarithm of the standard deviation of the actions at the start.
    pub init_log_std: f64,
    /// Smallest standard deviation, at the start: a floor keeps a policy that has found one safe way from ceasing to
    /// look for better ones.
    pub min_std: f64,
    /// Smallest standard deviation at the end, reached linearly; the same as at the start by default.
    pub final_min_std: Option<f64>,
    /// Largest standard deviation.
    pub max_std: f64,

    /// Whether observations are normalized by their running mean and deviation.
    pub normalize_observations: bool,
    /// Whether the networks' first layers follow the statistics that normalize observations, so that what the networks make
    /// of an observation stays what it was when a rollout has moved them. Few agents with long rollouts feel the move most.
    /// Not with SAC.
    pub follow_statistics: bool,
    /// Bound of the normalized observations.
    pub observation_clip: f64,
    /// Whether rewards are divided by the running deviation of the discounted return.
    pub scale_rewards: bool,
    /// Most samples that the running statistics remember.
    pub statistics_cap: f64,

    /// Seed of everything random.
    pub seed: u64,
    /// Threads; 0 means one per processor. The result does not depend on it.
    pub threads: usize,
}

impl Default for PpoConfig {
    /// A setting that solves the small tasks.
    fn default() -> Self {
        Self {
            algorithm: Algorithm::Ppo,
            agents: 256,
            horizon: 64,
            rollouts: 1,
            minibatches: 8,
            epochs: 4,
            total_steps: 10_000_000,
            actor_hidden: vec![64, 64],
            critic_hidden: vec![64, 64],
            activation: Activation::Tanh,
            initialization: Init::Orthogonal,
            lr: 1e-3,
            value_lr: 1e-3,
            schedule: Schedule::Adaptive,
            target_kl: 0.015,
            final_target_kl: None,
            lr_range: [1e-5, 3e-3],
            adam_epsilon: 1e-5,
            max_grad_norm: 1.0,
            gamma: 0.99,
            reward_strength: 1.0,
            signals: Vec::new(),
            gae_lambda: 0.95,
            ratio: Ratio::Joint,
            clip: 0.2,
            final_clip: None,
            value_clip: None,
            entropy_coef: 0.002,
            final_entropy_coef: None,
            action_clip: 1.0,
            init_log_std: -0.5,
            min_std: 0.05,
            final_min_std: None,
            max_std: 2.0,
            normalize_observations: true,
            follow_statistics: false,
            observation_clip: 10.0,
            scale_rewards: true,
            statistics_cap: 3e7,
            seed: 1,
            threads: 0,
        }
    }
}

impl PpoConfig {
    /// A2C with the settings of the paper's comparison: OpenAI Baselines' with the rate that its authors chose, sixteen
    /// agents, two networks of 64 and 64 units.
    pub fn a2c() -> Self {
        Self {
            algorithm: Algorithm::A2c(A2c::default()),
            agents: 16,
            horizon: 5,
            rollouts: 50,
            minibatches: 1,
            epochs: 1,
            total_steps: 1_000_000,
            lr: 3e-4,
            value_lr: 3e-4,
            schedule: Schedule::Linear,
            max_grad_norm: 0.5,
            gae_lambda: 1.0,
            entropy_coef: 0.01,
            init_log_std: 0.0,
            min_std: 1e-3,
            max_std: 1e3,
            ..Self::default()
        }
    }

    /// ACKTR with the settings of OpenAI Baselines, sixteen agents, two networks of 64 and 64 units.
    pub fn acktr() -> Self {
        Self { algorithm: Algorithm::Acktr(Acktr::default()), horizon: 20, rollouts: 10, lr: 0.25, ..Self::a2c() }
    }

    /// SAC for many agents: sixty-four, and an update with 256 samples for every eighth of their steps.
    pub fn sac() -> Self {
        Self {
            algorithm: Algorithm::Sac(Sac::default()),
            agents: 64,
            horizon: 4,
            rollouts: 16,
            minibatches: 1,
            epochs: 1,
            total_steps: 1_000_000,
            activation: Activation::Relu,
            lr: 1e-3,
            value_lr: 1e-3,
            schedule: Schedule::Constant,
            init_log_std: 0.0,
            min_std: 1e-3,
            max_std: 1e3,
            scale_rewards: false,
            ..Self::default()
        }
    }

    /// The settings that an algorithm starts from, by its name.
    pub fn of(algorithm: &str) -> Option<Self> {
        match algorithm {
            "ppo" => Some(Self::default()),
            "a2c" => Some(Self::a2c()),
            "acktr" => Some(Self::acktr()),
            "sac" => Some(Self::sac()),
            _ => None,
        }
    }

    /// Whether so many agents fill their lanes evenly: a multiple of sixteen, or a divisor of it.
    pub fn fills_lanes(agents: usize) -> bool {
        agents.is_multiple_of(BLOCK) || agents < BLOCK && agents.is_power_of_two()
    }
    /// Factor of the actions drawn, before they are clipped to [-1, 1].
    pub fn action_scale(&self) -> f32 {
        match self.algorithm {
            Algorithm::Sac(_) => 1.0,
            _ => 1.0 / self.action_clip as f32,
        }
    }
    /// Number of blocks of sixteen agents.
    pub fn blocks(&self) -> usize {
        self.agents.div_ceil(BLOCK)
    }
    /// Agent-steps per rollout.
    pub fn rollout_steps(&self) -> u64 {
        (self.agents * self.horizon) as u64
    }
    /// Threads that a run uses: the configured or available number, at most one per block.
    pub fn worker_count(&self) -> usize {
        let wanted = match self.threads {
            0 => std::thread::available_parallelism().map_or(1, |n| n.get()),
            n => n,
        };
        wanted.clamp(1, self.blocks().max(1))
    }

    /// Checks every field.
    ///
    /// # Errors
    /// Names the field, its value and the values that are valid.
    pub fn validate(&self) -> Result<(), Error> {
        let sac = matches!(self.algorithm, Algorithm::Sac(_));
        if self.agents == 0 || !Self::fills_lanes(self.agents) || sac && self.agents < BLOCK {
            let nearest = (self.agents as f64 / BLOCK as f64).round().max(1.0) as usize * BLOCK;
            let or = if sac { " with sac" } else { ", or 1, 2, 4 or 8" };
            return Err(Error::config("agents", self.agents, format!("a multiple of {BLOCK}, such as {nearest}{or}")));
        }
        let items = self.blocks().saturating_mul(self.horizon);
        if items.saturating_mul(BLOCK) > 1 << 31 {
            return Err(Error::config("agents * horizon", items.saturating_mul(BLOCK), "at most 2^31 samples"));
        }
        self.validate_algorithm()?;
        self.validate_signals()?;
        if self.total_steps > MAX_STEPS {
            return Err(Error::config("total_steps", self.total_steps, format!("at most {MAX_STEPS}")));
        }
        let counts = [
            ("horizon", self.horizon),
            ("rollouts", self.rollouts),
            ("minibatches", self.minibatches),
            ("epochs", self.epochs),
        ];
        for (field, n) in counts {
            if n == 0 {
                return Err(Error::config(field, n, "at least 1"));
            }
        }
        if self.minibatches > items {
            let most = format!("at most {items}, one for every 16 of the rollout's {} samples", items * BLOCK);
            return Err(Error::config("minibatches", self.minibatches, most));
        }
        for (field, widths) in [("actor_hidden", &self.actor_hidden), ("critic_hidden", &self.critic_hidden)] {
            if widths.iter().any(|w| !(1..=65536).contains(w)) || widths.len() > 64 {
                return Err(Error::config(field, format!("{widths:?}"), "up to 64 widths between 1 and 65536"));
            }
        }
        if self.follow_statistics && sac {
            return Err(Error::config(
                "follow_statistics",
                true,
                "false with sac, whose replay is normalized anew whenever it is drawn from",
            ));
        }
        let positive = [
            ("lr", self.lr),
            ("value_lr", self.value_lr),
            ("reward_strength", self.reward_strength),
            ("target_kl", self.target_kl),
            ("final_target_kl", self.final_target_kl.unwrap_or(self.target_kl)),
            ("adam_epsilon", self.adam_epsilon),
            ("max_grad_norm", self.max_grad_norm),
            ("clip", self.clip),
            ("final_clip", self.final_clip.unwrap_or(1.0)),
            ("value_clip", self.value_clip.unwrap_or(1.0)),
            ("action_clip", self.action_clip),
            ("min_std", self.min_std),
            ("final_min_std", self.final_min_std.unwrap_or(self.min_std)),
            ("observation_clip", self.observation_clip),
            ("statistics_cap", self.statistics_cap),
        ];
        for (field, x) in positive {
            // in single precision, too, in which most of them are used
            if !((x as f32).is_finite() && x > 0.0) {
                return Err(Error::config(field, x, "a positive number"));
            }
        }
        let fractions = [("gamma", self.gamma), ("gae_lambda", self.gae_lambda)];
        for (field, x) in fractions {
            if !(0.0..=1.0).contains(&x) {
                return Err(Error::config(field, x, "a number between 0 and 1"));
            }
        }
        let entropy = [("entropy_coef", Some(self.entropy_coef)), ("final_entropy_coef", self.final_entropy_coef)];
        for (field, x) in entropy.into_iter().filter_map(|(f, x)| Some((f, x?))) {
            if !(x.is_finite() && x >= 0.0) {
                return Err(Error::config(field, x, "a number not below 0"));
            }
        }
        let largest_min = self.min_std.max(self.final_min_std.unwrap_or(self.min_std));
        if !(self.max_std.is_finite() && self.max_std >= largest_min) {
            let expected = format!("a number not below the smallest deviation, {largest_min}");
            return Err(Error::config("max_std", self.max_std, expected));
        }
        if !self.init_log_std.is_finite() {
            return Err(Error::config("init_log_std", self.init_log_std, "a finite number"));
        }
        let [low, high] = self.lr_range;
        if !(low > 0.0 && low <= high && high.is_finite()) {
            return Err(Error::config(
                "lr_range",
                format!("[{low}, {high}]"),
                "two positive numbers in ascending order",
            ));
        }
        Ok(())
    }
    fn validate_signals(&self) -> Result<(), Error> {
        for (i, signal) in self.signals.iter().enumerate() {
            let name = signal.kind.name();
            if self.signals[..i].iter().any(|other| other.kind == signal.kind) {
                return Err(Error::config("signals", format!("{name} twice"), "each kind once"));
            }
            if let Algorithm::Acktr(_) | Algorithm::Sac(_) = self.algorithm {
                let with = self.algorithm.name();
                return Err(Error::config("signals", name, format!("none with {with}; ppo and a2c take them")));
            }
            for (field, x) in [("signals: strength", signal.strength), ("signals: lr", signal.lr)] {
                if !(x.is_finite() && x > 0.0) {
                    return Err(Error::config(field, x, "a positive number"));
                }
            }
            if !(0.0..=1.0).contains(&signal.gamma) {
                return Err(Error::config("signals: gamma", signal.gamma, "a number between 0 and 1"));
            }
            if signal.hidden.is_empty()
                || signal.hidden.len() > 64
                || signal.hidden.iter().any(|w| !(1..=4096).contains(w))
            {
                return Err(Error::config(
                    "signals: hidden",
                    format!("{:?}", signal.hidden),
                    "1 to 64 widths between 1 and 4096",
                ));
            }
        }
        Ok(())
    }

    /// Checks what is the algorithm's own, and what it demands of the rest.
    fn validate_algorithm(&self) -> Result<(), Error> {
        let positive = |field, x: f64| match x.is_finite() && x > 0.0 {
            true => Ok(()),
            false => Err(Error::config(field, x, "a positive number")),
        };
        let fraction = |field, x: f64| match (0.0..1.0).contains(&x) {
            true => Ok(()),
            false => Err(Error::config(field, x, "a number from 0 to below 1")),
        };
        match &self.algorithm {
            Algorithm::Ppo => return Ok(()),
            Algorithm::A2c(a2c) => {
                positive("value_coef", a2c.value_coef)?;
                fraction("rms_decay", a2c.rms_decay)?;
                positive("rms_epsilon", a2c.rms_epsilon)?;
            }
            Algorithm::Acktr(acktr) => {
                positive("value_coef", acktr.value_coef)?;
                positive("kl_clip", acktr.kl_clip)?;
                fraction("momentum", acktr.momentum)?;
                positive("damping", acktr.damping)?;
                fraction("stats_decay", acktr.stats_decay)?;
                if acktr.inverse_every == 0 {
                    return Err(Error::config("inverse_every", 0, "at least 1"));
                }
                // the factors are square
                for (field, widths) in [("actor_hidden", &self.actor_hidden), ("critic_hidden", &self.critic_hidden)] {
                    if widths.iter().any(|w| *w > 2048) {
                        return Err(Error::config(field, format!("{widths:?}"), "widths up to 2048 with ACKTR"));
                    }
                }
            }
            Algorithm::Sac(sac) => {
                if sac.batch == 0 || !sac.batch.is_multiple_of(BLOCK) || sac.batch > 1 << 20 {
                    return Err(Error::config("batch", sac.batch, format!("a multiple of {BLOCK} up to {}", 1 << 20)));
                }
                if sac.updates == 0 || sac.n_step == 0 {
                    return Err(Error::config(
                        "updates, n_step",
                        format!("{}, {}", sac.updates, sac.n_step),
                        "at least 1",
                    ));
                }
                if sac.replay / self.agents.max(1) < sac.n_step.max(self.horizon) || sac.replay > 1 << 31 {
                    let least = self.agents * sac.n_step.max(self.horizon);
                    return Err(Error::config(
                        "replay",
                        sac.replay,
                        format!("a rollout at least, {least}, and at most 2^31"),
                    ));
                }
                positive("tau", sac.tau)?;
                positive("init_alpha", sac.init_alpha)?;
                if sac.tau > 1.0 {
                    return Err(Error::config("tau", sac.tau, "at most 1"));
                }
                if self.scale_rewards {
                    let why = "false with sac: rewards of another scale would stay in the replay";
                    return Err(Error::config("scale_rewards", true, why));
                }
            }
        }
        let name = self.algorithm.name();
        if self.ratio != Ratio::Joint {
            return Err(Error::config("ratio", "per_action", format!("joint with {name}, which clips no ratio")));
        }
        for (field, n) in [("epochs", self.epochs), ("minibatches", self.minibatches)] {
            if n != 1 {
                return Err(Error::config(field, n, format!("1: {name} makes one step on each rollout")));
            }
        }
        if self.schedule == Schedule::Adaptive {
            return Err(Error::config("schedule", "adaptive", format!("constant or linear with {name}")));
        }
        Ok(())
    }
}

impl From<&PpoConfig> for TrainConfig {
    fn from(flat: &PpoConfig) -> Self {
        let moving = |first: f64, last: Option<f64>| Moving { first, last: last.unwrap_or(first) };
        let entropy_coef = moving(flat.entropy_coef, flat.final_entropy_coef);
        let deviations = Deviations {
            action_clip: flat.action_clip,
            init_log_std: flat.init_log_std,
            min_std: moving(flat.min_std, flat.final_min_std),
            max_std: flat.max_std,
        };
        let PpoConfig { lr, value_lr, schedule, adam_epsilon, max_grad_norm, gae_lambda, .. } = *flat;
        let algorithm = match flat.algorithm {
            Algorithm::Ppo => crate::algorithms::Algorithm::Ppo(ppo::Ppo {
                minibatches: flat.minibatches,
                epochs: flat.epochs,
                lr,
                value_lr,
                schedule,
                target_kl: moving(flat.target_kl, flat.final_target_kl),
                lr_range: flat.lr_range,
                adam_epsilon,
                max_grad_norm,
                gae_lambda,
                ratio: flat.ratio,
                clip: moving(flat.clip, flat.final_clip),
                value_clip: flat.value_clip,
                entropy_coef,
                deviations,
            }),
            Algorithm::A2c(A2c { value_coef, rms_decay, rms_epsilon }) => crate::algorithms::Algorithm::A2c(a2c::A2c {
                lr,
                schedule,
                max_grad_norm,
                gae_lambda,
                entropy_coef,
                deviations,
                value_coef,
                rms_decay,
                rms_epsilon,
            }),
            Algorithm::Acktr(Acktr { value_coef, kl_clip, momentum, damping, stats_decay, inverse_every }) => {
                crate::algorithms::Algorithm::Acktr(acktr::Acktr {
                    lr,
                    schedule,
                    gae_lambda,
                    entropy_coef,
                    deviations,
                    value_coef,
                    kl_clip,
                    momentum,
                    damping,
                    stats_decay,
                    inverse_every,
                })
            }
            Algorithm::Sac(Sac { replay, warmup, batch, updates, tau, n_step, init_alpha }) => {
                crate::algorithms::Algorithm::Sac(sac::Sac {
                    lr,
                    value_lr,
                    schedule,
                    adam_epsilon,
                    replay,
                    warmup,
                    batch,
                    updates,
                    tau,
                    n_step,
                    init_alpha,
                })
            }
        };
        let task = RewardConfig { kind: RewardKind::Task, strength: flat.reward_strength, gamma: flat.gamma };
        let novelty = flat.signals.iter().map(|signal| {
            let networks = Novelty { hidden: signal.hidden.clone(), lr: signal.lr };
            let kind = match signal.kind {
                SignalKind::Curiosity => RewardKind::Curiosity(networks),
                SignalKind::Rnd => RewardKind::Rnd(networks),
            };
            RewardConfig { kind, strength: signal.strength, gamma: signal.gamma }
        });
        TrainConfig {
            run: RunConfig {
                agents: flat.agents,
                horizon: flat.horizon,
                rollouts: flat.rollouts,
                total_steps: flat.total_steps,
                seed: flat.seed,
                threads: flat.threads,
            },
            network: NetworkConfig {
                actor_hidden: flat.actor_hidden.clone(),
                critic_hidden: flat.critic_hidden.clone(),
                activation: flat.activation,
                initialization: flat.initialization,
            },
            statistics: StatisticsConfig {
                normalize_observations: flat.normalize_observations,
                follow_statistics: flat.follow_statistics,
                observation_clip: flat.observation_clip,
                scale_rewards: flat.scale_rewards,
                statistics_cap: flat.statistics_cap,
            },
            rewards: [task].into_iter().chain(novelty).collect(),
            algorithm,
        }
    }
}
