//! The `marathon-game` app: watch policies, push and steer their characters, train them, and record videos of them.
//!
//! The characters are those of the plugin [`bevy_marathon`]. A program that registers an agent of its own and calls
//! [`app::main`] has the whole app for it.

pub mod app;
