//! State of a lane group.

use super::clearance::GeomPlaces;
use super::scratch::Work;
use super::solids::Solids;
use super::weights::Weights;
use crate::algebra::spatial::{V3, V6};
use crate::geometry::height::HeightField;
use crate::lanes::Real;
use crate::model::JointType;
use crate::sim::Sim;
use std::sync::Arc;

/// Largest valid position, velocity or acceleration.
const LARGEST: f64 = 1e10;

/// State of `T::LANES` agents that share a model: everything that their future depends on.
#[derive(Clone, Debug)]
pub struct Group<T: Real> {
    /// Configuration in MuJoCo's layout, one entry per coordinate.
    pub qpos: Vec<T>,
    /// Velocity in MuJoCo's layout.
    pub qvel: Vec<T>,
    /// Controls, one per actuator; kept until changed.
    pub ctrl: Vec<T>,
    /// Activations of the actuators that have one.
    pub act: Vec<T>,
    /// Acceleration of the last step, the start of the constraint solver.
    pub qacc_warmstart: Vec<T>,
    /// Positions of the mocap bodies, m, in the order of the bodies.
    pub mocap_pos: Vec<V3<T>>,
    /// Orientations of the mocap bodies, unit quaternions.
    pub mocap_quat: Vec<[T; 4]>,
    /// External torque and force on every body, world axes, at its center of mass; empty for none. Kept until changed.
    pub xfrc_applied: Vec<V6<T>>,
    /// Constants that differ from the model's.
    pub(crate) varied: Option<Box<Varied<T>>>,
    /// Height fields that differ from the model's, by field and lane; empty for none.
    pub(crate) grounds: Vec<Option<Arc<HeightField<T::Scalar>>>>,
    /// Obstacles of agents that have some.
    pub(crate) obstacles: Option<Box<Solids<T>>>,
    /// Places of the geoms at the last evaluation of the forces, which save work and change nothing.
    pub(crate) places: GeomPlaces<T>,
}

/// An agent's own constants in place of the model's.
#[derive(Clone, Debug)]
pub(crate) struct Varied<T: Real> {
    /// Per link.
    pub mass: Vec<T>,
    pub friction: T,
    /// Per actuator.
    pub strength: Vec<T>,
    pub gravity: V3<T>,
    /// Inverse weights, if masses have deviated.
    pub weights: Option<Box<Weights<T>>>,
}

impl<T: Real> Group<T> {
    /// Creates agents in the reference configuration, at rest.
    pub fn new(sim: &Sim<T>) -> Self {
        let m = &sim.model;
        let zero = T::zero();
        let mocaps = || m.mocap_bodies().map(|b| &m.bodies[b]);
        Group {
            qpos: m.qpos0.iter().map(|x| T::lit(*x)).collect(),
            qvel: vec![zero; m.nv],
            ctrl: vec![zero; m.nu],
            act: vec![zero; m.na],
            mocap_pos: mocaps().map(|b| b.pos.map(T::lit)).collect(),
            mocap_quat: mocaps().map(|b| b.quat.map(T::lit)).collect(),
            xfrc_applied: Vec::new(),
            varied: None,
            grounds: Vec::new(),
            obstacles: None,
            places: GeomPlaces::none(),
            qacc_warmstart: vec![zero; m.nv],
        }
    }

    /// Memory of what a group of this model keeps for one agent besides its state, bytes.
    pub fn kept_bytes(sim: &Sim<T>) -> usize {
        GeomPlaces::bytes(sim)
    }

    /// Exchanges the group's places of geoms with those in scratch memory.
    pub(crate) fn swap_places(&mut self, sim: &Sim<T>, work: &mut Work<T>) {
        if sim.contacts.kept {
            if !self.places.fit(sim) {
                self.places = GeomPlaces::new(sim);
            }
            std::mem::swap(&mut self.places, &mut work.contacts.places);
        }
    }

    /// Pushes a body of one agent until changed: force, N, and torque, N m, in world axes at its center of mass.
    ///
    /// # Panics
    /// If the body does not exist.
    pub fn push(&mut self, sim: &Sim<T>, lane: usize, body: usize, force: [f64; 3], torque: [f64; 3]) {
        if self.xfrc_applied.is_empty() {
            self.xfrc_applied = vec![[T::zero(); 6]; sim.model.bodies.len()];
        }
        for i in 0..3 {
            self.xfrc_applied[body][i].set(lane, T::scalar(torque[i]));
            self.xfrc_applied[body][3 + i].set(lane, T::scalar(force[i]));
        }
    }

    /// Moves a mocap body of one agent, until changed or until a reset. The quaternion is normalized.
    ///
    /// # Panics
    /// If there is no mocap body with this number.
    pub fn set_mocap(&mut self, lane: usize, mocap: usize, pos: &[f64; 3], quat: &[f64; 4]) {
        for (x, s) in self.mocap_pos[mocap].iter_mut().zip(pos) {
            x.set(lane, T::scalar(*s));
        }
        for (x, s) in self.mocap_quat[mocap].iter_mut().zip(unit(quat)) {
            x.set(lane, T::scalar(s));
        }
    }

    /// Sets the state of one agent. Clears its controls, activations, pushes and warm start, and puts its mocap bodies where the model
    /// has them. Quaternions are normalized.
    ///
    /// # Panics
    /// If a slice's length is not the model's `nq` or `nv`.
    pub fn reset_lane(&mut self, sim: &Sim<T>, lane: usize, qpos: &[f64], qvel: &[f64]) {
        assert_eq!(qpos.len(), self.qpos.len(), "qpos has the model's length");
        assert_eq!(qvel.len(), self.qvel.len(), "qvel has the model's length");
        for (v, x) in self.qpos.iter_mut().zip(qpos) {
            v.set(lane, T::scalar(*x));
        }
        for joint in &sim.model.joints {
            let start = match joint.kind {
                JointType::Free => joint.qpos_adr + 3,
                JointType::Ball => joint.qpos_adr,
                _ => continue,
            };
            let q = [qpos[start], qpos[start + 1], qpos[start + 2], qpos[start + 3]];
            for (v, x) in self.qpos[start..].iter_mut().zip(unit(&q)) {
                v.set(lane, T::scalar(x));
            }
        }
        for (k, body) in sim.model.mocap_bodies().enumerate() {
            let body = &sim.model.bodies[body];
            self.set_mocap(lane, k, &body.pos, &body.quat);
        }
        for (v, x) in self.qvel.iter_mut().zip(qvel) {
            v.set(lane, T::scalar(*x));
        }
        for v in self
            .qacc_warmstart
            .iter_mut()
            .chain(&mut self.ctrl)
            .chain(&mut self.act)
            .chain(self.xfrc_applied.iter_mut().flatten())
        {
            v.set(lane, T::scalar(0.0));
        }
    }

    /// Lanes with a valid state: finite, with positions, velocities and accelerations below 1e10, which is also
    /// MuJoCo's bound. Far beyond that, products overflow, and even masked zeros become NaN.
    pub fn finite(&self) -> T::Mask {
        let mut sum = T::zero();
        for x in &self.act {
            // 0 x is 0, or NaN where x is not finite
            sum += *x * T::zero();
        }
        let mut sound = sum.is_finite();
        for x in self.qpos.iter().chain(&self.qvel).chain(&self.qacc_warmstart) {
            sound = T::and(sound, x.abs().lt(T::lit(LARGEST)));
        }
        sound
    }
}

/// A normalized quaternion; the identity for zero.
fn unit(q: &[f64; 4]) -> [f64; 4] {
    let n = q.iter().map(|x| x * x).sum::<f64>().sqrt();
    // squares of large numbers overflow
    let largest = q.iter().fold(0.0f64, |most, x| most.max(x.abs()));
    match n {
        f64::INFINITY if largest.is_finite() => unit(&q.map(|x| x / largest)),
        n if n > 1e-10 => q.map(|x| x / n),
        _ => [1.0, 0.0, 0.0, 0.0],
    }
}
