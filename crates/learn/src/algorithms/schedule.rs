//! Settings that move over a run.

use serde::{Deserialize, Serialize};

/// How the policy's learning rate moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Schedule {
    /// Not at all.
    Constant,
    /// Linearly to zero over the run, the value function's rate too.
    Linear,
    /// After every minibatch: divided by 1.5 where the divergence from the policy that acted exceeds twice `target_kl`,
    /// multiplied by 1.2 where it is below half of it, within `lr_range` (Rudin et al., "Learning to walk in minutes",
    /// 2021, with smaller steps). With PPO alone.
    Adaptive,
}

/// A setting that moves linearly over the run.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Moving {
    /// At the start.
    pub first: f64,
    /// At the end.
    pub last: f64,
}

impl Moving {
    /// One that stays where it is.
    pub const fn still(x: f64) -> Self {
        Self { first: x, last: x }
    }
}

/// How far a run is.
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
    /// A moving setting at this moment.
    pub fn at(&self, setting: Moving) -> f64 {
        let part = (self.steps as f64 / self.total_steps as f64).min(1.0);
        setting.first + (setting.last - setting.first) * part
    }

    /// The part of its first value that a learning rate still has under the linear schedule; 1 under the others.
    pub fn rate(&self, schedule: Schedule) -> f64 {
        match schedule {
            // an iteration of several rollouts may lead beyond the end
            Schedule::Linear => (1.0 - self.steps as f64 / self.total_steps as f64).max(0.0),
            Schedule::Constant | Schedule::Adaptive => 1.0,
        }
    }
}
