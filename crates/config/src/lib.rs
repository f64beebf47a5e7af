//! Configuration files: bytes in, the trainer's configuration and notes out.
//!
//! Marathon's own files have the fields of [`TrainConfig`](marathon_learn::TrainConfig), as many as they name; the preset of the task holds for
//! the others. Files of Unity's ML-Agents, today's and those of version 0.x, are imported.
//!
//! Nothing here reads a file or knows a command line, so that a browser can use it, too.
//!
//! The way of a file: `document` makes a tree of the YAML text. `layer` reads a file of Marathon's by the table of `keys`, and
//! `loaded` puts it over what `presets` has for the task. `mlagents` reads the other files. `section` is what both read
//! values with. `recipe` reads files with stages.
//!
//! `docs/reference/configs.md` has the tables of all keys.

mod document;
mod error;
mod keys;
mod layer;
mod loaded;
mod mlagents;
mod names;
mod parse;
mod presets;
pub mod recipe;
mod reference;
mod section;
mod stage_keys;
mod yaml;

pub use error::{ConfigError, Place};
pub use keys::all as keys;
pub use loaded::{Loaded, default_of};
pub use parse::{convert, parse, parse_object, set};
pub use presets::{against, default_for};
pub use recipe::{Recipe, recipe_for, shipped};
pub use reference::reference;
pub use section::steps;
