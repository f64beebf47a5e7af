//! Shows simulations in Marathon's web page.
//!
//! [`facts`] and [`Poses`] are what a page needs to draw a model. With the feature `server`, [`Viewer`] serves the page on
//! loopback and streams poses to it. A program that steps a simulation never waits for a browser: each tab takes the newest
//! frame when it is ready for one.

mod facts;
mod poses;
#[cfg(feature = "server")]
mod server;

pub use facts::facts;
pub use poses::Poses;
#[cfg(feature = "server")]
pub use server::{Frame, PAGE_VARIABLE, Viewer, ViewerError, find_page};
