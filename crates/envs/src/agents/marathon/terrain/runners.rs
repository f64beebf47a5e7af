//! Properties in which the runners differ.

use marathon_physics::lanes::Real;

use super::super::ant::{self, AntV0};
use super::super::hopper::{self, FOOT, HopperV0};
use super::super::walker2d::{self, LEFT_FOOT, RIGHT_FOOT, Walker2dV0};
use super::sight::{self, Sight};
use crate::agent::{Agent, Obs, Part, ResetNoise, Senses, Start, Terms};
use crate::episode_rng::EpisodeRng;

/// Weight of the motors driven at their joint's limit: 0.8 for each.
const JOINTS_AT_LIMIT: f64 = -4.0;

/// Groups of the observation of the body that all runners share.
const BODY: [&str; 6] = ["velocity", "forward", "up", "touch", "joint_rotations", "joint_velocities"];

/// A figure that runs on uneven ground.
pub trait Runner: Agent + Clone + Default {
    /// Registry name of the task on courses.
    const ID: &'static str;
    /// One line for listings.
    const SUMMARY: &'static str;
    /// The torso.
    const TORSO: Part;
    /// The part from which the ground ahead is observed.
    const EYES: Part;
    /// The feet, in the order in which their heights are observed.
    const SOLES: &'static [Part];
    /// Weight of the effort.
    const EFFORT: f64 = 0.0;
    /// Reward of a fall that ends the episode.
    const FALL: f64 = -1.0;
    /// Terms of the reward `full`.
    const TERMS: &'static [&'static str] = &["velocity", "uprightness", "effort", "joints_at_limit"];
    /// Number of the figure's own memory slots, which come first.
    const MEMORY: usize = 0;
    /// Where a figure in space sees the ground. One in a plane sees it along its line.
    const SIGHTS: &'static [Sight] = &[];
    /// Whether the figure moves in space.
    const IN_SPACE: bool = !Self::SIGHTS.is_empty();
    /// Groups of the observation of the body.
    const BODY: &'static [&'static str];
    /// Number of motors. Those of other roles follow.
    const MOTORS: usize;
    /// A joint for the adversary's motor, which exerts no force on it.
    const JOINT: &'static str;
    /// Half the width of the courses, m. Neighboring tracks of figures in a plane must not overlap in a picture.
    const HALF_WIDTH: f64;
    /// Writes the observation of the body.
    fn observe_body<T: Real>(&self, s: &Senses<T>, out: &mut Obs<T>);

    /// Sets the start state.
    fn place(&self, start: &mut Start) {
        start.add_noise(ResetNoise::MARATHON);
    }

    /// Points the figure's own variables along the course at the start of an episode.
    #[inline(always)]
    fn aim<T: Real>(_: &mut [T]) {}

    /// Draws a command if no caller sets one. Returns its duration in decisions.
    fn tell(&self, _: &mut EpisodeRng, _: usize, _: &mut [f64]) -> usize {
        usize::MAX
    }

    /// Adds the figure's terms of the reward `full`. `whole` is 1, or 0 after a fall. `hard` holds the effort and the
    /// penalty for motors at their limits.
    #[inline(always)]
    fn add_terms<T: Real>(&self, s: &Senses<T>, whole: T, hard: [T; 2], terms: &mut Terms<T>) {
        terms.add("velocity", 1.0, s.velocity(Self::TORSO));
        terms.add("uprightness", 1.0, whole * s.forward_bonus(Self::TORSO));
        terms.add("effort", Self::EFFORT, whole * hard[0]);
        terms.add("joints_at_limit", JOINTS_AT_LIMIT, hard[1]);
    }
}

impl Runner for HopperV0 {
    const ID: &'static str = "TerrainHopper-v0";
    const SUMMARY: &'static str = "one leg in a plane: run over slopes, steps, gaps and boxes that it observes ahead";
    const TORSO: Part = hopper::TORSO;
    const EYES: Part = FOOT;
    const SOLES: &'static [Part] = &[FOOT];
    const EFFORT: f64 = -0.3;
    const BODY: &'static [&'static str] = &BODY;
    const MOTORS: usize = 4;
    const JOINT: &'static str = "rootx";
    const HALF_WIDTH: f64 = 0.4;

    #[inline(always)]
    fn observe_body<T: Real>(&self, s: &Senses<T>, out: &mut Obs<T>) {
        hopper::observe_body(s, out);
    }
}

impl Runner for Walker2dV0 {
    const ID: &'static str = "TerrainWalker2d-v0";
    const SUMMARY: &'static str = "two legs in a plane: run over slopes, steps, gaps and boxes that it observes ahead";
    const TORSO: Part = walker2d::TORSO;
    const EYES: Part = walker2d::TORSO;
    const SOLES: &'static [Part] = &[LEFT_FOOT, RIGHT_FOOT];
    const EFFORT: f64 = -0.1;
    const BODY: &'static [&'static str] = &BODY;
    const MOTORS: usize = 6;
    const JOINT: &'static str = "rootx";
    const HALF_WIDTH: f64 = 0.4;

    #[inline(always)]
    fn observe_body<T: Real>(&self, s: &Senses<T>, out: &mut Obs<T>) {
        self.observe(s, out);
    }
}

impl Runner for AntV0 {
    const ID: &'static str = "TerrainAnt-v0";
    const SUMMARY: &'static str = "four legs: run over slopes, steps, gaps and boxes that it observes ahead";
    const TORSO: Part = ant::TORSO;
    const EYES: Part = ant::TORSO;
    const SOLES: &'static [Part] = &ant::SOLES;
    const EFFORT: f64 = -0.5;
    const BODY: &'static [&'static str] = &BODY;
    const MOTORS: usize = 8;
    const JOINT: &'static str = "hip_1";
    // it may leave its line
    const HALF_WIDTH: f64 = 8.0;
    const SIGHTS: &'static [Sight] = &[sight::AHEAD];

    #[inline(always)]
    fn observe_body<T: Real>(&self, s: &Senses<T>, out: &mut Obs<T>) {
        self.observe(s, out);
    }
}
