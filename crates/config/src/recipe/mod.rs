//! Recipes: files with `stages`, which are trained one after the other.

mod criterion;
mod shipped;
mod sources;
mod stages;

pub use criterion::{Criterion, Pick};
pub use shipped::{recipe_for, shipped};
pub use sources::Source;
pub use stages::{Recipe, Stage, StageKind};
