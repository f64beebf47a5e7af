//! An obstacle of an agent: a sphere, capsule, box or height field that it touches and cannot move.
//!
//! Obstacles come from outside the physics, such as the walls, platforms, terrain and other characters of a game.

use crate::model::{HField, Quat, Vec3};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Shape of an [`Obstacle`], sizes in m.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
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
    /// A height field. Its elevations are finite and above the base; they need not be between 0 and 1. Saved states leave out its
    /// name.
    HField(#[serde(with = "shared")] Arc<HField>),
}

/// Reads and writes what an `Arc` points to.
mod shared {
    use super::HField;
    use serde::{Deserialize, Deserializer, Serialize, Serializer};
    use std::sync::Arc;

    pub fn serialize<S: Serializer>(field: &HField, serializer: S) -> Result<S::Ok, S::Error> {
        field.serialize(serializer)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Arc<HField>, D::Error> {
        HField::deserialize(deserializer).map(Arc::new)
    }
}

/// A solid that an agent touches and cannot move, in world axes.
///
/// The model must have a geom for them, see [`ModelSpec::add_obstacles`](crate::spec::ModelSpec::add_obstacles).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
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
        let positive = |name, sizes: &[f64]| {
            let wrong = sizes.iter().copied().find(|x| !(x.is_finite() && *x > 0.0));
            wrong.map(|x| (name, x, "a length above 0"))
        };
        let wrong = match &self.shape {
            ObstacleShape::Sphere { radius } => positive("radius", &[*radius]),
            ObstacleShape::Capsule { radius, half_length } => {
                positive("radius or half length", &[*radius, *half_length])
            }
            ObstacleShape::Box { half_size } => positive("half size", half_size),
            ObstacleShape::HField(field) => out_of_field(field).or_else(|| positive("size of its field", &field.size)),
        };
        if wrong.is_some() {
            return wrong;
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

    /// Appends its bytes. [`read_from`](Obstacle::read_from) is the inverse.
    pub(super) fn write_to(&self, bytes: &mut Vec<u8>) {
        let (kind, size) = match &self.shape {
            ObstacleShape::Sphere { radius } => (0.0, [*radius, 0.0, 0.0, 0.0]),
            ObstacleShape::Capsule { radius, half_length } => (1.0, [*radius, *half_length, 0.0, 0.0]),
            ObstacleShape::Box { half_size: [x, y, z] } => (2.0, [*x, *y, *z, 0.0]),
            ObstacleShape::HField(field) => (3.0, field.size),
        };
        let parts = [&[kind][..], &size, &self.pos, &self.quat, &self.velocity, &self.angular_velocity];
        bytes.extend(parts.into_iter().flatten().flat_map(|x| x.to_le_bytes()));
        if let ObstacleShape::HField(field) = &self.shape {
            bytes.extend([field.nrow, field.ncol].into_iter().flat_map(|x| (x as u64).to_le_bytes()));
            bytes.extend(field.data.iter().flat_map(|x| x.to_le_bytes()));
        }
    }

    /// Reads an obstacle from the front of some bytes. `None` if they are invalid.
    pub(super) fn read_from(bytes: &mut &[u8]) -> Option<Self> {
        let x = take(bytes, 18, f64::from_le_bytes)?;
        let v3 = |at: usize| [x[at], x[at + 1], x[at + 2]];
        let shape = match x[0] {
            0.0 => ObstacleShape::Sphere { radius: x[1] },
            1.0 => ObstacleShape::Capsule { radius: x[1], half_length: x[2] },
            2.0 => ObstacleShape::Box { half_size: v3(1) },
            3.0 => {
                let sides = take(bytes, 2, u64::from_le_bytes)?;
                let [nrow, ncol] = [sides[0], sides[1]].map(|side| usize::try_from(side).unwrap_or(usize::MAX));
                let data = take(bytes, nrow.checked_mul(ncol)?, f32::from_le_bytes)?;
                let size = [x[1], x[2], x[3], x[4]];
                ObstacleShape::HField(Arc::new(HField { name: String::new(), nrow, ncol, size, data }))
            }
            _ => return None,
        };
        let quat = [x[8], x[9], x[10], x[11]];
        let out = Obstacle { shape, pos: v3(5), quat, velocity: v3(12), angular_velocity: v3(15) };
        out.out_of_range().is_none().then_some(out)
    }
}

/// The first fault of the grid of a height field, as [`Obstacle::out_of_range`] names it.
fn out_of_field(field: &HField) -> Option<(&'static str, f64, &'static str)> {
    if let Some(side) = [field.nrow, field.ncol].into_iter().find(|side| *side < 2) {
        return Some(("side of its field", side as f64, "at least 2 points"));
    }
    if field.nrow.checked_mul(field.ncol) != Some(field.data.len()) {
        return Some(("field of this many elevations", field.data.len() as f64, "one per row and column"));
    }
    // lanes divide by sides in single precision
    if let Some(x) = field.size.iter().find(|x| **x > 0.0 && !(1e-6..1e8).contains(*x)) {
        return Some(("size of its field", *x, "a length from 1e-6 to 1e8"));
    }
    let below = -field.size[3] / field.size[2];
    let wrong = field.data.iter().map(|x| f64::from(*x)).find(|x| !(*x > below && *x * field.size[2] < 1e8));
    wrong.map(|x| ("elevation", x, "a number above the base and below 1e8"))
}

/// Takes `count` numbers from the front of some bytes.
pub(super) fn take<const N: usize, X>(bytes: &mut &[u8], count: usize, number: fn([u8; N]) -> X) -> Option<Vec<X>> {
    let (mine, rest) = bytes.split_at_checked(count.checked_mul(N)?)?;
    *bytes = rest;
    Some(mine.as_chunks::<N>().0.iter().map(|x| number(*x)).collect())
}
