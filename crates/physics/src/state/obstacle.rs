//! An obstacle of an agent: a sphere, capsule or box that it touches and cannot move.
//!
//! Obstacles come from outside the physics, such as the walls, platforms and other characters of a game.

use crate::model::{Quat, Vec3};
use serde::{Deserialize, Serialize};

/// Shape of an [`Obstacle`], sizes in m.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum ObstacleShape {
    /// A ball.
    Sphere {
        /// Its radius.
        radius: f64,
    },
    /// The points within `radius` of a segment along the z axis.
    Capsule {
        /// Its radius.
        radius: f64,
        /// Half the length of the segment.
        half_length: f64,
    },
    /// A box.
    Box {
        /// Half its extent along each axis.
        half_size: Vec3,
    },
}

/// A solid that an agent touches and cannot move, in world axes.
///
/// The model must have a geom for them, see [`ModelSpec::add_obstacles`](crate::spec::ModelSpec::add_obstacles).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Obstacle {
    /// Shape.
    pub shape: ObstacleShape,
    /// Position of its center, m.
    pub pos: Vec3,
    /// Orientation, `[w, x, y, z]`.
    pub quat: Quat,
    /// Velocity of its center, m/s. It moves by it at every step.
    pub velocity: Vec3,
    /// Angular velocity, rad/s. It turns by it at every step.
    pub angular_velocity: Vec3,
}

impl Obstacle {
    /// Most obstacles that an agent can have.
    pub const MOST: usize = 256;

    /// At rest, with the axes of the world.
    pub fn new(shape: ObstacleShape, pos: Vec3) -> Self {
        Obstacle { shape, pos, quat: [1.0, 0.0, 0.0, 0.0], velocity: [0.0; 3], angular_velocity: [0.0; 3] }
    }

    /// The first number that is out of its range: its name, its value and the valid values.
    pub fn out_of_range(&self) -> Option<(&'static str, f64, &'static str)> {
        let valid = |x: &f64| x.is_finite() && *x > 0.0;
        let (sizes, round) = match self.shape {
            ObstacleShape::Sphere { radius } => ([radius, 1.0, 1.0], true),
            ObstacleShape::Capsule { radius, half_length } => ([radius, half_length, 1.0], true),
            ObstacleShape::Box { half_size } => (half_size, false),
        };
        if let Some(x) = sizes.into_iter().find(|x| !valid(x)) {
            return Some((if round { "radius or half length" } else { "half size" }, x, "a length above 0"));
        }
        let first = |numbers: &[f64]| numbers.iter().copied().find(|x| !x.is_finite());
        let norm = self.quat.iter().map(|x| x * x).sum::<f64>();
        let turn =
            || (!(norm > 1e-10 && norm.is_finite())).then_some(("quat", norm.sqrt(), "a quaternion that is not 0"));
        first(&self.pos)
            .map(|x| ("pos", x, "finite numbers"))
            .or_else(|| first(&self.velocity).map(|x| ("velocity", x, "finite numbers")))
            .or_else(|| first(&self.angular_velocity).map(|x| ("angular velocity", x, "finite numbers")))
            .or_else(turn)
    }

    /// All numbers, after one for the kind of the shape.
    pub(super) fn numbers(&self) -> [f64; 17] {
        let (kind, size) = match self.shape {
            ObstacleShape::Sphere { radius } => (0.0, [radius, 0.0, 0.0]),
            ObstacleShape::Capsule { radius, half_length } => (1.0, [radius, half_length, 0.0]),
            ObstacleShape::Box { half_size } => (2.0, half_size),
        };
        let mut out = [kind; 17];
        let parts = [&size[..], &self.pos, &self.quat, &self.velocity, &self.angular_velocity];
        for (x, y) in out[1..].iter_mut().zip(parts.into_iter().flatten()) {
            *x = *y;
        }
        out
    }

    /// The obstacle of such numbers, if they are valid.
    pub(super) fn of_numbers(x: &[f64; 17]) -> Option<Self> {
        let v3 = |at: usize| [x[at], x[at + 1], x[at + 2]];
        let shape = match x[0] {
            0.0 => ObstacleShape::Sphere { radius: x[1] },
            1.0 => ObstacleShape::Capsule { radius: x[1], half_length: x[2] },
            2.0 => ObstacleShape::Box { half_size: v3(1) },
            _ => return None,
        };
        let quat = [x[7], x[8], x[9], x[10]];
        let out = Obstacle { shape, pos: v3(4), quat, velocity: v3(11), angular_velocity: v3(14) };
        out.out_of_range().is_none().then_some(out)
    }
}
