//! Kernels that the networks of rewards share.

use crate::lanes::BLOCK;
use crate::lanes::buffer::Blocks;
use crate::nets::mlp::CHUNK;
use marathon_physics::lanes::{Kernel, Real};
use std::marker::PhantomData;

/// Copies rows of sixteen into features `first..` of a block.
pub(crate) fn place<S: Copy + Default>(block: &mut [S], first: usize, rows: &[S]) {
    block[first * BLOCK..first * BLOCK + rows.len()].copy_from_slice(rows);
}

/// Squared distances: `delta = weight (guess - truth)`, and `half = |guess - truth|^2 / 2` in a row of sixteen per block.
pub(crate) struct Distance<'a, T: Real> {
    pub guess: &'a Blocks<T::Scalar>,
    pub truth: &'a Blocks<T::Scalar>,
    pub weight: f64,
    pub delta: &'a mut Blocks<T::Scalar>,
    pub half: &'a mut [T::Scalar],
    pub blocks: usize,
    pub lanes: PhantomData<T>,
}

impl<T: Real> Kernel<T> for Distance<'_, T> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let (weight, features) = (T::lit(self.weight), self.guess.features());
        for b in 0..self.blocks.min(CHUNK) {
            let (guess, truth, delta) = (self.guess.block(b), self.truth.block(b), self.delta.block_mut(b));
            for lane in (0..BLOCK).step_by(T::LANES) {
                let mut sum = T::zero();
                for k in 0..features {
                    let at = k * BLOCK + lane;
                    let d = T::load(&guess[at..]) - T::load(&truth[at..]);
                    sum = (d * T::lit(0.5)).mul_add(d, sum);
                    (d * weight).store(&mut delta[at..]);
                }
                sum.store(&mut self.half[b * BLOCK + lane..]);
            }
        }
    }
}

/// Adds `factor` times features `first..` of one buffer to all features of another.
pub(crate) struct Gather<'a, T: Real> {
    pub from: &'a Blocks<T::Scalar>,
    pub first: usize,
    pub factor: f64,
    pub to: &'a mut Blocks<T::Scalar>,
    pub blocks: usize,
    pub lanes: PhantomData<T>,
}

impl<T: Real> Kernel<T> for Gather<'_, T> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let factor = T::lit(self.factor);
        for b in 0..self.blocks.min(CHUNK) {
            let (from, to) = (&self.from.block(b)[self.first * BLOCK..], self.to.block_mut(b));
            for (to, from) in to.chunks_exact_mut(T::LANES).zip(from.chunks_exact(T::LANES)) {
                factor.mul_add(T::load(from), T::load(to)).store(to);
            }
        }
    }
}
