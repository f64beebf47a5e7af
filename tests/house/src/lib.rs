//! The house as it stands: crates, the rooms in each, and every import from one file to another.
//!
//! A *room* is a top-level module of a crate: a folder or a file under `src`. [`House::read`] parses the sources and follows
//! each path to the file that defines its name. [`Order::read`] takes from `docs/project/architecture.md` the order in which crates and
//! rooms are said to stand. The test compares them; `cargo run -p house` draws the picture of that page.

mod imports;
mod names;
mod order;
pub mod picture;
mod plan;
mod sources;

pub use imports::Import;
pub use order::{Order, Step};
pub use plan::{Crate, House, Room};

use std::path::PathBuf;

/// Errors of reading the house.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A file cannot be read or written.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// A source is not Rust.
    #[error("{}:{line}: {message}", path.display())]
    Syntax {
        /// The source.
        path: PathBuf,
        /// Where in it.
        line: usize,
        /// Message of the parser.
        message: String,
    },
    /// Cargo does not tell the crates of the workspace.
    #[error("cargo metadata: {0}")]
    Cargo(String),
}
