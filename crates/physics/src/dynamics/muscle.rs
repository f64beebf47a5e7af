//! Forces and activation of muscles (MuJoCo's `mju_muscleGain`, `mju_muscleBias` and `mju_muscleDynamics`).

use crate::lanes::Real;
use crate::sim::{MuscleActivation, MuscleSpec};

impl<C: Real<Scalar = C>> MuscleSpec<C> {
    /// Length in units of the optimal one.
    #[inline(always)]
    fn normal<T: Real<Scalar = C>>(&self, length: T) -> T {
        (length - T::splat(self.shortest)).mul_add(T::splat(self.per_length), T::splat(self.start))
    }

    /// Active force over the length: a bump of four parabolas.
    #[inline(always)]
    fn over_length<T: Real<Scalar = C>>(&self, length: T) -> T {
        let (one, half) = (T::lit(1.0), T::lit(0.5));
        let [lmin, below, above, lmax] = self.knots.map(T::splat);
        let [rise, to_top, from_top, fall] = self.per_piece.map(T::splat);
        let square = |x: T| half * x * x;
        let left = T::select(below.lt(length), one - square((one - length) * to_top), square((length - lmin) * rise));
        let right =
            T::select(above.lt(length), square((lmax - length) * fall), one - square((length - one) * from_top));
        let outside = T::or(length.lt(lmin), lmax.lt(length));
        T::masked(T::not(outside), T::select(one.lt(length), right, left))
    }

    /// Active force per unit of activation, and its derivative with respect to the velocity.
    #[inline(always)]
    pub(super) fn gain<T: Real<Scalar = C>>(&self, length: T, velocity: T) -> (T, T) {
        let (one, two) = (T::lit(1.0), T::lit(2.0));
        let pull = -(T::splat(self.force) * self.over_length(self.normal(length)));
        let per_velocity = T::splat(self.per_velocity);
        let v = velocity * per_velocity;
        let (excess, per_excess) = (T::splat(self.excess), T::splat(self.per_excess));
        let (shortens, rest) = (v + one, excess - v);
        let (lengthens, fast, still) = (T::zero().lt(v), excess.lt(v), (-one).lt(v));
        let fvmax = T::splat(self.fvmax);
        let up = T::select(fast, fvmax, fvmax - rest * rest * per_excess);
        let factor = T::select(lengthens, up, T::masked(still, shortens * shortens));
        let up = T::masked(T::not(fast), two * rest * per_excess);
        let slope = T::select(lengthens, up, T::masked(still, two * shortens));
        (pull * factor, pull * slope * per_velocity)
    }

    /// Passive force.
    #[inline(always)]
    pub(super) fn bias<T: Real<Scalar = C>>(&self, length: T) -> T {
        let (one, half) = (T::lit(1.0), T::lit(0.5));
        let (above, per) = (T::splat(self.knots[2]), T::splat(self.per_piece[2]));
        let length = self.normal(length);
        let x = (length - one) * per;
        let stretch = T::select(above.lt(length), (length - above).mul_add(per, half), half * x * x);
        T::masked(one.lt(length), -(T::splat(self.passive) * stretch))
    }
}

impl<C: Real<Scalar = C>> MuscleActivation<C> {
    /// Rate of change of the activation.
    #[inline(always)]
    pub(super) fn rate<T: Real<Scalar = C>>(&self, ctrl: T, act: T) -> T {
        let (zero, one) = (T::zero(), T::lit(1.0));
        let clamp = |x: T| x.max(zero).min(one);
        // a muscle that is active is slower to activate and faster to relax
        let speed = clamp(act).mul_add(T::lit(1.5), T::lit(0.5));
        let (up, down) = (T::splat(self.up) * speed, T::splat(self.down).div(speed));
        let way = clamp(ctrl) - act;
        let time = match self.per_width {
            None => T::select(zero.lt(way), up, down),
            Some(per_width) => {
                let x = clamp(way.mul_add(T::splat(per_width), T::lit(0.5)));
                let step = x * x * x * (x * T::lit(3.0)).mul_add(x.mul_add(T::lit(2.0), T::lit(-5.0)), T::lit(10.0));
                (up - down).mul_add(step, down)
            }
        };
        way.div(time.max(T::lit(1e-15)))
    }
}
