//! Runs Python scripts as references. Used by the tests of physics, motion, envs and learn.
#![allow(dead_code, reason = "every test file uses a part")]

use serde_json::Value;
use std::ffi::OsString;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

/// Root of the repository.
pub fn workspace() -> PathBuf {
    let mut folder = PathBuf::from(env!("CARGO_MANIFEST_DIR"));
    assert!(folder.pop() && folder.pop(), "crates lie two folders deep");
    folder
}

/// A new folder for a test's files. The name must differ from those of all other tests of the crate.
pub fn scratch(name: &str) -> PathBuf {
    let Some(place) = option_env!("CARGO_TARGET_TMPDIR") else {
        panic!("Cargo names a folder for integration tests only")
    };
    let folder = Path::new(place).join(env!("CARGO_PKG_NAME")).join(name);
    if folder.exists() {
        std::fs::remove_dir_all(&folder).expect("files of an earlier run can be removed");
    }
    std::fs::create_dir_all(&folder).expect("the folder can be made");
    folder
}

/// Feeds `input` to `tests/oracle/<script>` and returns what it prints.
pub fn oracle(script: &str, input: &Value) -> Value {
    let output = oracle_text(script, input);
    serde_json::from_str(&output).unwrap_or_else(|e| panic!("{script} prints no JSON: {e}"))
}

/// Feeds `input` to `tests/oracle/<script>` and returns the text that it prints.
pub fn oracle_text(script: &str, input: &Value) -> String {
    python(&[workspace().join("tests/oracle").join(script).into()], &input.to_string())
}

/// Folder of an installed Python package.
pub fn package(name: &str) -> PathBuf {
    let code = format!("import importlib.util,os;print(os.path.dirname(importlib.util.find_spec('{name}').origin))");
    PathBuf::from(python(&["-c".into(), code.into()], "").trim())
}

/// Runs Python with the given arguments and input, and returns its output.
///
/// # Panics
/// If that fails: a test that needs a reference must not pass without it.
fn python(arguments: &[OsString], input: &str) -> String {
    if let Some(folder) = std::env::var_os("MARATHON_ORACLE_MAIL") {
        return by_mail(Path::new(&folder), arguments, input);
    }
    let program =
        std::env::var_os("MARATHON_PYTHON").map_or_else(|| workspace().join(".venv/bin/python"), PathBuf::from);
    let advice = "run ./test.sh, which sets up .venv, or set MARATHON_PYTHON";
    let mut child = Command::new(&program)
        .args(arguments)
        // MuJoCo writes a log of its warnings to the working directory
        .current_dir(std::env::temp_dir())
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap_or_else(|e| panic!("{}: {e}; {advice}", program.display()));
    // a script that fails at once closes the pipe; its status is checked below
    let _ = child.stdin.take().expect("stdin is piped").write_all(input.as_bytes());
    let output = child.wait_with_output().expect("Python ends");
    assert!(output.status.success(), "Python failed on {arguments:?}; {advice}");
    String::from_utf8(output.stdout).expect("Python prints UTF-8")
}

/// Has Python run outside of WebAssembly, where there are no processes: `tests/lanes/wasi.mjs` waits for a file with the arguments and
/// the input, and leaves the output in another.
fn by_mail(folder: &Path, arguments: &[OsString], input: &str) -> String {
    let arguments: Vec<&str> = arguments.iter().map(|word| word.to_str().expect("arguments are UTF-8")).collect();
    let question = serde_json::json!({"arguments": arguments, "input": input}).to_string();
    std::fs::write(folder.join("question.part"), question).expect("the question can be written");
    std::fs::rename(folder.join("question.part"), folder.join("question")).expect("the question can be named");
    let answer = folder.join("answer");
    while !answer.exists() {
        std::thread::sleep(Duration::from_millis(2));
    }
    let text = std::fs::read_to_string(&answer).expect("the answer can be read");
    std::fs::remove_file(&answer).expect("the answer can be removed");
    text.strip_prefix("ok\n").unwrap_or_else(|| panic!("Python failed on {arguments:?}: {text}")).to_owned()
}
