//! `Hopper-v5`: one leg in a plane, three motors.
//!
//! Observation: qpos without x (5), qvel clipped to 10 (6). Reward: velocity of the root + 1 while healthy - 0.001 sum of
//! squared actions. Healthy: height above 0.7 m, torso within 0.2 rad, everything else within 100.

use marathon_physics::Model;
use marathon_physics::lanes::Real;

use super::{Noise, Travel};
use crate::agent::{Agent, Facts, Motors, Obs, OptionInfo, OptionSet, Options, Scale, Senses, Start, Terms, names};

crate::options! {
    /// Gymnasium's keyword arguments of the hopper.
    pub struct Hopper {
        /// Model: `hopper.xml`, or the path of an MJCF file.
        xml_file: String = "hopper.xml".into(),
        /// Physics steps per decision.
        frame_skip: usize = 4,
        /// Weight of the forward velocity.
        forward_reward_weight: f64 = 1.0,
        /// Weight of the squared actions.
        ctrl_cost_weight: f64 = 1e-3,
        /// Reward per decision while healthy.
        healthy_reward: f64 = 1.0,
        /// Whether the episode ends when it is no longer healthy.
        terminate_when_unhealthy: bool = true,
        /// Healthy range of all coordinates but x and z, and of all velocities.
        healthy_state_range: [f64; 2] = [-100.0, 100.0],
        /// Healthy range of the torso's height, m.
        healthy_z_range: [f64; 2] = [0.7, f64::INFINITY],
        /// Healthy range of the torso's angle, rad.
        healthy_angle_range: [f64; 2] = [-0.2, 0.2],
        /// Half width of the uniform noise at the start.
        reset_noise_scale: Scale = Scale(5e-3),
        /// Whether the observation excludes x.
        exclude_current_positions_from_observation: bool = true,
    }
}

impl Hopper {
    #[inline(always)]
    fn healthy<T: Real>(&self, s: &Senses<T>) -> T::Mask {
        let (r, model) = (s.readings(), s.readings().sim.model());
        let mut healthy =
            T::and(super::within(r.qpos(1), self.healthy_z_range), super::within(r.qpos(2), self.healthy_angle_range));
        for i in 2..model.nq {
            healthy = T::and(healthy, super::within(r.qpos(i), self.healthy_state_range));
        }
        for i in 0..model.nv {
            healthy = T::and(healthy, super::within(r.qvel(i), self.healthy_state_range));
        }
        healthy
    }
}

impl Agent for Hopper {
    fn facts(&self) -> Facts {
        Facts {
            reward_terms: names(["reward_forward", "reward_ctrl", "reward_survive"]),
            info: names(["x_position", "z_distance_from_origin", "x_velocity"]),
            memory: Travel::SLOTS,
            ..super::facts("Hopper-v5", "Gymnasium's hopper", &self.xml_file, self.frame_skip)
        }
    }

    fn options(&self) -> Vec<OptionInfo> {
        self.infos()
    }

    fn with_options(&self, options: &Options) -> Option<Self> {
        Some(self.with(options))
    }

    fn fits(&self, model: &Model) -> Result<(), String> {
        super::has(model, 3, 1)
    }

    fn reset(&self, start: &mut Start) {
        super::start(start, self.reset_noise_scale.0, Noise::Uniform);
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
        super::observe_clipped_velocities(s, out);
    }

    #[inline(always)]
    fn step_reward<T: Real>(&self, s: &Senses<T>, terms: &mut Terms<T>) {
        terms.add("reward_forward", self.forward_reward_weight, s.memory(Travel::X_VELOCITY));
        terms.add("reward_ctrl", -self.ctrl_cost_weight, s.effort(Motors::NONE));
        terms.add("reward_survive", self.healthy_reward, T::masked(self.healthy(s), T::lit(1.0)));
    }

    #[inline(always)]
    fn info<T: Real>(&self, s: &Senses<T>, out: &mut Obs<T>) {
        out.scalar(s.readings().qpos(0));
        out.scalar(super::from_origin(s, 1));
        out.scalar(s.memory(Travel::X_VELOCITY));
    }

    #[inline(always)]
    fn terminated<T: Real>(&self, s: &Senses<T>) -> T::Mask {
        if self.terminate_when_unhealthy { T::not(self.healthy(s)) } else { T::none() }
    }
}
