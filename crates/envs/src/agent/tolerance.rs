//! Rewards between 0 and 1: 1 within bounds, decreasing outside of them (dm_control's `tolerance`).
//!
//! ```
//! use marathon_envs::{Sigmoid, Tolerance};
//!
//! // 1 at 2 m/s and above, 0.5 at 1 m/s, 0 at 0 m/s
//! let speed = Tolerance { value_at_margin: 0.5, sigmoid: Sigmoid::Linear, ..Tolerance::at_least(2.0, 1.0) };
//! assert_eq!([3.0, 1.0, -1.0].map(|x: f64| speed.of(x)), [1.0, 0.5, 0.0]);
//! ```

use std::f64::consts::{FRAC_1_PI, PI};

use marathon_physics::lanes::Real;

/// Shape of a [`Tolerance`] outside its bounds, as a function of the distance `d` from the bounds in units of the
/// margin. The scale `s` is such that the value at `d = 1` is [`Tolerance::value_at_margin`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sigmoid {
    /// `exp(-(s d)^2 / 2)`.
    Gaussian,
    /// `1 / cosh(s d)`.
    Hyperbolic,
    /// `1 / ((s d)^2 + 1)`.
    LongTail,
    /// `1 / (s d + 1)`.
    Reciprocal,
    /// `(1 + cos(pi s d)) / 2`, then 0.
    Cosine,
    /// `1 - s d`, then 0.
    Linear,
    /// `1 - (s d)^2`, then 0.
    Quadratic,
    /// `1 - tanh(s d)^2`.
    TanhSquared,
}

/// A reward that is 1 within `bounds` and decreases outside of them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerance {
    /// Lowest and highest number with reward 1. They may be infinite.
    pub bounds: [f64; 2],
    /// Distance from the bounds at which the reward has dropped to `value_at_margin`. If it is 0, the reward is 0
    /// outside of the bounds.
    pub margin: f64,
    /// Shape of the decrease.
    pub sigmoid: Sigmoid,
    /// Between 0 and 1. It may be 0 only for the linear, quadratic and cosine shapes.
    pub value_at_margin: f64,
}

impl Default for Tolerance {
    /// dm_control's defaults: 1 at 0 and nothing elsewhere. With a margin, a Gaussian that drops to 0.1.
    fn default() -> Self {
        Tolerance { bounds: [0.0, 0.0], margin: 0.0, sigmoid: Sigmoid::Gaussian, value_at_margin: 0.1 }
    }
}

impl Tolerance {
    /// A reward of 1 from `low` upward.
    pub fn at_least(low: f64, margin: f64) -> Self {
        Tolerance { bounds: [low, f64::INFINITY], margin, ..Tolerance::default() }
    }

    /// A reward of 1 at 0 only.
    pub fn around_zero(margin: f64) -> Self {
        Tolerance { margin, ..Tolerance::default() }
    }

    /// Reward of a number, in [0, 1].
    #[inline(always)]
    pub fn of<T: Real>(&self, x: T) -> T {
        let [low, high] = self.bounds;
        let (zero, one, v) = (T::zero(), T::lit(1.0), self.value_at_margin);
        let outside = (T::lit(low) - x).max(x - T::lit(high)).max(zero);
        if !(self.margin > 0.0) {
            return T::select(zero.lt(outside), zero, one);
        }
        let d = outside * T::lit(1.0 / self.margin);
        // every sigmoid is 1 at 0
        match self.sigmoid {
            Sigmoid::Gaussian => (d * d * T::lit(libm::log(v))).exp(),
            Sigmoid::Hyperbolic => {
                let e = (d * T::lit(libm::acosh(1.0 / v))).exp();
                T::lit(2.0).div(e + e.recip())
            }
            Sigmoid::LongTail => (d * d).mul_add(T::lit(1.0 / v - 1.0), one).recip(),
            Sigmoid::Reciprocal => d.mul_add(T::lit(1.0 / v - 1.0), one).recip(),
            Sigmoid::Cosine => {
                let turned = (d * T::lit(libm::acos(2.0 * v - 1.0) * FRAC_1_PI)).min(one);
                let (_, cos) = (turned * T::lit(PI)).sin_cos();
                T::lit(0.5).mul_add(cos, T::lit(0.5)).max(zero)
            }
            Sigmoid::Linear => d.neg_mul_add(T::lit(1.0 - v), one).max(zero),
            Sigmoid::Quadratic => (d * d).neg_mul_add(T::lit(1.0 - v), one).max(zero),
            Sigmoid::TanhSquared => {
                let t = (d * T::lit(libm::atanh((1.0 - v).sqrt()))).tanh();
                t.neg_mul_add(t, one)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [Sigmoid; 8] = [
        Sigmoid::Gaussian,
        Sigmoid::Hyperbolic,
        Sigmoid::LongTail,
        Sigmoid::Reciprocal,
        Sigmoid::Cosine,
        Sigmoid::Linear,
        Sigmoid::Quadratic,
        Sigmoid::TanhSquared,
    ];

    #[test]
    fn worth_is_1_inside_falls_to_the_value_at_the_margin_and_never_below_0() {
        for sigmoid in ALL {
            let t = Tolerance { bounds: [-1.0, 3.0], margin: 2.0, sigmoid, value_at_margin: 0.3 };
            for (x, expected) in [(-1.0, 1.0), (0.0, 1.0), (3.0, 1.0), (5.0, 0.3), (-3.0, 0.3)] {
                let (double, single): (f64, f32) = (t.of(x), t.of(x as f32));
                assert!((double - expected).abs() < 1e-6, "{sigmoid:?} of {x} is {double}");
                assert!((single - expected as f32).abs() < 1e-6, "{sigmoid:?} of {x} is {single}");
            }
            let mut last = 1.0;
            for i in 0..100 {
                let x = t.of(3.0 + 0.2 * f64::from(i));
                assert!((0.0..=last + 1e-12).contains(&x), "{sigmoid:?}: {x} after {last}");
                last = x;
            }
            assert!((0.0..0.2).contains(&t.of(1e4_f64)), "{sigmoid:?}");
        }
    }

    #[test]
    fn without_a_margin_it_is_all_or_nothing() {
        let t = Tolerance { bounds: [0.6, 2.0], ..Tolerance::default() };
        assert_eq!([0.5, 0.6, 1.0, 2.0, 2.1].map(|x: f64| t.of(x)), [0.0, 1.0, 1.0, 1.0, 0.0]);
        assert_eq!(Tolerance::at_least(1.0, 0.5).of(f64::MAX), 1.0);
    }
}
