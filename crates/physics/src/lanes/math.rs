//! Transcendental functions from additions, products and fused products alone, so that every backend gives the same bits.
//!
//! Single precision: argument reduction after Cody and Waite, polynomials of the Cephes library (public domain),
//! the hyperbolic tangent as a rational minimax function. Errors are a few units in the last place.

use super::Real;
use std::f64::consts::{FRAC_2_PI, FRAC_PI_2, FRAC_PI_4, LN_2, LOG2_E, PI};

/// Horner's scheme, highest power first.
#[inline(always)]
fn horner<T: Real, const N: usize>(x: T, c: [f64; N]) -> T {
    let mut p = T::lit(c[0]);
    for ci in c.iter().skip(1) {
        p = p.mul_add(x, T::lit(*ci));
    }
    p
}

/// Sine and cosine; accurate for |x| up to a few thousand.
#[inline(always)]
pub fn sin_cos<T: Real>(x: T) -> (T, T) {
    // x = k pi/2 + r, pi/2 split in three parts
    let k = (x * T::lit(FRAC_2_PI)).round();
    let r = k.neg_mul_add(T::lit(1.5703125), x);
    let r = k.neg_mul_add(T::lit(4.837512969970703e-4), r);
    let r = k.neg_mul_add(T::lit(7.549789948768648e-8), r);
    let z = r * r;
    let s = horner(z, [-1.9515295891e-4, 8.3321608736e-3, -1.6666654611e-1]);
    let s = (s * z).mul_add(r, r);
    let c = horner(z, [2.443315711809948e-5, -1.388731625493765e-3, 4.166664568298827e-2]);
    let c = (c * z).mul_add(z, z.neg_mul_add(T::lit(0.5), T::lit(1.0)));
    // quadrant k mod 4 as three comparisons
    let k4 = (k * T::lit(0.25)).floor().neg_mul_add(T::lit(4.0), k);
    let q1 = T::lit(0.5).lt(k4);
    let q2 = T::lit(1.5).lt(k4);
    let q3 = T::lit(2.5).lt(k4);
    let swap = T::or(T::xor(q1, q2), q3);
    let (sin, cos) = (T::select(swap, c, s), T::select(swap, s, c));
    (T::select(q2, -sin, sin), T::select(T::xor(q1, q3), -cos, cos))
}

/// Exponential, argument clamped to +-87.
#[inline(always)]
pub fn exp<T: Real>(x: T) -> T {
    let x = x.max(T::lit(-87.0)).min(T::lit(87.0));
    let n = (x * T::lit(LOG2_E)).round();
    let r = n.neg_mul_add(T::lit(0.693359375), x);
    let r = n.neg_mul_add(T::lit(-2.12194440e-4), r);
    let p = horner(
        r,
        [1.9875691500e-4, 1.3981999507e-3, 8.3334519073e-3, 4.1665795894e-2, 1.6666665459e-1, 5.0000001201e-1],
    );
    p.mul_add(r * r, r + T::lit(1.0)) * n.exp2_int()
}

/// Natural logarithm of a positive normal number.
#[inline(always)]
pub fn ln<T: Real>(x: T) -> T {
    let (m, e) = x.split_exponent();
    // mantissa to [sqrt(1/2), sqrt(2)), then ln m = 2 artanh((m-1)/(m+1))
    let big = T::lit(std::f64::consts::SQRT_2).lt(m);
    let m = T::select(big, m * T::lit(0.5), m);
    let e = T::select(big, e + T::lit(1.0), e);
    let f = m - T::lit(1.0);
    let s = f.div(f + T::lit(2.0));
    let z = s * s;
    let r = horner(z, [0.22222222, 0.28571429, 0.4, 0.66666667]);
    let r = (r * z).mul_add(s, s * T::lit(2.0));
    e.mul_add(T::lit(LN_2), r)
}

/// Hyperbolic tangent.
#[inline(always)]
pub fn tanh<T: Real>(x: T) -> T {
    // beyond this point the result is +-1 in single precision
    let x = x.max(T::lit(-7.905_311)).min(T::lit(7.905_311));
    let z = x * x;
    let p = horner(
        z,
        [
            -2.76076847742355e-16,
            2.00018790482477e-13,
            -8.60467152213735e-11,
            5.12229709037114e-08,
            1.48572235717979e-05,
            6.37261928875436e-04,
            4.89352455891786e-03,
        ],
    );
    let q = horner(z, [1.19825839466702e-06, 1.18534705686654e-04, 2.26843463243900e-03, 4.89352518554385e-03]);
    (x * p).div(q)
}

/// Angle of the point (`x`, `y`); 0 for the origin.
#[inline(always)]
pub fn atan2<T: Real>(y: T, x: T) -> T {
    let zero = T::zero();
    let (ax, ay) = (x.abs(), y.abs());
    let steep = ax.lt(ay);
    let (num, den) = (T::select(steep, ax, ay), T::select(steep, ay, ax));
    let t = num.div(den.max(T::lit(1e-37)));
    // second reduction: atan t = pi/4 + atan((t-1)/(t+1)) above tan(pi/8)
    let upper = T::lit(0.414_213_57).lt(t);
    let u = T::select(upper, (t - T::lit(1.0)).div(t + T::lit(1.0)), t);
    let z = u * u;
    let p = horner(z, [8.05374449538e-2, -1.38776856032e-1, 1.99777106478e-1, -3.33329491539e-1]);
    let a = (p * z).mul_add(u, u);
    let a = a + T::select(upper, T::lit(FRAC_PI_4), zero);
    let a = T::select(steep, T::lit(FRAC_PI_2) - a, a);
    let a = T::select(x.lt(zero), T::lit(PI) - a, a);
    T::select(y.lt(zero), -a, a)
}
