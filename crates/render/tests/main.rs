//! One program for all integration tests of the crate, so that the kernels are compiled once. A file has one promise.

mod common;

mod a_broken_encoder_keeps_the_older_video;
mod files;
mod follow;
mod ghosts;
mod golden;
mod kinematics_agrees_with_mujoco;
mod meshes;
mod shapes;
