//! Running statistics of observations and returns, which normalize network inputs and targets.

use super::sums::Totals;
use crate::error::Error;
use crate::nets::normalize::{Moments, Normalizer};
use serde::{Deserialize, Serialize};

/// Normalization of observations and rewards.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct StatisticsConfig {
    /// Whether observations are normalized by their running mean and deviation.
    pub normalize_observations: bool,
    /// Whether the first layers of the networks follow the observation statistics. The network's output for an
    /// observation then stays the same when a rollout changes the statistics. This matters most for few agents with
    /// long rollouts. Not with SAC.
    pub follow_statistics: bool,
    /// Bound of the normalized observations.
    pub observation_clip: f64,
    /// Whether rewards are divided by the running deviation of the discounted return.
    pub scale_rewards: bool,
    /// Maximum number of samples that the running statistics remember.
    pub statistics_cap: f64,
}

impl Default for StatisticsConfig {
    fn default() -> Self {
        Self {
            normalize_observations: true,
            follow_statistics: false,
            observation_clip: 10.0,
            scale_rewards: true,
            statistics_cap: 3e7,
        }
    }
}

impl StatisticsConfig {
    /// Checks every field.
    ///
    /// # Errors
    /// Names the field, its value and the values that are valid.
    pub fn validate(&self) -> Result<(), Error> {
        for (field, x) in [("observation_clip", self.observation_clip), ("statistics_cap", self.statistics_cap)] {
            // checked in single precision too, where they are used
            if !((x as f32).is_finite() && x > 0.0) {
                return Err(Error::config(field, x, "a positive number"));
            }
        }
        Ok(())
    }
}

/// The statistics.
#[derive(Clone, Debug, PartialEq)]
pub struct Statistics {
    config: StatisticsConfig,
    /// Statistics of raw observations.
    pub observations: Moments,
    /// Statistics of the discounted return.
    pub returns: Moments,
}

impl Statistics {
    /// Statistics without samples, for observations of length `obs`.
    pub fn new(obs: usize, config: StatisticsConfig) -> Self {
        Self { config, observations: Moments::new(obs), returns: Moments::new(1) }
    }

    /// Current map of observations.
    pub fn normalizer(&self) -> Normalizer {
        let clip = self.config.observation_clip as f32;
        if self.config.normalize_observations {
            Normalizer::new(self.observations.mean32(), self.observations.std(), clip)
        } else {
            Normalizer::identity(self.observations.mean.len(), clip)
        }
    }

    /// Factor of the rewards.
    pub fn reward_scale(&self) -> f64 {
        if self.config.scale_rewards { 1.0 / (self.returns.var[0] + 1e-8).sqrt().max(1e-3) } else { 1.0 }
    }

    /// Merges a rollout. Returns the maps of observations before and after, if networks should follow them. They do not
    /// follow the first samples: new weights are meant for the statistics after those.
    pub fn absorb(&mut self, totals: &Totals) -> Option<[Normalizer; 2]> {
        let StatisticsConfig { normalize_observations, follow_statistics, statistics_cap: cap, .. } = self.config;
        let mut moved = None;
        // without normalization the deviations are from zero, not from the mean
        if normalize_observations {
            let before = (follow_statistics && self.observations.count > 0.0).then(|| self.normalizer());
            self.observations.merge(totals.samples, &totals.sums.observations, cap);
            moved = before.map(|before| [before, self.normalizer()]);
        }
        self.returns.merge(totals.samples, &[totals.sums.discounted], cap);
        moved
    }
}
