//! Adam (Kingma and Ba, 2015), element by element: the same bits on every vector width. Lengths are multiples of sixteen.

use crate::lanes::BLOCK;
use crate::lanes::f32_lanes;
use marathon_physics::lanes::{Isa, Kernel, Real};

const BETA1: f64 = 0.9;
const BETA2: f64 = 0.999;

/// Moments of the gradient.
#[derive(Clone, Debug, PartialEq)]
pub struct Adam {
    /// First moment.
    pub m: Vec<f32>,
    /// Second moment.
    pub v: Vec<f32>,
    /// Powers of the decay rates for the bias correction, by repeated multiplication.
    pub powers: [f64; 2],
    /// Added to the root of the second moment.
    pub epsilon: f32,
}

impl Adam {
    /// Creates the state for `n` parameters.
    pub fn new(n: usize, epsilon: f64) -> Self {
        Self { m: vec![0.0; n], v: vec![0.0; n], powers: [1.0; 2], epsilon: epsilon as f32 }
    }

    /// Starts the next step. Call it once before the [`Adam::update`]s of all parameters.
    pub fn advance(&mut self) {
        self.powers = [self.powers[0] * BETA1, self.powers[1] * BETA2];
    }

    /// Updates the parameters `range` by `scale * gradient`. `gradient` covers only this range.
    pub fn update(
        &mut self,
        isa: Isa,
        params: &mut [f32],
        range: std::ops::Range<usize>,
        gradient: &[f32],
        scale: f64,
        lr: f64,
    ) {
        assert!(range.len() == gradient.len() && range.len().is_multiple_of(BLOCK));
        let step = Step {
            params: &mut params[range.clone()],
            m: &mut self.m[range.clone()],
            v: &mut self.v[range],
            gradient,
            scale: scale as f32,
            rate: (lr / (1.0 - self.powers[0])) as f32,
            correction: (1.0 / (1.0 - self.powers[1])) as f32,
            epsilon: self.epsilon,
        };
        f32_lanes!(isa, T => <T as Real>::enter(step))
    }
}

struct Step<'a> {
    params: &'a mut [f32],
    m: &'a mut [f32],
    v: &'a mut [f32],
    gradient: &'a [f32],
    scale: f32,
    rate: f32,
    correction: f32,
    epsilon: f32,
}

impl<T: Real<Scalar = f32>> Kernel<T> for Step<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let (scale, rate, correction) = (T::splat(self.scale), T::splat(self.rate), T::splat(self.correction));
        let (b1, b2) = (T::lit(BETA1), T::lit(BETA2));
        let (c1, c2) = (T::lit(1.0 - BETA1), T::lit(1.0 - BETA2));
        let moments = self.m.chunks_exact_mut(T::LANES).zip(self.v.chunks_exact_mut(T::LANES));
        let rest = self.gradient.chunks_exact(T::LANES).zip(moments);
        for (p, (g, (m, v))) in self.params.chunks_exact_mut(T::LANES).zip(rest) {
            let g = T::load(g) * scale;
            let m1 = b1.mul_add(T::load(m), c1 * g);
            let v1 = b2.mul_add(T::load(v), c2 * g * g);
            m1.store(m);
            v1.store(v);
            let root = (v1 * correction).sqrt() + T::splat(self.epsilon);
            (T::load(p) - (rate * m1).div(root)).store(p);
        }
    }
}
