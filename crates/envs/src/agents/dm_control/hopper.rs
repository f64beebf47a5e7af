//! `hopper-stand-v0`, `hopper-hop-v0`: one leg, a pelvis and a nose in a plane, four motors.
//!
//! Observation: qpos without x (6), qvel (7), `ln(1 + force)` of the touch sensors at toe and heel (2).
//!
//! Reward: 1 while the torso is between 0.6 and 2 m above the foot, times a second factor. To stand, the factor is 0.8
//! to 1 for small actions. To hop, it is up to 1 for a forward velocity of the center of mass of 2 m/s.

use marathon_physics::Model;
use marathon_physics::lanes::Real;

use super::Domain;
use crate::agent::{Agent, Body, Facts, Obs, OptionInfo, OptionSet, Options, Senses, Start, Terms, Tolerance, names};

const DOMAIN: Domain = Domain {
    file: "hopper.xml",
    text: marathon_assets::text("dm_control/hopper.xml"),
    frame_skip: 4,
    info: &["height", "speed"],
};

const BODIES: [&str; 2] = ["torso", "foot"];
const TORSO: Body = Body::named(&BODIES, "torso");
const FOOT: Body = Body::named(&BODIES, "foot");
const TOUCH: [&str; 2] = ["touch_toe", "touch_heel"];

/// Heights of the torso above the foot that count as standing, m.
const STAND_HEIGHT: [f64; 2] = [0.6, 2.0];
/// Speed at which the hopping factor is 1, m/s.
const HOP_SPEED: f64 = 2.0;

crate::options! {
    /// Arguments of the hopper.
    pub struct Arguments {
        /// Model: `hopper.xml`, or the path of an MJCF file.
        xml_file: String = "hopper.xml".into(),
        /// Whether the task is to hop forward instead of standing.
        hopping: bool = false,
    }
}

/// dm_control's planar hopper.
#[derive(Clone, Debug)]
pub struct Hopper {
    id: &'static str,
    summary: &'static str,
    arguments: Arguments,
}

impl Hopper {
    /// The standing task.
    pub fn stand() -> Self {
        Self::new("hopper-stand-v0", "dm_control's hopper, to stand", false)
    }

    /// The hopping task, at 2 m/s.
    pub fn hop() -> Self {
        Self::new("hopper-hop-v0", "dm_control's hopper, to hop", true)
    }

    fn new(id: &'static str, summary: &'static str, hopping: bool) -> Self {
        Hopper { id, summary, arguments: Arguments { hopping, ..Arguments::default() } }
    }

    /// Height of the torso's center of mass above the foot's, m.
    #[inline(always)]
    fn height<T: Real>(&self, s: &Senses<T>) -> T {
        let r = s.readings();
        r.body_com(s.body(TORSO))[2] - r.body_com(s.body(FOOT))[2]
    }

    /// Velocity of the center of mass along x, m/s.
    #[inline(always)]
    fn speed<T: Real>(&self, s: &Senses<T>) -> T {
        s.readings().subtree_velocity(s.body(TORSO))[0]
    }
}

impl Agent for Hopper {
    fn facts(&self) -> Facts {
        Facts {
            bodies: names(BODIES),
            touch_sites: names(TOUCH),
            ..DOMAIN.facts(self.id, self.summary, &self.arguments.xml_file)
        }
    }

    fn options(&self) -> Vec<OptionInfo> {
        self.arguments.infos()
    }

    fn with_options(&self, options: &Options) -> Option<Self> {
        Some(Hopper { arguments: self.arguments.with(options), ..*self })
    }

    fn fits(&self, model: &Model) -> Result<(), String> {
        super::fits(model, 3)
    }

    fn reset(&self, start: &mut Start) {
        super::randomize_joints(start);
    }

    #[inline(always)]
    fn observe<T: Real>(&self, s: &Senses<T>, out: &mut Obs<T>) {
        super::observe_positions(s, out, 1);
        super::observe_velocities(s, out);
        out.group("touch");
        for i in 0..TOUCH.len() {
            out.scalar((s.touch_force(i) + T::lit(1.0)).ln());
        }
    }

    #[inline(always)]
    fn step_reward<T: Real>(&self, s: &Senses<T>, terms: &mut Terms<T>) {
        let standing = Tolerance { bounds: STAND_HEIGHT, ..Tolerance::default() }.of(self.height(s));
        let factor = if self.arguments.hopping {
            super::fast(self.speed(s), HOP_SPEED, HOP_SPEED / 2.0, 0.5)
        } else {
            super::weighted(1.0, super::small_control(s), 4.0)
        };
        super::pay(terms, standing * factor);
    }

    #[inline(always)]
    fn info<T: Real>(&self, s: &Senses<T>, out: &mut Obs<T>) {
        out.scalar(self.height(s));
        out.scalar(self.speed(s));
    }

    #[inline(always)]
    fn terminated<T: Real>(&self, s: &Senses<T>) -> T::Mask {
        s.terminate_never()
    }
}
