//! One program for all integration tests of the crate, so that the kernels are compiled once. A file has one promise.

mod common;

mod a_broken_state_stays_with_its_agent;
mod a_dm_control_return_agrees_with_dm_control;
mod a_figure_does_what_a_player_wants;
mod a_figure_goes_where_it_is_told;
mod a_figure_in_a_plane_is_told_how_fast_to_go;
mod a_figure_runs_over_ground_of_its_own;
mod a_gait_comes_from_clips_of_ones_own;
mod a_gymnasium_return_agrees_with_gymnasium;
mod a_sparse_reward_is_paid_once;
mod agents_are_found_by_name;
mod agents_beyond_the_budget_are_refused;
mod agents_can_differ;
mod agents_follow_motion_clips;
mod an_adversary_builds_the_ground;
mod an_agent_does_what_it_is_told;
mod an_agent_of_ones_own;
mod an_agent_sees_its_own_ground;
mod any_robot_learns_to_follow;
mod autoreset_modes_tell_the_same_story;
mod bits_do_not_depend_on_threads_slots_widths;
mod edited_models_are_those_written_by_hand;
mod every_agent_passes_the_suite_checks;
mod falls_are_replayed;
mod levels_choose_pieces_that_teach;
mod rewards_agree_with_mujoco;
mod snapshots_continue_exactly;
mod the_ant_goes_where_it_is_told;
mod what_agents_tell_has_names;
mod who_decides_next_is_told;
