//! Running means and variances of observations and returns.
//!
//! A rollout adds up deviations from the current mean, rounded to single precision, block by block in lanes. The sums
//! of the blocks are then merged in double precision, in the order of the blocks (Chan, Golub and LeVeque, 1979). A cap
//! on the count lets the statistics follow a policy that keeps changing.

use crate::lanes::BLOCK;
use crate::lanes::buffer::Blocks;
use marathon_physics::lanes::{Kernel, Real};
use std::marker::PhantomData;

/// Number of samples that adopted statistics count as, so that the first rollouts change them little.
const ASSUMED: f64 = 100_000.0;

/// Means and variances of a list of quantities.
#[derive(Clone, Debug, PartialEq)]
pub struct Moments {
    /// Samples seen, up to the cap.
    pub count: f64,
    /// Means.
    pub mean: Vec<f64>,
    /// Variances.
    pub var: Vec<f64>,
}

impl Moments {
    /// Statistics without samples: mean 0, variance 1.
    pub fn new(n: usize) -> Self {
        Self { count: 0.0, mean: vec![0.0; n], var: vec![1.0; n] }
    }

    /// Merges `count` samples. `sums[i]` holds the sum of their deviations from `self.mean`, rounded to `f32`, and the
    /// sum of the squared deviations. A quantity whose sums are not finite keeps its statistics.
    pub fn merge(&mut self, count: f64, sums: &[(f64, f64)], cap: f64) {
        if count == 0.0 {
            return;
        }
        let weight = count / (self.count + count);
        for ((mean, var), (sum, square)) in self.mean.iter_mut().zip(&mut self.var).zip(sums) {
            let shift = sum / count;
            let batch_var = (square / count - shift * shift).max(0.0);
            // one bad number must not spoil the statistics forever
            if !(shift.is_finite() && batch_var.is_finite() && square.is_finite()) {
                continue;
            }
            let delta = (*mean as f32 as f64 + shift) - *mean;
            *var = (1.0 - weight) * *var + weight * batch_var + weight * (1.0 - weight) * delta * delta;
            *mean += weight * delta;
        }
        self.count = (self.count + count).min(cap);
    }

    /// Adopts the statistics of another map of observations, whose number `i` is number `sees[i]` here. They count as
    /// 100,000 samples.
    pub fn assume(&mut self, known: &Normalizer, sees: &[usize]) {
        for (place, (mean, std)) in sees.iter().zip(known.mean().iter().zip(known.std())) {
            (self.mean[*place], self.var[*place]) = (f64::from(*mean), f64::from(*std) * f64::from(*std));
        }
        self.count = ASSUMED;
    }

    /// Standard deviations, at least 1e-4.
    pub fn std(&self) -> Vec<f32> {
        self.var.iter().map(|v| (v + 1e-8).sqrt().max(1e-4) as f32).collect()
    }
    /// Means in single precision.
    pub fn mean32(&self) -> Vec<f32> {
        self.mean.iter().map(|m| *m as f32).collect()
    }
}

/// The map from a raw to a normalized observation: `clamp((x - mean) * (1 / std), -clip, clip)`.
#[derive(Clone, Debug, PartialEq)]
pub struct Normalizer {
    mean: Vec<f32>,
    std: Vec<f32>,
    inv_std: Vec<f32>,
    clip: f32,
}

impl Normalizer {
    /// Creates the map from means and standard deviations.
    pub fn new(mean: Vec<f32>, std: Vec<f32>, clip: f32) -> Self {
        let inv_std = std.iter().map(|s| 1.0 / s).collect();
        Self { mean, std, inv_std, clip }
    }
    /// A map that only clips.
    pub fn identity(n: usize, clip: f32) -> Self {
        Self::new(vec![0.0; n], vec![1.0; n], clip)
    }
    /// Means.
    pub fn mean(&self) -> &[f32] {
        &self.mean
    }
    /// Standard deviations.
    pub fn std(&self) -> &[f32] {
        &self.std
    }
    /// Bound of the normalized values.
    pub fn clip(&self) -> f32 {
        self.clip
    }
    /// Normalizes number `i` of an observation, with the bits of the lanes.
    #[inline(always)]
    pub fn number(&self, i: usize, raw: f32) -> f32 {
        Real::min(Real::max((raw - self.mean[i]) * self.inv_std[i], -self.clip), self.clip)
    }
    /// Normalizes one observation, with the bits of the lanes.
    pub fn row(&self, raw: &[f32]) -> Vec<f32> {
        let scales = self.mean.iter().zip(&self.inv_std);
        let one = |(x, (m, s)): (&f32, (&f32, &f32))| Real::min(Real::max((x - m) * s, -self.clip), self.clip);
        raw.iter().zip(scales).map(one).collect()
    }
}

/// Normalizes a chunk of raw blocks, `[block][obs][16]`, into a network's input. On request, also fills a flat copy,
/// and the sums of deviations from the mean and of their squares.
pub(crate) struct Normalize<'a, T> {
    pub normalizer: &'a Normalizer,
    pub raw: &'a [f32],
    pub input: &'a mut Blocks<f32>,
    pub copy: Option<&'a mut [f32]>,
    /// `[block][obs][16]` each.
    pub sums: Option<(&'a mut [f32], &'a mut [f32])>,
    pub lanes: PhantomData<T>,
}

impl<T: Real<Scalar = f32>> Kernel<T> for Normalize<'_, T> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Normalize { normalizer, raw, input, mut copy, mut sums, .. } = self;
        let n = normalizer.mean.len();
        let clip = T::splat(normalizer.clip);
        for (b, raw) in raw.chunks_exact(n * BLOCK).enumerate() {
            let out = input.block_mut(b);
            for k in 0..n {
                let (mean, inv_std) = (T::splat(normalizer.mean[k]), T::splat(normalizer.inv_std[k]));
                for lane in (k * BLOCK..(k + 1) * BLOCK).step_by(T::LANES) {
                    let d = T::load(&raw[lane..]) - mean;
                    let y = (d * inv_std).max(-clip).min(clip);
                    y.store(&mut out[lane..]);
                    if let Some(copy) = &mut copy {
                        y.store(&mut copy[b * n * BLOCK + lane..]);
                    }
                    if let Some((sum, square)) = &mut sums {
                        let at = b * n * BLOCK + lane;
                        (T::load(&sum[at..]) + d).store(&mut sum[at..]);
                        d.mul_add(d, T::load(&square[at..])).store(&mut square[at..]);
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn merged_moments_equal_those_of_the_whole() {
        let x: Vec<f64> = (0..3000).map(|i| ((i * i) % 1009) as f64 * 0.01 + 500.0).collect();
        let mut m = Moments::new(1);
        for part in [&x[..100], &x[100..1700], &x[1700..]] {
            let center = m.mean[0] as f32 as f64;
            let sums = part.iter().fold((0.0, 0.0), |s, x| (s.0 + x - center, s.1 + (x - center).powi(2)));
            m.merge(part.len() as f64, &[sums], 1e9);
        }
        let mean = x.iter().sum::<f64>() / 3000.0;
        let var = x.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / 3000.0;
        assert!((m.mean[0] - mean).abs() < 1e-9 * mean && (m.var[0] - var).abs() < 1e-7 * var, "{m:?} {mean} {var}");
        assert_eq!(m.count, 3000.0);
        // at the cap, later samples weigh more
        m.count = 100.0;
        m.merge(100.0, &[(100.0 * (mean + 4.0 - m.mean[0] as f32 as f64), 0.0)], 150.0);
        assert!((m.mean[0] - mean - 2.0).abs() < 1e-4 && m.count == 150.0, "{m:?}");
    }
}
