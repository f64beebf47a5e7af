//! Marathon Man on assault courses: the [steered task](super::steer) on uneven ground that the character observes. Each
//! agent has its own ground.

use marathon_physics::lanes::Real;

use super::super::terrain::sight::{self, Sight};
use super::super::terrain::{Runner, Terrain};
use super::body::{ACTIONS, BUTT, FEET, JOINTS};
use super::steer::{DIRECTION, HOLDS, MAX_SPEED, OBSERVED, START_ROW, Steer, TERMS};
use crate::agent::{Agent, Obs, Part, Senses, Start, Terms};
use crate::episode_rng::EpisodeRng;

/// Lowest commanded speed, m/s.
const SLOWEST: f64 = 1.0;

/// The steered Marathon Man on courses.
pub type TerrainMarathonMan = Terrain<Steer>;

/// Drawn commands are straight ahead, at a speed that changes every 1 to 6 s. Other callers may command any direction.
impl Runner for Steer {
    const ID: &'static str = "TerrainMarathonMan-v0";
    const SUMMARY: &'static str =
        "a figure of 21 motors: run as commanded over slopes, steps, gaps and boxes that it observes ahead";
    const TORSO: Part = BUTT;
    const EYES: Part = BUTT;
    const SOLES: &'static [Part] = &FEET;
    const FALL: f64 = -20.0;
    const TERMS: &'static [&'static str] = &TERMS;
    const MEMORY: usize = START_ROW + 1;
    const SIGHTS: &'static [Sight] = &[sight::AHEAD, sight::CLOSE];
    const BODY: &'static [&'static str] = &OBSERVED;
    const MOTORS: usize = ACTIONS.len();
    const JOINT: &'static str = JOINTS[0].name;
    const HALF_WIDTH: f64 = 8.0;

    #[inline(always)]
    fn observe_body<T: Real>(&self, s: &Senses<T>, out: &mut Obs<T>) {
        self.guide.observe_along(s, out);
    }

    // start from the clips as in the steered task, but at the beginning of the course, facing along it
    fn place(&self, start: &mut Start) {
        self.reset(start);
        let [w, x, y, z] = [3, 4, 5, 6].map(|i| start.qpos[i]);
        let yaw = libm::atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z));
        let (sin, cos) = libm::sincos(-0.5 * yaw);
        start.qpos[..2].fill(0.0);
        // rotation about z, times the current orientation
        start.qpos[3..7].copy_from_slice(&[cos * w - sin * z, cos * x - sin * y, cos * y + sin * x, cos * z + sin * w]);
        let ((sin, cos), [vx, vy]) = (libm::sincos(-yaw), [start.qvel[0], start.qvel[1]]);
        start.qvel[..2].copy_from_slice(&[cos * vx - sin * vy, sin * vx + cos * vy]);
    }

    #[inline(always)]
    fn aim<T: Real>(own: &mut [T]) {
        own[DIRECTION..DIRECTION + 2].copy_from_slice(&[T::lit(1.0), T::zero()]);
    }

    fn tell(&self, random: &mut EpisodeRng, _: usize, out: &mut [f64]) -> usize {
        out.copy_from_slice(&[random.uniform(SLOWEST, MAX_SPEED), 0.0]);
        random.whole(HOLDS[0], HOLDS[1])
    }

    #[inline(always)]
    fn add_terms<T: Real>(&self, s: &Senses<T>, whole: T, _: [T; 2], terms: &mut Terms<T>) {
        self.guide.add_terms(s, [T::lit(0.5).lt(whole); 3], Steer::told(s), terms);
    }
}
