//! The objective of PPO (Schulman et al., "Proximal policy optimization algorithms", 2017) and its derivative with
//! respect to the network outputs, for a chunk of blocks.
//!
//! The loss per sample, with `r` the probability ratio, `A` the normalized advantage and `R` the return:
//!
//! ```text
//! policy:  -min(r A, clip(r, 1 - clip, 1 + clip) A) - entropy_coef H
//! value:   max((V - R)^2, (clip(V, V_old - value_clip, V_old + value_clip) - R)^2) / 2      (without value_clip: (V - R)^2 / 2)
//! ```
//!
//! With [`Ratio::PerAction`] each of the `n` actions has its own ratio. The policy term and the entropy are then means
//! over the actions (`trust_region_policy_loss` and `entropy` of ML-Agents 1.1.0).

use crate::lanes::BLOCK;
use crate::lanes::buffer::Blocks;
use crate::nets::gaussian::{Gaussian, Ratio, log_prob};
use crate::rollout::data::Samples;
use marathon_physics::lanes::{Kernel, Real, sum16};
use std::marker::PhantomData;

/// Constants of the objective.
#[derive(Clone, Copy, Debug)]
pub struct Objective {
    /// Whether the ratio is clipped for all actions together or for each one.
    pub ratio: Ratio,
    /// Clip range of the probability ratio.
    pub clip: f64,
    /// Clip range of the value's change, if any.
    pub value_clip: Option<f64>,
    /// Weight of the entropy.
    pub entropy_coef: f64,
    /// Subtracted from the advantages.
    pub advantage_mean: f64,
    /// Factor of the advantages after the subtraction.
    pub advantage_scale: f64,
}

/// Sums over samples.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LossSums {
    /// Policy objective without the entropy.
    pub policy: f64,
    /// Value objective, over all streams.
    pub value: f64,
    /// Estimate of the divergence from the policy that collected the rollout, `r - 1 - ln r`.
    pub kl: f64,
    /// Samples whose ratio left the clip range in the direction of their advantage. With one ratio per action: the
    /// fraction of the actions.
    pub clipped: f64,
    /// SAC only, whose deviations depend on the state: negative log-probabilities of the sampled actions.
    pub entropy: f64,
    /// SAC only: mean standard deviations of the actions.
    pub std: f64,
    /// Number of samples.
    pub samples: f64,
}

impl std::ops::AddAssign for LossSums {
    fn add_assign(&mut self, o: Self) {
        self.policy += o.policy;
        self.value += o.value;
        self.kl += o.kl;
        self.clipped += o.clipped;
        self.entropy += o.entropy;
        self.std += o.std;
        self.samples += o.samples;
    }
}

/// Evaluates the objective: fills the derivatives with respect to the network outputs and the log standard deviations
/// (sums over samples, not means).
pub struct Loss<'a, T: Real> {
    /// Constants.
    pub objective: Objective,
    /// Current standard deviations.
    pub gaussian: &'a Gaussian<T::Scalar>,
    /// One entry per block.
    pub samples: &'a [Samples<'a, T::Scalar>],
    /// Means, and the derivative with respect to them.
    pub mean: (&'a Blocks<T::Scalar>, &'a mut Blocks<T::Scalar>),
    /// Values, and the derivative with respect to them.
    pub value: (&'a Blocks<T::Scalar>, &'a mut Blocks<T::Scalar>),
    /// Out: derivative with respect to the log standard deviations.
    pub d_log_std: &'a mut [T::Scalar],
    /// Work space: a row per action.
    pub rows: &'a mut [[T::Scalar; BLOCK]],
    /// The lane type.
    pub lanes: PhantomData<T>,
}

impl<T: Real> Kernel<T> for Loss<'_, T> {
    type Output = LossSums;

    #[inline(always)]
    fn run(self) -> LossSums {
        // one function: a loss and its gradient in order
        let Loss {
            objective, gaussian, samples, mean: (mean, d_mean), value: (value, d_value), d_log_std, rows, ..
        } = self;
        let (zero, one) = (T::zero(), T::lit(1.0));
        let (low, high) = (T::lit(1.0 - objective.clip), T::lit(1.0 + objective.clip));
        let (shift, scale) = (T::lit(objective.advantage_mean), T::lit(objective.advantage_scale));
        // with one ratio per action, the mean over the actions
        let weight = match objective.ratio {
            Ratio::Joint => 1.0,
            Ratio::PerAction => 1.0 / gaussian.std.len() as f64,
        };
        let entropy_coef = T::lit(objective.entropy_coef * weight);
        let weight = T::lit(weight);
        rows.as_flattened_mut().fill(T::Scalar::default());
        let [mut policy_sum, mut value_sum, mut kl_sum, mut clipped_sum] = [[zero; BLOCK]; 4];
        for (b, s) in samples.iter().enumerate() {
            let (mean, d_mean) = (mean.block(b), d_mean.block_mut(b));
            let (value, d_value) = (value.block(b), d_value.block_mut(b));
            for part in 0..BLOCK / T::LANES {
                let lane = part * T::LANES;
                let lp = log_prob::<T>(gaussian, s.action, mean, d_mean, lane);
                let on = T::from_bits(s.decided as u32 >> lane);
                let advantage = (T::load(&s.advantage[lane..]) - shift) * scale;
                let mut d_lp = zero;
                if objective.ratio == Ratio::Joint {
                    let surrogate = Surrogate::new(lp - T::load(&s.log_prob[lane..]), advantage, (low, high));
                    policy_sum[part] -= T::masked(on, surrogate.gain);
                    kl_sum[part] += T::masked(on, surrogate.kl);
                    clipped_sum[part] += T::masked(T::and(on, surrogate.clipped), one);
                    d_lp = T::masked(on, surrogate.d_log_prob);
                }

                // d lp / d mean = z / std, d lp / d log std = z^2 - 1, d H / d log std = 1
                for (k, inv_std) in gaussian.inv_std.iter().enumerate() {
                    let at = k * BLOCK + lane;
                    let z = T::load(&d_mean[at..]);
                    if objective.ratio == Ratio::PerAction {
                        let lp = (z * T::lit(0.5)).neg_mul_add(z, -T::splat(gaussian.log_std[k]));
                        let surrogate = Surrogate::new(lp - T::load(&s.log_prob[at..]), advantage, (low, high));
                        policy_sum[part] = T::masked(on, surrogate.gain).neg_mul_add(weight, policy_sum[part]);
                        kl_sum[part] += T::masked(on, surrogate.kl);
                        clipped_sum[part] += T::masked(T::and(on, surrogate.clipped), weight);
                        d_lp = T::masked(on, surrogate.d_log_prob * weight);
                    }
                    (d_lp * z * T::splat(*inv_std)).store(&mut d_mean[at..]);
                    let row = &mut rows[k][lane..];
                    (d_lp.mul_add(z.mul_add(z, -one), T::load(row)) - T::masked(on, entropy_coef)).store(row);
                }

                // values of all streams
                for at in (lane..value.len()).step_by(BLOCK) {
                    let (v, target) = (T::load(&value[at..]), T::load(&s.target[at..]));
                    let mut error = v - target;
                    let mut d = error;
                    if let Some(range) = objective.value_clip {
                        let (old, range) = (T::load(&s.value[at..]), T::lit(range));
                        let moved = v - old;
                        let held = old + moved.max(-range).min(range);
                        let held_error = held - target;
                        let worse = (error * error).lt(held_error * held_error);
                        // outside the range the clipped value does not depend on the network
                        d = T::select(worse, T::masked(moved.abs().lt(range), held_error), error);
                        error = T::select(worse, held_error, error);
                    }
                    (error, d) = (T::masked(on, error), T::masked(on, d));
                    value_sum[part] = (error * T::lit(0.5)).mul_add(error, value_sum[part]);
                    d.store(&mut d_value[at..]);
                }
            }
        }
        for (d, row) in d_log_std.iter_mut().zip(rows.iter()) {
            *d = sum_row::<T>(row);
        }
        let parts = BLOCK / T::LANES;
        LossSums {
            policy: T::widen(sum16(&policy_sum[..parts])),
            value: T::widen(sum16(&value_sum[..parts])),
            kl: T::widen(sum16(&kl_sum[..parts])),
            clipped: T::widen(sum16(&clipped_sum[..parts])),
            samples: samples.iter().map(|s| s.decided.count_ones() as f64).sum(),
            ..LossSums::default()
        }
    }
}

/// The clipped objective of one ratio.
struct Surrogate<T: Real> {
    /// `min(r A, clip(r) A)`.
    gain: T,
    /// `r - 1 - ln r`.
    kl: T,
    /// True where the ratio left the clip range in the direction of the advantage.
    clipped: T::Mask,
    /// Derivative of `-gain` with respect to the log-probability.
    d_log_prob: T,
}

impl<T: Real> Surrogate<T> {
    #[inline(always)]
    fn new(log_ratio: T, advantage: T, (low, high): (T, T)) -> Self {
        // a clamped logarithm keeps the exponential finite
        let log_ratio = log_ratio.max(T::lit(-20.0)).min(T::lit(20.0));
        let ratio = log_ratio.exp();
        let above = T::and(T::zero().lt(advantage), high.lt(ratio));
        let below = T::and(advantage.lt(T::zero()), ratio.lt(low));
        let clipped = T::or(above, below);
        let gain = ratio * advantage;
        let bound = ratio.max(low).min(high) * advantage;
        Self {
            gain: gain.min(bound),
            kl: (ratio - T::lit(1.0)) - log_ratio,
            clipped,
            d_log_prob: T::masked(T::not(clipped), -gain),
        }
    }
}

/// Sum of a row in the order of [`sum16`].
#[inline(always)]
fn sum_row<T: Real>(row: &[T::Scalar; BLOCK]) -> T::Scalar {
    let mut v = [T::zero(); BLOCK];
    for part in 0..BLOCK / T::LANES {
        v[part] = T::load(&row[part * T::LANES..]);
    }
    sum16(&v[..BLOCK / T::LANES])
}
