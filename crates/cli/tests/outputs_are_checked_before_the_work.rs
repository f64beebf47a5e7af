//! A command checks its output file before it starts: the ending, the folder, and that the file is not one of its
//! inputs.

use crate::common::*;
use std::time::{Duration, Instant};

#[test]
fn every_command_looks_at_its_output_first() {
    let temp = tempfile::tempdir().unwrap();
    let path = temp.path();
    std::fs::copy(shipped("hopper"), path.join("p.safetensors")).unwrap();
    std::fs::copy(shipped("WalkerController"), path.join("w.safetensors")).unwrap();
    let before = ["p.safetensors", "w.safetensors"].map(|name| std::fs::read(path.join(name)).unwrap());
    for folder in ["d.png", "d.demo", "d.onnx", "d.safetensors"] {
        std::fs::create_dir(path.join(folder)).unwrap();
    }
    std::fs::write(path.join("file"), "").unwrap();
    // all but the last four commands would run for hours
    let commands: [(&[&str], &str); 7] = [
        (&["record-demo", "p.safetensors", "--episodes", "100000"], "demo"),
        (&["render", "p.safetensors", "--seconds", "3600", "--agents", "64"], "png"),
        (&["render", "p.safetensors", "--seconds", "3600", "--agents", "64"], "gif"),
        (&["bench", "controller", "w.safetensors", "--episodes", "100000"], "png"),
        (&["average", "p.safetensors", "p.safetensors"], "safetensors"),
        (&["import", "p.safetensors"], "safetensors"),
        (&["export", "p.safetensors"], "onnx"),
    ];
    let begun = Instant::now();
    for (words, ending) in commands {
        let refused = |out: &str, part: &str| {
            let output = run(path, &[words, &["--out", out]].concat());
            let text = stderr(&output);
            assert!(matches!(output.status.code(), Some(1 | 2)), "{words:?} {out}: {text}");
            assert!(text.contains(part), "{words:?} {out}: {text}");
        };
        refused("x.abc", "abc");
        refused(&format!("none/x.{ending}"), "there is no folder none");
        if ending != "gif" {
            refused(&format!("d.{ending}"), "a folder; expected a file");
        }
        refused(&format!("file/x.{ending}"), "there is no folder file");
    }
    for words in [&["average", "p.safetensors", "w.safetensors"][..], &["import", "p.safetensors"]] {
        let error = fail(path, 2, &[words, &["--out", "./p.safetensors"]].concat());
        assert!(error.contains("which is also an input; expected another file"), "{error}");
    }
    assert!(begun.elapsed() < Duration::from_secs(60), "no work is done");
    assert_eq!(before, ["p.safetensors", "w.safetensors"].map(|name| std::fs::read(path.join(name)).unwrap()));
    assert_no_leftovers(path);
    assert_eq!(files(path).len(), 3, "{:?}", files(path));
}

/// `import` adds the checksum that a policy lacks and keeps its numbers.
#[test]
fn a_policy_without_a_checksum_is_imported() {
    let temp = tempfile::tempdir().unwrap();
    let path = temp.path();
    let bytes = std::fs::read(shipped("hopper")).unwrap();
    let header = 8 + u64::from_le_bytes(bytes[..8].try_into().unwrap()) as usize;
    let text = std::str::from_utf8(&bytes[8..header]).unwrap();
    let start = text.rfind(r#",\"checksum\":\""#).unwrap();
    let text =
        format!("{}{}", &text[..start], text[start + r#",\"checksum\":\"0123456789abcdef\""#.len()..].trim_end());
    let old = [&(text.len() as u64).to_le_bytes(), text.as_bytes(), &bytes[header..]].concat();
    std::fs::write(path.join("old.safetensors"), old).unwrap();
    for command in ["eval", "export"] {
        let error = fail(path, 1, &[command, "old.safetensors"]);
        let advice = "`marathon import old.safetensors --out NEW.safetensors` writes it";
        assert!(error.contains("old.safetensors: checksum: found none") && error.contains(advice), "{error}");
    }
    succeed(path, &["import", "old.safetensors", "--out", "new.safetensors"]);
    assert_eq!(tensors(&path.join("new.safetensors")), tensors(std::path::Path::new(&shipped("hopper"))));
    let [new, own] = ["new.safetensors".to_string(), shipped("hopper")]
        .map(|policy| json(&succeed(path, &["eval", &policy, "--episodes", "16", "--json"])));
    assert_eq!(new, own);
}

/// The file receives each episode when it ends, so memory does not grow with the number of episodes.
#[cfg(target_os = "linux")]
#[test]
fn a_long_demonstration_takes_little_memory() {
    let temp = tempfile::tempdir().unwrap();
    let limited = |episodes: &str| {
        let mut shell = std::process::Command::new("bash");
        let script =
            format!("ulimit -d 160000; exec \"$0\" record-demo \"$1\" --episodes {episodes} --out a.demo --json");
        let output =
            shell.args(["-c", &script, program(), &shipped("hopper")]).current_dir(temp.path()).output().unwrap();
        assert!(output.status.success(), "{}", stderr(&output));
        json(&String::from_utf8(output.stdout).unwrap())
    };
    let report = limited("600");
    assert_eq!(report["episodes"], 600);
    let bytes = std::fs::metadata(temp.path().join("a.demo")).unwrap().len();
    // an extra copy or two would exceed the limit
    assert!(bytes > 90_000_000, "{bytes} bytes");
    assert_no_leftovers(temp.path());
}
