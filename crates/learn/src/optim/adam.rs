//! The optimizer: sums of partial gradients, their norm, and Adam (Kingma and Ba, 2015).
//!
//! Everything here is element by element, or a sum in a fixed order, so it has the same bits on every vector width and
//! however many threads share it. Lengths are multiples of sixteen, but for [`add`].

use crate::lanes::BLOCK;
use crate::lanes::f32_lanes;
use marathon_physics::lanes::{Isa, Kernel, Real, sum16};

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
    /// For `n` parameters.
    pub fn new(n: usize, epsilon: f64) -> Self {
        Self { m: vec![0.0; n], v: vec![0.0; n], powers: [1.0; 2], epsilon: epsilon as f32 }
    }

    /// Starts the next step: call once before the [`Adam::update`]s of all parameters.
    pub fn advance(&mut self) {
        self.powers = [self.powers[0] * BETA1, self.powers[1] * BETA2];
    }

    /// Updates the parameters `range` by `scale * gradient` (`gradient` covers the range alone).
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

/// Adds up partial gradients in their order and returns the sum of squares of the result.
pub fn reduce(isa: Isa, partials: &[&[f32]], out: &mut [f32]) -> f64 {
    assert!(out.len().is_multiple_of(BLOCK) && partials.iter().all(|p| p.len() == out.len()));
    f32_lanes!(isa, T => <T as Real>::enter(Reduce { partials, out }))
}

struct Reduce<'a> {
    partials: &'a [&'a [f32]],
    out: &'a mut [f32],
}

impl<T: Real<Scalar = f32>> Kernel<T> for Reduce<'_> {
    type Output = f64;

    #[inline(always)]
    fn run(self) -> f64 {
        let mut squares = [T::zero(); BLOCK];
        for (row, out) in self.out.chunks_exact_mut(BLOCK).enumerate() {
            for (part, out) in out.chunks_exact_mut(T::LANES).enumerate() {
                let at = row * BLOCK + part * T::LANES;
                let mut sum = T::load(&self.partials[0][at..]);
                for p in &self.partials[1..] {
                    sum += T::load(&p[at..]);
                }
                squares[part] = sum.mul_add(sum, squares[part]);
                sum.store(out);
            }
        }
        sum16(&squares[..BLOCK / T::LANES]) as f64
    }
}

/// `sum += x`.
pub fn add(isa: Isa, sum: &mut [f32], x: &[f32]) {
    assert!(sum.len() == x.len());
    f32_lanes!(isa, T => <T as Real>::enter(Add::<T> { sum, x }))
}

/// `sum += x`, of any length.
pub struct Add<'a, T: Real> {
    /// The sum.
    pub sum: &'a mut [T::Scalar],
    /// What is added.
    pub x: &'a [T::Scalar],
}

impl<T: Real> Kernel<T> for Add<'_, T> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let whole = self.sum.len() / BLOCK * BLOCK;
        let (sum, sum_rest) = self.sum.split_at_mut(whole);
        let (x, x_rest) = self.x.split_at(whole);
        for (s, x) in sum.chunks_exact_mut(T::LANES).zip(x.chunks_exact(T::LANES)) {
            (T::load(s) + T::load(x)).store(s);
        }
        for (s, x) in sum_rest.iter_mut().zip(x_rest) {
            *s = T::scalar(T::widen(*s) + T::widen(*x));
        }
    }
}
