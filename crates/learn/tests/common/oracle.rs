//! Reference results of PyTorch.

#![allow(dead_code, reason = "every test file uses a part")]

use serde_json::Value;
use std::io::Write;
use std::path::PathBuf;
use std::process::{Command, Stdio};

/// Runs a script of `tests/oracle`.
pub fn ask_torch(script: &str, request: &Value) -> Value {
    let root = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../..");
    let python = match std::env::var_os("MARATHON_PYTHON") {
        Some(python) => PathBuf::from(python),
        None => root.join(".venv/bin/python"),
    };
    let advice = "run ./test.sh, which sets up .venv with PyTorch, or set MARATHON_PYTHON";
    let mut child = Command::new(&python)
        .arg(root.join("tests/oracle").join(script))
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap_or_else(|e| panic!("{}: {e}; {advice}", python.display()));
    let mut stdin = child.stdin.take().expect("stdin is piped");
    // a script that fails at once closes the pipe; its status is checked below
    let _ = stdin.write_all(request.to_string().as_bytes());
    drop(stdin);
    let output = child.wait_with_output().expect("the oracle ends");
    assert!(output.status.success(), "{script} failed with {}; {advice}", python.display());
    serde_json::from_slice(&output.stdout).expect("the oracle prints JSON")
}
