//! What the crate promises, a file for each promise. One program, so that the kernels are compiled once.

mod common;

mod every_model_gets_a_sound_skin;
mod files_are_gltf;
mod skins_follow_their_models;
