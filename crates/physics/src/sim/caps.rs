//! The solver's settings in models whose cap ends it before it has converged.

use super::options::SimOptions;
use crate::model::{Model, Solver};

/// Caps below this are followed to the letter. MuJoCo's Newton solver converges in fewer iterations. In 6,700 steps from
/// random states of 186 models of `docs/models.md`, it takes 25 at most, and 10 in 99.5 % of them.
pub(crate) const LEAST_ORDINARY_CAP: usize = 50;

/// The solver's settings in models whose cap ends it before it has converged.
#[derive(Clone, Debug)]
pub(crate) struct Caps {
    /// Caps on the iterations, and on the evaluations of a line search.
    pub iterations: usize,
    pub ls_iterations: usize,
    /// Scaled improvement or gradient at which an island is done, and the share of it that ends a line search.
    pub tolerance: f64,
    pub ls_tolerance: f64,
    /// Scale of costs and gradients if there are no islands.
    pub scale: f64,
    /// Trees that no constraint ties together are solved on their own.
    pub islands: bool,
    /// Conjugate gradients instead of Newton's method.
    pub conjugate: bool,
}

impl Caps {
    /// The settings of a model if its cap is low; none with `solver="PGS"`, whose iteration has nothing in common with this one.
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

/// The cap on Newton's method where the model's cap is not followed to the letter: PGS needs many more iterations than Newton, so
/// that its cap, if it is low, says nothing about them.
pub(crate) fn cap(model: &Model, options: &SimOptions) -> usize {
    let iterations = options.max_newton.unwrap_or(model.opt.iterations);
    if model.opt.solver == Solver::Pgs { iterations.max(LEAST_ORDINARY_CAP) } else { iterations }
}
