//! Inverse weights of a model with other masses, as MuJoCo's `mj_setConst` finds them.

use super::mass_matrix::{inverse_weights, tendon_inverse_weights};
use super::pose::Pose;
use super::room::Room;
use super::tendon::{Moments, moments};
use crate::model::Model;

/// A model, and what does not depend on its masses.
#[derive(Debug)]
pub(crate) struct Reweigher {
    model: Model,
    pose: Pose,
    simple: Vec<bool>,
    moments: Moments,
}

impl Reweigher {
    pub fn new(model: &Model) -> Self {
        let pose = Pose::new(model);
        let moments = moments(model, &pose);
        // inverse weights of this form follow from the rule for lone sliders
        let simple = model.bodies.iter().map(|b| b.mass > 0.0 && b.invweight0 == [1.0 / b.mass, 0.0]).collect();
        let mut light = model.clone();
        (light.geoms, light.hfields, light.meshes, light.hulls) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        Reweigher { model: light, pose, simple, moments }
    }

    /// The model with the masses and inertias of its bodies times `factors`, and the inverse weights that follow. It has no geoms.
    /// `None` if its mass matrix is not positive definite.
    pub fn with_masses(&self, factors: &[f64]) -> Option<Model> {
        let mut model = self.model.clone();
        for (body, factor) in model.bodies.iter_mut().zip(factors) {
            body.mass *= factor;
            body.inertia = body.inertia.map(|x| x * factor);
        }
        let mass_matrix =
            inverse_weights(&mut model, &self.pose, &self.simple, &self.moments, &Room::default()).ok()?;
        tendon_inverse_weights(&mut model, &mass_matrix, &self.moments);
        Some(model)
    }
}
