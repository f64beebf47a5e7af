//! What the crate promises, a file for each promise. One program, so that the kernels are compiled once.

mod common;

mod a_broken_encoder_keeps_the_older_video;
mod files;
mod follow;
mod ghosts;
mod golden;
mod kinematics_agrees_with_mujoco;
mod meshes;
mod shapes;
