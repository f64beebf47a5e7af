//! Context of a rollout: networks, streams of rewards and constants.

use crate::nets::acting::Acting;
use crate::nets::mlp::Mlp;
use crate::rewards::Stream;

/// Context of a rollout, the same for all workers.
pub struct RolloutContext<'a> {
    /// The acting network.
    pub acting: Acting<'a>,
    /// The streams of rewards, the task's first.
    pub streams: &'a [Stream],
    /// All parameters, including those of the rewards' networks.
    pub params: &'a [f32],
    /// The value function. Without it, raw observations are kept for later.
    pub values: Option<Values<'a>>,
    /// Factor of the task's rewards.
    pub reward_scale: f64,
    /// Center of the statistics of discounted returns.
    pub return_center: f32,
}

/// The value function, with one output per stream of rewards.
pub struct Values<'a> {
    /// Network.
    pub net: &'a Mlp,
    /// Its parameters.
    pub params: &'a [f32],
    /// Decay of the advantage estimator.
    pub lambda: f64,
}
