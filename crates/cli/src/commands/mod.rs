//! One file per command.

pub mod bench;
pub mod convert;
pub mod eval;
pub mod list;
pub mod play;
pub mod record_demo;
pub mod render;
pub mod study;
pub mod train;
