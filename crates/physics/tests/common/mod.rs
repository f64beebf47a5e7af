//! Runs the oracle scripts from tests, and compares their results.

#[allow(dead_code, reason = "the unit tests of shapes use a part")]
pub mod compiled;
pub mod numbers;
mod oracle;

#[allow(unused_imports)]
pub use oracle::{oracle, oracle_text, package, scratch, workspace};
use std::path::PathBuf;

/// Every shipped model file: those of Marathon's agents, and Marathon's own files of Gymnasium's and dm_control's
/// tasks.
#[allow(dead_code, reason = "the unit tests of shapes use a part")]
pub fn shipped() -> Vec<PathBuf> {
    let mut paths: Vec<PathBuf> = ["agents", "gymnasium", "dm_control"]
        .iter()
        .flat_map(|folder| std::fs::read_dir(workspace().join("assets").join(folder)).expect("the folder exists"))
        .map(|entry| entry.expect("readable").path())
        .filter(|path| path.extension().is_some_and(|e| e == "xml"))
        .collect();
    paths.sort();
    assert!(paths.len() >= 17, "models are missing");
    paths
}
