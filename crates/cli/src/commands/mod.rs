//! One file per command.

pub mod average;
pub mod completions;
pub mod config;
pub mod convert;
pub mod distill;
pub mod doctor;
pub mod eval;
pub mod list;
pub mod play;
pub mod recipe;
pub mod record_demo;
pub mod render;
pub mod rollout_worker;
pub mod serve;
pub mod skin;
pub mod train;
