//! One program for all integration tests of the crate, so that the kernels are compiled once. A file has one promise.

mod common;

mod a_batch_task_learns_like_its_blocks;
mod a_role_may_leave_early;
mod a_run_may_be_stepped;
mod clip_schedule;
mod determinism;
mod evaluation;
mod fewer_agents_than_lanes;
mod gradients;
mod imitation;
mod learning;
mod networks_follow_the_statistics;
mod networks_start_as_configured;
mod onnx_files_act_the_same;
mod policies_have_a_checksum;
mod policy;
mod resume;
mod rollouts_played_elsewhere_change_nothing;
mod signals;
mod squashed_policies;
mod the_factors_are_the_fisher_matrix;
mod the_policy_is_the_mean_of_the_last;
mod torch;
mod two_roles_learn_in_one_run;
