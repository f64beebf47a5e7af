//! The complete state of one agent, independent of lanes.

use super::group::Group;
use super::obstacle::{Obstacle, take};
use super::variation::Variation;
use crate::geometry::height::HeightField;
use crate::lanes::Real;
use crate::model::Model;
use crate::sim::Sim;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// Everything that an agent's future depends on. The copy is exact: files store the bits of numbers, so that even NaN
/// survives.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct AgentState {
    /// Configuration, velocity, controls and activations in MuJoCo's layout, then the solver's warm start, then positions and
    /// orientations of the mocap bodies.
    #[serde(serialize_with = "to_bits", deserialize_with = "from_bits")]
    numbers: Vec<f64>,
    /// External torque and force on every body; empty for none.
    #[serde(serialize_with = "to_bits", deserialize_with = "from_bits")]
    pushes: Vec<f64>,
    /// The agent's own constants.
    variation: Option<Variation>,
    /// The agent's own elevations, m, by height field.
    grounds: Vec<Option<Vec<f32>>>,
    /// The agent's obstacles.
    obstacles: Vec<Obstacle>,
}

impl AgentState {
    /// Whether its sizes fit this model. Otherwise it cannot be loaded into a `Batch`.
    pub fn fits(&self, model: &Model) -> bool {
        let Model { nu, bodies, .. } = model;
        let varied =
            |v: &Variation| v.mass.len() == bodies.len() && v.strength.len() == *nu && v.out_of_range().is_none();
        let grid = |(i, elevations): (usize, &Option<Vec<f32>>)| match (elevations, model.hfields.get(i)) {
            (Some(elevations), Some(field)) => elevations.len() == field.nrow * field.ncol,
            (Some(_), None) => false,
            (None, _) => true,
        };
        self.numbers.len() == numbers(model)
            && (self.pushes.is_empty() || self.pushes.len() == 6 * bodies.len())
            && self.variation.as_ref().is_none_or(varied)
            && self.grounds.iter().enumerate().all(grid)
            && (self.obstacles.is_empty() || model.obstacles.is_some() && self.obstacles.len() <= Obstacle::MOST)
            && self.obstacles.iter().all(|o| o.out_of_range().is_none())
    }

    /// Appends the state's bytes. [`read_from`](AgentState::read_from) is the inverse.
    pub fn write_to(&self, bytes: &mut Vec<u8>) {
        let AgentState { numbers, pushes, variation, grounds, obstacles } = self;
        let own = [
            (PUSHED, !pushes.is_empty()),
            (VARIED, variation.is_some()),
            (GROUNDED, !grounds.is_empty()),
            (OBSTRUCTED, !obstacles.is_empty()),
        ];
        bytes.push(own.iter().map(|(bit, there)| bit * u8::from(*there)).sum());
        let varied =
            variation.iter().flat_map(|v| v.mass.iter().chain([&v.friction]).chain(&v.strength).chain(&v.gravity));
        for x in numbers.iter().chain(pushes).chain(varied) {
            bytes.extend(x.to_le_bytes());
        }
        for ground in grounds {
            bytes.push(u8::from(ground.is_some()));
            bytes.extend(ground.iter().flatten().flat_map(|x| x.to_le_bytes()));
        }
        if !obstacles.is_empty() {
            bytes.extend((obstacles.len() as u32).to_le_bytes());
            obstacles.iter().for_each(|obstacle| obstacle.write_to(bytes));
        }
    }

    /// Reads the state of an agent of this model from bytes of [`write_to`](AgentState::write_to). Returns it with the
    /// remaining bytes. `None` if the bytes are invalid.
    pub fn read_from<'a>(model: &Model, bytes: &'a [u8]) -> Option<(Self, &'a [u8])> {
        let Model { nu, bodies, hfields, .. } = model;
        let (own, mut bytes) = bytes.split_first()?;
        if own & !(PUSHED | VARIED | GROUNDED | OBSTRUCTED) != 0 {
            return None;
        }
        let numbers = take(&mut bytes, numbers(model), f64::from_le_bytes)?;
        let pushes = if own & PUSHED == 0 { 0 } else { 6 * bodies.len() };
        let pushes = take(&mut bytes, pushes, f64::from_le_bytes)?;
        let mut variation = None;
        if own & VARIED != 0 {
            let mut mass = take(&mut bytes, bodies.len() + 1, f64::from_le_bytes)?;
            let friction = mass.pop()?;
            let strength = take(&mut bytes, *nu, f64::from_le_bytes)?;
            let gravity = take(&mut bytes, 3, f64::from_le_bytes)?.try_into().ok()?;
            variation = Some(Variation { mass, friction, strength, gravity });
        }
        let mut grounds = Vec::new();
        for field in hfields.iter().filter(|_| own & GROUNDED != 0) {
            let (there, rest) = bytes.split_first()?;
            bytes = rest;
            grounds.push(match there {
                0 => None,
                1 => Some(take(&mut bytes, field.nrow * field.ncol, f32::from_le_bytes)?),
                _ => return None,
            });
        }
        let mut obstacles = Vec::new();
        if own & OBSTRUCTED != 0 {
            let count = take(&mut bytes, 1, u32::from_le_bytes)?[0] as usize;
            if count > Obstacle::MOST || model.obstacles.is_none() {
                return None;
            }
            obstacles = (0..count).map(|_| Obstacle::read_from(&mut bytes)).collect::<Option<_>>()?;
        }
        Some((AgentState { numbers, pushes, variation, grounds, obstacles }, bytes))
    }
}

/// Length of [`AgentState::numbers`].
fn numbers(model: &Model) -> usize {
    let Model { nq, nv, nu, na, .. } = model;
    nq + 2 * nv + nu + na + 7 * model.mocap_bodies().count()
}

/// Optional parts of a state, one bit each.
const PUSHED: u8 = 1;
const VARIED: u8 = 2;
const GROUNDED: u8 = 4;
const OBSTRUCTED: u8 = 8;

impl PartialEq for AgentState {
    /// Bitwise equality.
    fn eq(&self, other: &Self) -> bool {
        let same =
            |a: &[f64], b: &[f64]| a.len() == b.len() && a.iter().zip(b).all(|(a, b)| a.to_bits() == b.to_bits());
        same(&self.numbers, &other.numbers)
            && same(&self.pushes, &other.pushes)
            && self.variation == other.variation
            && self.grounds == other.grounds
            && self.obstacles == other.obstacles
    }
}

fn to_bits<S: Serializer>(numbers: &[f64], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_seq(numbers.iter().map(|x| x.to_bits()))
}

fn from_bits<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<f64>, D::Error> {
    Ok(Vec::<u64>::deserialize(deserializer)?.into_iter().map(f64::from_bits).collect())
}

impl<T: Real> Group<T> {
    /// Copies an agent's state out of its lane. It does not depend on other lanes.
    pub fn save(&self, sim: &Sim<T>, lane: usize) -> AgentState {
        let get = |x: &T| T::widen(x.get(lane));
        let parts = [&self.qpos, &self.qvel, &self.ctrl, &self.act, &self.qacc_warmstart];
        let (pos, quat) = (self.mocap_pos.iter().flatten(), self.mocap_quat.iter().flatten());
        let mut pushes: Vec<f64> = self.xfrc_applied.iter().flatten().map(get).collect();
        if pushes.iter().all(|x| x.to_bits() == 0) {
            pushes.clear();
        }
        let lanes = self.grounds.chunks(T::LANES);
        let mut grounds: Vec<Option<Vec<f32>>> = Vec::new();
        if lanes.clone().any(|lanes| lanes[lane].is_some()) {
            let elevation = |x: &T::Scalar| T::widen(*x) as f32;
            let of = |field: &HeightField<T::Scalar>| field.heights.iter().map(elevation).collect();
            grounds.extend(lanes.map(|lanes| lanes[lane].as_deref().map(of)));
        }
        AgentState {
            numbers: parts.into_iter().flatten().chain(pos).chain(quat).map(get).collect(),
            pushes,
            variation: self.varied.as_ref().and_then(|_| self.deviation(sim, lane)),
            grounds,
            obstacles: self.obstacles(lane),
        }
    }

    /// The constants of an agent, if they differ from the model's.
    fn deviation(&self, sim: &Sim<T>, lane: usize) -> Option<Variation> {
        let (own, none) = (self.variation(sim, lane), Variation::none(&sim.model));
        // compared in the precision of the lanes
        let all = |v: &Variation| [&v.mass[..], &[v.friction], &v.strength, &v.gravity].concat();
        let same = |(own, none): (&f64, &f64)| T::scalar(*own) == T::scalar(*none);
        (!all(&own).iter().zip(&all(&none)).all(same)).then_some(own)
    }

    /// Copies an agent's state into a lane.
    ///
    /// # Panics
    /// If the state belongs to another model.
    pub fn load(&mut self, sim: &Sim<T>, lane: usize, state: &AgentState) {
        let bodies = sim.model.bodies.len();
        assert_eq!(state.numbers.len(), numbers(&sim.model), "expected a state of the same model");
        assert!(state.pushes.is_empty() || state.pushes.len() == 6 * bodies, "expected a state of the same model");
        let parts = [&mut self.qpos, &mut self.qvel, &mut self.ctrl, &mut self.act, &mut self.qacc_warmstart];
        let (pos, quat) = (self.mocap_pos.iter_mut().flatten(), self.mocap_quat.iter_mut().flatten());
        for (x, s) in parts.into_iter().flatten().chain(pos).chain(quat).zip(&state.numbers) {
            x.set(lane, T::scalar(*s));
        }
        if self.xfrc_applied.is_empty() && !state.pushes.is_empty() {
            self.xfrc_applied = vec![[T::zero(); 6]; bodies];
        }
        // clears the pushes of an agent that was saved without any
        let pushes = state.pushes.iter().copied().chain(std::iter::repeat(0.0));
        for (x, s) in self.xfrc_applied.iter_mut().flatten().zip(pushes) {
            x.set(lane, T::scalar(s));
        }
        match &state.variation {
            Some(variation) => self.vary(sim, lane, variation),
            None if self.varied.is_some() => self.vary(sim, lane, &Variation::none(&sim.model)),
            None => {}
        }
        self.put_obstacles(lane, &state.obstacles);
        for field in 0..sim.fields.len() {
            match state.grounds.get(field) {
                Some(Some(elevations)) => self.set_ground(sim, lane, field, elevations),
                _ if !self.grounds.is_empty() => self.grounds[field * T::LANES + lane] = None,
                _ => {}
            }
        }
    }
}
