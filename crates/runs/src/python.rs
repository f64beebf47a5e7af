//! The Python interpreter for external programs, such as MuJoCo and Stable-Baselines3.

use std::env;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// Environment variable with the Python to use.
pub const VARIABLE: &str = "MARATHON_PYTHON";
/// Characters that [`complaint`] keeps.
const COMPLAINT: usize = 2000;

/// The Python in [`VARIABLE`], else that of `.venv` in the working directory or the root of its repository, else the
/// system's.
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

/// A Python process that runs `script`, with pipes for input and output.
pub fn command(python: &Path, script: &str) -> Command {
    let mut command = Command::new(python);
    // a folder in the working directory with the name of a package must not replace the package
    command.args(["-c", script]).env("PYTHONSAFEPATH", "1");
    command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

/// The end of the error output of a process.
pub fn complaint(text: &str) -> &str {
    let text = text.trim();
    let from = text.char_indices().rev().nth(COMPLAINT).map_or(0, |(i, _)| i);
    &text[from..]
}
