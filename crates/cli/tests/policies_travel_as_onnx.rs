//! `marathon export` and `marathon import`: a policy acts the same after conversion to ONNX and back, and `eval`
//! accepts both. A policy can be converted for other options.

use crate::common::{assert_no_leftovers, fail, json, shipped, succeed};
use marathon_envs::options::Value;
use marathon_learn::Policy;
use serde_json::Value as Json;
use std::path::Path;

fn eval(folder: &Path, policy: &str) -> Json {
    json(&succeed(folder, &["eval", policy, "--episodes", "16", "--json"]))
}

#[test]
fn there_and_back() {
    let temp = tempfile::tempdir().unwrap();
    let folder = temp.path();
    let text = succeed(folder, &["export", &shipped("hopper"), "--out", "hopper.onnx"]);
    assert!(text.starts_with("wrote hopper.onnx: Hopper-v0, 31 -> "), "{text}");
    let text = succeed(folder, &["import", "hopper.onnx"]);
    assert!(text.starts_with("wrote hopper.safetensors: Hopper-v0, 31 -> "), "{text}");
    let (before, after) = (eval(folder, &shipped("hopper")), eval(folder, "hopper.safetensors"));
    let mean = |report: &Json| report["return_mean"].as_f64().unwrap();
    // the bits of a division may differ, and with them single episodes
    assert!((mean(&before) / mean(&after) - 1.0).abs() < 0.05, "{before} {after}");
    assert_eq!(eval(folder, "hopper.onnx")["return_mean"], after["return_mean"]);
    assert_no_leftovers(folder);
}

/// A policy that was trained with some options is converted for others.
#[test]
fn a_policy_is_written_for_other_options() {
    let temp = tempfile::tempdir().unwrap();
    let folder = temp.path();
    let walk = shipped("MarathonManWalk");
    succeed(folder, &["import", &walk, "--option", "start=first", "--out", "walk.safetensors"]);
    let [before, after] = [Path::new(&walk), &folder.join("walk.safetensors")].map(|path| Policy::load(path).unwrap());
    assert_eq!((before.params(), before.normalizer()), (after.params(), after.normalizer()));
    let start = |policy: &Policy| policy.meta().options.get("start").cloned();
    assert_eq!(start(&before), Some(Value::Text("adaptive".into())));
    assert_eq!(start(&after), Some(Value::Text("first".into())));
    let error = fail(folder, 1, &["import", &walk, "--option", "start=frist", "--out", "x.safetensors"]);
    assert!(error.contains("frist") && error.contains("first"), "{error}");
    assert!(!folder.join("x.safetensors").exists());
    assert_no_leftovers(folder);
}

#[test]
fn mistakes_are_told() {
    let temp = tempfile::tempdir().unwrap();
    let folder = temp.path();
    let error = fail(folder, 2, &["export", &shipped("hopper"), "--out", "hopper.pt"]);
    assert!(error.contains("--out is hopper.pt, expected a name that ends with .onnx"), "{error}");
    let error = fail(folder, 2, &["import", &shipped("hopper")]);
    assert!(error.contains("--out is missing, expected a file for the policy of"), "{error}");
    std::fs::write(folder.join("x.onnx"), b"").unwrap();
    let error = fail(folder, 1, &["import", "x.onnx"]);
    assert!(error.contains("x.onnx: agent: found none, expected one"), "{error}");
    succeed(folder, &["export", &shipped("hopper"), "--out", "hopper.onnx"]);
    let bytes = std::fs::read(folder.join("hopper.onnx")).unwrap();
    for command in
        [["import", "hopper.onnx", "--out", "./hopper.onnx"], ["export", "hopper.onnx", "--out", "hopper.onnx"]]
    {
        let error = fail(folder, 2, &command);
        assert!(error.contains("hopper.onnx, which is also an input; expected another file"), "{error}");
        assert!(std::fs::read(folder.join("hopper.onnx")).unwrap() == bytes);
    }
    let error = fail(folder, 1, &["import", "hopper.onnx", "--agent", "ant"]);
    assert!(error.contains("expected one observation of 53 numbers, as Ant-v0 has"), "{error}");
}
