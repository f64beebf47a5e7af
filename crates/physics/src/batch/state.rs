//! The complete state of one agent, independent of lanes.

use crate::lanes::Real;
use crate::model::Model;
use crate::sim::Sim;
use crate::variation::Variation;
use crate::work::Group;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// Everything an agent's future depends on. It is exact: numbers are written to files by their bits, so that even what
/// is not a number survives.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct AgentState {
    /// Configuration, velocity, controls and activations in MuJoCo's layout, then the solver's warm start.
    #[serde(serialize_with = "to_bits", deserialize_with = "from_bits")]
    numbers: Vec<f64>,
    /// Torque and force on every body from outside; empty: none.
    #[serde(serialize_with = "to_bits", deserialize_with = "from_bits")]
    pushes: Vec<f64>,
    /// Constants of its own.
    variation: Option<Variation>,
    /// Elevations of its own, m, by height field.
    grounds: Vec<Option<Vec<f32>>>,
}

impl AgentState {
    /// Whether it has the sizes of a state of this model. One that has not cannot be put into a [`Batch`](crate::Batch).
    pub fn fits(&self, model: &Model) -> bool {
        let Model { nq, nv, nu, na, bodies, .. } = model;
        let varied = |v: &Variation| v.mass.len() == bodies.len() && v.strength.len() == *nu;
        let grid = |(i, elevations): (usize, &Option<Vec<f32>>)| match (elevations, model.hfields.get(i)) {
            (Some(elevations), Some(field)) => elevations.len() == field.nrow * field.ncol,
            (Some(_), None) => false,
            (None, _) => true,
        };
        self.numbers.len() == nq + 2 * nv + nu + na
            && (self.pushes.is_empty() || self.pushes.len() == 6 * bodies.len())
            && self.variation.as_ref().is_none_or(varied)
            && self.grounds.iter().enumerate().all(grid)
    }
}

impl PartialEq for AgentState {
    /// Equal to the bit.
    fn eq(&self, other: &Self) -> bool {
        let same =
            |a: &[f64], b: &[f64]| a.len() == b.len() && a.iter().zip(b).all(|(a, b)| a.to_bits() == b.to_bits());
        same(&self.numbers, &other.numbers)
            && same(&self.pushes, &other.pushes)
            && self.variation == other.variation
            && self.grounds == other.grounds
    }
}

fn to_bits<S: Serializer>(numbers: &[f64], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_seq(numbers.iter().map(|x| x.to_bits()))
}

fn from_bits<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<f64>, D::Error> {
    Ok(Vec::<u64>::deserialize(deserializer)?.into_iter().map(f64::from_bits).collect())
}

impl<T: Real> Group<T> {
    /// Copies an agent's state out of its lane.
    pub(crate) fn save(&self, sim: &Sim<T>, lane: usize) -> AgentState {
        let get = |x: &T| T::widen(x.get(lane));
        let parts = [&self.qpos, &self.qvel, &self.ctrl, &self.act, &self.warm];
        let grounds = self.grounds.chunks(T::LANES).map(|lanes| {
            let elevation = |x: &T::Scalar| T::widen(*x) as f32;
            lanes[lane].as_ref().map(|field| field.heights.iter().map(elevation).collect())
        });
        AgentState {
            numbers: parts.into_iter().flatten().map(get).collect(),
            pushes: self.external.iter().flatten().map(get).collect(),
            variation: self.varied.as_ref().map(|_| self.variation(sim, lane)),
            grounds: grounds.collect(),
        }
    }

    /// Copies an agent's state into a lane.
    ///
    /// # Panics
    /// If the state belongs to another model.
    pub(crate) fn load(&mut self, sim: &Sim<T>, lane: usize, state: &AgentState) {
        let bodies = sim.model.bodies.len();
        let size = self.qpos.len() + self.qvel.len() + self.ctrl.len() + self.act.len() + self.warm.len();
        assert_eq!(state.numbers.len(), size, "a state of the same model");
        assert!(state.pushes.is_empty() || state.pushes.len() == 6 * bodies, "a state of the same model");
        let parts = [&mut self.qpos, &mut self.qvel, &mut self.ctrl, &mut self.act, &mut self.warm];
        for (x, s) in parts.into_iter().flatten().zip(&state.numbers) {
            x.set(lane, T::scalar(*s));
        }
        if self.external.is_empty() && !state.pushes.is_empty() {
            self.external = vec![[T::zero(); 6]; bodies];
        }
        // an agent that was not pushed when it was saved is not pushed now
        let pushes = state.pushes.iter().copied().chain(std::iter::repeat(0.0));
        for (x, s) in self.external.iter_mut().flatten().zip(pushes) {
            x.set(lane, T::scalar(s));
        }
        match &state.variation {
            Some(variation) => self.vary(sim, lane, variation),
            None if self.varied.is_some() => self.vary(sim, lane, &Variation::none(&sim.model)),
            None => {}
        }
        for field in 0..sim.fields.len() {
            match state.grounds.get(field) {
                Some(Some(elevations)) => self.set_ground(sim, lane, field, elevations),
                _ if !self.grounds.is_empty() => self.grounds[field * T::LANES + lane] = None,
                _ => {}
            }
        }
    }
}
