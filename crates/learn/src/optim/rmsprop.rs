//! RMSProp as in TensorFlow: the constant is under the root, and the mean square starts at 1. Otherwise the first steps
//! would be ten times the rate.

use crate::lanes::f32_lanes;
use marathon_physics::lanes::{Isa, Kernel, Real};
use std::ops::Range;

/// Running mean square of the gradient.
#[derive(Clone, Debug, PartialEq)]
pub struct RmsProp {
    /// The mean square.
    pub mean_square: Vec<f32>,
    decay: f64,
    epsilon: f64,
}

impl RmsProp {
    /// Creates the state for `n` parameters.
    pub fn new(n: usize, decay: f64, epsilon: f64) -> Self {
        Self { mean_square: vec![1.0; n], decay, epsilon }
    }

    /// Updates the parameters `range` by `scale * gradient`. `gradient` covers only this range.
    pub fn update(&mut self, isa: Isa, params: &mut [f32], range: Range<usize>, gradient: &[f32], scale: f64, lr: f64) {
        let step = Step {
            params: &mut params[range.clone()],
            mean_square: &mut self.mean_square[range],
            gradient,
            scale: scale as f32,
            lr: lr as f32,
            decay: self.decay,
            epsilon: self.epsilon,
        };
        step.apply(isa);
    }
}

struct Step<'a> {
    params: &'a mut [f32],
    mean_square: &'a mut [f32],
    gradient: &'a [f32],
    scale: f32,
    lr: f32,
    decay: f64,
    epsilon: f64,
}

impl Step<'_> {
    fn apply(self, isa: Isa) {
        f32_lanes!(isa, T => <T as Real>::enter(self))
    }
}

impl<T: Real<Scalar = f32>> Kernel<T> for Step<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let (scale, lr, epsilon) = (T::splat(self.scale), T::splat(self.lr), T::lit(self.epsilon));
        let (decay, rest) = (T::lit(self.decay), T::lit(1.0 - self.decay));
        let squares = self.mean_square.chunks_exact_mut(T::LANES).zip(self.gradient.chunks_exact(T::LANES));
        for (p, (s, g)) in self.params.chunks_exact_mut(T::LANES).zip(squares) {
            let g = T::load(g) * scale;
            let square = decay.mul_add(T::load(s), rest * g * g);
            square.store(s);
            (T::load(p) - (lr * g).div((square + epsilon).sqrt())).store(p);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rms_prop_is_its_formula_on_every_width() {
        let gradient: Vec<f32> = (0..48).map(|i| (i as f32 - 20.0) * 0.1).collect();
        for isa in [Isa::F32, Isa::X4, Isa::X8, Isa::X16].into_iter().filter(|isa| isa.supported()) {
            let (mut params, mut mean_square) = (vec![0.5f32; 48], vec![1.0f32; 48]);
            let (scale, lr) = (0.5, 0.01);
            let step = Step {
                params: &mut params,
                mean_square: &mut mean_square,
                gradient: &gradient,
                scale,
                lr,
                decay: 0.9,
                epsilon: 1e-5,
            };
            step.apply(isa);
            for i in 0..48 {
                let g = gradient[i] as f64 * 0.5;
                let square = 0.9 + 0.1 * g * g;
                let want = 0.5 - 0.01 * g / (square + 1e-5).sqrt();
                assert!((params[i] as f64 - want).abs() < 1e-6 && (mean_square[i] as f64 - square).abs() < 1e-6);
            }
        }
    }
}
