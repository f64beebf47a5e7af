//! `InvertedPendulum-v5`: a pole on a cart on a rail, one motor.
//!
//! Observation: qpos (2), qvel (2). Reward: 1 per decision. The episode is terminated when the pole leans by more than
//! 0.2 rad.

use marathon_physics::Model;
use marathon_physics::lanes::Real;

use super::Noise;
use crate::agent::{Agent, Facts, Obs, OptionInfo, OptionSet, Options, Scale, Senses, Start, Terms, names};

/// Lean at which the pole counts as fallen, rad.
const FALLEN: f64 = 0.2;

crate::options! {
    /// Gymnasium's keyword arguments of the cart and pole.
    pub struct InvertedPendulum {
        /// Model: `inverted_pendulum.xml`, or the path of an MJCF file.
        xml_file: String = "inverted_pendulum.xml".into(),
        /// Physics steps per decision.
        frame_skip: usize = 2,
        /// Half width of the uniform noise at the start.
        reset_noise_scale: Scale = Scale(0.01),
    }
}

impl Agent for InvertedPendulum {
    fn facts(&self) -> Facts {
        Facts {
            reward_terms: names(["reward_survive"]),
            ..super::facts("InvertedPendulum-v5", "Gymnasium's cart and pole", &self.xml_file, self.frame_skip)
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
    fn observe<T: Real>(&self, s: &Senses<T>, out: &mut Obs<T>) {
        super::observe_positions(s, out, 0);
        super::observe_velocities(s, out);
    }

    #[inline(always)]
    fn step_reward<T: Real>(&self, s: &Senses<T>, terms: &mut Terms<T>) {
        terms.add("reward_survive", 1.0, T::masked(T::not(self.terminated(s)), T::lit(1.0)));
    }

    #[inline(always)]
    fn terminated<T: Real>(&self, s: &Senses<T>) -> T::Mask {
        T::lit(FALLEN).lt(s.readings().qpos(1).abs())
    }
}
