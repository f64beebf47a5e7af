//! Approximate inverse inertias for constraints between two bodies.

use super::weld::BodyMount;
use crate::lanes::Real;
use crate::model::Model;

/// Fraction of a body's other inverse inertia below which an inverse inertia counts as zero.
const NOTHING: f64 = 1e-6;

/// Fraction that replaces it. At this value, the softness of the constraint and its rounding error in single precision
/// are of similar size.
const LEAST: f64 = 1e-2;

/// The same for tendons, in double and in single precision: smaller ones make rounding errors larger than the softness.
const LEAST_OF_TENDONS: [f64; 2] = [1e-10, 1e-4];

/// A constraint that is harder than its bodies by this factor is hard for single precision.
const HARD: f64 = 1e-2;

/// Inverse inertias of two bodies for separating and for rotating them: the sums of MuJoCo's inverse weights.
///
/// A body that only turns about its center of mass has no translational inverse inertia, and a sliding body no
/// rotational one. MuJoCo uses 1e-15 instead. Such a constraint is so hard that rounding decides, in MuJoCo too. Here
/// it is as hard as single precision allows.
pub(crate) fn inverse_weights(model: &Model, mounts: &[BodyMount], bodies: [usize; 2]) -> [f64; 2] {
    [0, 1].map(|k| {
        let own: f64 = bodies.iter().map(|b| model.bodies[*b].invweight0[k]).sum();
        let other = other_weight(model, mounts, bodies, k);
        if own < NOTHING * other { LEAST * other } else { own }
    })
}

/// The same from the sums of the two bodies' own translational inverse weights and of those estimated.
#[inline(always)]
pub(crate) fn translational_weight<T: Real>(own: T, other: T) -> T {
    T::select(own.lt(other * T::lit(NOTHING)), other * T::lit(LEAST), own)
}

/// A body's own translational inverse weight, and the one estimated from the other kind of motion.
pub(crate) fn weights_of_body(model: &Model, mounts: &[BodyMount], body: usize) -> [f64; 2] {
    [model.bodies[body].invweight0[0], other_weight(model, mounts, [body], 0)]
}

/// The sum of MuJoCo's inverse weights of tendons, unless it is next to nothing.
///
/// A string that nothing moves in the reference configuration has none, and MuJoCo uses 1e-15. Its constraint is then
/// exact, but the rounding of such hard rows leads the solver astray. Here it is exact to rounding.
pub(crate) fn tendon_weight<T: Real>(model: &Model, tendons: [Option<usize>; 2]) -> f64 {
    let tendons = || tendons.iter().flatten().map(|t| &model.tendons[*t]);
    let own: f64 = tendons().map(|t| t.invweight0).sum();
    let body = |site: usize| model.bodies[model.sites[site].body].invweight0[0];
    let spans = tendons().flat_map(|t| t.kind.spans());
    let most: f64 = spans.map(|s| (body(s.sites[0]) + body(s.sites[1])) / (s.divisor * s.divisor)).sum();
    let [double, single] = LEAST_OF_TENDONS;
    let (nothing, least) = if T::EPSILON < 1e-12 { (double, double) } else { (NOTHING, single) };
    if own < nothing * most { least * most } else { own }
}

/// An inverse weight estimated from that of the other kind of motion, as if the bodies were free.
fn other_weight<const N: usize>(model: &Model, mounts: &[BodyMount], bodies: [usize; N], k: usize) -> f64 {
    let share = |b: &usize| {
        let (weight, spread) = (model.bodies[*b].invweight0[1 - k], mounts[*b].spread);
        if k == 0 || spread == 0.0 { weight * spread } else { weight / spread }
    };
    bodies.iter().map(share).sum()
}

/// Whether a constraint on points of two bodies is hard: the inverse weight `diag` of its rows is far below that of a
/// point that moves and turns.
pub(crate) fn is_hard(model: &Model, mounts: &[BodyMount], bodies: [usize; 2], diag: f64) -> bool {
    let own: f64 = bodies.iter().map(|b| model.bodies[*b].invweight0[0]).sum();
    diag < HARD * (own + other_weight(model, mounts, bodies, 0))
}

#[cfg(test)]
mod tests {
    use crate::model::Model;
    use crate::sim::{Sim, SimOptions};

    #[test]
    fn constraints_of_shipped_models_are_not_hard() {
        for folder in ["agents", "gymnasium", "dm_control"] {
            let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets").join(folder);
            for file in std::fs::read_dir(folder).expect("the folder exists") {
                let path = file.expect("readable").path();
                let model = Model::from_xml_file(&path).unwrap_or_else(|e| panic!("{e}"));
                let sim = Sim::<f32>::new(&model, SimOptions::default()).unwrap_or_else(|e| panic!("{e}"));
                assert!(!sim.hard, "{}", path.display());
            }
        }
    }

    #[test]
    fn a_constraint_on_a_body_that_only_turns_about_its_center_is_hard() {
        let text = r#"<mujoco><worldbody><geom type="plane" size="1 1 1"/><body><joint/><geom size=".1"/></body></worldbody>
            </mujoco>"#;
        let model = Model::from_xml_str(text, "turning").expect("a model");
        assert!(model.bodies[1].invweight0[0] < 1e-12);
        let sim = Sim::<f32>::new(&model, SimOptions::default()).expect("a simulation");
        assert!(sim.contacts.floor[0].soft.diag > 1e-3);
    }
}
