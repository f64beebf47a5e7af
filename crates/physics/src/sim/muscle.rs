//! Muscles: their forces over length and velocity, and their activation.

use crate::lanes::Real;
use crate::model::Muscle;

/// Smallest divisor, MuJoCo's `mjMINVAL`.
const LEAST: f64 = 1e-15;

/// The force of a muscle, prepared for [`MuscleSpec::gain`] and [`MuscleSpec::bias`].
#[derive(Clone, Debug)]
pub(crate) struct MuscleSpec<C> {
    pub force: C,
    /// Shortest length of the actuator, the same in units of the optimal length, and the inverse of that length.
    pub shortest: C,
    pub start: C,
    pub per_length: C,
    /// Inverse of the velocity at which the force is gone.
    pub per_velocity: C,
    /// Ends and middles of the curve over the length, without the optimum at 1: lmin, below, above, lmax.
    pub knots: [C; 4],
    /// Inverse widths of its four pieces.
    pub per_piece: [C; 4],
    /// Largest factor over the velocity, its excess over 1, and the inverse of the excess.
    pub fvmax: C,
    pub excess: C,
    pub per_excess: C,
    /// Passive force at lmax.
    pub passive: C,
}

impl<C> MuscleSpec<C> {
    pub(super) fn new<T: Real<Scalar = C>>(m: &Muscle) -> Self {
        let c = T::scalar;
        let per = |x: f64| c(1.0 / x.max(LEAST));
        let optimal = (m.length_range[1] - m.length_range[0]) / (m.range[1] - m.range[0]).max(LEAST);
        let (below, above) = (0.5 * (m.lmin + 1.0), 0.5 * (1.0 + m.lmax));
        MuscleSpec {
            force: c(m.force),
            shortest: c(m.length_range[0]),
            start: c(m.range[0]),
            per_length: per(optimal),
            per_velocity: per(optimal * m.vmax),
            knots: [m.lmin, below, above, m.lmax].map(c),
            per_piece: [per(below - m.lmin), per(1.0 - below), per(above - 1.0), per(m.lmax - above)],
            fvmax: c(m.fvmax),
            excess: c(m.fvmax - 1.0),
            per_excess: per(m.fvmax - 1.0),
            passive: c(m.force * m.fpmax),
        }
    }
}

/// How the activation of a muscle follows its control.
#[derive(Clone, Debug)]
pub(crate) struct MuscleActivation<C> {
    /// Time constants.
    pub up: C,
    pub down: C,
    /// Inverse of the width of the transition between them; `None` without a transition.
    pub per_width: Option<C>,
}

impl<C> MuscleActivation<C> {
    pub(super) fn new<T: Real<Scalar = C>>(up: f64, down: f64, width: f64) -> Self {
        let c = T::scalar;
        MuscleActivation { up: c(up), down: c(down), per_width: (width >= LEAST).then(|| c(1.0 / width)) }
    }
}
