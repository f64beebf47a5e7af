//! Programs in a terminal: output, Ctrl-C and exit codes.

mod console;
mod exit;
pub mod interrupt;

pub use console::{note, notes, print_json, say};
pub use exit::{failed, finish, refused};
