//! One program for all integration tests of the crate, so that the kernels are compiled once. A file has one promise.

mod common;
#[path = "common/tag.rs"]
mod tag;

mod a_trainer_that_is_silent_or_gone_is_noticed;
mod each_role_is_a_behavior;
mod the_conversation_goes_as_python_expects;
