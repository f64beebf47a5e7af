//! The path of a model is a task: it trains, resumes, is evaluated and drawn, from any folder.

use crate::common::*;
use std::path::Path;

#[test]
fn the_path_of_a_model_is_a_task() {
    let temp = tempfile::tempdir().unwrap();
    let (here, elsewhere) = (temp.path().join("here"), temp.path().join("elsewhere"));
    [&here, &elsewhere].iter().for_each(|folder| std::fs::create_dir(folder).unwrap());
    let shipped = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/robots/hexapod.xml");
    std::fs::copy(shipped, here.join("bug.xml")).unwrap();

    let listed = succeed(&here, &["list", "bug.xml"]);
    for part in
        ["Robot-v0", "found in the model", "the reference pose", "rear_left_tibia (0)", "18 (0 in place of motors)"]
    {
        assert!(listed.contains(part), "{part} in\n{listed}");
    }
    let short = ["--agents", "64", "--steps", "8192", "--seed", "1"];
    let train = |out: &str| {
        succeed(&here, &[&["train", "bug.xml", "--option", "speed=0.8", "--out", out][..], &short].concat());
    };
    train("run");
    train("again");
    let weights = |run: &str| tensors(&here.join(run).join("policy.safetensors"));
    assert_eq!(weights("run"), weights("again"), "the same seed trains the same policy");
    // the run has noted its model and its options
    succeed(&elsewhere, &["train", "--resume", "../here/run", "--steps", "12288"]);
    let report = succeed(&elsewhere, &["eval", "../here/run", "--episodes", "2", "--json"]);
    assert!(report.contains("velocity_error"), "{report}");
    succeed(&elsewhere, &["render", "../here/run", "--out", "bug.png"]);

    let refused = run(&here, &["train", "cat.xml", "--out", "none"]);
    let said = String::from_utf8_lossy(&refused.stderr);
    assert!(!refused.status.success() && said.contains("cat.xml") && said.contains("cannot read"), "{said}");
    assert!(!here.join("none").exists());
}

#[test]
fn the_model_that_is_named_is_used() {
    let temp = tempfile::tempdir().unwrap();
    let path = temp.path();
    let shipped = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/robots/hexapod.xml");
    let text = std::fs::read_to_string(shipped).unwrap();
    let (old, new) = (path.join("old.xml"), path.join("new.xml"));
    [&old, &new].iter().for_each(|file| std::fs::write(file, &text).unwrap());
    succeed(path, &["train", "old.xml", "--agents", "64", "--steps", "4096", "--out", "run"]);
    let eval = ["eval", "run", "--episodes", "1"];
    let said = |words: &[&str]| stderr(&run(path, words));
    assert!(!said(&eval).contains("note:"), "{}", said(&eval));

    // another version of the model
    std::fs::write(&old, format!("{text}<!-- heavier -->")).unwrap();
    let render = ["render", "run", "--out", "run.png", "--seconds", "0.1"];
    for words in [&eval[..], &["eval", "run/policy.safetensors", "--episodes", "1"], &render] {
        assert!(said(words).contains("old.xml has changed since the policy was trained"), "{}", said(words));
    }
    // the model of the command line has no need of the old one
    std::fs::remove_file(&old).unwrap();
    assert!(fail(path, 1, &eval).contains("old.xml"));
    let other = [&eval[..], &["--agent", "new.xml"]].concat();
    succeed(path, &other);
    assert!(!said(&other).contains("note:"), "{}", said(&other));

    for words in [&["train", "new.xml", "--out", "two"][..], &other] {
        let text = fail(path, 2, &[words, &["--option", "xml_file=old.xml"]].concat());
        assert!(text.contains("--option xml_file=old.xml and the task new.xml name two models"), "{text}");
    }
    assert!(!path.join("two").exists());

    let listed = succeed(path, &["list", "new.xml"]);
    assert_eq!(listed.lines().filter(|line| *line == "command").count(), 1, "{listed}");
    let speed = listed.lines().find(|line| line.ends_with("speed m/s")).expect("a speed");
    assert!(speed.trim().len() < 30, "{speed}");
}
