//! One program for all integration tests of the crate, so that the kernels are compiled once. A file has one promise.

mod common;

mod every_model_gets_a_sound_skin;
mod files_are_gltf;
mod skins_follow_their_models;
