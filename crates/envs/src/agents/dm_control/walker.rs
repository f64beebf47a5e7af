//! `walker-stand-v0`, `walker-walk-v0`, `walker-run-v0`: two legs in a plane, six motors.
//!
//! Observation: for the seven bodies, x of the axes x and z (14); height of the torso (1); qvel (9; z before x).
//!
//! Reward: up to 1 for standing, three quarters of it for the torso's height and one for its uprightness. It is
//! multiplied by up to 1 for the forward velocity of the center of mass, and by a sixth at rest.

use marathon_physics::Model;
use marathon_physics::lanes::Real;

use super::Domain;
use crate::agent::{Agent, Body, Facts, Obs, OptionInfo, OptionSet, Options, Senses, Start, Terms, Tolerance, names};

const DOMAIN: Domain = Domain {
    file: "walker.xml",
    text: marathon_assets::text("dm_control/walker.xml"),
    frame_skip: 10,
    info: &["height", "upright", "speed"],
};

const BODIES: [&str; 1] = ["torso"];
const TORSO: Body = Body::named(&BODIES, "torso");

/// Height of the torso that counts as standing, m.
const STAND_HEIGHT: f64 = 1.2;

crate::options! {
    /// Arguments of the walker.
    pub struct Arguments {
        /// Model: `walker.xml`, or the path of an MJCF file.
        xml_file: String = "walker.xml".into(),
        /// Speed at which the reward is full, m/s. 0 rewards standing only.
        move_speed: f64 = 0.0,
    }
}

/// dm_control's planar walker.
#[derive(Clone, Debug)]
pub struct Walker {
    id: &'static str,
    summary: &'static str,
    arguments: Arguments,
}

impl Walker {
    /// The standing task.
    pub fn stand() -> Self {
        Self::new("walker-stand-v0", "dm_control's walker, to stand", 0.0)
    }

    /// The walking task, at 1 m/s.
    pub fn walk() -> Self {
        Self::new("walker-walk-v0", "dm_control's walker, to walk", 1.0)
    }

    /// The running task, at 8 m/s.
    pub fn run() -> Self {
        Self::new("walker-run-v0", "dm_control's walker, to run", 8.0)
    }

    fn new(id: &'static str, summary: &'static str, move_speed: f64) -> Self {
        Walker { id, summary, arguments: Arguments { move_speed, ..Arguments::default() } }
    }

    /// Height of the torso, m.
    #[inline(always)]
    fn height<T: Real>(&self, s: &Senses<T>) -> T {
        s.readings().body_pos(s.body(TORSO))[2]
    }

    /// Cosine of the angle between the torso and the vertical.
    #[inline(always)]
    fn upright<T: Real>(&self, s: &Senses<T>) -> T {
        s.readings().body_axes(s.body(TORSO))[2][2]
    }

    /// Velocity of the center of mass along x, m/s.
    #[inline(always)]
    fn speed<T: Real>(&self, s: &Senses<T>) -> T {
        s.readings().subtree_velocity(s.body(TORSO))[0]
    }
}

impl Agent for Walker {
    fn facts(&self) -> Facts {
        Facts { bodies: names(BODIES), ..DOMAIN.facts(self.id, self.summary, &self.arguments.xml_file) }
    }

    fn options(&self) -> Vec<OptionInfo> {
        self.arguments.infos()
    }

    fn with_options(&self, options: &Options) -> Option<Self> {
        Some(Walker { arguments: self.arguments.with(options), ..*self })
    }

    fn fits(&self, model: &Model) -> Result<(), String> {
        super::goal(self.arguments.move_speed)?;
        super::fits(model, 3)
    }

    fn reset(&self, start: &mut Start) {
        super::randomize_joints(start);
    }

    #[inline(always)]
    fn observe<T: Real>(&self, s: &Senses<T>, out: &mut Obs<T>) {
        let r = s.readings();
        out.group("orientations");
        for body in 1..r.sim.model().bodies.len() {
            let axes = r.body_axes(body);
            out.scalar(axes[0][0]);
            out.scalar(axes[2][0]);
        }
        out.group("height");
        out.scalar(self.height(s));
        super::observe_velocities(s, out);
    }

    #[inline(always)]
    fn step_reward<T: Real>(&self, s: &Senses<T>, terms: &mut Terms<T>) {
        let goal = self.arguments.move_speed;
        let standing = Tolerance::at_least(STAND_HEIGHT, STAND_HEIGHT / 2.0).of(self.height(s));
        let upright = super::weighted(1.0, self.upright(s), 1.0);
        let mut reward = standing.mul_add(T::lit(0.75), upright * T::lit(0.25));
        if goal > 0.0 {
            reward *= super::weighted(5.0, super::fast(self.speed(s), goal, goal / 2.0, 0.5), 1.0);
        }
        super::pay(terms, reward);
    }

    #[inline(always)]
    fn info<T: Real>(&self, s: &Senses<T>, out: &mut Obs<T>) {
        out.scalar(self.height(s));
        out.scalar(self.upright(s));
        out.scalar(self.speed(s));
    }

    #[inline(always)]
    fn terminated<T: Real>(&self, s: &Senses<T>) -> T::Mask {
        s.terminate_never()
    }
}
