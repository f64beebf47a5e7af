//! Settings of the second solver for friction (`noslip_iterations`).

use crate::model::Model;
use std::collections::BTreeMap;

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
    /// Places of the declared pairs in MuJoCo's list, by their geoms, the lower number first.
    declared: BTreeMap<[usize; 2], usize>,
}

impl NoSlip {
    /// The settings of a model; `None` if it has no such solver.
    pub fn new(model: &Model) -> Option<NoSlip> {
        let opt = &model.opt;
        let mut declared = BTreeMap::new();
        for (i, pair) in model.pairs.iter().enumerate() {
            let [a, b] = pair.geoms;
            declared.entry([a.min(b), a.max(b)]).or_insert(i);
        }
        (opt.noslip_iterations > 0).then(|| NoSlip {
            iterations: opt.noslip_iterations,
            tolerance: opt.noslip_tolerance,
            scale: 1.0 / (model.stat.mean_inertia * model.nv.max(1) as f64),
            islands: opt.flags.island,
            midphase: opt.flags.midphase,
            declared,
        })
    }

    /// Key of a contact in MuJoCo's order. The geoms are in the order of their types. MuJoCo finds contacts by pairs of
    /// bodies, declared pairs first, and its middle phase sorts the others by the numbers of the geoms.
    pub fn order(&self, model: &Model, geoms: [usize; 2]) -> [usize; 5] {
        let [a, b] = geoms;
        let ascending = [a.min(b), a.max(b)];
        let bodies = geoms.map(|g| model.geoms[g].body);
        let declared = self.declared.get(&ascending).map_or(usize::MAX, |i| *i);
        let [first, second] = if self.midphase { geoms } else { ascending };
        [bodies[0].min(bodies[1]), bodies[0].max(bodies[1]), declared, first, second]
    }
}
