//! Vectors of 128 bits for 64-bit Arm, where every processor has NEON with fused multiply-add.

use super::MAX_LANES;
use std::arch::aarch64::*;

pub const ISA: &str = "neon";

/// Four numbers.
pub type Vector = float32x4_t;
/// Four truth values: all bits of a lane set, or none.
pub type Mask = uint32x4_t;

// SAFETY of every block below: every processor of this target has NEON. Loads and stores have room for four numbers, and
// may be unaligned.

#[inline(always)]
pub fn load(from: &[f32; 4]) -> Vector {
    unsafe { vld1q_f32(from.as_ptr()) }
}
#[inline(always)]
pub fn store(v: Vector, to: &mut [f32; 4]) {
    unsafe { vst1q_f32(to.as_mut_ptr(), v) }
}
#[inline(always)]
pub fn splat(x: f32) -> Vector {
    unsafe { vdupq_n_f32(x) }
}
#[inline(always)]
pub fn add(a: Vector, b: Vector) -> Vector {
    unsafe { vaddq_f32(a, b) }
}
#[inline(always)]
pub fn sub(a: Vector, b: Vector) -> Vector {
    unsafe { vsubq_f32(a, b) }
}
#[inline(always)]
pub fn mul(a: Vector, b: Vector) -> Vector {
    unsafe { vmulq_f32(a, b) }
}
#[inline(always)]
pub fn div(a: Vector, b: Vector) -> Vector {
    unsafe { vdivq_f32(a, b) }
}
#[inline(always)]
pub fn sqrt(a: Vector) -> Vector {
    unsafe { vsqrtq_f32(a) }
}
#[inline(always)]
pub fn neg(a: Vector) -> Vector {
    unsafe { vnegq_f32(a) }
}
#[inline(always)]
pub fn abs(a: Vector) -> Vector {
    unsafe { vabsq_f32(a) }
}
/// By comparison: Arm's own maximum differs for NaN and signed zeros.
#[inline(always)]
pub fn max(a: Vector, b: Vector) -> Vector {
    unsafe { vbslq_f32(vcgtq_f32(a, b), a, b) }
}
#[inline(always)]
pub fn min(a: Vector, b: Vector) -> Vector {
    unsafe { vbslq_f32(vcltq_f32(a, b), a, b) }
}
#[inline(always)]
pub fn mul_add(a: Vector, b: Vector, c: Vector) -> Vector {
    unsafe { vfmaq_f32(c, a, b) }
}
#[inline(always)]
pub fn neg_mul_add(a: Vector, b: Vector, c: Vector) -> Vector {
    unsafe { vfmsq_f32(c, a, b) }
}
#[inline(always)]
pub fn round(a: Vector) -> Vector {
    unsafe { vrndnq_f32(a) }
}
#[inline(always)]
pub fn floor(a: Vector) -> Vector {
    unsafe { vrndmq_f32(a) }
}
#[inline(always)]
pub fn exp2_int(a: Vector) -> Vector {
    unsafe { vreinterpretq_f32_s32(vshlq_n_s32::<23>(vaddq_s32(vcvtnq_s32_f32(a), vdupq_n_s32(127)))) }
}
#[inline(always)]
pub fn split_exponent(a: Vector) -> (Vector, Vector) {
    unsafe {
        let bits = vreinterpretq_u32_f32(a);
        let e = vsubq_s32(vreinterpretq_s32_u32(vshrq_n_u32::<23>(bits)), vdupq_n_s32(127));
        let m = vorrq_u32(vandq_u32(bits, vdupq_n_u32(0x7f_ffff)), vdupq_n_u32(0x3f80_0000));
        (vreinterpretq_f32_u32(m), vcvtq_f32_s32(e))
    }
}
/// A shuffle of bytes: lane `l` is the bytes `4 l` to `4 l + 3`.
#[inline(always)]
pub fn rearrange(a: Vector, from: &[i32; MAX_LANES]) -> Vector {
    unsafe {
        let lane = vld1q_s32(from.as_ptr());
        let byte = vmlaq_s32(vdupq_n_s32(0x0302_0100), lane, vdupq_n_s32(0x0404_0404));
        vreinterpretq_f32_u8(vqtbl1q_u8(vreinterpretq_u8_f32(a), vreinterpretq_u8_s32(byte)))
    }
}
#[inline(always)]
pub fn reduce_add(a: Vector) -> f32 {
    unsafe {
        let x = vadd_f32(vget_low_f32(a), vget_high_f32(a));
        vget_lane_f32::<0>(x) + vget_lane_f32::<1>(x)
    }
}

#[inline(always)]
pub fn lt(a: Vector, b: Vector) -> Mask {
    unsafe { vcltq_f32(a, b) }
}
#[inline(always)]
pub fn select(mask: Mask, a: Vector, b: Vector) -> Vector {
    unsafe { vbslq_f32(mask, a, b) }
}
#[inline(always)]
pub fn masked(mask: Mask, a: Vector) -> Vector {
    unsafe { vreinterpretq_f32_u32(vandq_u32(mask, vreinterpretq_u32_f32(a))) }
}
#[inline(always)]
pub fn and(a: Mask, b: Mask) -> Mask {
    unsafe { vandq_u32(a, b) }
}
#[inline(always)]
pub fn or(a: Mask, b: Mask) -> Mask {
    unsafe { vorrq_u32(a, b) }
}
#[inline(always)]
pub fn xor(a: Mask, b: Mask) -> Mask {
    unsafe { veorq_u32(a, b) }
}
#[inline(always)]
pub fn not(a: Mask) -> Mask {
    unsafe { vmvnq_u32(a) }
}
#[inline(always)]
pub fn none() -> Mask {
    unsafe { vdupq_n_u32(0) }
}
/// The powers of two of the lanes.
#[inline(always)]
fn powers() -> Mask {
    unsafe { vld1q_u32([1, 2, 4, 8].as_ptr()) }
}
#[inline(always)]
pub fn bits(a: Mask) -> u32 {
    unsafe { vaddvq_u32(vandq_u32(a, powers())) }
}
#[inline(always)]
pub fn any(a: Mask) -> bool {
    unsafe { vmaxvq_u32(a) != 0 }
}
#[inline(always)]
pub fn from_bits(bits: u32) -> Mask {
    unsafe { vtstq_u32(vdupq_n_u32(bits), powers()) }
}
