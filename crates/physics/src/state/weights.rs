//! Inverse weights of agents whose masses deviate: how much stiffer or softer their constraints are.

use crate::lanes::Real;
use crate::model::{EqualityKind, Model};
use crate::sim::{Sim, inverse_weights, mounts, tendon_weight, translational_weight, weights_of_body};

/// Stiffness of constraints relative to the model's: the inverse of the ratio of inverse weights.
#[derive(Clone, Debug)]
pub(crate) struct Weights<T: Real> {
    /// Per body: translational inverse weights as in [`weights_of_body`], of the model and of the agents.
    bodies: Vec<[[T; 2]; 2]>,
    /// Per degree of freedom.
    pub dofs: Vec<T>,
    /// Per tendon.
    pub tendons: Vec<T>,
    /// Per equality constraint of the model: rows of positions, and of orientations.
    pub equalities: Vec<[T; 2]>,
}

impl<T: Real> Weights<T> {
    /// Those of the model.
    pub fn new(sim: &Sim<T>) -> Self {
        let (model, one) = (&sim.model, T::lit(1.0));
        let mounts = mounts(model);
        let body = |b: usize| [weights_of_body(model, &mounts, b).map(T::lit); 2];
        Weights {
            bodies: (0..model.bodies.len()).map(body).collect(),
            dofs: vec![one; model.nv],
            tendons: vec![one; model.tendons.len()],
            equalities: vec![[one; 2]; model.equalities.len()],
        }
    }

    /// Stiffness of the contacts of two bodies.
    #[inline(always)]
    pub fn contact(&self, bodies: [usize; 2]) -> T {
        let [a, b] = bodies.map(|body| &self.bodies[body]);
        let [given, own] = [0, 1].map(|i| translational_weight(a[i][0] + b[i][0], a[i][1] + b[i][1]));
        given.div(own)
    }

    /// Sets the weights of one lane to those of `own`, a model with the same bodies.
    pub fn set(&mut self, lane: usize, model: &Model, own: &Model) {
        let mounts = mounts(model);
        for (body, x) in self.bodies.iter_mut().enumerate() {
            let weights = weights_of_body(own, &mounts, body);
            x[1].iter_mut().zip(weights).for_each(|(x, w)| x.set(lane, T::scalar(w)));
        }
        let ratio = |given: f64, own: f64| T::scalar(if given > 0.0 && own > 0.0 { given / own } else { 1.0 });
        for ((x, given), own) in self.dofs.iter_mut().zip(&model.dofs).zip(&own.dofs) {
            x.set(lane, ratio(given.invweight0, own.invweight0));
        }
        let tendon = |ends| ratio(tendon_weight::<T>(model, ends), tendon_weight::<T>(own, ends));
        for (i, x) in self.tendons.iter_mut().enumerate() {
            x.set(lane, tendon([Some(i), None]));
        }
        let dof = |model: &Model, joint: usize| model.dofs[model.joints[joint].dof_adr].invweight0;
        for (x, e) in self.equalities.iter_mut().zip(&model.equalities) {
            let ratios = match &e.kind {
                EqualityKind::Connect { bodies, .. } | EqualityKind::Weld { bodies, .. } => {
                    let [given, own] = [model, own].map(|m| inverse_weights(m, &mounts, *bodies));
                    [ratio(given[0], own[0]), ratio(given[1], own[1])]
                }
                EqualityKind::Joint { joint1, joint2, .. } => {
                    let [given, own] =
                        [model, own].map(|m| dof(m, *joint1) + joint2.map_or(0.0, |joint| dof(m, joint)));
                    [ratio(given, own); 2]
                }
                EqualityKind::Tendon { tendon1, tendon2, .. } => [tendon([Some(*tendon1), *tendon2]); 2],
            };
            x.iter_mut().zip(ratios).for_each(|(x, r)| x.set(lane, r));
        }
    }
}
