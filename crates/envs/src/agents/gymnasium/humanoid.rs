//! `Humanoid-v5`: two legs, a waist and two arms in space, 17 motors.
//!
//! Observation: qpos without x and y (22), qvel (23); for the 13 bodies `cinert` (130) and `cvel` (78); motor torques
//! on the joints (17); contact forces on the bodies (78).
//!
//! Reward: 1.25 velocity of the center of mass + 5 while healthy - 0.1 sum of squared actions - 5e-7 sum of squared
//! contact forces (at most 10). Healthy: height between 1 and 2 m.

use marathon_physics::Model;
use marathon_physics::lanes::Real;

use super::{Noise, Travel};
use crate::agent::senses::clamp;
use crate::agent::{
    Agent, Facts, Motors, Obs, OptionInfo, OptionSet, Options, Scale, Senses, Start, Terms, View, names,
};

/// Velocities of the root, on which no motor acts.
const ROOT: usize = 6;

crate::options! {
    /// Gymnasium's keyword arguments of the humanoid.
    pub struct Humanoid {
        /// Model: `humanoid.xml`, or the path of an MJCF file.
        xml_file: String = "humanoid.xml".into(),
        /// Physics steps per decision.
        frame_skip: usize = 5,
        /// Weight of the forward velocity.
        forward_reward_weight: f64 = 1.25,
        /// Weight of the squared actions.
        ctrl_cost_weight: f64 = 0.1,
        /// Weight of the squared contact forces.
        contact_cost_weight: f64 = 5e-7,
        /// Range to which the cost of contact forces is clipped.
        contact_cost_range: [f64; 2] = [f64::NEG_INFINITY, 10.0],
        /// Reward per decision while healthy.
        healthy_reward: f64 = 5.0,
        /// Whether the episode ends when it is no longer healthy.
        terminate_when_unhealthy: bool = true,
        /// Healthy range of the torso's height, m.
        healthy_z_range: [f64; 2] = [1.0, 2.0],
        /// Half width of the uniform noise at the start.
        reset_noise_scale: Scale = Scale(1e-2),
        /// Whether the observation excludes x and y.
        exclude_current_positions_from_observation: bool = true,
        /// Whether the observation includes inertias of the bodies.
        include_cinert_in_observation: bool = true,
        /// Whether the observation includes velocities of the bodies.
        include_cvel_in_observation: bool = true,
        /// Whether the observation includes motor torques.
        include_qfrc_actuator_in_observation: bool = true,
        /// Whether the observation includes contact forces.
        include_cfrc_ext_in_observation: bool = true,
    }
}

/// Optional parts of a humanoid's observation.
pub(super) struct HumanoidObs {
    pub position: bool,
    pub cinert: bool,
    pub cvel: bool,
    pub qfrc_actuator: bool,
    pub cfrc_ext: bool,
}

impl HumanoidObs {
    /// Quantities that the physics has to compute.
    pub fn view() -> View {
        View { of_last_step: true, bodies: true, actuators: true, ..View::default() }
    }

    /// Writes the observation.
    #[inline(always)]
    pub fn observe<T: Real>(&self, s: &Senses<T>, out: &mut Obs<T>) {
        let r = s.readings();
        let (bodies, nv) = (r.sim.model().bodies.len(), r.sim.model().nv);
        super::observe_positions(s, out, if self.position { 0 } else { 2 });
        super::observe_velocities(s, out);
        if self.cinert {
            out.group("cinert");
            for body in 1..bodies {
                for x in r.cinert(body) {
                    out.scalar(x);
                }
            }
        }
        if self.cvel {
            out.group("cvel");
            for body in 1..bodies {
                for x in r.cvel(body) {
                    out.scalar(x);
                }
            }
        }
        if self.qfrc_actuator {
            out.group("qfrc_actuator");
            for dof in ROOT..nv {
                out.scalar(r.qfrc_actuator(dof));
            }
        }
        if self.cfrc_ext {
            out.group("cfrc_ext");
            for body in 1..bodies {
                for x in s.contact_wrench(body) {
                    out.scalar(x);
                }
            }
        }
    }

    /// Sum of the squared contact forces and torques on all bodies.
    #[inline(always)]
    pub fn contact_squares<T: Real>(s: &Senses<T>) -> T {
        let mut sum = T::zero();
        for body in 1..s.readings().sim.model().bodies.len() {
            for x in s.contact_wrench(body) {
                sum = x.mul_add(x, sum);
            }
        }
        sum
    }
}

impl Humanoid {
    #[inline(always)]
    fn healthy<T: Real>(&self, s: &Senses<T>) -> T::Mask {
        super::within(s.readings().qpos(2), self.healthy_z_range)
    }

    #[inline(always)]
    fn parts(&self) -> HumanoidObs {
        HumanoidObs {
            position: !self.exclude_current_positions_from_observation,
            cinert: self.include_cinert_in_observation,
            cvel: self.include_cvel_in_observation,
            qfrc_actuator: self.include_qfrc_actuator_in_observation,
            cfrc_ext: self.include_cfrc_ext_in_observation,
        }
    }
}

/// Center of mass of the model.
#[inline(always)]
fn center<T: Real>(s: &Senses<T>) -> [T; 2] {
    let [x, y, _] = s.readings().center_of_mass();
    [x, y]
}

impl Agent for Humanoid {
    fn facts(&self) -> Facts {
        Facts {
            reward_terms: names(["reward_survive", "reward_forward", "reward_ctrl", "reward_contact"]),
            info: names(["x_position", "y_position", "distance_from_origin", "x_velocity", "y_velocity"]),
            memory: Travel::SLOTS,
            view: HumanoidObs::view(),
            ..super::facts("Humanoid-v5", "Gymnasium's humanoid", &self.xml_file, self.frame_skip)
        }
    }

    fn options(&self) -> Vec<OptionInfo> {
        self.infos()
    }

    fn with_options(&self, options: &Options) -> Option<Self> {
        Some(self.with(options))
    }

    fn fits(&self, model: &Model) -> Result<(), String> {
        super::has(model, 7, ROOT)
    }

    fn reset(&self, start: &mut Start) {
        super::start(start, self.reset_noise_scale.0, Noise::Uniform);
    }

    #[inline(always)]
    fn begin<T: Real>(&self, s: &Senses<T>, memory: &mut [T]) {
        Travel::begin(memory, center(s));
    }

    #[inline(always)]
    fn remember<T: Real>(&self, s: &Senses<T>, memory: &mut [T]) {
        Travel::update(memory, center(s), s.dt());
    }

    #[inline(always)]
    fn observe<T: Real>(&self, s: &Senses<T>, out: &mut Obs<T>) {
        self.parts().observe(s, out);
    }

    #[inline(always)]
    fn step_reward<T: Real>(&self, s: &Senses<T>, terms: &mut Terms<T>) {
        let contact = T::lit(self.contact_cost_weight) * HumanoidObs::contact_squares(s);
        let [low, high] = self.contact_cost_range;
        terms.add("reward_survive", self.healthy_reward, T::masked(self.healthy(s), T::lit(1.0)));
        terms.add("reward_forward", self.forward_reward_weight, s.memory(Travel::X_VELOCITY));
        terms.add("reward_ctrl", -self.ctrl_cost_weight, s.effort(Motors::NONE));
        terms.add("reward_contact", -1.0, clamp(contact, low, high));
    }

    #[inline(always)]
    fn info<T: Real>(&self, s: &Senses<T>, out: &mut Obs<T>) {
        let at = [s.readings().qpos(0), s.readings().qpos(1)];
        out.scalar(at[0]);
        out.scalar(at[1]);
        out.scalar(super::distance(at));
        out.scalar(s.memory(Travel::X_VELOCITY));
        out.scalar(s.memory(Travel::Y_VELOCITY));
    }

    #[inline(always)]
    fn terminated<T: Real>(&self, s: &Senses<T>) -> T::Mask {
        if self.terminate_when_unhealthy { T::not(self.healthy(s)) } else { T::none() }
    }
}
