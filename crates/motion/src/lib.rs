//! Motion clips: conversion of motion capture to joint angles of a character, and sampling.
//!
//! This crate reads no files, uses no clock and starts no threads. Bytes go in and clips come out, so it also runs in a
//! browser.
//!
//! A [`Clip`] is a motion of one MJCF model, in MuJoCo's `qpos`. Its file format is that of [`Clip::parse`] and
//! [`Clip::to_bytes`].
//!
//! ```
//! # fn main() -> Result<(), marathon_motion::MotionError> {
//! let text = r#"{
//!   "motion": 1, "name": "bow", "model": "pole", "source": "made up", "license": "CC0-1.0", "loop": "none", "dt": 0.5,
//!   "joints": [["hip", "hinge"]],
//!   "checksum": "a490b523fb298ca5",
//!   "frames": [[0.0], [0.4], [0.6]]
//! }"#;
//! let clip = marathon_motion::Clip::parse("bow.motion".as_ref(), text.as_bytes())?;
//! assert_eq!(clip.duration(), 1.0);
//! let (mut qpos, mut qvel) = ([0.0], [0.0]);
//! clip.qpos(0.75, &mut qpos);
//! clip.qvel(0.5, &mut qvel);
//! assert!((qpos[0] - 0.5).abs() < 1e-12 && (qvel[0] - 0.6).abs() < 1e-12);
//! # Ok(())
//! # }
//! ```

mod error;
mod limits;
mod peak;
mod rotation;

mod layout;

mod clip;

pub mod kinematics;

pub mod dynamics;

mod ground;
mod self_collision;

mod contact;

mod effort;

mod check;
mod skeleton;
mod tracking;

pub mod import;

mod roles;

mod retarget;

pub use check::{Report, check};
pub use clip::{About, Clip, Cycle, Nearness};
pub use contact::contacts;
pub use effort::{Effort, Efforts, Flight, efforts};
pub use error::MotionError;
pub use layout::{JointKind, Layout};
pub use peak::Peak;
pub use retarget::{Fit, Mapping, SkeletonPoser, fit, retarget, soles};
pub use rotation::wrap_angle;
pub use skeleton::{Animation, Bone, Keyframe, Seam, Skeleton};
pub use tracking::{Places, Tracking};
