//! The Python that others' programs run in.

use std::env;
use std::path::{Path, PathBuf};

/// Names the Python to use.
pub const VARIABLE: &str = "MARATHON_PYTHON";

/// The Python that the user names, else that of the virtual environment at hand, else the system's.
pub fn find() -> PathBuf {
    if let Some(named) = env::var_os(VARIABLE).filter(|name| !name.is_empty()) {
        return named.into();
    }
    let inside = if cfg!(windows) { ".venv/Scripts/python.exe" } else { ".venv/bin/python" };
    let here = env::current_dir().unwrap_or_default();
    let root = here.ancestors().find(|folder| folder.join(".git").exists());
    let venv = [Some(here.as_path()), root].into_iter().flatten().map(|folder: &Path| folder.join(inside));
    let found = venv.into_iter().find(|python| python.exists());
    found.unwrap_or_else(|| if cfg!(windows) { "python".into() } else { "python3".into() })
}
