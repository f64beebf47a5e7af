//! `Ant-v5`: four legs, eight motors.
//!
//! Observation: qpos without x and y (13), qvel (14), torque and force of the contacts on each of the 13 bodies,
//! clipped to 1 (78).
//!
//! Reward: velocity of the torso + 1 while healthy - 0.5 sum of squared actions - 0.0005 sum of squared clipped contact
//! forces. Healthy: height between 0.2 and 1 m.

use marathon_physics::Model;
use marathon_physics::lanes::Real;

use super::{Noise, Travel};
use crate::agent::senses::clamp;
use crate::agent::{
    Agent, Body, Facts, Motors, Obs, OptionInfo, OptionSet, OptionValue, Options, Scale, Senses, Start, Terms, Value,
    View, names,
};

/// A body by number, as in MuJoCo, or by name.
#[derive(Clone, Debug, PartialEq)]
pub enum MainBody {
    /// Number; 0 is the world.
    Number(usize),
    /// Name.
    Name(String),
}

impl OptionValue for MainBody {
    const EXPECTED: &'static str = "a body by number or name";
    fn value(&self) -> Value {
        match self {
            MainBody::Number(i) => i.value(),
            MainBody::Name(name) => name.value(),
        }
    }
    fn read(value: &Value) -> Option<Self> {
        usize::read(value).map(MainBody::Number).or_else(|| String::read(value).map(MainBody::Name))
    }
}

crate::options! {
    /// Gymnasium's keyword arguments of the ant.
    pub struct Ant {
        /// Model: `ant.xml`, or the path of an MJCF file.
        xml_file: String = "ant.xml".into(),
        /// Physics steps per decision.
        frame_skip: usize = 5,
        /// Weight of the forward velocity.
        forward_reward_weight: f64 = 1.0,
        /// Weight of the squared actions.
        ctrl_cost_weight: f64 = 0.5,
        /// Weight of the squared contact forces.
        contact_cost_weight: f64 = 5e-4,
        /// Reward per decision while healthy.
        healthy_reward: f64 = 1.0,
        /// Body whose velocity counts, by number or name.
        main_body: MainBody = MainBody::Number(1),
        /// Whether the episode ends when it is no longer healthy.
        terminate_when_unhealthy: bool = true,
        /// Range of the healthy torso height, m, inclusive.
        healthy_z_range: [f64; 2] = [0.2, 1.0],
        /// Range to which contact forces are clipped, N and N m.
        contact_force_range: [f64; 2] = [-1.0, 1.0],
        /// Noise of the start: half width (uniform) for coordinates, standard deviation (normal) for velocities.
        reset_noise_scale: Scale = Scale(0.1),
        /// Whether the observation excludes x and y.
        exclude_current_positions_from_observation: bool = true,
        /// Whether the observation includes contact forces.
        include_cfrc_ext_in_observation: bool = true,
    }
}

impl Ant {
    #[inline(always)]
    fn healthy<T: Real>(&self, s: &Senses<T>) -> T::Mask {
        let (z, [low, high]) = (s.readings().qpos(2), self.healthy_z_range);
        T::not(T::or(z.lt(T::lit(low)), T::lit(high).lt(z)))
    }

    /// Position of the main body.
    #[inline(always)]
    fn place<T: Real>(&self, s: &Senses<T>) -> [T; 2] {
        let body = match &self.main_body {
            MainBody::Number(i) => *i,
            MainBody::Name(_) => s.body(Body(0)),
        };
        let [x, y, _] = s.readings().body_pos(body);
        [x, y]
    }

    #[inline(always)]
    fn clipped_wrench<T: Real>(&self, s: &Senses<T>, body: usize) -> [T; 6] {
        let ([low, high], mut w) = (self.contact_force_range, s.contact_wrench(body));
        for x in &mut w {
            *x = clamp(*x, low, high);
        }
        w
    }
}

impl Agent for Ant {
    fn facts(&self) -> Facts {
        let bodies = match &self.main_body {
            MainBody::Number(_) => Vec::new(),
            MainBody::Name(name) => vec![name.clone()],
        };
        Facts {
            reward_terms: names(["reward_forward", "reward_ctrl", "reward_contact", "reward_survive"]),
            info: names(["x_position", "y_position", "distance_from_origin", "x_velocity", "y_velocity"]),
            bodies,
            memory: Travel::SLOTS,
            view: View { of_last_step: true, bodies: true, ..View::default() },
            ..super::facts("Ant-v5", "Gymnasium's ant", &self.xml_file, self.frame_skip)
        }
    }

    fn options(&self) -> Vec<OptionInfo> {
        self.infos()
    }

    fn with_options(&self, options: &Options) -> Option<Self> {
        Some(self.with(options))
    }

    fn fits(&self, model: &Model) -> Result<(), String> {
        if let MainBody::Number(i) = self.main_body
            && i >= model.bodies.len()
        {
            return Err(format!(
                "main_body is {i}, but its model has {} bodies, the world included",
                model.bodies.len()
            ));
        }
        super::has(model, 3, 1)
    }

    fn reset(&self, start: &mut Start) {
        super::start(start, self.reset_noise_scale.0, Noise::Normal);
    }

    #[inline(always)]
    fn begin<T: Real>(&self, s: &Senses<T>, memory: &mut [T]) {
        Travel::begin(memory, self.place(s));
    }

    #[inline(always)]
    fn remember<T: Real>(&self, s: &Senses<T>, memory: &mut [T]) {
        Travel::update(memory, self.place(s), s.dt());
    }

    #[inline(always)]
    fn observe<T: Real>(&self, s: &Senses<T>, out: &mut Obs<T>) {
        super::observe_positions(s, out, 2 * usize::from(self.exclude_current_positions_from_observation));
        super::observe_velocities(s, out);
        if self.include_cfrc_ext_in_observation {
            out.group("cfrc_ext");
            for body in 1..s.readings().sim.model().bodies.len() {
                for x in self.clipped_wrench(s, body) {
                    out.scalar(x);
                }
            }
        }
    }

    #[inline(always)]
    fn step_reward<T: Real>(&self, s: &Senses<T>, terms: &mut Terms<T>) {
        let mut contact = T::zero();
        for body in 0..s.readings().sim.model().bodies.len() {
            for x in self.clipped_wrench(s, body) {
                contact = x.mul_add(x, contact);
            }
        }
        terms.add("reward_forward", self.forward_reward_weight, s.memory(Travel::X_VELOCITY));
        terms.add("reward_ctrl", -self.ctrl_cost_weight, s.effort(Motors::NONE));
        terms.add("reward_contact", -self.contact_cost_weight, contact);
        terms.add("reward_survive", self.healthy_reward, T::masked(self.healthy(s), T::lit(1.0)));
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
