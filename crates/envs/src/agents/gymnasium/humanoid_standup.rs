//! `HumanoidStandup-v5`: the humanoid on its back, 17 motors.
//!
//! Observation: that of `Humanoid-v5`. Reward: height of the torso over the physics' timestep + 1 - 0.1 sum of squared
//! actions - 5e-7 sum of squared contact forces (at most 10). It never terminates.

use marathon_physics::Model;
use marathon_physics::lanes::Real;

use super::Noise;
use super::humanoid::HumanoidObs;
use crate::agent::senses::clamp;
use crate::agent::{Agent, Facts, Motors, Obs, OptionInfo, OptionSet, Options, Scale, Senses, Start, Terms, names};

crate::options! {
    /// Gymnasium's keyword arguments of the humanoid that stands up.
    pub struct HumanoidStandup {
        /// Model: `humanoidstandup.xml`, or the path of an MJCF file.
        xml_file: String = "humanoidstandup.xml".into(),
        /// Physics steps per decision.
        frame_skip: usize = 5,
        /// Accepted but unused, as in Gymnasium 1.4: the weight of the height is 1.
        uph_cost_weight: f64 = 1.0,
        /// Weight of the squared actions.
        ctrl_cost_weight: f64 = 0.1,
        /// Weight of the squared contact forces.
        impact_cost_weight: f64 = 0.5e-6,
        /// Range to which the cost of contact forces is clipped.
        impact_cost_range: [f64; 2] = [f64::NEG_INFINITY, 10.0],
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

impl Agent for HumanoidStandup {
    fn facts(&self) -> Facts {
        let id = "HumanoidStandup-v5";
        Facts {
            // the last term is part of Gymnasium's reward but not of its info
            reward_terms: names(["reward_linup", "reward_quadctrl", "reward_impact", "reward_alive"]),
            info: names(["x_position", "y_position", "z_distance_from_origin"]),
            metrics: names(["z_distance_from_origin"]),
            view: HumanoidObs::view(),
            ..super::facts(id, "Gymnasium's humanoid that is to stand up", &self.xml_file, self.frame_skip)
        }
    }

    fn options(&self) -> Vec<OptionInfo> {
        self.infos()
    }

    fn with_options(&self, options: &Options) -> Option<Self> {
        Some(self.with(options))
    }

    fn fits(&self, model: &Model) -> Result<(), String> {
        super::has(model, 7, 6)
    }

    fn reset(&self, start: &mut Start) {
        super::start(start, self.reset_noise_scale.0, Noise::Uniform);
    }

    #[inline(always)]
    fn observe<T: Real>(&self, s: &Senses<T>, out: &mut Obs<T>) {
        let parts = HumanoidObs {
            position: !self.exclude_current_positions_from_observation,
            cinert: self.include_cinert_in_observation,
            cvel: self.include_cvel_in_observation,
            qfrc_actuator: self.include_qfrc_actuator_in_observation,
            cfrc_ext: self.include_cfrc_ext_in_observation,
        };
        parts.observe(s, out);
    }

    #[inline(always)]
    fn step_reward<T: Real>(&self, s: &Senses<T>, terms: &mut Terms<T>) {
        let impact = T::lit(self.impact_cost_weight) * HumanoidObs::contact_squares(s);
        let [low, high] = self.impact_cost_range;
        let timestep = T::lit(s.readings().sim.model().opt.timestep);
        terms.add("reward_linup", 1.0, s.readings().qpos(2).div(timestep));
        terms.add("reward_quadctrl", -self.ctrl_cost_weight, s.effort(Motors::NONE));
        terms.add("reward_impact", -1.0, clamp(impact, low, high));
        terms.add("reward_alive", 1.0, T::lit(1.0));
    }

    #[inline(always)]
    fn info<T: Real>(&self, s: &Senses<T>, out: &mut Obs<T>) {
        out.scalar(s.readings().qpos(0));
        out.scalar(s.readings().qpos(1));
        out.scalar(super::from_origin(s, 2));
    }

    #[inline(always)]
    fn terminated<T: Real>(&self, s: &Senses<T>) -> T::Mask {
        s.terminate_never()
    }
}
