//! Results of an evaluation, as stored in a policy.

use serde::{Deserialize, Serialize};

/// Results over whole episodes.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Evaluation {
    /// Number of episodes.
    pub episodes: u64,
    /// Mean return.
    pub return_mean: f64,
    /// Standard deviation of the returns over the episodes.
    pub return_std: f64,
    /// Lowest return.
    pub return_min: f64,
    /// Highest return.
    pub return_max: f64,
    /// Mean length, decisions.
    pub length_mean: f64,
    /// Mean distance along +x, m.
    pub distance_mean: f64,
    /// Mean over the episodes of distance along +x per time, m/s.
    pub speed_mean: f64,
    /// Episodes that ended in a terminal state.
    pub falls: u64,
    /// Episodes whose simulation became non-finite (they count as falls too).
    pub diverged: u64,
    /// Mean of each metric of the task per decision, by name, without the distance along +x.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub metrics: Vec<(String, f64)>,
}
