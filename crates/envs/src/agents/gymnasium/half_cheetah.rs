//! `HalfCheetah-v5`: a spine with two legs in a plane, six motors.
//!
//! Observation: qpos without x (8), qvel (9). Reward: velocity of the root - 0.1 sum of squared actions. It never
//! terminates.

use marathon_physics::Model;
use marathon_physics::lanes::Real;

use super::{Noise, Travel};
use crate::agent::{Agent, Facts, Motors, Obs, OptionInfo, OptionSet, Options, Scale, Senses, Start, Terms, names};

crate::options! {
    /// Gymnasium's keyword arguments of the cheetah.
    pub struct HalfCheetah {
        /// Model: `half_cheetah.xml`, or the path of an MJCF file.
        xml_file: String = "half_cheetah.xml".into(),
        /// Physics steps per decision.
        frame_skip: usize = 5,
        /// Weight of the forward velocity.
        forward_reward_weight: f64 = 1.0,
        /// Weight of the squared actions.
        ctrl_cost_weight: f64 = 0.1,
        /// Noise of the start: half width (uniform) for coordinates, standard deviation (normal) for velocities.
        reset_noise_scale: Scale = Scale(0.1),
        /// Whether the observation excludes x.
        exclude_current_positions_from_observation: bool = true,
    }
}

impl Agent for HalfCheetah {
    fn facts(&self) -> Facts {
        Facts {
            reward_terms: names(["reward_forward", "reward_ctrl"]),
            info: names(["x_position", "x_velocity"]),
            memory: Travel::SLOTS,
            ..super::facts("HalfCheetah-v5", "Gymnasium's cheetah", &self.xml_file, self.frame_skip)
        }
    }

    fn options(&self) -> Vec<OptionInfo> {
        self.infos()
    }

    fn with_options(&self, options: &Options) -> Option<Self> {
        Some(self.with(options))
    }

    fn fits(&self, model: &Model) -> Result<(), String> {
        super::has(model, 1, 1)
    }

    fn reset(&self, start: &mut Start) {
        super::start(start, self.reset_noise_scale.0, Noise::Normal);
    }

    #[inline(always)]
    fn begin<T: Real>(&self, s: &Senses<T>, memory: &mut [T]) {
        Travel::begin(memory, [s.readings().qpos(0), T::zero()]);
    }

    #[inline(always)]
    fn remember<T: Real>(&self, s: &Senses<T>, memory: &mut [T]) {
        Travel::update(memory, [s.readings().qpos(0), T::zero()], s.dt());
    }

    #[inline(always)]
    fn observe<T: Real>(&self, s: &Senses<T>, out: &mut Obs<T>) {
        super::observe_positions(s, out, usize::from(self.exclude_current_positions_from_observation));
        super::observe_velocities(s, out);
    }

    #[inline(always)]
    fn step_reward<T: Real>(&self, s: &Senses<T>, terms: &mut Terms<T>) {
        terms.add("reward_forward", self.forward_reward_weight, s.memory(Travel::X_VELOCITY));
        terms.add("reward_ctrl", -self.ctrl_cost_weight, s.effort(Motors::NONE));
    }

    #[inline(always)]
    fn info<T: Real>(&self, s: &Senses<T>, out: &mut Obs<T>) {
        out.scalar(s.readings().qpos(0));
        out.scalar(s.memory(Travel::X_VELOCITY));
    }

    #[inline(always)]
    fn terminated<T: Real>(&self, s: &Senses<T>) -> T::Mask {
        s.terminate_never()
    }
}
