//! Four lanes in plain arrays, for processors without known vectors.

use super::{Kernel, Real, assign_ops};
use std::ops::{Add, AddAssign, Mul, MulAssign, Neg, Sub, SubAssign};

/// Four agents; 16-byte aligned so that compilers may use 128-bit registers.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(16))]
pub struct F32x4(pub [f32; 4]);

/// `a * b + c` with one rounding, from double-precision operations.
///
/// The product of two 24-bit significands is exact in 53 bits. The sum is rounded to odd (towards the neighbor with an
/// odd last bit whenever it is inexact), after which rounding to single precision gives the correct result: 53 is at
/// least 24 + 2 (Boldo and Melquiond, "Emulation of FMA and correctly rounded sums", 2008).
#[inline(always)]
fn fused(a: f32, b: f32, c: f32) -> f32 {
    let (p, c) = (a as f64 * b as f64, c as f64);
    let s = p + c;
    let t = s - p;
    let error = (p - (s - t)) + (c - t);
    let bits = s.to_bits();
    let inexact = error != 0.0 && error.is_finite() && bits & 1 == 0;
    let outward = (error > 0.0) == (s > 0.0);
    let odd = if outward { bits.wrapping_add(1) } else { bits.wrapping_sub(1) };
    f64::from_bits(if inexact { odd } else { bits }) as f32
}

/// The emulation in four lanes. A function call per product keeps the kernels' code small, which matters more than the
/// cost of the call.
#[inline(never)]
fn fused4(a: &[f32; 4], b: &[f32; 4], c: &[f32; 4]) -> [f32; 4] {
    [fused(a[0], b[0], c[0]), fused(a[1], b[1], c[1]), fused(a[2], b[2], c[2]), fused(a[3], b[3], c[3])]
}

macro_rules! lanewise {
    (|$($x:ident),*| $e:expr) => {{
        let mut r = [0.0f32; 4];
        for i in 0..4 {
            $(let $x = $x.0[i];)*
            r[i] = $e;
        }
        F32x4(r)
    }};
}
macro_rules! maskwise {
    (|$($x:ident),*| $e:expr) => {{
        let mut r = [false; 4];
        for i in 0..4 {
            $(let $x = $x[i];)*
            r[i] = $e;
        }
        r
    }};
}

impl Add for F32x4 {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        let a = self;
        lanewise!(|a, o| a + o)
    }
}
impl Sub for F32x4 {
    type Output = Self;
    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        let a = self;
        lanewise!(|a, o| a - o)
    }
}
impl Mul for F32x4 {
    type Output = Self;
    #[inline(always)]
    fn mul(self, o: Self) -> Self {
        let a = self;
        lanewise!(|a, o| a * o)
    }
}
impl Neg for F32x4 {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        let a = self;
        lanewise!(|a| -a)
    }
}
assign_ops!(F32x4);

impl Real for F32x4 {
    type Scalar = f32;
    type Mask = [bool; 4];
    const LANES: usize = 4;
    const EPSILON: f64 = f32::EPSILON as f64;
    const ISA: &'static str = "portable";

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
        F32x4([x; 4])
    }
    #[inline(always)]
    fn load(from: &[f32]) -> Self {
        F32x4([from[0], from[1], from[2], from[3]])
    }
    #[inline(always)]
    fn store(self, to: &mut [f32]) {
        to[..4].copy_from_slice(&self.0)
    }
    #[inline(always)]
    fn get(&self, i: usize) -> f32 {
        self.0[i]
    }
    #[inline(always)]
    fn set(&mut self, i: usize, x: f32) {
        self.0[i] = x
    }
    #[inline(always)]
    fn mul_add(self, b: Self, c: Self) -> Self {
        F32x4(fused4(&self.0, &b.0, &c.0))
    }
    #[inline(always)]
    fn neg_mul_add(self, b: Self, c: Self) -> Self {
        (-self).mul_add(b, c)
    }
    #[inline(always)]
    fn div(self, by: Self) -> Self {
        let a = self;
        lanewise!(|a, by| a / by)
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        let a = self;
        lanewise!(|a| a.sqrt())
    }
    #[inline(always)]
    fn abs(self) -> Self {
        let a = self;
        lanewise!(|a| a.abs())
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        let a = self;
        lanewise!(|a, other| if a > other { a } else { other })
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        let a = self;
        lanewise!(|a, other| if a < other { a } else { other })
    }
    #[inline(always)]
    fn round(self) -> Self {
        let a = self;
        lanewise!(|a| a.round_ties_even())
    }
    #[inline(always)]
    fn floor(self) -> Self {
        let a = self;
        lanewise!(|a| a.floor())
    }
    #[inline(always)]
    fn exp2_int(self) -> Self {
        let a = self;
        lanewise!(|a| f32::from_bits(((a as i32 + 127) as u32) << 23))
    }
    #[inline(always)]
    fn split_exponent(self) -> (Self, Self) {
        let a = self;
        let m = lanewise!(|a| f32::from_bits((a.to_bits() & 0x7f_ffff) | 0x3f80_0000));
        (m, lanewise!(|a| ((a.to_bits() >> 23) as i32 - 127) as f32))
    }
    #[inline(always)]
    fn reduce_add(self) -> f32 {
        (self.0[0] + self.0[2]) + (self.0[1] + self.0[3])
    }
    #[inline(always)]
    fn lt(self, other: Self) -> [bool; 4] {
        let (a, b) = (self.0, other.0);
        maskwise!(|a, b| a < b)
    }
    #[inline(always)]
    fn select(mask: [bool; 4], a: Self, b: Self) -> Self {
        let mut r = b.0;
        for i in 0..4 {
            r[i] = if mask[i] { a.0[i] } else { r[i] };
        }
        F32x4(r)
    }
    #[inline(always)]
    fn and(a: [bool; 4], b: [bool; 4]) -> [bool; 4] {
        maskwise!(|a, b| a & b)
    }
    #[inline(always)]
    fn or(a: [bool; 4], b: [bool; 4]) -> [bool; 4] {
        maskwise!(|a, b| a | b)
    }
    #[inline(always)]
    fn xor(a: [bool; 4], b: [bool; 4]) -> [bool; 4] {
        maskwise!(|a, b| a ^ b)
    }
    #[inline(always)]
    fn not(a: [bool; 4]) -> [bool; 4] {
        maskwise!(|a| !a)
    }
    #[inline(always)]
    fn none() -> [bool; 4] {
        [false; 4]
    }
    #[inline(always)]
    fn any(a: [bool; 4]) -> bool {
        a[0] | a[1] | a[2] | a[3]
    }
    #[inline(always)]
    fn bits(a: [bool; 4]) -> u32 {
        a[0] as u32 | (a[1] as u32) << 1 | (a[2] as u32) << 2 | (a[3] as u32) << 3
    }
    #[inline(always)]
    fn from_bits(bits: u32) -> [bool; 4] {
        [bits & 1 != 0, bits & 2 != 0, bits & 4 != 0, bits & 8 != 0]
    }
}
