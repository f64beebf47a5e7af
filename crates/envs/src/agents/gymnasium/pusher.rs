//! `Pusher-v5`: an arm with a fork that pushes a puck to a goal, 7 motors.
//!
//! Observation: angles and velocities of the seven joints, positions of the fork's body, the puck and the goal (23).
//!
//! Reward: - distance of the puck from the goal - 0.5 of its distance from the fork - 0.1 sum of squared actions. It
//! never terminates.

use marathon_physics::Model;
use marathon_physics::lanes::Real;

use crate::agent::{Agent, Body, Facts, Motors, Obs, OptionInfo, OptionSet, Options, Senses, Start, Terms, names};

/// Bodies that the task measures.
const BODIES: [&str; 3] = ["tips_arm", "object", "goal"];
const FORK: Body = Body::named(&BODIES, "tips_arm");
const PUCK: Body = Body::named(&BODIES, "object");
const GOAL: Body = Body::named(&BODIES, "goal");
/// Joints of the arm, the first coordinates.
const JOINTS: usize = 7;
/// Coordinates of the puck and the goal, the last ones: two each.
const SLIDES: usize = 4;
/// Half width of the noise of velocities at the start.
const NOISE: f64 = 0.005;
/// Ranges of the puck's two coordinates at the start, and its least distance from the goal, m.
const PLACES: [[f64; 2]; 2] = [[-0.3, 0.0], [-0.2, 0.2]];
const APART: f64 = 0.17;

crate::options! {
    /// Gymnasium's keyword arguments of the arm that pushes.
    pub struct Pusher {
        /// Model: `pusher_v5.xml`, or the path of an MJCF file.
        xml_file: String = "pusher_v5.xml".into(),
        /// Physics steps per decision.
        frame_skip: usize = 5,
        /// Weight of the distance between the fork and the puck.
        reward_near_weight: f64 = 0.5,
        /// Weight of the distance between the puck and the goal.
        reward_dist_weight: f64 = 1.0,
        /// Weight of the squared actions.
        reward_control_weight: f64 = 0.1,
    }
}

impl Agent for Pusher {
    fn facts(&self) -> Facts {
        let summary = "Gymnasium's arm that pushes a puck to a goal";
        Facts {
            reward_terms: names(["reward_dist", "reward_ctrl", "reward_near"]),
            bodies: names(BODIES),
            max_episode_steps: 100,
            ..super::facts("Pusher-v5", summary, &self.xml_file, self.frame_skip)
        }
    }

    fn options(&self) -> Vec<OptionInfo> {
        self.infos()
    }

    fn with_options(&self, options: &Options) -> Option<Self> {
        Some(self.with(options))
    }

    fn fits(&self, model: &Model) -> Result<(), String> {
        super::has(model, JOINTS + SLIDES, JOINTS + SLIDES)
    }

    fn reset(&self, start: &mut Start) {
        let (nq, nv) = (start.model().nq, start.model().nv);
        for v in &mut start.qvel[..nv - SLIDES] {
            *v = start.random.around_zero(NOISE);
        }
        let puck = loop {
            let at = PLACES.map(|[low, high]| start.random.uniform(low, high));
            if at[0].hypot(at[1]) > APART {
                break at;
            }
        };
        start.qpos[nq - 4..nq - 2].copy_from_slice(&puck);
        start.qpos[nq - 2..nq].fill(0.0);
        start.qvel[nv - SLIDES..nv].fill(0.0);
    }

    #[inline(always)]
    fn observe<T: Real>(&self, s: &Senses<T>, out: &mut Obs<T>) {
        let r = s.readings();
        out.group("qpos");
        for i in 0..JOINTS {
            out.scalar(r.qpos(i));
        }
        out.group("qvel");
        for i in 0..JOINTS {
            out.scalar(r.qvel(i));
        }
        for (name, body) in [("tips_arm", FORK), ("object", PUCK), ("goal", GOAL)] {
            out.group(name);
            for x in r.body_pos(s.body(body)) {
                out.scalar(x);
            }
        }
    }

    #[inline(always)]
    fn step_reward<T: Real>(&self, s: &Senses<T>, terms: &mut Terms<T>) {
        terms.add("reward_dist", -self.reward_dist_weight, super::length(super::way(s, GOAL, PUCK)));
        terms.add("reward_ctrl", -self.reward_control_weight, s.effort(Motors::NONE));
        terms.add("reward_near", -self.reward_near_weight, super::length(super::way(s, FORK, PUCK)));
    }

    #[inline(always)]
    fn terminated<T: Real>(&self, _: &Senses<T>) -> T::Mask {
        T::none()
    }
}
