//! Names of files.

use crate::app::error::GameError;
use marathon_physics::hint::nearest;
use std::path::{Path, PathBuf};

/// Refuses a file that is not there.
///
/// # Errors
/// If there is no such file; the error names one with a similar name.
pub fn exists(path: &Path) -> Result<(), GameError> {
    if path.exists() {
        return Ok(());
    }
    let name = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let mut others: Vec<String> = entries.map(|entry| entry.file_name().to_string_lossy().into_owned()).collect();
    // the first of several that are as near; folders have no order
    others.sort();
    let nearest = nearest(&name, others.iter().map(String::as_str));
    let nearest = nearest.map(|other| folder.join(other).display().to_string());
    Err(GameError::Missing { path: path.into(), nearest })
}

/// The stem of files about an agent: its name without the version.
pub fn file_stem(agent: &str) -> String {
    agent.split("-v").next().unwrap_or(agent).to_lowercase()
}

/// The first of `stem-1.extension`, `stem-2.extension` and so on that is not there yet.
pub fn free_name(stem: &str, extension: &str) -> PathBuf {
    let mut number = 1;
    loop {
        let path = PathBuf::from(format!("{stem}-{number}.{extension}"));
        if !path.exists() {
            return path;
        }
        number += 1;
    }
}
