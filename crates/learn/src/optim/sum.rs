//! Sums of partial gradients and their norm in a fixed order: the same bits for every vector width and number of
//! threads. Lengths are multiples of sixteen, except for [`add`].

use crate::lanes::BLOCK;
use crate::lanes::f32_lanes;
use marathon_physics::lanes::{Isa, Kernel, Real, sum16};

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
    /// The numbers that are added.
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
