//! One lane: plain `f32` and `f64`.

use super::{Kernel, Real};

macro_rules! scalar_backend {
    ($t:ident, $isa:literal, $bits:ident, $mantissa:literal, $bias:literal; $($special:tt)*) => {
        impl Real for $t {
            type Scalar = $t;
            type Mask = bool;
            const LANES: usize = 1;
            const EPSILON: f64 = $t::EPSILON as f64;
            const ISA: &'static str = $isa;

            fn supported() -> bool {
                #[cfg(not(without_fma))]
                return std::arch::is_x86_feature_detected!("fma");
                #[cfg(without_fma)]
                return true;
            }
            #[inline]
            fn enter<K: Kernel<Self>>(kernel: K) -> K::Output {
                // a function that is not inlined is compiled once, and shared by all crates
                #[cfg(without_fma)]
                #[inline(never)]
                fn plain<K: Kernel<$t>>(kernel: K) -> K::Output {
                    kernel.run()
                }
                #[cfg(target_arch = "x86_64")]
                {
                    /// Same code, compiled with the fused multiply-add instruction.
                    #[target_feature(enable = "fma")]
                    #[inline(never)]
                    fn with_fma<K: Kernel<$t>>(kernel: K) -> K::Output {
                        kernel.run()
                    }
                    if std::arch::is_x86_feature_detected!("fma") {
                        // SAFETY: the processor has FMA, as just checked.
                        return unsafe { with_fma(kernel) };
                    }
                }
                #[cfg(without_fma)]
                return plain(kernel);
                #[cfg(not(without_fma))]
                super::needs_fma();
            }
            #[inline(always)]
            fn scalar(x: f64) -> $t {
                x as $t
            }
            #[inline(always)]
            fn widen(x: $t) -> f64 {
                x as f64
            }
            #[inline(always)]
            fn splat(x: $t) -> $t {
                x
            }
            #[inline(always)]
            fn load(from: &[$t]) -> $t {
                from[0]
            }
            #[inline(always)]
            fn store(self, to: &mut [$t]) {
                to[0] = self
            }
            #[inline(always)]
            fn get(&self, _: usize) -> $t {
                *self
            }
            #[inline(always)]
            fn set(&mut self, _: usize, x: $t) {
                *self = x
            }
            #[inline(always)]
            fn mul_add(self, b: $t, c: $t) -> $t {
                $t::mul_add(self, b, c)
            }
            #[inline(always)]
            fn neg_mul_add(self, b: $t, c: $t) -> $t {
                $t::mul_add(-self, b, c)
            }
            #[inline(always)]
            fn div(self, by: $t) -> $t {
                self / by
            }
            #[inline(always)]
            fn sqrt(self) -> $t {
                $t::sqrt(self)
            }
            #[inline(always)]
            fn abs(self) -> $t {
                $t::abs(self)
            }
            #[inline(always)]
            fn max(self, other: $t) -> $t {
                if self > other { self } else { other }
            }
            #[inline(always)]
            fn min(self, other: $t) -> $t {
                if self < other { self } else { other }
            }
            #[inline(always)]
            fn round(self) -> $t {
                self.round_ties_even()
            }
            #[inline(always)]
            fn floor(self) -> $t {
                $t::floor(self)
            }
            #[inline(always)]
            fn exp2_int(self) -> $t {
                $t::from_bits(((self as i32 + $bias) as $bits) << $mantissa)
            }
            #[inline(always)]
            fn split_exponent(self) -> ($t, $t) {
                let bits = self.to_bits();
                let e = (bits >> $mantissa) as i32 - $bias;
                let m = (bits & ((1 << $mantissa) - 1)) | (($bias as $bits) << $mantissa);
                ($t::from_bits(m), e as $t)
            }
            #[inline(always)]
            fn reduce_add(self) -> $t {
                self
            }
            #[inline(always)]
            fn lt(self, other: $t) -> bool {
                self < other
            }
            #[inline(always)]
            fn select(mask: bool, a: $t, b: $t) -> $t {
                if mask { a } else { b }
            }
            #[inline(always)]
            fn and(a: bool, b: bool) -> bool {
                a & b
            }
            #[inline(always)]
            fn or(a: bool, b: bool) -> bool {
                a | b
            }
            #[inline(always)]
            fn xor(a: bool, b: bool) -> bool {
                a ^ b
            }
            #[inline(always)]
            fn not(a: bool) -> bool {
                !a
            }
            #[inline(always)]
            fn none() -> bool {
                false
            }
            #[inline(always)]
            fn any(a: bool) -> bool {
                a
            }
            #[inline(always)]
            fn bits(a: bool) -> u32 {
                a as u32
            }
            #[inline(always)]
            fn from_bits(bits: u32) -> bool {
                bits & 1 == 1
            }
            $($special)*
        }
    };
}

scalar_backend!(f32, "f32", u32, 23, 127;);
// double precision is the reference: full-precision functions from the `libm` crate (not the platform's)
scalar_backend!(f64, "f64", u64, 52, 1023;
    #[inline(always)]
    fn sin_cos(self) -> (f64, f64) {
        libm::sincos(self)
    }
    #[inline(always)]
    fn exp(self) -> f64 {
        libm::exp(self)
    }
    #[inline(always)]
    fn ln(self) -> f64 {
        libm::log(self)
    }
    #[inline(always)]
    fn tanh(self) -> f64 {
        libm::tanh(self)
    }
    #[inline(always)]
    fn atan2(self, x: f64) -> f64 {
        libm::atan2(self, x)
    }
);
