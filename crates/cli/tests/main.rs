//! One program for all integration tests of the crate, so that the kernels are compiled once. A file has one promise.

mod common;
#[path = "common/foreign.rs"]
mod foreign;

mod a_browser_can_watch;
mod a_full_disk_keeps_the_older_picture;
mod any_robot_is_trained;
mod bench_reports;
mod distillations_lose_nothing;
mod errors_say_what_to_do;
mod files_of_ml_agents_learn_as_there;
mod folders_keep_what_is_in_them;
mod interrupted_runs_lose_nothing;
mod kept_policies_have_a_mean;
mod limits_of_the_user_are_read;
mod lost_output_is_an_error;
mod motions_become_clips;
mod outputs_are_checked_before_the_work;
mod paths_may_hold_any_bytes;
mod policies_are_drawn_with_their_clips;
mod policies_travel_as_onnx;
mod processes_play_the_same_run;
mod recipes_resume_with_the_same_bits;
mod rendering_writes_pictures;
mod runs_name_what_they_depend_on;
mod runs_of_several_roles_are_played;
mod runs_of_strangers_write_nowhere_else;
mod settings_have_one_name_everywhere;
mod skins_are_generated;
mod strangers_files_end_in_good_order;
mod tasks_have_options;
mod the_first_minutes_are_easy;
mod the_page_of_own_motions_runs;
mod the_shipped_hopper_is_todays;
mod train_writes_everything;
