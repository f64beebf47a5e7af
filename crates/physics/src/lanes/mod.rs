//! Lanes: one generic number that is a plain `f64` or `f32`, or `L` agents side by side in one vector register.
//!
//! Every kernel of the engine is written once over [`Real`]. Lane `i` of every value belongs to agent `i` of a group.
//! No operation mixes lanes, so a trajectory depends neither on the agent's slot nor on the vector width. All backends
//! round alike: `mul_add` is fused (one rounding) everywhere, and emulated exactly on processors without such an
//! instruction. The transcendentals in [`math`] use these operations alone.
//!
//! By default, Rust compiles a function for the baseline processor. Vector code must therefore be entered through
//! [`Real::enter`], which runs a [`Kernel`] inside a function compiled for the right instruction set. Everything a
//! kernel calls must be `#[inline(always)]`.

#[cfg(any(vectors = "sse2", vectors = "simd128"))]
mod emulated;
#[cfg(not(vectors = "none"))]
mod four;
pub mod math;
#[cfg(vectors = "neon")]
mod neon;
#[cfg(any(vectors = "none", test))]
mod portable;
mod scalar;
#[cfg(vectors = "sse2")]
mod sse2;
#[cfg(any(vectors = "simd128", vectors = "relaxed"))]
mod wasm;
#[cfg(target_arch = "x86_64")]
mod x86;

use std::fmt::Debug;
use std::ops::{Add, AddAssign, Mul, MulAssign, Neg, Sub, SubAssign};

#[cfg(not(vectors = "none"))]
pub use four::{F32x4, fuses};
#[cfg(vectors = "none")]
pub use portable::F32x4;
#[cfg(target_arch = "x86_64")]
pub use x86::{F32x8, F32x16};

#[cfg(vectors = "sse2")]
use {emulated as fused, sse2 as vector};
#[cfg(vectors = "simd128")]
use {emulated as fused, wasm as vector};
#[cfg(vectors = "neon")]
use {neon as fused, neon as vector};
#[cfg(vectors = "relaxed")]
use {wasm as fused, wasm as vector};

/// Lanes of the widest backend.
pub const MAX_LANES: usize = 16;

/// Why no kernel can run on an x86-64 processor without fused multiply-add.
const NEEDS_FMA: &str = "this processor has no fused multiply-add (FMA), and this program was built for processors \
    that have it; build it on this machine, or with the feature `baseline` of marathon-physics";

/// Ends a program that ignored [`Isa::obstacle`].
#[cfg(not(without_fma))]
#[cold]
fn needs_fma() -> ! {
    panic!("{NEEDS_FMA}")
}

/// A piece of work over lanes of type `T`, run by [`Real::enter`].
///
/// Implementations mark `run` `#[inline(always)]`.
pub trait Kernel<T: Real> {
    /// Result of the work.
    type Output;
    /// Does the work.
    fn run(self) -> Self::Output;
}

/// `L` numbers, one per agent of a lane group.
pub trait Real:
    Copy
    + Debug
    + Send
    + Sync
    + 'static
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + SubAssign
    + MulAssign
{
    /// The number in one lane: `f32` or `f64`. Constants are stored like this and broadcast at use.
    type Scalar: Real<Scalar = Self::Scalar> + Default + PartialEq + PartialOrd;
    /// One truth value per lane.
    type Mask: Copy + Debug + Send + Sync + 'static;
    /// Number of lanes.
    const LANES: usize;
    /// Distance from 1 to the next larger number of the scalar type.
    const EPSILON: f64;
    /// Name of the instruction set, as printed by benchmarks.
    const ISA: &'static str;

    /// Whether this processor can run the backend.
    fn supported() -> bool;
    /// Runs a kernel inside a function compiled for this backend's instruction set.
    ///
    /// # Panics
    /// If the processor does not support it.
    fn enter<K: Kernel<Self>>(kernel: K) -> K::Output;

    /// Rounds a number to the precision of a lane.
    fn scalar(x: f64) -> Self::Scalar;
    /// The exact value of a lane's number.
    fn widen(x: Self::Scalar) -> f64;
    /// The same number in every lane.
    fn splat(x: Self::Scalar) -> Self;
    /// A literal in every lane.
    #[inline(always)]
    fn lit(x: f64) -> Self {
        Self::splat(Self::scalar(x))
    }
    /// Zero in every lane.
    #[inline(always)]
    fn zero() -> Self {
        Self::lit(0.0)
    }
    /// Reads `LANES` consecutive numbers.
    fn load(from: &[Self::Scalar]) -> Self;
    /// Writes `LANES` consecutive numbers.
    fn store(self, to: &mut [Self::Scalar]);
    /// The number in lane `i`.
    fn get(&self, i: usize) -> Self::Scalar;
    /// Replaces the number in lane `i`.
    fn set(&mut self, i: usize, x: Self::Scalar);

    /// `self * b + c`, rounded once.
    fn mul_add(self, b: Self, c: Self) -> Self;
    /// `c - self * b`, rounded once.
    fn neg_mul_add(self, b: Self, c: Self) -> Self;
    /// Quotient, correctly rounded.
    fn div(self, by: Self) -> Self;
    /// Reciprocal, correctly rounded.
    #[inline(always)]
    fn recip(self) -> Self {
        Self::lit(1.0).div(self)
    }
    /// Square root, correctly rounded.
    fn sqrt(self) -> Self;
    /// Absolute value.
    fn abs(self) -> Self;
    /// `self` where `self > other`, else `other` (so a NaN in `self` yields `other`).
    fn max(self, other: Self) -> Self;
    /// `self` where `self < other`, else `other` (so a NaN in `self` yields `other`).
    fn min(self, other: Self) -> Self;
    /// Nearest integer, ties to even.
    fn round(self) -> Self;
    /// Largest integer not above.
    fn floor(self) -> Self;
    /// `2^self` for integral `self` within the range of normal numbers.
    fn exp2_int(self) -> Self;
    /// `(m, e)` with `self = m * 2^e`, `1 <= m < 2`, for positive normal numbers.
    fn split_exponent(self) -> (Self, Self);
    /// The number of lane `from[i]` in lane `i`, for `from` within `LANES`. It is for work that is distributed over the
    /// lanes regardless of the agent. Numbers of different agents still never mix.
    #[inline(always)]
    fn rearrange(self, from: &[i32; MAX_LANES]) -> Self {
        let mut out = self;
        for i in 0..Self::LANES {
            out.set(i, self.get(from[i] as usize));
        }
        out
    }
    /// Sum over the lanes in the order of a halving tree: `x[i] + x[i + L/2]`, and so on.
    fn reduce_add(self) -> Self::Scalar;

    /// Lanes where `self < other`; false where either is NaN.
    fn lt(self, other: Self) -> Self::Mask;
    /// `a` where the mask is set, else `b`.
    fn select(mask: Self::Mask, a: Self, b: Self) -> Self;
    /// `a` where the mask is set, else +0.
    #[inline(always)]
    fn masked(mask: Self::Mask, a: Self) -> Self {
        Self::select(mask, a, Self::zero())
    }
    /// Lane-wise and.
    fn and(a: Self::Mask, b: Self::Mask) -> Self::Mask;
    /// Lane-wise or.
    fn or(a: Self::Mask, b: Self::Mask) -> Self::Mask;
    /// Lane-wise exclusive or.
    fn xor(a: Self::Mask, b: Self::Mask) -> Self::Mask;
    /// Lane-wise negation.
    fn not(a: Self::Mask) -> Self::Mask;
    /// No lane.
    fn none() -> Self::Mask;
    /// Whether any lane is set.
    fn any(a: Self::Mask) -> bool;
    /// Whether every lane is set.
    #[inline(always)]
    fn all(a: Self::Mask) -> bool {
        !Self::any(Self::not(a))
    }
    /// A bit mask: bit `i` is lane `i`.
    fn bits(a: Self::Mask) -> u32;
    /// The inverse of [`Real::bits`].
    fn from_bits(bits: u32) -> Self::Mask;

    /// Sine and cosine.
    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        math::sin_cos(self)
    }
    /// Exponential; the argument is clamped to the range of normal results.
    #[inline(always)]
    fn exp(self) -> Self {
        math::exp(self)
    }
    /// Natural logarithm of a positive normal number.
    #[inline(always)]
    fn ln(self) -> Self {
        math::ln(self)
    }
    /// Hyperbolic tangent.
    #[inline(always)]
    fn tanh(self) -> Self {
        math::tanh(self)
    }
    /// Angle of the point (`x`, `self`), in (-pi, pi].
    #[inline(always)]
    fn atan2(self, x: Self) -> Self {
        math::atan2(self, x)
    }
    /// Lanes that are neither infinite nor NaN.
    #[inline(always)]
    fn is_finite(self) -> Self::Mask {
        // inf 0 and NaN 0 are NaN, and a NaN compares false
        (self * Self::zero()).abs().lt(Self::lit(1.0))
    }
}

/// Sum over 16 consecutive lanes held in `16 / LANES` vectors, in the same halving tree for every width.
#[inline(always)]
pub fn sum16<T: Real>(v: &[T]) -> T::Scalar {
    match v.len() {
        1 => v[0].reduce_add(),
        2 => (v[0] + v[1]).reduce_add(),
        4 => ((v[0] + v[2]) + (v[1] + v[3])).reduce_add(),
        n => {
            // one lane each: fold halves until one number is left
            let mut x = [T::zero(); 16];
            x[..n].copy_from_slice(v);
            let mut half = n / 2;
            while half > 0 {
                for i in 0..half {
                    x[i] += x[i + half];
                }
                half /= 2;
            }
            x[0].reduce_add()
        }
    }
}

/// Instruction sets a group of agents can be stepped with, chosen at run time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Isa {
    /// One `f64` lane: the reference that tests compare with MuJoCo.
    F64,
    /// One `f32` lane.
    F32,
    /// Four `f32` lanes in the 128-bit vectors that every processor of the platform has. On x86-64, which has no fused
    /// multiply-add there, it needs the feature `baseline`.
    X4,
    /// Eight lanes, AVX2 and FMA.
    X8,
    /// Sixteen lanes, AVX-512F.
    X16,
}

impl Isa {
    /// All of them, narrowest first.
    pub const ALL: [Isa; 5] = [Isa::F64, Isa::F32, Isa::X4, Isa::X8, Isa::X16];

    /// The fastest one that this processor supports. Four lanes in plain arrays are slower than one.
    pub fn best() -> Isa {
        let vectors = [Isa::X16, Isa::X8, Isa::X4];
        let fast = vectors.into_iter().find(|isa| isa.supported() && (*isa != Isa::X4 || cfg!(not(vectors = "none"))));
        fast.unwrap_or(Isa::F32)
    }
    /// Number of agents per group.
    pub fn lanes(self) -> usize {
        match self {
            Isa::F64 | Isa::F32 => 1,
            Isa::X4 => 4,
            Isa::X8 => 8,
            Isa::X16 => 16,
        }
    }
    /// Whether this processor can run it, and this program has the kernels for it.
    pub fn supported(self) -> bool {
        match self {
            isa if cfg!(one_lane_type) => isa == Isa::X4,
            Isa::F64 => f64::supported(),
            Isa::F32 => f32::supported(),
            Isa::X4 => cfg!(without_fma),
            #[cfg(target_arch = "x86_64")]
            Isa::X8 => F32x8::supported(),
            #[cfg(target_arch = "x86_64")]
            Isa::X16 => F32x16::supported(),
            #[cfg(not(target_arch = "x86_64"))]
            Isa::X8 | Isa::X16 => false,
        }
    }
    /// Why it cannot run here; `None` if it can.
    pub fn obstacle(self) -> Option<&'static str> {
        match self {
            isa if isa.supported() => None,
            _ if cfg!(one_lane_type) => Some("programs for web pages have four lanes only"),
            Isa::X4 => Some("this program was built without the feature `baseline`"),
            Isa::F64 | Isa::F32 => Some(NEEDS_FMA),
            _ => Some("this processor does not support it"),
        }
    }
    /// Short name for tables.
    pub fn name(self) -> &'static str {
        match self {
            Isa::F64 => "f64",
            Isa::F32 => "f32",
            Isa::X4 => "baseline",
            Isa::X8 => "avx2",
            Isa::X16 => "avx512",
        }
    }
}

impl std::str::FromStr for Isa {
    type Err = String;
    fn from_str(s: &str) -> Result<Self, String> {
        Isa::ALL
            .into_iter()
            .find(|isa| isa.name() == s)
            .ok_or_else(|| format!("unknown instruction set '{s}'; expected one of f64, f32, baseline, avx2, avx512"))
    }
}

/// Runs a block for [`Isa::X4`] where its kernels are compiled.
#[cfg(without_fma)]
#[doc(hidden)]
#[macro_export]
macro_rules! with_baseline {
    ($($body:tt)*) => {{ $($body)* }};
}

/// The same: the processor of this build has wider vectors, and these kernels would take a fifth of the time to compile.
#[cfg(not(without_fma))]
#[doc(hidden)]
#[macro_export]
macro_rules! with_baseline {
    ($($body:tt)*) => {
        unreachable!("built without the feature `baseline`")
    };
}

/// Runs `$body` with the type alias `$T` bound to the lane type of an [`Isa`].
#[cfg(not(one_lane_type))]
#[macro_export]
macro_rules! with_lanes {
    ($isa:expr, $T:ident => $body:expr) => {
        match $isa {
            $crate::lanes::Isa::F64 => {
                type $T = f64;
                $body
            }
            isa => $crate::with_single_lanes!(isa, $T => $body),
        }
    };
}

/// The same for what is never computed in double precision.
///
/// # Panics
/// With [`Isa::F64`].
#[cfg(not(one_lane_type))]
#[macro_export]
macro_rules! with_single_lanes {
    ($isa:expr, $T:ident => $body:expr) => {
        match $isa {
            $crate::lanes::Isa::F64 => unreachable!("double precision where there is none"),
            $crate::lanes::Isa::F32 => {
                type $T = f32;
                $body
            }
            $crate::lanes::Isa::X4 => $crate::with_baseline! {
                type $T = $crate::lanes::F32x4;
                $body
            },
            #[cfg(target_arch = "x86_64")]
            $crate::lanes::Isa::X8 => {
                type $T = $crate::lanes::F32x8;
                $body
            }
            #[cfg(target_arch = "x86_64")]
            $crate::lanes::Isa::X16 => {
                type $T = $crate::lanes::F32x16;
                $body
            }
            #[cfg(not(target_arch = "x86_64"))]
            _ => unreachable!("not supported on this processor"),
        }
    };
}

/// Runs `$body` with the type alias `$T` bound to the lane type of an [`Isa`]. Programs for web pages have one.
///
/// # Panics
/// With an instruction set that is not [supported](lanes::Isa::supported).
#[cfg(one_lane_type)]
#[macro_export]
macro_rules! with_lanes {
    ($isa:expr, $T:ident => $body:expr) => {
        $crate::with_single_lanes!($isa, $T => $body)
    };
}

/// The same.
///
/// # Panics
/// As [`with_lanes`].
#[cfg(one_lane_type)]
#[macro_export]
macro_rules! with_single_lanes {
    ($isa:expr, $T:ident => $body:expr) => {
        match $isa {
            $crate::lanes::Isa::X4 => {
                type $T = $crate::lanes::F32x4;
                $body
            }
            isa => unreachable!("{} in a program that has four lanes only", isa.name()),
        }
    };
}

/// A function over lanes that is compiled separately for each instruction set. Its body is the [`Kernel`] that it
/// enters.
macro_rules! kernel_fn {
    ($(#[$meta:meta])* $vis:vis fn $name:ident<$life:lifetime, $T:ident>($($arg:ident: $type:ty),* $(,)?) $body:block) => {
        $crate::lanes::kernel_fn! { $(#[$meta])* $vis fn $name<$life, $T>($($arg: $type),*) -> () $body }
    };
    (
        $(#[$meta:meta])*
        $vis:vis fn $name:ident<$life:lifetime, $T:ident>($($arg:ident: $type:ty),* $(,)?) -> $out:ty $body:block
    ) => {
        $(#[$meta])*
        $vis fn $name<$life, $T: $crate::lanes::Real>($($arg: $type),*) -> $out {
            struct Body<$life, $T: $crate::lanes::Real> {
                $($arg: $type,)*
                lifetime: std::marker::PhantomData<&$life $T>,
            }
            impl<$life, $T: $crate::lanes::Real> $crate::lanes::Kernel<$T> for Body<$life, $T> {
                type Output = $out;
                #[inline(always)]
                fn run(self) -> $out {
                    let Body { $($arg,)* .. } = self;
                    $body
                }
            }
            $T::enter(Body { $($arg,)* lifetime: std::marker::PhantomData })
        }
    };
}
pub(crate) use kernel_fn;

macro_rules! assign_ops {
    ($t:ty) => {
        impl AddAssign for $t {
            #[inline(always)]
            fn add_assign(&mut self, o: Self) {
                *self = *self + o
            }
        }
        impl SubAssign for $t {
            #[inline(always)]
            fn sub_assign(&mut self, o: Self) {
                *self = *self - o
            }
        }
        impl MulAssign for $t {
            #[inline(always)]
            fn mul_assign(&mut self, o: Self) {
                *self = *self * o
            }
        }
    };
}
pub(crate) use assign_ops;

#[cfg(test)]
mod tests;
