//! `Swimmer-v5`: three links in a horizontal plane of viscous liquid, two motors.
//!
//! Observation: qpos without x and y (3), qvel (5). Reward: velocity of the front link along x - 0.0001 sum of squared
//! actions. It never terminates.

use marathon_physics::Model;
use marathon_physics::lanes::Real;

use super::{Noise, Travel};
use crate::agent::{Agent, Facts, Motors, Obs, OptionInfo, OptionSet, Options, Scale, Senses, Start, Terms, names};

crate::options! {
    /// Gymnasium's keyword arguments of the swimmer.
    pub struct Swimmer {
        /// Model: `swimmer.xml`, or the path of an MJCF file.
        xml_file: String = "swimmer.xml".into(),
        /// Physics steps per decision.
        frame_skip: usize = 4,
        /// Weight of the forward velocity.
        forward_reward_weight: f64 = 1.0,
        /// Weight of the squared actions.
        ctrl_cost_weight: f64 = 1e-4,
        /// Half width of the uniform noise at the start.
        reset_noise_scale: Scale = Scale(0.1),
        /// Whether the observation excludes x and y.
        exclude_current_positions_from_observation: bool = true,
    }
}

impl Agent for Swimmer {
    fn facts(&self) -> Facts {
        Facts {
            reward_terms: names(["reward_forward", "reward_ctrl"]),
            info: names(["x_position", "y_position", "distance_from_origin", "x_velocity", "y_velocity"]),
            memory: Travel::SLOTS,
            ..super::facts("Swimmer-v5", "Gymnasium's swimmer", &self.xml_file, self.frame_skip)
        }
    }

    fn options(&self) -> Vec<OptionInfo> {
        self.infos()
    }

    fn with_options(&self, options: &Options) -> Option<Self> {
        Some(self.with(options))
    }

    fn fits(&self, model: &Model) -> Result<(), String> {
        super::has(model, 2, 1)
    }

    fn reset(&self, start: &mut Start) {
        super::start(start, self.reset_noise_scale.0, Noise::Uniform);
    }

    #[inline(always)]
    fn begin<T: Real>(&self, s: &Senses<T>, memory: &mut [T]) {
        Travel::begin(memory, [s.readings().qpos(0), s.readings().qpos(1)]);
    }

    #[inline(always)]
    fn remember<T: Real>(&self, s: &Senses<T>, memory: &mut [T]) {
        Travel::update(memory, [s.readings().qpos(0), s.readings().qpos(1)], s.dt());
    }

    #[inline(always)]
    fn observe<T: Real>(&self, s: &Senses<T>, out: &mut Obs<T>) {
        super::observe_positions(s, out, 2 * usize::from(self.exclude_current_positions_from_observation));
        super::observe_velocities(s, out);
    }

    #[inline(always)]
    fn step_reward<T: Real>(&self, s: &Senses<T>, terms: &mut Terms<T>) {
        terms.add("reward_forward", self.forward_reward_weight, s.memory(Travel::X_VELOCITY));
        terms.add("reward_ctrl", -self.ctrl_cost_weight, s.effort(Motors::NONE));
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
        s.terminate_never()
    }
}
