//! Solver settings of models whose iteration cap stops the solver before it converges.

use super::options::SimOptions;
use crate::model::{Model, Solver};

/// Caps below this are followed exactly, because MuJoCo's Newton solver may not have converged by then. In 6,700 steps
/// from random states of 186 models of `docs/research/models.md`, it needs at most 25 iterations, and at most 10 in
/// 99.5 % of the steps.
pub(crate) const LEAST_ORDINARY_CAP: usize = 50;

/// Solver settings of models whose iteration cap stops the solver before it converges.
#[derive(Clone, Debug)]
pub(crate) struct Caps {
    /// Caps on the iterations, and on the evaluations of a line search.
    pub iterations: usize,
    pub ls_iterations: usize,
    /// Scaled improvement or gradient at which an island has converged, and the fraction of it that ends a line search.
    pub tolerance: f64,
    pub ls_tolerance: f64,
    /// Scale of costs and gradients if there are no islands.
    pub scale: f64,
    /// Whether trees that no constraint connects are solved separately.
    pub islands: bool,
    /// Whether to use conjugate gradients instead of Newton's method.
    pub conjugate: bool,
}

impl Caps {
    /// The settings of a model with a low cap; `None` for other models, and for `solver="PGS"`, which uses a different
    /// iteration.
    pub fn new(model: &Model, options: &SimOptions) -> Option<Caps> {
        let opt = &model.opt;
        let iterations = options.max_newton.unwrap_or(opt.iterations);
        (iterations < LEAST_ORDINARY_CAP && opt.solver != Solver::Pgs).then(|| Caps {
            iterations,
            ls_iterations: opt.ls_iterations,
            tolerance: opt.tolerance,
            ls_tolerance: opt.ls_tolerance,
            scale: 1.0 / (model.stat.mean_inertia * model.nv.max(1) as f64),
            islands: opt.flags.island,
            conjugate: opt.solver == Solver::Cg,
        })
    }
}

/// The iteration cap of Newton's method for models without [`Caps`]. PGS needs many more iterations than Newton, so a
/// low cap for PGS is not used.
pub(crate) fn cap(model: &Model, options: &SimOptions) -> usize {
    let iterations = options.max_newton.unwrap_or(model.opt.iterations);
    if model.opt.solver == Solver::Pgs { iterations.max(LEAST_ORDINARY_CAP) } else { iterations }
}
