//! Compiles the blocks of Rust in README.md and `docs` as documentation tests: `cargo test --doc -p marathon-examples`.
//!
//! `build.rs` collects the blocks. A block that cannot run has the attribute `no_run`, one that does not compile by itself
//! `ignore`, as in every documentation test.

#[cfg(doctest)]
include!(concat!(env!("OUT_DIR"), "/pages.rs"));
