//! One program for all integration tests of the crate, so that the kernels are compiled once. A file has one promise.

mod common;

mod clips_agree_with_mujoco;
mod clips_can_be_sampled_and_edited;
mod damaged_files_never_panic;
mod efforts_agree_with_mujoco;
mod glb_and_bvh_tell_the_same;
mod gltf_of_many_programs_is_read;
mod malformed_motions_get_named_errors;
mod motions_are_compared_as_the_field_does;
mod recordings_stand_upright_on_the_floor;
mod retargeting_keeps_the_motion_within_the_body;
mod skeletons_wear_models;
