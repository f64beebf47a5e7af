//! What a horizon is played with: networks, streams of rewards and constants.

use crate::nets::acting::Acting;
use crate::nets::mlp::Mlp;
use crate::rewards::Stream;

/// What a horizon is played with; the same for all workers.
pub struct RolloutContext<'a> {
    /// What acts.
    pub acting: Acting<'a>,
    /// The streams of rewards, the task's first.
    pub streams: &'a [Stream],
    /// All parameters, with those of the rewards' networks.
    pub params: &'a [f32],
    /// What judges observations. Without it, observations are kept as they are, for later.
    pub values: Option<Values<'a>>,
    /// Multiplies the task's rewards.
    pub reward_scale: f64,
    /// Center of the statistics of discounted returns.
    pub return_center: f32,
}

/// The value function, which has an output for each stream of rewards.
pub struct Values<'a> {
    /// Network.
    pub net: &'a Mlp,
    /// Its parameters.
    pub params: &'a [f32],
    /// Decay of the estimator of advantages.
    pub lambda: f64,
}
