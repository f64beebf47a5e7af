//! Four lanes in a vector of 128 bits, on any processor that has one.

use super::{Kernel, MAX_LANES, Real, assign_ops, fused, vector};
use std::fmt::{Debug, Formatter};
use std::ops::{Add, AddAssign, Mul, MulAssign, Neg, Sub, SubAssign};

/// Four agents in a 128-bit register.
#[derive(Clone, Copy)]
#[repr(transparent)]
pub struct F32x4(vector::Vector);

/// Truth values of four lanes.
#[derive(Clone, Copy, Debug)]
#[repr(transparent)]
pub struct Mask4(vector::Mask);

impl F32x4 {
    #[inline(always)]
    fn array(&self) -> [f32; 4] {
        let mut x = [0.0; 4];
        vector::store(self.0, &mut x);
        x
    }
}
impl Debug for F32x4 {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        self.array().fmt(f)
    }
}
impl Add for F32x4 {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        F32x4(vector::add(self.0, o.0))
    }
}
impl Sub for F32x4 {
    type Output = Self;
    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        F32x4(vector::sub(self.0, o.0))
    }
}
impl Mul for F32x4 {
    type Output = Self;
    #[inline(always)]
    fn mul(self, o: Self) -> Self {
        F32x4(vector::mul(self.0, o.0))
    }
}
impl Neg for F32x4 {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        F32x4(vector::neg(self.0))
    }
}
assign_ops!(F32x4);

impl Real for F32x4 {
    type Scalar = f32;
    type Mask = Mask4;
    const LANES: usize = 4;
    const EPSILON: f64 = f32::EPSILON as f64;
    const ISA: &'static str = vector::ISA;

    fn supported() -> bool {
        true
    }
    #[inline(never)]
    fn enter<K: Kernel<Self>>(kernel: K) -> K::Output {
        kernel.run()
    }
    #[inline(always)]
    fn scalar(x: f64) -> f32 {
        x as f32
    }
    #[inline(always)]
    fn widen(x: f32) -> f64 {
        x as f64
    }
    #[inline(always)]
    fn splat(x: f32) -> Self {
        F32x4(vector::splat(x))
    }
    #[inline(always)]
    fn load(from: &[f32]) -> Self {
        F32x4(vector::load(from.first_chunk().expect("four numbers")))
    }
    #[inline(always)]
    fn store(self, to: &mut [f32]) {
        vector::store(self.0, to.first_chunk_mut().expect("room for four numbers"))
    }
    #[inline(always)]
    fn get(&self, i: usize) -> f32 {
        self.array()[i]
    }
    #[inline(always)]
    fn set(&mut self, i: usize, x: f32) {
        let mut a = self.array();
        a[i] = x;
        *self = F32x4(vector::load(&a));
    }
    #[inline(always)]
    fn mul_add(self, b: Self, c: Self) -> Self {
        F32x4(fused::mul_add(self.0, b.0, c.0))
    }
    #[inline(always)]
    fn neg_mul_add(self, b: Self, c: Self) -> Self {
        F32x4(fused::neg_mul_add(self.0, b.0, c.0))
    }
    #[inline(always)]
    fn div(self, by: Self) -> Self {
        F32x4(vector::div(self.0, by.0))
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        F32x4(vector::sqrt(self.0))
    }
    #[inline(always)]
    fn abs(self) -> Self {
        F32x4(vector::abs(self.0))
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        F32x4(vector::max(self.0, other.0))
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        F32x4(vector::min(self.0, other.0))
    }
    #[inline(always)]
    fn round(self) -> Self {
        F32x4(vector::round(self.0))
    }
    #[inline(always)]
    fn floor(self) -> Self {
        F32x4(vector::floor(self.0))
    }
    #[inline(always)]
    fn exp2_int(self) -> Self {
        F32x4(vector::exp2_int(self.0))
    }
    #[inline(always)]
    fn split_exponent(self) -> (Self, Self) {
        let (m, e) = vector::split_exponent(self.0);
        (F32x4(m), F32x4(e))
    }
    #[inline(always)]
    fn rearrange(self, from: &[i32; MAX_LANES]) -> Self {
        F32x4(vector::rearrange(self.0, from))
    }
    #[inline(always)]
    fn reduce_add(self) -> f32 {
        vector::reduce_add(self.0)
    }
    #[inline(always)]
    fn lt(self, other: Self) -> Mask4 {
        Mask4(vector::lt(self.0, other.0))
    }
    #[inline(always)]
    fn select(mask: Mask4, a: Self, b: Self) -> Self {
        F32x4(vector::select(mask.0, a.0, b.0))
    }
    #[inline(always)]
    fn masked(mask: Mask4, a: Self) -> Self {
        F32x4(vector::masked(mask.0, a.0))
    }
    #[inline(always)]
    fn and(a: Mask4, b: Mask4) -> Mask4 {
        Mask4(vector::and(a.0, b.0))
    }
    #[inline(always)]
    fn or(a: Mask4, b: Mask4) -> Mask4 {
        Mask4(vector::or(a.0, b.0))
    }
    #[inline(always)]
    fn xor(a: Mask4, b: Mask4) -> Mask4 {
        Mask4(vector::xor(a.0, b.0))
    }
    #[inline(always)]
    fn not(a: Mask4) -> Mask4 {
        Mask4(vector::not(a.0))
    }
    #[inline(always)]
    fn none() -> Mask4 {
        Mask4(vector::none())
    }
    #[inline(always)]
    fn any(a: Mask4) -> bool {
        vector::any(a.0)
    }
    #[inline(always)]
    fn bits(a: Mask4) -> u32 {
        vector::bits(a.0)
    }
    #[inline(always)]
    fn from_bits(bits: u32) -> Mask4 {
        Mask4(vector::from_bits(bits))
    }
}

/// Whether multiply-add of [`F32x4`] rounds once. It always does, except in a WebAssembly module with the target feature
/// `relaxed-simd` on a processor or in an engine without fused multiply-add. There, results would differ from all others.
pub fn fuses() -> bool {
    use std::hint::black_box;
    // (1 + e)(1 - e) - 1 = -e^2, which a rounded product loses; the other cases need the last bit of the product or the sum
    let e = f32::EPSILON;
    let cases = [
        [1.0 + e, 1.0 - e, -1.0],
        [1.0 + 4096.0 * e, 1.0 + 4096.0 * e, -1.0 - 8192.0 * e],
        [1.0 + e, 1.0 + e, 0.5 * e],
        [f32::MAX, 2.0, -f32::MAX],
        [1e-30, 1e-30, 1e-40],
    ];
    cases.into_iter().all(|[a, b, c]| {
        let lanes = |x: f32| black_box(F32x4::splat(black_box(x)));
        let want = black_box(a).mul_add(black_box(b), black_box(c)).to_bits();
        let got = [lanes(a).mul_add(lanes(b), lanes(c)), lanes(-a).neg_mul_add(lanes(b), lanes(c))];
        got.iter().all(|got| got.array().iter().all(|x| x.to_bits() == want))
    })
}
