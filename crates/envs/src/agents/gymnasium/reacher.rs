//! `Reacher-v5`: an arm of two links that reaches for a target in the plane, 2 motors.
//!
//! Observation (10): cosines and sines of the two angles, position of the target, velocities of the angles, way from
//! the target to the fingertip along x and y.
//!
//! Reward: - distance of the fingertip from the target - sum of squared actions. It never terminates.

use marathon_physics::Model;
use marathon_physics::lanes::Real;

use crate::agent::{Agent, Body, Facts, Motors, Obs, OptionInfo, OptionSet, Options, Senses, Start, Terms, names};

/// Bodies that the task measures.
const BODIES: [&str; 2] = ["fingertip", "target"];
const FINGERTIP: Body = Body::named(&BODIES, "fingertip");
const TARGET: Body = Body::named(&BODIES, "target");
/// Angles of the arm, the first coordinates.
const ANGLES: usize = 2;
/// Half width of the noise of coordinates and of velocities at the start.
const NOISE: [f64; 2] = [0.1, 0.005];
/// Radius of the disk in which targets are, m.
const RADIUS: f64 = 0.2;

crate::options! {
    /// Gymnasium's keyword arguments of the arm that reaches.
    pub struct Reacher {
        /// Model: `reacher.xml`, or the path of an MJCF file.
        xml_file: String = "reacher.xml".into(),
        /// Physics steps per decision.
        frame_skip: usize = 2,
        /// Weight of the distance.
        reward_dist_weight: f64 = 1.0,
        /// Weight of the squared actions.
        reward_control_weight: f64 = 1.0,
    }
}

impl Agent for Reacher {
    fn facts(&self) -> Facts {
        Facts {
            reward_terms: names(["reward_dist", "reward_ctrl"]),
            bodies: names(BODIES),
            max_episode_steps: 50,
            ..super::facts("Reacher-v5", "Gymnasium's arm that reaches for a target", &self.xml_file, self.frame_skip)
        }
    }

    fn options(&self) -> Vec<OptionInfo> {
        self.infos()
    }

    fn with_options(&self, options: &Options) -> Option<Self> {
        Some(self.with(options))
    }

    fn fits(&self, model: &Model) -> Result<(), String> {
        super::has(model, ANGLES + 2, ANGLES + 2)
    }

    fn reset(&self, start: &mut Start) {
        let (nq, nv) = (start.model().nq, start.model().nv);
        for q in &mut start.qpos[..nq] {
            *q += start.random.around_zero(NOISE[0]);
        }
        for v in &mut start.qvel[..nv] {
            *v = start.random.around_zero(NOISE[1]);
        }
        let target = loop {
            let at = [(); 2].map(|()| start.random.around_zero(RADIUS));
            if at[0].hypot(at[1]) < RADIUS {
                break at;
            }
        };
        start.qpos[nq - 2..nq].copy_from_slice(&target);
        start.qvel[nv - 2..nv].fill(0.0);
    }

    #[inline(always)]
    fn observe<T: Real>(&self, s: &Senses<T>, out: &mut Obs<T>) {
        let r = s.readings();
        out.group("cos");
        for i in 0..ANGLES {
            out.scalar(r.qpos(i).sin_cos().1);
        }
        out.group("sin");
        for i in 0..ANGLES {
            out.scalar(r.qpos(i).sin_cos().0);
        }
        out.group("target");
        for i in ANGLES..r.sim.model().nq {
            out.scalar(r.qpos(i));
        }
        out.group("qvel");
        for i in 0..ANGLES {
            out.scalar(r.qvel(i));
        }
        out.group("from_target");
        let [x, y, _] = super::way(s, TARGET, FINGERTIP);
        out.scalar(x);
        out.scalar(y);
    }

    #[inline(always)]
    fn step_reward<T: Real>(&self, s: &Senses<T>, terms: &mut Terms<T>) {
        terms.add("reward_dist", -self.reward_dist_weight, super::length(super::way(s, TARGET, FINGERTIP)));
        terms.add("reward_ctrl", -self.reward_control_weight, s.effort(Motors::NONE));
    }

    #[inline(always)]
    fn terminated<T: Real>(&self, _: &Senses<T>) -> T::Mask {
        T::none()
    }
}
