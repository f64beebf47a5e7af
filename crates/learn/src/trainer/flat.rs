//! The configuration as one flat list of settings for all algorithms. Python's `MarathonAgent.learn` takes its keyword
//! arguments from it.

use super::config::{RunConfig, TrainConfig};
use crate::algorithms::actor_critic::Deviations;
use crate::algorithms::schedule::{Moving, Schedule};
use crate::algorithms::{a2c, acktr, ppo, sac};
use crate::error::Error;
use crate::nets::NetworkConfig;
use crate::nets::activation::Activation;
use crate::nets::gaussian::Ratio;
use crate::nets::init::Init;
use crate::rewards::{Novelty, RewardConfig, RewardKind};
use crate::rollout::statistics::StatisticsConfig;
use serde::Deserialize;
use serde_json::Value;

#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct A2c {
    value_coef: f64,
    rms_decay: f64,
    rms_epsilon: f64,
}

impl Default for A2c {
    fn default() -> Self {
        Self { value_coef: 0.25, rms_decay: 0.99, rms_epsilon: 1e-5 }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct Acktr {
    value_coef: f64,
    kl_clip: f64,
    momentum: f64,
    damping: f64,
    stats_decay: f64,
    inverse_every: u64,
}

impl Default for Acktr {
    fn default() -> Self {
        Self { value_coef: 0.5, kl_clip: 1e-3, momentum: 0.9, damping: 0.01, stats_decay: 0.99, inverse_every: 10 }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct Sac {
    replay: usize,
    warmup: u64,
    batch: usize,
    updates: usize,
    tau: f64,
    n_step: usize,
    init_alpha: f64,
}

impl Default for Sac {
    fn default() -> Self {
        Self { replay: 1_000_000, warmup: 10_000, batch: 256, updates: 32, tau: 0.005, n_step: 1, init_alpha: 0.2 }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
enum SignalKind {
    Curiosity,
    Rnd,
}

#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
struct Signal {
    kind: SignalKind,
    strength: f64,
    gamma: f64,
    hidden: Vec<usize>,
    lr: f64,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Algorithm {
    #[default]
    Ppo,
    A2c(A2c),
    Acktr(Acktr),
    Sac(Sac),
}

/// All settings with their defaults.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FlatConfig {
    algorithm: Algorithm,
    agents: usize,
    horizon: usize,
    rollouts: usize,
    minibatches: usize,
    epochs: usize,
    total_steps: u64,
    policy_average: f64,

    actor_hidden: Vec<usize>,
    critic_hidden: Vec<usize>,
    activation: Activation,
    initialization: Init,

    lr: f64,
    value_lr: f64,
    schedule: Schedule,
    target_kl: f64,
    final_target_kl: Option<f64>,
    lr_range: [f64; 2],
    adam_epsilon: f64,
    max_grad_norm: f64,

    gamma: f64,
    reward_strength: f64,
    signals: Vec<Signal>,
    gae_lambda: f64,
    ratio: Ratio,
    clip: f64,
    final_clip: Option<f64>,
    value_clip: Option<f64>,
    entropy_coef: f64,
    final_entropy_coef: Option<f64>,

    action_clip: f64,
    init_log_std: f64,
    min_std: f64,
    final_min_std: Option<f64>,
    max_std: f64,

    normalize_observations: bool,
    follow_statistics: bool,
    observation_clip: f64,
    scale_rewards: bool,
    statistics_cap: f64,

    seed: u64,
    threads: usize,
}

impl Default for FlatConfig {
    fn default() -> Self {
        Self {
            algorithm: Algorithm::Ppo,
            agents: 256,
            horizon: 64,
            rollouts: 1,
            minibatches: 8,
            epochs: 4,
            total_steps: 10_000_000,
            policy_average: 0.0,
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

impl From<&FlatConfig> for TrainConfig {
    /// Leaves out the settings of other algorithms.
    fn from(flat: &FlatConfig) -> Self {
        let moving = |first: f64, last: Option<f64>| Moving { first, last: last.unwrap_or(first) };
        let entropy_coef = moving(flat.entropy_coef, flat.final_entropy_coef);
        let deviations = Deviations {
            action_clip: flat.action_clip,
            init_log_std: flat.init_log_std,
            min_std: moving(flat.min_std, flat.final_min_std),
            max_std: flat.max_std,
        };
        let FlatConfig { lr, value_lr, schedule, adam_epsilon, max_grad_norm, gae_lambda, .. } = *flat;
        let algorithm = match flat.algorithm {
            Algorithm::Ppo => crate::algorithms::Algorithm::Ppo(ppo::Ppo {
                minibatches: flat.minibatches,
                epochs: flat.epochs,
                lr,
                value_lr,
                value_warmup: 0,
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
                policy_average: flat.policy_average,
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
            roles: Default::default(),
        }
    }
}

/// Whether a setting means nothing to an algorithm.
pub fn is_foreign(setting: &str, algorithm: &crate::algorithms::Algorithm) -> bool {
    const OF_PPO: [&str; 9] = [
        "minibatches",
        "epochs",
        "target_kl",
        "final_target_kl",
        "lr_range",
        "ratio",
        "clip",
        "final_clip",
        "value_clip",
    ];
    const ON_POLICY: [&str; 8] = [
        "gae_lambda",
        "entropy_coef",
        "final_entropy_coef",
        "action_clip",
        "init_log_std",
        "min_std",
        "final_min_std",
        "max_std",
    ];
    const ADAM: [&str; 2] = ["value_lr", "adam_epsilon"];
    const BOUND: [&str; 1] = ["max_grad_norm"];
    let foreign: &[&[&str]] = match algorithm {
        crate::algorithms::Algorithm::Ppo(_) => &[],
        crate::algorithms::Algorithm::A2c(_) => &[&OF_PPO, &ADAM],
        crate::algorithms::Algorithm::Acktr(_) => &[&OF_PPO, &ADAM, &BOUND],
        crate::algorithms::Algorithm::Sac(_) => &[&OF_PPO, &ON_POLICY, &BOUND],
    };
    foreign.concat().contains(&setting)
}

impl TrainConfig {
    /// A configuration from settings by name without their sections, such as `total_steps`, `gamma` or `actor_hidden`.
    /// Settings that change during a run end at the value of their second name, such as `final_min_std` for `min_std`.
    /// Other settings have PPO's defaults.
    ///
    /// # Errors
    /// If there is no such setting, its value is of the wrong kind, or it means nothing to the algorithm.
    pub fn from_settings(settings: Value) -> Result<Self, Error> {
        let names: Vec<String> = settings.as_object().map(|keys| keys.keys().cloned().collect()).unwrap_or_default();
        let flat: FlatConfig = serde_path_to_error::deserialize(settings)
            .map_err(|e| Error::Settings { place: e.path().to_string(), why: e.into_inner().to_string() })?;
        let config = TrainConfig::from(&flat);
        match names.iter().find(|name| is_foreign(name, &config.algorithm)) {
            Some(name) => Err(Error::Settings {
                place: name.clone(),
                why: format!("{} has no such setting", config.algorithm.name()),
            }),
            None => Ok(config),
        }
    }
}
