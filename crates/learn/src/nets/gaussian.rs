//! The policy's distribution: independent normal actions with a standard deviation that does not depend on the state.

use crate::lanes::BLOCK;
use crate::lanes::buffer::Blocks;
use crate::lanes::noise::Noise;
use marathon_physics::lanes::{Kernel, Real};
use serde::{Deserialize, Serialize};
use std::marker::PhantomData;

/// `ln(2 pi e) / 2`, the entropy of a standard normal number.
pub const UNIT_ENTROPY: f64 = 1.418_938_533_204_672_7;

/// Which probability ratio the objective bounds. It also determines the stored log-probabilities.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Ratio {
    /// One ratio for all actions together (Schulman et al.).
    #[default]
    Joint,
    /// One ratio per action (ML-Agents). The objective is then the mean over the actions. Each action may move as far
    /// as all together otherwise, so steps are larger, the more so with many actions.
    PerAction,
}

impl Ratio {
    /// Numbers that a sample's log-probability is kept as.
    pub fn rows(self, actions: usize) -> usize {
        match self {
            Ratio::Joint => 1,
            Ratio::PerAction => actions,
        }
    }
}

/// Standard deviations of the actions, precomputed.
///
/// Log-probabilities leave out the constant `-ln(2 pi) / 2` per action. It cancels in every ratio and would only cost
/// precision.
#[derive(Clone, Debug)]
pub struct Gaussian<S> {
    /// Standard deviation per action.
    pub std: Vec<S>,
    /// Its reciprocal.
    pub inv_std: Vec<S>,
    /// Its logarithm.
    pub log_std: Vec<S>,
    /// Sum of the logarithms.
    pub log_sum: S,
}

struct Prepare<'a, S>(&'a [S]);

impl<T: Real<Scalar = T>> Kernel<T> for Prepare<'_, T> {
    type Output = Gaussian<T>;

    #[inline(always)]
    fn run(self) -> Gaussian<T> {
        let mut log_sum = T::zero();
        let (mut std, mut inv_std) = (Vec::new(), Vec::new());
        for l in self.0 {
            log_sum += *l;
            std.push((*l).exp());
            inv_std.push((-*l).exp());
        }
        Gaussian { std, inv_std, log_std: self.0.to_vec(), log_sum }
    }
}

impl<S: Real<Scalar = S>> Gaussian<S> {
    /// Creates the distribution from the logarithms of the standard deviations (`S` is `f32` or `f64`).
    pub fn new(log_std: &[S]) -> Self {
        S::enter(Prepare(log_std))
    }
    /// Differential entropy, nats.
    pub fn entropy(&self) -> f64 {
        S::widen(self.log_sum) + UNIT_ENTROPY * self.std.len() as f64
    }
    /// Mean standard deviation over the actions.
    pub fn mean_std(&self) -> f64 {
        self.std.iter().map(|s| S::widen(*s)).sum::<f64>() / self.std.len() as f64
    }
}

/// Keeps logarithms of standard deviations within the bounds `min` and `max` of the deviations.
pub fn bound_std(log_std: &mut [f32], min: f64, max: f64) {
    let [low, high] = [min, max].map(|s| Real::ln(s) as f32);
    log_std.iter_mut().for_each(|l| *l = l.clamp(low, high));
}

/// Log-probability of one column of actions: `-sum(z^2) / 2 - sum(log std)`. Stores `(action - mean) / std` in `z`.
#[inline(always)]
pub(crate) fn log_prob<T: Real>(
    gaussian: &Gaussian<T::Scalar>,
    action: &[T::Scalar],
    mean: &[T::Scalar],
    z: &mut [T::Scalar],
    lane: usize,
) -> T {
    let mut lp = -T::splat(gaussian.log_sum);
    for (k, inv_std) in gaussian.inv_std.iter().enumerate() {
        let at = k * BLOCK + lane;
        let e = (T::load(&action[at..]) - T::load(&mean[at..])) * T::splat(*inv_std);
        e.store(&mut z[at..]);
        lp = (e * T::lit(0.5)).neg_mul_add(e, lp);
    }
    lp
}

/// Draws actions for a chunk of blocks.
pub(crate) struct Sample<'a, T> {
    pub gaussian: &'a Gaussian<f32>,
    /// Means, one block per stream.
    pub mean: &'a Blocks<f32>,
    pub noise: &'a mut [Noise],
    /// Out: `[block][action][16]`.
    pub action: &'a mut [f32],
    /// Out: `[block][16]`, or `[block][action][16]` with one row per action.
    pub log_prob: &'a mut [f32],
    /// Selects one of the two forms of `log_prob`.
    pub ratio: Ratio,
    /// Work space: a row per action.
    pub eps: &'a mut [[f32; BLOCK]],
    pub lanes: PhantomData<T>,
}

impl<T: Real<Scalar = f32>> Kernel<T> for Sample<'_, T> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let n = self.gaussian.std.len();
        for (b, noise) in self.noise.iter_mut().enumerate() {
            noise.normals::<T>(self.eps);
            let mean = self.mean.block(b);
            let action = &mut self.action[b * n * BLOCK..][..n * BLOCK];
            let rows = self.ratio.rows(n) * BLOCK;
            let log_prob = &mut self.log_prob[b * rows..][..rows];
            for lane in (0..BLOCK).step_by(T::LANES) {
                let mut lp = -T::splat(self.gaussian.log_sum);
                for k in 0..n {
                    let (at, e) = (k * BLOCK + lane, T::load(&self.eps[k][lane..]));
                    lp = (e * T::lit(0.5)).neg_mul_add(e, lp);
                    e.mul_add(T::splat(self.gaussian.std[k]), T::load(&mean[at..])).store(&mut action[at..]);
                    if self.ratio == Ratio::PerAction {
                        (e * T::lit(0.5))
                            .neg_mul_add(e, -T::splat(self.gaussian.log_std[k]))
                            .store(&mut log_prob[at..]);
                    }
                }
                if self.ratio == Ratio::Joint {
                    lp.store(&mut log_prob[lane..]);
                }
            }
        }
    }
}
