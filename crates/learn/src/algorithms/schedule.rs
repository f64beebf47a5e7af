//! Settings that change over a run.

use serde::{Deserialize, Serialize};

/// Schedule of the policy's learning rate.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Schedule {
    /// Constant rate.
    Constant,
    /// Falls linearly to zero over the run, together with the value function's rate.
    Linear,
    /// Adapts after every minibatch, within `lr_range`. The rate is divided by 1.5 if the divergence from the policy
    /// that collected the rollout exceeds twice `target_kl`, and multiplied by 1.2 below half of it. (Rudin et al.,
    /// "Learning to walk in minutes", 2021, with smaller steps.) PPO only.
    Adaptive,
}

/// A setting that changes linearly over the run.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Moving {
    /// Value at the start.
    pub first: f64,
    /// Value at the end.
    pub last: f64,
}

impl Moving {
    /// A constant value.
    pub const fn still(x: f64) -> Self {
        Self { first: x, last: x }
    }
}

/// Progress of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    /// Rollouts so far.
    pub iteration: u64,
    /// Agent-steps so far.
    pub steps: u64,
    /// Agent-steps of the whole run.
    pub total_steps: u64,
}

impl Progress {
    /// The current value of a setting.
    pub fn at(&self, setting: Moving) -> f64 {
        let part = (self.steps as f64 / self.total_steps as f64).min(1.0);
        setting.first + (setting.last - setting.first) * part
    }

    /// Factor of a learning rate at this moment: falls to 0 under the linear schedule, 1 under the others.
    pub fn rate(&self, schedule: Schedule) -> f64 {
        match schedule {
            // several rollouts per iteration may pass the end
            Schedule::Linear => (1.0 - self.steps as f64 / self.total_steps as f64).max(0.0),
            Schedule::Constant | Schedule::Adaptive => 1.0,
        }
    }
}
