//! What the controllers of the figures differ in.

use marathon_physics::lanes::Real;

use super::super::hopper::{self, FOOT, HopperV0};
use super::super::walker2d::{self, HEIGHT, LEFT_FOOT, RIGHT_FOOT, Walker2dV1};
use crate::agent::{Agent, Part, Senses};

/// A figure whose task the controller is made of.
pub trait Figure: Agent + Clone + Default {
    /// Registry name of the controller.
    const ID: &'static str;
    /// One line for listings.
    const SUMMARY: &'static str;
    /// All geoms: those of the figure's own task, in its order, then the others.
    const PARTS: &'static [&'static str];
    /// The torso.
    const TORSO: Part;
    /// How many motors it has.
    const MOTORS: usize;
    /// What it observes in its own task, by name.
    const OBSERVED: &'static [&'static str];
    /// Price of the effort; the original takes 0.3.
    const EFFORT: f64;
    /// Speed at which the center of mass rises when a jump leaves the ground, m/s, at least. Gravity takes 0.5 m/s away in half of
    /// the tenth of a second that makes a jump: a figure that draws up its legs is off the ground for as long, too, but falls.
    const THROWN: f64;
    /// Whether it is easier to draw up the legs than to jump. Nothing is paid for that while it stands, then; on the run, steps are
    /// flights.
    const DRAWS_UP: bool;
    /// What a jump is worth now: nothing while a foot is on the ground, or else 1 and the height of the lowest foot, m.
    fn leap<T: Real>(s: &Senses<T>) -> T;
    /// How far the torso is lower than it may be, m.
    fn low<T: Real>(s: &Senses<T>) -> T;
}

impl Figure for HopperV0 {
    const ID: &'static str = "HopperController-v0";
    const SUMMARY: &'static str = "one leg in a plane: go left and right as told, jump, stand still";
    const PARTS: &'static [&'static str] = &["torso", "foot", "nose", "pelvis", "thigh", "calf"];
    const TORSO: Part = hopper::TORSO;
    const MOTORS: usize = 4;
    const OBSERVED: &'static [&'static str] =
        &["velocity", "forward", "up", "touch", "joint_rotations", "joint_velocities", "foot_height"];
    const EFFORT: f64 = -0.1;
    const THROWN: f64 = 0.5;
    const DRAWS_UP: bool = true;

    #[inline(always)]
    fn leap<T: Real>(s: &Senses<T>) -> T {
        T::select(s.touch(0), T::zero(), T::lit(1.0) + s.height(FOOT))
    }

    #[inline(always)]
    fn low<T: Real>(_: &Senses<T>) -> T {
        T::zero()
    }
}

impl Figure for Walker2dV1 {
    const ID: &'static str = "WalkerController-v0";
    const SUMMARY: &'static str = "two legs in a plane: go left and right as told, jump, stand still";
    const PARTS: &'static [&'static str] =
        &["torso", "left_foot", "right_foot", "left_thigh", "left_leg", "right_thigh", "right_leg"];
    const TORSO: Part = walker2d::TORSO;
    const MOTORS: usize = 6;
    const OBSERVED: &'static [&'static str] =
        &["velocity", "forward", "up", "touch", "joint_rotations", "joint_velocities", "foot_heights"];
    // at 0.3, walking costs more than it earns
    const EFFORT: f64 = -0.05;
    // with something to spare
    const THROWN: f64 = 0.7;
    const DRAWS_UP: bool = false;

    #[inline(always)]
    fn leap<T: Real>(s: &Senses<T>) -> T {
        let height = s.height(LEFT_FOOT).min(s.height(RIGHT_FOOT));
        T::select(T::or(s.touch(0), s.touch(1)), T::zero(), T::lit(1.0) + height)
    }

    // the original lets it crouch, and it runs until its thighs touch the ground
    #[inline(always)]
    fn low<T: Real>(s: &Senses<T>) -> T {
        s.height_penalty(walker2d::TORSO, HEIGHT)
    }
}
