//! `InvertedDoublePendulum-v5`: two stacked poles on a cart on a rail, one motor.
//!
//! Observation: position of the cart, sines and cosines of the two angles, three velocities clipped to 10, and the
//! force of the rail's end on the cart, clipped to 10 (9).
//!
//! Reward: 10 while the tip is above 1 m - 0.01 x^2 - (z - 2 m)^2 of the tip - 0.001 w1^2 - 0.005 w2^2. The episode is
//! terminated when the tip is lower.

use marathon_physics::Model;
use marathon_physics::lanes::Real;

use super::Noise;
use crate::agent::senses::clamp;
use crate::agent::{Agent, Facts, Obs, OptionInfo, OptionSet, Options, Scale, Senses, Start, Terms, View, names};

/// Site at the end of the second pole, the model's first site.
const TIP: usize = 0;
/// Height of the tip at which the poles count as fallen, m.
const FALLEN: f64 = 1.0;
/// Height of the tip without a penalty, m.
const UPRIGHT: f64 = 2.0;

crate::options! {
    /// Gymnasium's keyword arguments of the cart with two poles.
    pub struct InvertedDoublePendulum {
        /// Model: `inverted_double_pendulum.xml`, or the path of an MJCF file.
        xml_file: String = "inverted_double_pendulum.xml".into(),
        /// Physics steps per decision.
        frame_skip: usize = 5,
        /// Reward per decision until the poles fall.
        healthy_reward: f64 = 10.0,
        /// Noise of the start: half width (uniform) for coordinates, standard deviation (normal) for velocities.
        reset_noise_scale: Scale = Scale(0.1),
    }
}

impl Agent for InvertedDoublePendulum {
    fn facts(&self) -> Facts {
        let id = "InvertedDoublePendulum-v5";
        Facts {
            reward_terms: names(["reward_survive", "distance_penalty", "velocity_penalty"]),
            view: View { of_last_step: true, joints: true, ..View::default() },
            ..super::facts(id, "Gymnasium's cart and two poles", &self.xml_file, self.frame_skip)
        }
    }

    fn options(&self) -> Vec<OptionInfo> {
        self.infos()
    }

    fn with_options(&self, options: &Options) -> Option<Self> {
        Some(self.with(options))
    }

    fn fits(&self, model: &Model) -> Result<(), String> {
        if model.sites.is_empty() {
            return Err("its model has no site, expected one at the tip of the second pole".into());
        }
        super::has(model, 1, 3)
    }

    fn reset(&self, start: &mut Start) {
        super::start(start, self.reset_noise_scale.0, Noise::Normal);
    }

    #[inline(always)]
    fn observe<T: Real>(&self, s: &Senses<T>, out: &mut Obs<T>) {
        let r = s.readings();
        out.group("cart_position");
        out.scalar(r.qpos(0));
        out.group("sin");
        for i in 1..r.sim.model().nq {
            out.scalar(r.qpos(i).sin_cos().0);
        }
        out.group("cos");
        for i in 1..r.sim.model().nq {
            out.scalar(r.qpos(i).sin_cos().1);
        }
        super::observe_clipped_velocities(s, out);
        out.group("qfrc_constraint");
        out.scalar(clamp(r.qfrc_constraint(0), -10.0, 10.0));
    }

    #[inline(always)]
    fn step_reward<T: Real>(&self, s: &Senses<T>, terms: &mut Terms<T>) {
        let [x, _, z] = s.readings().site_pos(TIP);
        let below = z - T::lit(UPRIGHT);
        let (w1, w2) = (s.readings().qvel(1), s.readings().qvel(2));
        let alive = T::masked(T::not(self.terminated(s)), T::lit(1.0));
        terms.add("reward_survive", self.healthy_reward, alive);
        terms.add("distance_penalty", -1.0, (x * T::lit(0.01)).mul_add(x, below * below));
        terms.add("velocity_penalty", -1.0, (w1 * T::lit(1e-3)).mul_add(w1, w2 * w2 * T::lit(5e-3)));
    }

    #[inline(always)]
    fn terminated<T: Real>(&self, s: &Senses<T>) -> T::Mask {
        T::not(T::lit(FALLEN).lt(s.readings().site_pos(TIP)[2]))
    }
}
