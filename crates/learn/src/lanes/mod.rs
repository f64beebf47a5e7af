//! Sixteen samples side by side: memory, the inner loops of networks, random streams.

pub mod buffer;
pub(crate) mod mirror;
pub mod noise;
pub(crate) mod tiles;

pub use marathon_envs::BLOCK;

pub(crate) use marathon_physics::with_single_lanes as f32_lanes;
