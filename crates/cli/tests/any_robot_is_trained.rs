//! The path of a model is a task: it trains, resumes, is evaluated and drawn, from any folder.

mod common;

use common::*;
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
