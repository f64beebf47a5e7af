//! The policy of SAC: normal numbers through the hyperbolic tangent, with means and deviations from the network for
//! each state (Haarnoja et al., "Soft actor-critic", 2018).
//!
//! The network has two outputs per action: the mean `m` and the logarithm `l` of the deviation, bounded to [`LOG_STD`].
//! With a standard normal number `z`:
//!
//! ```text
//! u = m + exp(l) z        a = tanh(u)        ln p(a) = sum(-z^2 / 2 - l - ln(2 pi) / 2 - ln(1 - a^2 + 1e-6))
//! ```

use crate::lanes::BLOCK;
use crate::lanes::buffer::Blocks;
use crate::lanes::noise::Noise;
use marathon_physics::lanes::{Kernel, Real};
use std::marker::PhantomData;

/// Bounds of the logarithm of the deviation.
pub const LOG_STD: [f64; 2] = [-5.0, 2.0];
/// Keeps the logarithm of the tangent's slope finite.
const EDGE: f64 = 1e-6;
/// `ln(2 pi) / 2`.
const HALF_LN_TAU: f64 = 0.918_938_533_204_672_7;

/// Fills `[block][action][16]` with normal numbers, each block from its own stream.
pub(crate) struct Normals<'a, T> {
    pub noise: &'a mut [Noise],
    pub z: &'a mut [f32],
    pub act: usize,
    pub lanes: PhantomData<T>,
}

impl<T: Real<Scalar = f32>> Kernel<T> for Normals<'_, T> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        for (noise, z) in self.noise.iter_mut().zip(self.z.chunks_exact_mut(self.act * BLOCK)) {
            noise.normals::<T>(z.as_chunks_mut::<BLOCK>().0);
        }
    }
}

/// Draws actions for a chunk of blocks.
pub struct Draw<'a, T: Real> {
    /// Outputs of the network.
    pub output: &'a Blocks<T::Scalar>,
    /// Standard normal numbers, `[block][action][16]`.
    pub z: &'a [T::Scalar],
    /// Number of actions.
    pub act: usize,
    /// Out: `[block][action][16]`.
    pub action: &'a mut [T::Scalar],
    /// Out: `[block][16]`.
    pub log_prob: &'a mut [T::Scalar],
    /// Number of blocks.
    pub blocks: usize,
    /// The lane type.
    pub lanes: PhantomData<T>,
}

impl<T: Real> Kernel<T> for Draw<'_, T> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Draw { output, z, act, action, log_prob, blocks, .. } = self;
        let [low, high] = LOG_STD.map(T::lit);
        for b in 0..blocks {
            let output = output.block(b);
            let row = b * act * BLOCK;
            for lane in (0..BLOCK).step_by(T::LANES) {
                let mut lp = T::lit(-HALF_LN_TAU * act as f64);
                for k in 0..act {
                    let at = k * BLOCK + lane;
                    let (m, l) = (T::load(&output[at..]), T::load(&output[act * BLOCK + at..]));
                    let (l, z) = (l.max(low).min(high), T::load(&z[row + at..]));
                    let a = l.exp().mul_add(z, m).tanh();
                    a.store(&mut action[row + at..]);
                    let slope = a.neg_mul_add(a, T::lit(1.0 + EDGE));
                    lp = (z * T::lit(0.5)).neg_mul_add(z, lp) - l - slope.ln();
                }
                lp.store(&mut log_prob[b * BLOCK + lane..]);
            }
        }
    }
}

/// Derivative of `alpha ln p(a) - Q(s, a)`, summed over samples, with respect to the network's outputs.
pub struct Objective<'a, T: Real> {
    /// Outputs of the network, and the derivative with respect to them.
    pub output: (&'a Blocks<T::Scalar>, &'a mut Blocks<T::Scalar>),
    /// As in [`Draw`].
    pub z: &'a [T::Scalar],
    /// The sampled actions.
    pub action: &'a [T::Scalar],
    /// Derivatives of `-Q` with respect to the inputs of two value networks. Their sum counts. Actions begin at feature
    /// `first`.
    pub minus_q: [&'a Blocks<T::Scalar>; 2],
    /// First feature of the actions in `minus_q`.
    pub first: usize,
    /// Weight of the entropy.
    pub alpha: f64,
    /// Number of actions.
    pub act: usize,
    /// Number of blocks.
    pub blocks: usize,
    /// The lane type.
    pub lanes: PhantomData<T>,
}

impl<T: Real> Kernel<T> for Objective<'_, T> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Objective { output: (output, delta), z, action, minus_q: [one, two], first, alpha, act, blocks, .. } = self;
        let [low, high] = LOG_STD.map(T::lit);
        let alpha = T::lit(alpha);
        for b in 0..blocks {
            let (output, delta) = (output.block(b), delta.block_mut(b));
            let (one, two) = (&one.block(b)[first * BLOCK..], &two.block(b)[first * BLOCK..]);
            let row = b * act * BLOCK;
            for k in 0..act {
                for at in (k * BLOCK..(k + 1) * BLOCK).step_by(T::LANES) {
                    let l = T::load(&output[act * BLOCK + at..]);
                    let inside = T::and(low.lt(l), l.lt(high));
                    let (l, z, a) = (l.max(low).min(high), T::load(&z[row + at..]), T::load(&action[row + at..]));
                    let slope = a.neg_mul_add(a, T::lit(1.0));
                    // d(-ln(1 - a^2 + edge))/du and d(-Q)/du
                    let of_entropy = (a * slope * T::lit(2.0)).div(slope + T::lit(EDGE));
                    let of_value = (T::load(&one[at..]) + T::load(&two[at..])) * slope;
                    let du = alpha.mul_add(of_entropy, of_value);
                    du.store(&mut delta[at..]);
                    let dl = (du * l.exp()).mul_add(z, -alpha);
                    T::masked(inside, dl).store(&mut delta[act * BLOCK + at..]);
                }
            }
        }
    }
}
