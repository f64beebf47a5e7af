//! Properties in which the controlled figures differ.

use marathon_physics::lanes::Real;

use super::super::hopper::{self, FOOT, HopperV0};
use super::super::walker2d::{self, HEIGHT, LEFT_FOOT, RIGHT_FOOT, Walker2dV1};
use crate::agent::{Agent, Part, Senses};

/// A figure whose task the controller extends.
pub trait Figure: Agent + Clone + Default {
    /// Registry name of the controller.
    const ID: &'static str;
    /// One line for listings.
    const SUMMARY: &'static str;
    /// All geoms: those of the figure's own task, in its order, then the others.
    const PARTS: &'static [&'static str];
    /// The torso.
    const TORSO: Part;
    /// Number of motors.
    const MOTORS: usize;
    /// Groups of the observation in its own task.
    const OBSERVED: &'static [&'static str];
    /// Weight of the effort; 0.3 in the original.
    const EFFORT: f64;
    /// Lowest upward speed of the center of mass at the take-off of a jump, m/s. A jump lasts at least 0.1 s, and
    /// gravity takes 0.5 m/s in half of that. A figure that only pulls up its legs leaves the ground for as long, but
    /// its body falls.
    const THROWN: f64;
    /// Whether pulling up the legs is easier than jumping. While such a figure stands, only flights after a take-off
    /// count as a jump. While it runs, every flight counts.
    const DRAWS_UP: bool;
    /// Value of the present state as a jump: 0 with a foot on the ground, otherwise 1 plus the height of the lowest
    /// foot, m.
    fn leap<T: Real>(s: &Senses<T>) -> T;
    /// How far the torso is below its lowest allowed height, m.
    fn low<T: Real>(s: &Senses<T>) -> T;
}

impl Figure for HopperV0 {
    const ID: &'static str = "HopperController-v0";
    const SUMMARY: &'static str = "one leg in a plane: go left and right as commanded, jump, stand still";
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
    const SUMMARY: &'static str = "two legs in a plane: go left and right as commanded, jump, stand still";
    const PARTS: &'static [&'static str] =
        &["torso", "left_foot", "right_foot", "left_thigh", "left_leg", "right_thigh", "right_leg"];
    const TORSO: Part = walker2d::TORSO;
    const MOTORS: usize = 6;
    const OBSERVED: &'static [&'static str] =
        &["velocity", "forward", "up", "touch", "joint_rotations", "joint_velocities", "foot_heights"];
    // at 0.3, walking costs more than it earns
    const EFFORT: f64 = -0.05;
    // includes a margin
    const THROWN: f64 = 0.7;
    const DRAWS_UP: bool = false;

    #[inline(always)]
    fn leap<T: Real>(s: &Senses<T>) -> T {
        let height = s.height(LEFT_FOOT).min(s.height(RIGHT_FOOT));
        T::select(T::or(s.touch(0), s.touch(1)), T::zero(), T::lit(1.0) + height)
    }

    // the original allows crouching, and the Walker then runs until its thighs touch the ground
    #[inline(always)]
    fn low<T: Real>(s: &Senses<T>) -> T {
        s.height_penalty(walker2d::TORSO, HEIGHT)
    }
}
