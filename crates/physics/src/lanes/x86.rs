//! Sixteen lanes on AVX-512F, eight on AVX2 with FMA.

use super::{Kernel, MAX_LANES, Real, assign_ops};
use std::arch::x86_64::*;
use std::fmt::{Debug, Formatter};
use std::ops::{Add, AddAssign, Mul, MulAssign, Neg, Sub, SubAssign};

/// Sixteen agents in a 512-bit register.
#[derive(Clone, Copy)]
#[repr(transparent)]
pub struct F32x16(__m512);

/// Eight agents in a 256-bit register.
#[derive(Clone, Copy)]
#[repr(transparent)]
pub struct F32x8(__m256);

/// Truth values of eight lanes: all bits of a lane set, or none.
#[derive(Clone, Copy, Debug)]
#[repr(transparent)]
pub struct Mask8(__m256);

// SAFETY of every block below: the intrinsics need AVX-512F (AVX2 and FMA) and nothing else; kernels over these types
// run inside `enter`, which checks for them. Loads and stores are checked against the slice's length.
macro_rules! x86_backend {
    ($t:ident, $raw:ident, $n:literal, $mask:ty, $isa:literal, $features:literal, [$($detect:tt),*],
     $add:ident, $sub:ident, $mul:ident, $div:ident, $fma:ident, $fnma:ident, $sqrt:ident, $max:ident, $min:ident,
     $set1:ident, $loadu:ident, $storeu:ident; $($rest:tt)*) => {
        impl Debug for $t {
            fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
                self.array().fmt(f)
            }
        }
        impl $t {
            #[inline(always)]
            fn array(&self) -> [f32; $n] {
                // SAFETY: both are plain numbers of the same size.
                unsafe { std::mem::transmute::<$raw, [f32; $n]>(self.0) }
            }
        }
        impl Add for $t {
            type Output = Self;
            #[inline(always)]
            fn add(self, o: Self) -> Self {
                unsafe { $t($add(self.0, o.0)) }
            }
        }
        impl Sub for $t {
            type Output = Self;
            #[inline(always)]
            fn sub(self, o: Self) -> Self {
                unsafe { $t($sub(self.0, o.0)) }
            }
        }
        impl Mul for $t {
            type Output = Self;
            #[inline(always)]
            fn mul(self, o: Self) -> Self {
                unsafe { $t($mul(self.0, o.0)) }
            }
        }
        assign_ops!($t);
        impl Real for $t {
            type Scalar = f32;
            type Mask = $mask;
            const LANES: usize = $n;
            const EPSILON: f64 = f32::EPSILON as f64;
            const ISA: &'static str = $isa;

            #[inline(always)]
            fn supported() -> bool {
                true $(&& std::arch::is_x86_feature_detected!($detect))*
            }
            #[inline]
            fn enter<K: Kernel<Self>>(kernel: K) -> K::Output {
                #[target_feature(enable = $features)]
                #[inline(never)]
                fn inner<K: Kernel<$t>>(kernel: K) -> K::Output {
                    kernel.run()
                }
                assert!(Self::supported(), "this processor has no {}", $isa);
                // SAFETY: the instruction set is there, as just checked.
                unsafe { inner(kernel) }
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
                unsafe { $t($set1(x)) }
            }
            #[inline(always)]
            fn load(from: &[f32]) -> Self {
                assert!(from.len() >= $n);
                unsafe { $t($loadu(from.as_ptr())) }
            }
            #[inline(always)]
            fn store(self, to: &mut [f32]) {
                assert!(to.len() >= $n);
                unsafe { $storeu(to.as_mut_ptr(), self.0) }
            }
            #[inline(always)]
            fn get(&self, i: usize) -> f32 {
                self.array()[i]
            }
            #[inline(always)]
            fn set(&mut self, i: usize, x: f32) {
                let mut a = self.array();
                a[i] = x;
                *self = Self::load(&a);
            }
            #[inline(always)]
            fn mul_add(self, b: Self, c: Self) -> Self {
                unsafe { $t($fma(self.0, b.0, c.0)) }
            }
            #[inline(always)]
            fn neg_mul_add(self, b: Self, c: Self) -> Self {
                unsafe { $t($fnma(self.0, b.0, c.0)) }
            }
            #[inline(always)]
            fn div(self, by: Self) -> Self {
                unsafe { $t($div(self.0, by.0)) }
            }
            #[inline(always)]
            fn sqrt(self) -> Self {
                unsafe { $t($sqrt(self.0)) }
            }
            #[inline(always)]
            fn max(self, other: Self) -> Self {
                unsafe { $t($max(self.0, other.0)) }
            }
            #[inline(always)]
            fn min(self, other: Self) -> Self {
                unsafe { $t($min(self.0, other.0)) }
            }
            $($rest)*
        }
    };
}

x86_backend!(F32x16, __m512, 16, __mmask16, "avx512", "avx512f,avx512vl,fma,avx2", ["avx512f", "avx512vl", "fma", "avx2"],
    _mm512_add_ps, _mm512_sub_ps, _mm512_mul_ps, _mm512_div_ps, _mm512_fmadd_ps, _mm512_fnmadd_ps, _mm512_sqrt_ps,
    _mm512_max_ps, _mm512_min_ps, _mm512_set1_ps, _mm512_loadu_ps, _mm512_storeu_ps;
    #[inline(always)]
    fn abs(self) -> Self {
        unsafe { F32x16(_mm512_abs_ps(self.0)) }
    }
    #[inline(always)]
    fn round(self) -> Self {
        unsafe { F32x16(_mm512_roundscale_ps::<0x08>(self.0)) }
    }
    #[inline(always)]
    fn floor(self) -> Self {
        unsafe { F32x16(_mm512_roundscale_ps::<0x09>(self.0)) }
    }
    #[inline(always)]
    fn exp2_int(self) -> Self {
        unsafe {
            let n = _mm512_add_epi32(_mm512_cvtps_epi32(self.0), _mm512_set1_epi32(127));
            F32x16(_mm512_castsi512_ps(_mm512_slli_epi32::<23>(n)))
        }
    }
    #[inline(always)]
    fn split_exponent(self) -> (Self, Self) {
        unsafe {
            let bits = _mm512_castps_si512(self.0);
            let e = _mm512_sub_epi32(_mm512_srli_epi32::<23>(bits), _mm512_set1_epi32(127));
            let m = _mm512_or_si512(_mm512_and_si512(bits, _mm512_set1_epi32(0x7f_ffff)), _mm512_set1_epi32(0x3f80_0000));
            (F32x16(_mm512_castsi512_ps(m)), F32x16(_mm512_cvtepi32_ps(e)))
        }
    }
    #[inline(always)]
    fn rearrange(self, from: &[i32; MAX_LANES]) -> Self {
        unsafe { F32x16(_mm512_permutexvar_ps(_mm512_loadu_epi32(from.as_ptr()), self.0)) }
    }
    #[inline(always)]
    fn reduce_add(self) -> f32 {
        unsafe {
            let x = _mm512_castps_pd(self.0);
            let high = _mm256_castpd_ps(_mm512_extractf64x4_pd::<1>(x));
            F32x8(_mm256_add_ps(_mm512_castps512_ps256(self.0), high)).reduce_add()
        }
    }
    #[inline(always)]
    fn lt(self, other: Self) -> __mmask16 {
        unsafe { _mm512_cmp_ps_mask::<_CMP_LT_OQ>(self.0, other.0) }
    }
    #[inline(always)]
    fn select(mask: __mmask16, a: Self, b: Self) -> Self {
        unsafe { F32x16(_mm512_mask_blend_ps(mask, b.0, a.0)) }
    }
    #[inline(always)]
    fn masked(mask: __mmask16, a: Self) -> Self {
        unsafe { F32x16(_mm512_maskz_mov_ps(mask, a.0)) }
    }
    #[inline(always)]
    fn and(a: __mmask16, b: __mmask16) -> __mmask16 {
        a & b
    }
    #[inline(always)]
    fn or(a: __mmask16, b: __mmask16) -> __mmask16 {
        a | b
    }
    #[inline(always)]
    fn xor(a: __mmask16, b: __mmask16) -> __mmask16 {
        a ^ b
    }
    #[inline(always)]
    fn not(a: __mmask16) -> __mmask16 {
        !a
    }
    #[inline(always)]
    fn none() -> __mmask16 {
        0
    }
    #[inline(always)]
    fn any(a: __mmask16) -> bool {
        a != 0
    }
    #[inline(always)]
    fn bits(a: __mmask16) -> u32 {
        a as u32
    }
    #[inline(always)]
    fn from_bits(bits: u32) -> __mmask16 {
        bits as u16
    }
);

impl Neg for F32x16 {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        unsafe {
            let sign = _mm512_set1_epi32(i32::MIN);
            F32x16(_mm512_castsi512_ps(_mm512_xor_si512(_mm512_castps_si512(self.0), sign)))
        }
    }
}

x86_backend!(F32x8, __m256, 8, Mask8, "avx2", "avx2,fma", ["avx2", "fma"],
    _mm256_add_ps, _mm256_sub_ps, _mm256_mul_ps, _mm256_div_ps, _mm256_fmadd_ps, _mm256_fnmadd_ps, _mm256_sqrt_ps,
    _mm256_max_ps, _mm256_min_ps, _mm256_set1_ps, _mm256_loadu_ps, _mm256_storeu_ps;
    #[inline(always)]
    fn abs(self) -> Self {
        unsafe { F32x8(_mm256_andnot_ps(_mm256_set1_ps(-0.0), self.0)) }
    }
    #[inline(always)]
    fn round(self) -> Self {
        unsafe { F32x8(_mm256_round_ps::<0x08>(self.0)) }
    }
    #[inline(always)]
    fn floor(self) -> Self {
        unsafe { F32x8(_mm256_round_ps::<0x09>(self.0)) }
    }
    #[inline(always)]
    fn exp2_int(self) -> Self {
        unsafe {
            let n = _mm256_add_epi32(_mm256_cvtps_epi32(self.0), _mm256_set1_epi32(127));
            F32x8(_mm256_castsi256_ps(_mm256_slli_epi32::<23>(n)))
        }
    }
    #[inline(always)]
    fn split_exponent(self) -> (Self, Self) {
        unsafe {
            let bits = _mm256_castps_si256(self.0);
            let e = _mm256_sub_epi32(_mm256_srli_epi32::<23>(bits), _mm256_set1_epi32(127));
            let m = _mm256_or_si256(_mm256_and_si256(bits, _mm256_set1_epi32(0x7f_ffff)), _mm256_set1_epi32(0x3f80_0000));
            (F32x8(_mm256_castsi256_ps(m)), F32x8(_mm256_cvtepi32_ps(e)))
        }
    }
    #[inline(always)]
    fn rearrange(self, from: &[i32; MAX_LANES]) -> Self {
        unsafe { F32x8(_mm256_permutevar8x32_ps(self.0, _mm256_loadu_si256(from.as_ptr().cast()))) }
    }
    #[inline(always)]
    fn reduce_add(self) -> f32 {
        unsafe {
            let x = _mm_add_ps(_mm256_castps256_ps128(self.0), _mm256_extractf128_ps::<1>(self.0));
            let x = _mm_add_ps(x, _mm_movehl_ps(x, x));
            _mm_cvtss_f32(_mm_add_ss(x, _mm_shuffle_ps::<1>(x, x)))
        }
    }
    #[inline(always)]
    fn lt(self, other: Self) -> Mask8 {
        unsafe { Mask8(_mm256_cmp_ps::<_CMP_LT_OQ>(self.0, other.0)) }
    }
    #[inline(always)]
    fn select(mask: Mask8, a: Self, b: Self) -> Self {
        unsafe { F32x8(_mm256_blendv_ps(b.0, a.0, mask.0)) }
    }
    #[inline(always)]
    fn masked(mask: Mask8, a: Self) -> Self {
        unsafe { F32x8(_mm256_and_ps(mask.0, a.0)) }
    }
    #[inline(always)]
    fn and(a: Mask8, b: Mask8) -> Mask8 {
        unsafe { Mask8(_mm256_and_ps(a.0, b.0)) }
    }
    #[inline(always)]
    fn or(a: Mask8, b: Mask8) -> Mask8 {
        unsafe { Mask8(_mm256_or_ps(a.0, b.0)) }
    }
    #[inline(always)]
    fn xor(a: Mask8, b: Mask8) -> Mask8 {
        unsafe { Mask8(_mm256_xor_ps(a.0, b.0)) }
    }
    #[inline(always)]
    fn not(a: Mask8) -> Mask8 {
        unsafe { Mask8(_mm256_xor_ps(a.0, _mm256_castsi256_ps(_mm256_set1_epi32(-1)))) }
    }
    #[inline(always)]
    fn none() -> Mask8 {
        unsafe { Mask8(_mm256_setzero_ps()) }
    }
    #[inline(always)]
    fn any(a: Mask8) -> bool {
        unsafe { _mm256_movemask_ps(a.0) != 0 }
    }
    #[inline(always)]
    fn bits(a: Mask8) -> u32 {
        unsafe { _mm256_movemask_ps(a.0) as u32 }
    }
    #[inline(always)]
    fn from_bits(bits: u32) -> Mask8 {
        unsafe {
            let lane = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
            let set = _mm256_and_si256(_mm256_set1_epi32(bits as i32), lane);
            Mask8(_mm256_castsi256_ps(_mm256_cmpeq_epi32(set, lane)))
        }
    }
);

impl Neg for F32x8 {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        unsafe { F32x8(_mm256_xor_ps(self.0, _mm256_set1_ps(-0.0))) }
    }
}
