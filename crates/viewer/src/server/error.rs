//! Errors.

use std::path::PathBuf;

/// Why the page cannot be shown.
#[derive(Debug, thiserror::Error)]
pub enum ViewerError {
    /// A folder without the page.
    #[error("{}: no index.html, expected the page of Marathon, which web/build.sh makes in web/dist", .0.display())]
    NoPage(PathBuf),
    /// The page is nowhere.
    #[error("the page was not found in {tried}; build it with web/build.sh and name its folder, web/dist")]
    NotFound {
        /// Folders that were searched.
        tried: String,
    },
    /// The port cannot be used.
    #[error("port {port} cannot be used: {error}; 0 takes any free port")]
    Port {
        /// The port.
        port: u16,
        /// The system's reason.
        error: std::io::Error,
    },
    /// There is no randomness for a token.
    #[error("the system gives no random numbers for a token: {0}")]
    Random(String),
}
