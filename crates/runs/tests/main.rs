//! One program for all integration tests of the crate, so that the kernels are compiled once. A file has one promise.

mod a_held_backflip_goes_before_speed;
mod clips_go_with_their_task;
mod command_tracking_is_measured;
mod options_are_refused_by_name;
mod policies_learn_from_policies;
