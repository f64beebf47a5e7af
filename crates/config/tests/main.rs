//! One program for all integration tests of the crate, so that the kernels are compiled once. A file has one promise.

mod common;

mod config_errors;
mod config_mapping;
mod config_mapping_of_trainers_and_rewards;
mod config_never_panics;
mod files_lie_over_presets;
mod recipes_have_stages;
mod roles_have_behaviors_of_their_own;
mod the_reference_is_complete;
