//! Statistics of an iteration for reports.

use serde::{Deserialize, Serialize};

/// Numbers of one iteration.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct IterationStats {
    /// Iterations done, the first being 1.
    pub iteration: u64,
    /// Agent-steps done.
    pub steps: u64,
    /// Seconds since the start, without the observer's own and those between an interruption and its resumption.
    pub wall_seconds: f64,
    /// Processor seconds of all threads, in the same sense.
    pub cpu_seconds: f64,
    /// Part of the workers' time spent in the environments.
    pub env_share: f64,
    /// Part of the workers' time spent on gradients and waiting for each other.
    pub update_share: f64,

    /// Episodes that ended in this iteration.
    pub episodes: u64,
    /// Their mean length, decisions; none if no episode ended.
    pub length_mean: Option<f64>,
    /// Mean over them of distance along +x by time, m/s.
    pub speed_mean: Option<f64>,
    /// Part of them that ended in a terminal state.
    pub fall_fraction: Option<f64>,
    /// Agents whose simulation stopped being finite in this iteration.
    pub diverged: u64,
    /// Mean of each metric of the task per decision, by name, but for the distance along +x.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub metrics: Vec<(String, f64)>,

    /// Learning statistics; in a task with several roles, those of the first.
    #[serde(flatten)]
    pub learned: Learned,
    /// Learning statistics of the other roles, by name.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub others: Vec<(String, Learned)>,
}

/// Returns and learning statistics of a role in an iteration.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Learned {
    /// Mean return of the episodes that ended; none if none did.
    pub return_mean: Option<f64>,
    /// Mean of each of its reward terms per decision, in the order of the task's names.
    pub reward_terms: Vec<f64>,

    /// Estimated divergence of the policy from the one that acted, mean over the updates, nats.
    pub kl: f64,
    /// Part of the samples whose ratio was clipped.
    pub clip_fraction: f64,
    /// Mean policy objective, without the entropy.
    pub policy_loss: f64,
    /// Mean value loss, in units of the scaled return squared.
    pub value_loss: f64,
    /// Part of the returns' variance that the value function foresaw; 1 is perfect.
    pub explained_variance: f64,
    /// Entropy of the policy, nats.
    pub entropy: f64,
    /// Mean standard deviation of the actions.
    pub std_mean: f64,
    /// Learning rate of the policy.
    pub lr: f64,
    /// Minibatches left out in the whole run because their gradient was not finite.
    pub skipped_minibatches: u64,
    /// Mean of each reward per decision but the task's, by name, in the order of the configuration.
    pub signal_rewards: Vec<(String, f64)>,
}
