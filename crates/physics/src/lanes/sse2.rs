//! Vectors of 128 bits for every x86-64 processor: SSE2 and nothing newer.

use super::MAX_LANES;
use std::arch::x86_64::*;

pub const ISA: &str = "sse2";

/// Four numbers.
pub type Vector = __m128;
/// Four truth values: all bits of a lane set, or none.
pub type Mask = __m128;
/// Two numbers in double precision.
pub type Pair = __m128d;

// SAFETY of every block below: every x86-64 processor has SSE2. Loads and stores have room for four numbers, and may be
// unaligned.

#[inline(always)]
pub fn load(from: &[f32; 4]) -> Vector {
    unsafe { _mm_loadu_ps(from.as_ptr()) }
}
#[inline(always)]
pub fn store(v: Vector, to: &mut [f32; 4]) {
    unsafe { _mm_storeu_ps(to.as_mut_ptr(), v) }
}
#[inline(always)]
pub fn splat(x: f32) -> Vector {
    unsafe { _mm_set1_ps(x) }
}
#[inline(always)]
pub fn add(a: Vector, b: Vector) -> Vector {
    unsafe { _mm_add_ps(a, b) }
}
#[inline(always)]
pub fn sub(a: Vector, b: Vector) -> Vector {
    unsafe { _mm_sub_ps(a, b) }
}
#[inline(always)]
pub fn mul(a: Vector, b: Vector) -> Vector {
    unsafe { _mm_mul_ps(a, b) }
}
#[inline(always)]
pub fn div(a: Vector, b: Vector) -> Vector {
    unsafe { _mm_div_ps(a, b) }
}
#[inline(always)]
pub fn sqrt(a: Vector) -> Vector {
    unsafe { _mm_sqrt_ps(a) }
}
#[inline(always)]
pub fn neg(a: Vector) -> Vector {
    unsafe { _mm_xor_ps(a, splat(-0.0)) }
}
#[inline(always)]
pub fn abs(a: Vector) -> Vector {
    unsafe { _mm_andnot_ps(splat(-0.0), a) }
}
#[inline(always)]
pub fn max(a: Vector, b: Vector) -> Vector {
    unsafe { _mm_max_ps(a, b) }
}
#[inline(always)]
pub fn min(a: Vector, b: Vector) -> Vector {
    unsafe { _mm_min_ps(a, b) }
}

/// Numbers from 2^23 on are integers; below, adding and subtracting 2^23 leaves the nearest one.
#[inline(always)]
pub fn round(a: Vector) -> Vector {
    unsafe {
        let sign = _mm_and_ps(a, splat(-0.0));
        let whole = _mm_or_ps(splat(8_388_608.0), sign);
        let near = _mm_or_ps(sub(add(a, whole), whole), sign);
        select(lt(abs(a), splat(8_388_608.0)), near, a)
    }
}
#[inline(always)]
pub fn floor(a: Vector) -> Vector {
    let near = round(a);
    sub(near, masked(lt(a, near), splat(1.0)))
}
#[inline(always)]
pub fn exp2_int(a: Vector) -> Vector {
    unsafe {
        let n = _mm_add_epi32(_mm_cvtps_epi32(a), _mm_set1_epi32(127));
        _mm_castsi128_ps(_mm_slli_epi32::<23>(n))
    }
}
#[inline(always)]
pub fn split_exponent(a: Vector) -> (Vector, Vector) {
    unsafe {
        let bits = _mm_castps_si128(a);
        let e = _mm_sub_epi32(_mm_srli_epi32::<23>(bits), _mm_set1_epi32(127));
        let m = _mm_or_si128(_mm_and_si128(bits, _mm_set1_epi32(0x7f_ffff)), _mm_set1_epi32(0x3f80_0000));
        (_mm_castsi128_ps(m), _mm_cvtepi32_ps(e))
    }
}
/// SSE2 has no shuffle by a variable.
#[inline(always)]
pub fn rearrange(a: Vector, from: &[i32; MAX_LANES]) -> Vector {
    let mut x = [0.0; 4];
    store(a, &mut x);
    let lane = |i: usize| x[(from[i] & 3) as usize];
    load(&[lane(0), lane(1), lane(2), lane(3)])
}
#[inline(always)]
pub fn reduce_add(a: Vector) -> f32 {
    unsafe {
        let x = add(a, _mm_movehl_ps(a, a));
        _mm_cvtss_f32(_mm_add_ss(x, _mm_shuffle_ps::<1>(x, x)))
    }
}

#[inline(always)]
pub fn lt(a: Vector, b: Vector) -> Mask {
    unsafe { _mm_cmplt_ps(a, b) }
}
#[inline(always)]
pub fn select(mask: Mask, a: Vector, b: Vector) -> Vector {
    unsafe { _mm_or_ps(_mm_and_ps(mask, a), _mm_andnot_ps(mask, b)) }
}
#[inline(always)]
pub fn masked(mask: Mask, a: Vector) -> Vector {
    unsafe { _mm_and_ps(mask, a) }
}
#[inline(always)]
pub fn and(a: Mask, b: Mask) -> Mask {
    unsafe { _mm_and_ps(a, b) }
}
#[inline(always)]
pub fn or(a: Mask, b: Mask) -> Mask {
    unsafe { _mm_or_ps(a, b) }
}
#[inline(always)]
pub fn xor(a: Mask, b: Mask) -> Mask {
    unsafe { _mm_xor_ps(a, b) }
}
#[inline(always)]
pub fn not(a: Mask) -> Mask {
    unsafe { _mm_xor_ps(a, _mm_castsi128_ps(_mm_set1_epi32(-1))) }
}
#[inline(always)]
pub fn none() -> Mask {
    unsafe { _mm_setzero_ps() }
}
#[inline(always)]
pub fn bits(a: Mask) -> u32 {
    unsafe { _mm_movemask_ps(a) as u32 }
}
#[inline(always)]
pub fn any(a: Mask) -> bool {
    unsafe { _mm_movemask_ps(a) != 0 }
}
#[inline(always)]
pub fn from_bits(bits: u32) -> Mask {
    unsafe {
        let lane = _mm_setr_epi32(1, 2, 4, 8);
        _mm_castsi128_ps(_mm_cmpeq_epi32(_mm_and_si128(_mm_set1_epi32(bits as i32), lane), lane))
    }
}

/// The lower and the upper two lanes in double precision.
#[inline(always)]
pub fn widen(a: Vector) -> [Pair; 2] {
    unsafe { [_mm_cvtps_pd(a), _mm_cvtps_pd(_mm_movehl_ps(a, a))] }
}
/// The inverse of [`widen`], rounded.
#[inline(always)]
pub fn narrow([low, high]: [Pair; 2]) -> Vector {
    unsafe { _mm_movelh_ps(_mm_cvtpd_ps(low), _mm_cvtpd_ps(high)) }
}
#[inline(always)]
pub fn pair_mul(a: Pair, b: Pair) -> Pair {
    unsafe { _mm_mul_pd(a, b) }
}
#[inline(always)]
pub fn pair_add(a: Pair, b: Pair) -> Pair {
    unsafe { _mm_add_pd(a, b) }
}
#[inline(always)]
pub fn pair_sub(a: Pair, b: Pair) -> Pair {
    unsafe { _mm_sub_pd(a, b) }
}
/// The number rounded to odd, if the exact one is `a + error`.
#[inline(always)]
pub fn to_odd(a: Pair, error: Pair) -> Pair {
    unsafe {
        let magnitude = _mm_andnot_pd(_mm_set1_pd(-0.0), error);
        let inexact = _mm_castpd_si128(_mm_cmpgt_pd(magnitude, _mm_setzero_pd()));
        let bits = _mm_castpd_si128(a);
        let outward = _mm_srli_epi64::<63>(_mm_castpd_si128(_mm_xor_pd(a, error)));
        let towards_zero = _mm_sub_epi64(bits, _mm_and_si128(inexact, outward));
        _mm_castsi128_pd(_mm_or_si128(towards_zero, _mm_and_si128(inexact, _mm_set1_epi64x(1))))
    }
}
/// The lower and the upper halves of the bits of four numbers, as integers.
#[inline(always)]
pub fn halves([low, high]: [Pair; 2]) -> [__m128i; 2] {
    unsafe {
        let (low, high) = (_mm_castpd_ps(low), _mm_castpd_ps(high));
        let pick = |v| _mm_castps_si128(v);
        [pick(_mm_shuffle_ps::<0x88>(low, high)), pick(_mm_shuffle_ps::<0xdd>(low, high))]
    }
}
/// Lanes whose masked integer has this value.
#[inline(always)]
pub fn int_eq(a: __m128i, mask: i32, value: i32) -> Mask {
    unsafe { _mm_castsi128_ps(_mm_cmpeq_epi32(_mm_and_si128(a, _mm_set1_epi32(mask)), _mm_set1_epi32(value))) }
}
/// Lanes where `2 a + offset < limit`, modulo 2^32 and signed.
#[inline(always)]
pub fn int_below(a: __m128i, offset: i32, limit: i32) -> Mask {
    unsafe {
        let shifted = _mm_add_epi32(_mm_slli_epi32::<1>(a), _mm_set1_epi32(offset));
        _mm_castsi128_ps(_mm_cmplt_epi32(shifted, _mm_set1_epi32(limit)))
    }
}
