//! Vectors of 128 bits for WebAssembly.
//!
//! WebAssembly has no multiply-add that is sure to round once. With the target feature `relaxed-simd`, `mul_add` is
//! `f32x4.relaxed_madd`: one instruction where the processor has one that fuses, otherwise a product and a sum. An engine
//! answers the same way all the time, so a page asks [`fuses`](super::fuses) once, and loads the module without the feature, which
//! emulates, if the answer is no.

use super::MAX_LANES;
use std::arch::wasm32::*;

pub const ISA: &str = if cfg!(target_feature = "relaxed-simd") { "relaxed128" } else { "simd128" };

/// Four numbers.
pub type Vector = v128;
/// Four truth values: all bits of a lane set, or none.
pub type Mask = v128;
/// Two numbers in double precision.
#[cfg(not(target_feature = "relaxed-simd"))]
pub type Pair = v128;

#[inline(always)]
pub fn load(from: &[f32; 4]) -> Vector {
    // SAFETY: four numbers are there, and the load may be unaligned.
    unsafe { v128_load(from.as_ptr().cast()) }
}
#[inline(always)]
pub fn store(v: Vector, to: &mut [f32; 4]) {
    // SAFETY: there is room for four numbers, and the store may be unaligned.
    unsafe { v128_store(to.as_mut_ptr().cast(), v) }
}
#[inline(always)]
pub fn splat(x: f32) -> Vector {
    f32x4_splat(x)
}
#[inline(always)]
pub fn add(a: Vector, b: Vector) -> Vector {
    f32x4_add(a, b)
}
#[inline(always)]
pub fn sub(a: Vector, b: Vector) -> Vector {
    f32x4_sub(a, b)
}
#[inline(always)]
pub fn mul(a: Vector, b: Vector) -> Vector {
    f32x4_mul(a, b)
}
#[inline(always)]
pub fn div(a: Vector, b: Vector) -> Vector {
    f32x4_div(a, b)
}
#[inline(always)]
pub fn sqrt(a: Vector) -> Vector {
    f32x4_sqrt(a)
}
#[inline(always)]
pub fn neg(a: Vector) -> Vector {
    f32x4_neg(a)
}
#[inline(always)]
pub fn abs(a: Vector) -> Vector {
    f32x4_abs(a)
}

// LLVM turns `pmax` and `pmin` into relaxed instructions where those are allowed, and they may treat NaN and -0 otherwise.
#[cfg(target_feature = "relaxed-simd")]
#[inline(always)]
pub fn max(a: Vector, b: Vector) -> Vector {
    select(f32x4_gt(a, b), a, b)
}
#[cfg(target_feature = "relaxed-simd")]
#[inline(always)]
pub fn min(a: Vector, b: Vector) -> Vector {
    select(f32x4_lt(a, b), a, b)
}
#[cfg(not(target_feature = "relaxed-simd"))]
#[inline(always)]
pub fn max(a: Vector, b: Vector) -> Vector {
    f32x4_pmax(b, a)
}
#[cfg(not(target_feature = "relaxed-simd"))]
#[inline(always)]
pub fn min(a: Vector, b: Vector) -> Vector {
    f32x4_pmin(b, a)
}

#[cfg(target_feature = "relaxed-simd")]
#[inline(always)]
pub fn mul_add(a: Vector, b: Vector, c: Vector) -> Vector {
    f32x4_relaxed_madd(a, b, c)
}
#[cfg(target_feature = "relaxed-simd")]
#[inline(always)]
pub fn neg_mul_add(a: Vector, b: Vector, c: Vector) -> Vector {
    f32x4_relaxed_nmadd(a, b, c)
}

#[inline(always)]
pub fn round(a: Vector) -> Vector {
    f32x4_nearest(a)
}
#[inline(always)]
pub fn floor(a: Vector) -> Vector {
    f32x4_floor(a)
}
/// The sum with 3 * 2^22 has the integer in its last bits.
#[inline(always)]
pub fn exp2_int(a: Vector) -> Vector {
    i32x4_shl(i32x4_add(f32x4_add(a, splat(12_582_912.0)), i32x4_splat(127)), 23)
}
#[inline(always)]
pub fn split_exponent(a: Vector) -> (Vector, Vector) {
    let e = i32x4_sub(u32x4_shr(a, 23), i32x4_splat(127));
    (v128_or(v128_and(a, i32x4_splat(0x7f_ffff)), i32x4_splat(0x3f80_0000)), f32x4_convert_i32x4(e))
}
/// A shuffle of bytes: lane `l` is the bytes `4 l` to `4 l + 3`.
#[inline(always)]
pub fn rearrange(a: Vector, from: &[i32; MAX_LANES]) -> Vector {
    // SAFETY: four numbers are there.
    let lane = unsafe { v128_load(from.as_ptr().cast()) };
    let byte = i32x4_add(i32x4_mul(lane, i32x4_splat(0x0404_0404)), i32x4_splat(0x0302_0100));
    i8x16_swizzle(a, byte)
}
#[inline(always)]
pub fn reduce_add(a: Vector) -> f32 {
    let x = add(a, i64x2_shuffle::<1, 1>(a, a));
    f32x4_extract_lane::<0>(x) + f32x4_extract_lane::<1>(x)
}

#[inline(always)]
pub fn lt(a: Vector, b: Vector) -> Mask {
    f32x4_lt(a, b)
}
/// Every mask has all or no bits of a lane set, which is what the relaxed selection asks for.
#[cfg(target_feature = "relaxed-simd")]
#[inline(always)]
pub fn select(mask: Mask, a: Vector, b: Vector) -> Vector {
    i32x4_relaxed_laneselect(a, b, mask)
}
#[cfg(not(target_feature = "relaxed-simd"))]
#[inline(always)]
pub fn select(mask: Mask, a: Vector, b: Vector) -> Vector {
    v128_bitselect(a, b, mask)
}
#[inline(always)]
pub fn masked(mask: Mask, a: Vector) -> Vector {
    v128_and(mask, a)
}
#[inline(always)]
pub fn and(a: Mask, b: Mask) -> Mask {
    v128_and(a, b)
}
#[inline(always)]
pub fn or(a: Mask, b: Mask) -> Mask {
    v128_or(a, b)
}
#[inline(always)]
pub fn xor(a: Mask, b: Mask) -> Mask {
    v128_xor(a, b)
}
#[inline(always)]
pub fn not(a: Mask) -> Mask {
    v128_not(a)
}
#[inline(always)]
pub fn none() -> Mask {
    i32x4_splat(0)
}
#[inline(always)]
pub fn bits(a: Mask) -> u32 {
    u32::from(i32x4_bitmask(a))
}
#[inline(always)]
pub fn any(a: Mask) -> bool {
    v128_any_true(a)
}
#[inline(always)]
pub fn from_bits(bits: u32) -> Mask {
    let lane = i32x4(1, 2, 4, 8);
    i32x4_eq(v128_and(i32x4_splat(bits as i32), lane), lane)
}

/// Operations of the emulation.
#[cfg(not(target_feature = "relaxed-simd"))]
mod pairs {
    use super::*;

    /// The lower and the upper two lanes in double precision.
    #[inline(always)]
    pub fn widen(a: Vector) -> [Pair; 2] {
        [f64x2_promote_low_f32x4(a), f64x2_promote_low_f32x4(i64x2_shuffle::<1, 1>(a, a))]
    }
    /// The inverse of [`widen`], rounded.
    #[inline(always)]
    pub fn narrow([low, high]: [Pair; 2]) -> Vector {
        i64x2_shuffle::<0, 2>(f32x4_demote_f64x2_zero(low), f32x4_demote_f64x2_zero(high))
    }
    #[inline(always)]
    pub fn pair_mul(a: Pair, b: Pair) -> Pair {
        f64x2_mul(a, b)
    }
    #[inline(always)]
    pub fn pair_add(a: Pair, b: Pair) -> Pair {
        f64x2_add(a, b)
    }
    #[inline(always)]
    pub fn pair_sub(a: Pair, b: Pair) -> Pair {
        f64x2_sub(a, b)
    }
    /// The number rounded to odd, if the exact one is `a + error`.
    #[inline(always)]
    pub fn to_odd(a: Pair, error: Pair) -> Pair {
        let inexact = f64x2_gt(f64x2_abs(error), f64x2_splat(0.0));
        let outward = u64x2_shr(v128_xor(a, error), 63);
        let towards_zero = i64x2_sub(a, v128_and(inexact, outward));
        v128_or(towards_zero, v128_and(inexact, i64x2_splat(1)))
    }
    /// The lower and the upper halves of the bits of four numbers, as integers.
    #[inline(always)]
    pub fn halves([low, high]: [Pair; 2]) -> [v128; 2] {
        [i32x4_shuffle::<0, 2, 4, 6>(low, high), i32x4_shuffle::<1, 3, 5, 7>(low, high)]
    }
    /// Lanes whose masked integer has this value.
    #[inline(always)]
    pub fn int_eq(a: v128, mask: i32, value: i32) -> Mask {
        i32x4_eq(v128_and(a, i32x4_splat(mask)), i32x4_splat(value))
    }
    /// Lanes where `2 a + offset < limit`, modulo 2^32 and signed.
    #[inline(always)]
    pub fn int_below(a: v128, offset: i32, limit: i32) -> Mask {
        i32x4_lt(i32x4_add(i32x4_shl(a, 1), i32x4_splat(offset)), i32x4_splat(limit))
    }
}
#[cfg(not(target_feature = "relaxed-simd"))]
pub use pairs::*;
