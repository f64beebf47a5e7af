//! Approximate inverse inertias that constraints between two bodies see.

use super::weld::BodyMount;
use crate::model::Model;

/// Below this fraction of a body's other inverse inertia, one is nothing.
const NOTHING: f64 = 1e-6;

/// What is taken then, as such a fraction: where the softness of the constraint and its rounding in single precision are
/// errors of a size.
const LEAST: f64 = 1e-2;

/// A constraint this much harder than what it acts on is hard for single precision.
const HARD: f64 = 1e-2;

/// Inverse inertias that two bodies have against being moved apart and against being turned: the sums of MuJoCo's inverse
/// weights.
///
/// A body that turns about its center of mass has no translational one, a body that slides no rotational one, and MuJoCo
/// takes 1e-15 for them. Such a constraint is so hard that rounding decides, in MuJoCo too. Here it is as hard as single
/// precision can hold.
pub(crate) fn inverse_weights(model: &Model, mounts: &[BodyMount], bodies: [usize; 2]) -> [f64; 2] {
    [0, 1].map(|k| {
        let own: f64 = bodies.iter().map(|b| model.bodies[*b].invweight0[k]).sum();
        let other = other_weight(model, mounts, bodies, k);
        if own < NOTHING * other { LEAST * other } else { own }
    })
}

/// What an inverse weight would be of bodies that move in the other way as if they were free.
fn other_weight(model: &Model, mounts: &[BodyMount], bodies: [usize; 2], k: usize) -> f64 {
    let share = |b: &usize| {
        let (weight, spread) = (model.bodies[*b].invweight0[1 - k], mounts[*b].spread);
        if k == 0 || spread == 0.0 { weight * spread } else { weight / spread }
    };
    bodies.iter().map(share).sum()
}

/// Whether a constraint on points of two bodies is much harder, by the inverse weight `diag` of its rows, than what a
/// point of them weighs that moves and turns.
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
