//! Settings that change over a run.

use serde::{Deserialize, Serialize};

/// Schedule of the policy's learning rate.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum LrSchedule {
    /// Not at all.
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
#[serde(from = "Written", into = "Written")]
pub struct Schedule {
    /// At the start.
    pub from: f64,
    /// At the end.
    pub to: f64,
}

impl Schedule {
    /// A constant value.
    pub const fn constant(x: f64) -> Self {
        Self { from: x, to: x }
    }
}

/// A schedule in files.
#[derive(Clone, Copy, Serialize, Deserialize)]
#[serde(untagged, deny_unknown_fields, expecting = "expected a number, or {from: A, to: B}")]
enum Written {
    Constant(f64),
    Linear { from: f64, to: f64 },
}

impl From<Written> for Schedule {
    fn from(written: Written) -> Self {
        match written {
            Written::Constant(x) => Self::constant(x),
            Written::Linear { from, to } => Self { from, to },
        }
    }
}

impl From<Schedule> for Written {
    fn from(Schedule { from, to }: Schedule) -> Self {
        if from.to_bits() == to.to_bits() { Self::Constant(from) } else { Self::Linear { from, to } }
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
    pub fn at(&self, setting: Schedule) -> f64 {
        let part = (self.steps as f64 / self.total_steps as f64).min(1.0);
        setting.from + (setting.to - setting.from) * part
    }

    /// Factor of a learning rate at this moment: falls to 0 under the linear schedule, 1 under the others.
    pub fn rate(&self, schedule: LrSchedule) -> f64 {
        match schedule {
            // an iteration of several rollouts may lead beyond the end
            LrSchedule::Linear => (1.0 - self.steps as f64 / self.total_steps as f64).max(0.0),
            LrSchedule::Constant | LrSchedule::Adaptive => 1.0,
        }
    }
}
