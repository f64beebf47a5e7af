//! One program for all integration tests of the crate, so that the kernels are compiled once. A file has one promise.

#[path = "../../bevy_marathon/tests/common/devices.rs"]
mod devices;
#[path = "common/windowless.rs"]
mod windowless;

mod a_course_is_run;
mod a_gamepad_plays;
mod a_player_steers;
mod a_recording_survives_every_key;
mod a_stranger_plays;
mod a_window_under_xvfb;
mod every_mode_leads_to_every_other;
mod keys_ask_before_something_is_lost;
mod pictures;
mod settings_are_kept_and_screens_fit;
mod the_app;
mod the_command_has_the_help_of_the_game;
mod the_longest_runs_are_kept;
mod the_player_has_hands_on_the_characters;
