//! `cheetah-run-v0`: a spine with two legs in a plane, six motors.
//!
//! Observation: qpos without x (8), qvel (9). Reward: forward velocity of the center of mass over 10 m/s, at most 1.

use marathon_physics::Model;
use marathon_physics::lanes::Real;

use super::Domain;
use crate::agent::{Agent, Body, Facts, Obs, OptionInfo, OptionSet, Options, Senses, Start, Terms, names};

const DOMAIN: Domain = Domain {
    file: "cheetah.xml",
    text: marathon_assets::text("dm_control/cheetah.xml"),
    frame_skip: 1,
    info: &["speed"],
};

const BODIES: [&str; 1] = ["torso"];
const TORSO: Body = Body::named(&BODIES, "torso");

/// Speed at which the reward is 1, m/s.
const RUN_SPEED: f64 = 10.0;
/// Physics steps for which every start settles.
const SETTLE: usize = 200;
/// The root's slide along z: coordinate and velocity.
const Z: usize = 1;

crate::options! {
    /// Arguments of the cheetah.
    pub struct Arguments {
        /// Model: `cheetah.xml`, or the path of an MJCF file.
        xml_file: String = "cheetah.xml".into(),
    }
}

/// dm_control's cheetah.
#[derive(Clone, Debug)]
pub struct Cheetah {
    arguments: Arguments,
}

impl Cheetah {
    /// The running task.
    pub fn run() -> Self {
        Cheetah { arguments: Arguments::default() }
    }

    /// Velocity of the center of mass along x, m/s.
    #[inline(always)]
    fn speed<T: Real>(&self, s: &Senses<T>) -> T {
        s.readings().subtree_velocity(s.body(TORSO))[0]
    }
}

impl Agent for Cheetah {
    fn facts(&self) -> Facts {
        Facts {
            bodies: names(BODIES),
            ..DOMAIN.facts("cheetah-run-v0", "dm_control's cheetah, to run", &self.arguments.xml_file)
        }
    }

    fn options(&self) -> Vec<OptionInfo> {
        self.arguments.infos()
    }

    fn with_options(&self, options: &Options) -> Option<Self> {
        Some(Cheetah { arguments: self.arguments.with(options) })
    }

    fn fits(&self, model: &Model) -> Result<(), String> {
        super::fits(model, 3)
    }

    /// Limited joints at random angles within their ranges, then 200 physics steps. As in dm_control, the first of them
    /// computes its forces from the reference configuration: a free fall.
    fn reset(&self, start: &mut Start) {
        let limited: Vec<_> =
            start.model().joints.iter().filter(|j| j.limited).map(|j| (j.qpos_adr, j.range)).collect();
        for (at, [low, high]) in limited {
            start.qpos[at] = start.random.uniform(low, high);
        }
        let opt = &start.model().opt;
        let (dt, fall) = (opt.timestep, opt.timestep * opt.gravity[2]);
        start.qvel[Z] += fall;
        start.qpos[Z] += dt * start.qvel[Z];
        start.settle = SETTLE - 1;
    }

    #[inline(always)]
    fn observe<T: Real>(&self, s: &Senses<T>, out: &mut Obs<T>) {
        super::observe_positions(s, out, 1);
        super::observe_velocities(s, out);
    }

    #[inline(always)]
    fn step_reward<T: Real>(&self, s: &Senses<T>, terms: &mut Terms<T>) {
        super::pay(terms, super::fast(self.speed(s), RUN_SPEED, RUN_SPEED, 0.0));
    }

    #[inline(always)]
    fn info<T: Real>(&self, s: &Senses<T>, out: &mut Obs<T>) {
        out.scalar(self.speed(s));
    }

    #[inline(always)]
    fn terminated<T: Real>(&self, s: &Senses<T>) -> T::Mask {
        s.terminate_never()
    }
}
