//! The own constants of an agent: masses, friction, strength, gravity, ground.
//!
//! All agents share a model's constants. For domain randomization each may deviate from them. Masses change the softness of constraints,
//! too, as in MuJoCo when `mj_setConst` follows an edit of `mjModel`.

use super::group::{Group, Varied};
use super::weights::Weights;
use crate::algebra::spatial::V3;
use crate::geometry::height::HeightField;
use crate::lanes::{MAX_LANES, Real};
use crate::mjcf::reweigh::Reweigher;
use crate::model::{Model, Vec3};
use crate::sim::Sim;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// One agent's deviations from the model.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Variation {
    /// Factor of every body's mass and inertia, one per body. Bodies without joints use the factor of the body that they
    /// are welded to, and keep their masses if no joint moves that one.
    pub mass: Vec<f64>,
    /// Factor of all friction coefficients of contacts.
    pub friction: f64,
    /// Factor of every actuator's force, one per actuator.
    pub strength: Vec<f64>,
    /// Gravity, m/s^2.
    pub gravity: Vec3,
}

impl Variation {
    /// No deviation.
    pub fn none(model: &Model) -> Self {
        Variation {
            mass: vec![1.0; model.bodies.len()],
            friction: 1.0,
            strength: vec![1.0; model.nu],
            gravity: if model.opt.flags.gravity { model.opt.gravity } else { [0.0; 3] },
        }
    }

    /// The first constant that is out of its range: its name, its value and the valid values.
    pub fn out_of_range(&self) -> Option<(&'static str, f64, &'static str)> {
        let Variation { mass, friction, strength, gravity } = self;
        let first = |numbers: &[f64], valid: fn(f64) -> bool| numbers.iter().copied().find(|x| !valid(*x));
        // single precision has to hold them
        const fn is_finite(x: f64) -> bool {
            (x as f32).is_finite()
        }
        let mass = first(mass, |x| (1e-30..=1e30).contains(&x)).map(|x| ("mass", x, "a factor from 1e-30 to 1e30"));
        let friction = || first(&[*friction], |x| is_finite(x) && x >= 0.0);
        let strength = || first(strength, is_finite).map(|x| ("strength", x, "a finite factor"));
        let gravity = || first(gravity, is_finite).map(|x| ("gravity", x, "finite numbers"));
        mass.or_else(|| friction().map(|x| ("friction", x, "a factor of 0 or more"))).or_else(strength).or_else(gravity)
    }
}

impl<T: Real> Group<T> {
    /// Sets an agent's own constants, until changed. They survive a reset.
    ///
    /// # Panics
    /// If the number of masses or strengths is not the model's number of bodies or actuators.
    pub fn vary(&mut self, sim: &Sim<T>, lane: usize, variation: &Variation) {
        let model = &sim.model;
        assert_eq!(variation.mass.len(), model.bodies.len(), "one mass factor per body");
        assert_eq!(variation.strength.len(), model.nu, "one strength per actuator");
        let varied = self.varied.get_or_insert_with(|| {
            let one = T::lit(1.0);
            Box::new(Varied {
                mass: vec![one; sim.links.len()],
                friction: one,
                strength: vec![one; model.nu],
                gravity: sim.gravity.map(T::splat),
                weights: None,
            })
        });
        for (body, b) in model.bodies.iter().enumerate() {
            if b.weld_id == body
                && let Some(link) = sim.bodies[body].link
            {
                varied.mass[link].set(lane, T::scalar(variation.mass[body]));
            }
        }
        varied.friction.set(lane, T::scalar(variation.friction));
        for (s, x) in varied.strength.iter_mut().zip(&variation.strength) {
            s.set(lane, T::scalar(*x));
        }
        for (g, x) in varied.gravity.iter_mut().zip(variation.gravity) {
            g.set(lane, T::scalar(x));
        }
        self.reweigh(sim, lane, &variation.mass);
    }

    /// Finds an agent's inverse weights from the factors of its bodies' masses. They stay those of the model where its mass matrix has
    /// no inverse.
    fn reweigh(&mut self, sim: &Sim<T>, lane: usize, masses: &[f64]) {
        let model = &sim.model;
        // of moving bodies and rounded like their masses, so that a state that was saved has the same
        let factor =
            |weld: usize| if model.bodies[weld].dof_count > 0 { T::widen(T::scalar(masses[weld])) } else { 1.0 };
        let factors: Vec<f64> = model.bodies.iter().map(|b| factor(b.weld_id)).collect();
        let deviates = factors.iter().any(|factor| *factor != 1.0);
        let Some(varied) = &mut self.varied else { return };
        if !deviates && varied.weights.is_none() {
            return;
        }
        let reweigher = || sim.reweigher.get_or_init(|| Arc::new(Reweigher::new(model)));
        let own = if deviates { reweigher().with_masses(&factors) } else { None };
        let weights = varied.weights.get_or_insert_with(|| Box::new(Weights::new(sim)));
        weights.set(lane, model, own.as_ref().unwrap_or(model));
    }

    /// The inverse weights of agents whose masses deviate.
    #[inline(always)]
    pub(crate) fn weights(&self) -> Option<&Weights<T>> {
        self.varied.as_ref()?.weights.as_deref()
    }

    /// The constants of an agent.
    pub fn variation(&self, sim: &Sim<T>, lane: usize) -> Variation {
        let mut out = Variation::none(&sim.model);
        let Some(varied) = &self.varied else { return out };
        let get = |x: &T| T::widen(x.get(lane));
        for (body, factor) in out.mass.iter_mut().enumerate() {
            if let Some(link) = sim.bodies[body].link {
                *factor = get(&varied.mass[link]);
            }
        }
        out.friction = get(&varied.friction);
        out.strength = varied.strength.iter().map(get).collect();
        out.gravity = [get(&varied.gravity[0]), get(&varied.gravity[1]), get(&varied.gravity[2])];
        out
    }

    /// Gravity of every agent.
    #[inline(always)]
    pub(crate) fn gravity(&self, sim: &Sim<T>) -> V3<T> {
        match &self.varied {
            Some(v) => v.gravity,
            None => [T::splat(sim.gravity[0]), T::splat(sim.gravity[1]), T::splat(sim.gravity[2])],
        }
    }

    /// Factor of the friction coefficients.
    #[inline(always)]
    pub(crate) fn friction(&self) -> Option<T> {
        self.varied.as_ref().map(|v| v.friction)
    }

    /// Sets an agent's own ground: the elevations (m, from the height field's zero) of height field `field`, row by row
    /// as in the model. It stays until changed.
    ///
    /// # Panics
    /// If there is no such field, or the number of elevations is not that of its grid.
    pub fn set_ground(&mut self, sim: &Sim<T>, lane: usize, field: usize, elevations: &[f32]) {
        let own = sim.fields[field].with_elevations(elevations);
        if self.grounds.is_empty() {
            self.grounds = vec![None; sim.fields.len() * T::LANES];
        }
        self.grounds[field * T::LANES + lane] = Some(Arc::new(own));
    }

    /// Elevations of a height field for an agent, as [`Group::set_ground`] takes them.
    ///
    /// # Panics
    /// If there is no such field.
    pub fn elevations(&self, sim: &Sim<T>, lane: usize, field: usize) -> Vec<f32> {
        self.ground(sim, lane, field).heights.iter().map(|z| T::widen(*z) as f32).collect()
    }

    /// Highest elevation of a height field for every agent.
    #[inline(always)]
    pub(crate) fn ground_top(&self, sim: &Sim<T>, field: usize) -> T {
        let mut top = T::splat(sim.fields[field].top);
        if !self.grounds.is_empty() {
            for lane in 0..T::LANES {
                top.set(lane, self.ground(sim, lane, field).top);
            }
        }
        top
    }

    /// Height field `field` of every agent.
    #[inline(always)]
    pub(crate) fn all_grounds<'a>(&'a self, sim: &'a Sim<T>, field: usize) -> [&'a HeightField<T::Scalar>; MAX_LANES] {
        let mut fields = [&sim.fields[field]; MAX_LANES];
        if !self.grounds.is_empty() {
            for (lane, own) in fields[..T::LANES].iter_mut().enumerate() {
                *own = self.ground(sim, lane, field);
            }
        }
        fields
    }

    /// Height field `field` of an agent.
    #[inline(always)]
    pub(crate) fn ground<'a>(&'a self, sim: &'a Sim<T>, lane: usize, field: usize) -> &'a HeightField<T::Scalar> {
        match self.grounds.get(field * T::LANES + lane) {
            Some(Some(own)) => own,
            _ => &sim.fields[field],
        }
    }
}
