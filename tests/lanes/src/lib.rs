//! The lanes of marathon-physics, compiled for other processors. See `../run.sh`.
#![allow(unused_imports, unused_macros)]

#[path = "../../../crates/physics/src/lanes/mod.rs"]
pub mod lanes;
