//! One program for all integration tests of the crate, so that the kernels are compiled once. A file has one promise.

mod common;
#[path = "common/motions.rs"]
mod motions;
#[path = "common/refusal.rs"]
mod refusal;

mod a_model_file_keeps_to_its_budget;
mod a_turned_world_moves_alike;
mod actuators_move_as_in_mujoco;
mod an_edited_model_is_the_one_written_by_hand;
mod attached_models;
mod bits_do_not_depend_on_threads_slots_widths;
mod blowups_can_be_replayed;
mod constraints_without_weight_stay_sound;
mod convex_shapes_move_as_in_mujoco;
mod crowds_agree_with_mujoco;
mod foreign_models_agree_or_are_refused;
mod friction_without_slip_agrees_with_mujoco;
mod gathered_rows_are_the_agents_own;
mod ice_carries;
mod implicit_integrators_move_as_in_mujoco;
mod integrators_converge_with_their_order;
mod limits_are_documented;
mod low_iteration_caps_agree_with_mujoco;
mod media_move_as_in_mujoco;
mod mesh_errors;
mod meshes_agree_with_mujoco;
mod mjcf_agrees_with_mujoco;
mod mjcf_errors;
mod mjcf_errors_of_actuators;
mod mjcf_never_panics;
mod non_finite_states_are_quarantined;
mod obstacles_are_felt;
mod physics_agrees_with_mujoco;
mod random_models_agree_with_mujoco;
mod sensors_agree_with_mujoco;
mod snapshot_restore_continue;
mod special_cases_move_as_in_mujoco;
mod strings_move_as_in_mujoco;
mod ten_million_steps_stay_finite;
mod what_is_remembered_changes_nothing;
mod what_mujoco_saves_is_read;
