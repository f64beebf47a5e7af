//! Runs the oracle scripts from tests, and compares their results.

#[allow(dead_code)]
pub mod compiled;
pub mod numbers;

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// Root of the workspace.
pub fn workspace() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").canonicalize().expect("the workspace exists")
}

/// Python with the oracles installed.
///
/// # Panics
/// If there is none: a test that needs an oracle must not pass without it.
pub fn python() -> PathBuf {
    if let Some(p) = std::env::var_os("MARATHON_PYTHON") {
        return p.into();
    }
    let p = workspace().join(".venv/bin/python");
    assert!(p.exists(), "no Python with MuJoCo at {}: run ./test.sh, which sets up .venv", p.display());
    p
}

/// Feeds `input` to `tests/oracle/<script>` and returns what it prints.
#[allow(dead_code)]
pub fn oracle(script: &str, input: &serde_json::Value) -> serde_json::Value {
    let mut child = Command::new(python())
        .arg(workspace().join("tests/oracle").join(script))
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("Python starts");
    child.stdin.take().expect("piped").write_all(input.to_string().as_bytes()).expect("the oracle reads its input");
    let output = child.wait_with_output().expect("the oracle ends");
    assert!(output.status.success(), "oracle {script} failed");
    serde_json::from_slice(&output.stdout).expect("the oracle prints JSON")
}

/// Folder of an installed Python package.
#[allow(dead_code)]
pub fn package(name: &str) -> PathBuf {
    let code = format!("import importlib.util,os;print(os.path.dirname(importlib.util.find_spec('{name}').origin))");
    let output = Command::new(python()).args(["-c", &code]).output().expect("Python starts");
    assert!(output.status.success(), "package {name} is not installed: run ./test.sh");
    PathBuf::from(String::from_utf8(output.stdout).expect("a path").trim())
}

/// Every shipped model file: those of Marathon's agents, and Marathon's own files of Gymnasium's and dm_control's
/// tasks.
#[allow(dead_code)]
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
