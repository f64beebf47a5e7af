//! Cameras and lights, for viewers.

use super::{Quat, Vec3};
use serde::{Deserialize, Serialize};

/// How a camera or light moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum TrackMode {
    /// Fixed in the body's frame.
    Fixed,
    /// Keeps its offset from the body in world axes.
    Track,
    /// Keeps its offset from the subtree's center of mass in world axes.
    TrackCom,
    /// Looks at a target body.
    TargetBody,
    /// Looks at a target's center of mass.
    TargetBodyCom,
}

/// A camera; it looks along its negative z axis, x to the right.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Camera {
    /// Name; empty when the file gives none.
    pub name: String,
    /// Body it is attached to.
    pub body: usize,
    /// Position in the body's frame.
    pub pos: Vec3,
    /// Orientation in the body's frame.
    pub quat: Quat,
    /// How it moves.
    pub mode: TrackMode,
    /// Vertical field of view in degrees.
    pub fovy: f64,
}

/// A light; kept for viewers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Light {
    /// Name; empty when the file gives none.
    pub name: String,
    /// Body it is attached to.
    pub body: usize,
    /// Position in the body's frame.
    pub pos: Vec3,
    /// Direction in the body's frame.
    pub dir: Vec3,
    /// How it moves.
    pub mode: TrackMode,
    /// Parallel rays.
    pub directional: bool,
    /// Diffuse color.
    pub diffuse: [f32; 3],
}
