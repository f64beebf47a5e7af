//! Fused multiply-add in four lanes for processors without such an instruction, with the bits of those that have it.
//!
//! A product of two numbers of single precision is exact in double precision. Its sum with the third number is rounded there,
//! and then again to single precision. The second rounding can go wrong only where the first sum lies halfway between two
//! numbers of single precision, or where the result is subnormal. Those lanes, a few of a hundred, are computed again
//! with a sum that is rounded to odd, after which a second rounding is harmless: 53 bits are at least 24 + 2 (Boldo and
//! Melquiond, "Emulation of FMA and correctly rounded sums: proved algorithms using rounding to odd", 2008).

use super::vector::{
    Mask, Pair, Vector, any, halves, int_below, int_eq, narrow, neg, or, pair_add, pair_mul, pair_sub, to_odd, widen,
};

/// `a * b + c`, rounded once.
#[inline(always)]
pub fn mul_add(a: Vector, b: Vector, c: Vector) -> Vector {
    let ([a0, a1], [b0, b1], [c0, c1]) = (widen(a), widen(b), widen(c));
    let sums = [pair_add(pair_mul(a0, b0), c0), pair_add(pair_mul(a1, b1), c1)];
    if any(doubtful(sums)) { again(a, b, c) } else { narrow(sums) }
}

/// `c - a * b`, rounded once.
#[inline(always)]
pub fn neg_mul_add(a: Vector, b: Vector, c: Vector) -> Vector {
    mul_add(neg(a), b, c)
}

/// Lanes whose second rounding may go wrong.
#[inline(always)]
fn doubtful(sums: [Pair; 2]) -> Mask {
    let [low, high] = halves(sums);
    // the 29 bits that single precision has no room for are 100...0
    let halfway = int_eq(low, 0x1fff_ffff, 0x1000_0000);
    // 0 < |sum| < 2^-126, by the upper halves without their sign, shifted so that a signed comparison treats 0 as large
    const SHIFT: i32 = 0x7fff_ffff;
    let subnormal = int_below(high, SHIFT, (0x3810_0000i32 << 1).wrapping_add(SHIFT));
    or(halfway, subnormal)
}

/// The product with a sum that is rounded to odd. A call, because it is rare and would double the size of the kernels.
#[cold]
#[inline(never)]
fn again(a: Vector, b: Vector, c: Vector) -> Vector {
    let ([a0, a1], [b0, b1], [c0, c1]) = (widen(a), widen(b), widen(c));
    let sum = |a, b, c| {
        let product = pair_mul(a, b);
        let sum = pair_add(product, c);
        // what the sum has lost (Knuth's TwoSum)
        let tail = pair_sub(sum, product);
        let error = pair_add(pair_sub(product, pair_sub(sum, tail)), pair_sub(c, tail));
        to_odd(sum, error)
    };
    narrow([sum(a0, b0, c0), sum(a1, b1, c1)])
}
