//! One program for all integration tests of the crate, so that the kernels are compiled once. A file has one promise.

mod common;
#[path = "common/devices.rs"]
mod devices;

mod a_transform_is_where_the_character_is;
mod characters_fall_get_up_and_feel_blows;
mod characters_feel_solids;
mod characters_go_where_they_are_sent;
mod clips_and_physics_take_turns;
mod every_system;
mod feet_stand_on_screen;
mod inspectors_and_scenes_know_the_components;
mod saved_and_sleeping_characters_keep_their_bits;
mod the_camera_stays_outside;
mod the_example_drives;
mod the_examples_run_without_a_window;
mod the_game_has_the_bits_of_eval;
