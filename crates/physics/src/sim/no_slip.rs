//! Settings of the second solver for friction (`noslip_iterations`).

use crate::model::Model;

/// Maximum number of sweeps.
const MOST_SWEEPS: usize = 1000;

/// Settings of the second solver for friction.
#[derive(Clone, Debug)]
pub(crate) struct NoSlip {
    /// Maximum number of sweeps over the rows.
    pub iterations: usize,
    /// Scaled improvement of a sweep below which the sweeps end.
    pub tolerance: f64,
    /// Scale of the improvement if there are no islands.
    pub scale: f64,
    /// Whether trees that no constraint connects end separately. The scale is then the inverse of the sum of an island's
    /// diagonal of the mass matrix.
    pub islands: bool,
    /// Whether MuJoCo's middle phase sorts the contacts of two bodies.
    midphase: bool,
}

impl NoSlip {
    /// The settings of a model; `None` if it has no such solver.
    pub fn new(model: &Model) -> Option<NoSlip> {
        let opt = &model.opt;
        (opt.noslip_iterations > 0).then(|| NoSlip {
            iterations: opt.noslip_iterations.min(MOST_SWEEPS),
            tolerance: opt.noslip_tolerance,
            scale: 1.0 / (model.stat.mean_inertia * model.nv.max(1) as f64),
            islands: opt.flags.island,
            midphase: opt.flags.midphase,
        })
    }

    /// Key of a contact in MuJoCo's order, with the number of the declared pair if it is one. The geoms are in the order
    /// of their types. MuJoCo finds contacts by pairs of bodies, declared pairs first. Its middle phase sorts the others
    /// by the numbers of the geoms.
    pub fn order(&self, model: &Model, geoms: [usize; 2], declared: Option<usize>) -> [usize; 5] {
        let [a, b] = geoms;
        let ascending = [a.min(b), a.max(b)];
        let bodies = geoms.map(|g| model.geoms[g].body);
        let [first, second] = if self.midphase { geoms } else { ascending };
        [bodies[0].min(bodies[1]), bodies[0].max(bodies[1]), declared.unwrap_or(usize::MAX), first, second]
    }
}
