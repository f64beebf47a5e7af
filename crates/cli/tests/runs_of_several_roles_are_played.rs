//! `marathon eval` and `marathon render` play the run of a task with several roles with the policies of all of them,
//! which lie in the same folder. The evaluation equals the one at the end of the training, and the picture shows the
//! built ground. A missing policy is named.

use crate::common::{assert_no_leftovers, fail, json, read_json, succeed};
use std::path::Path;

const RENDERED: [&str; 8] = ["render", "run", "--out", "strip.png", "--seconds", "1", "--frames", "3"];

fn train(folder: &Path, builder: &str) {
    let option = format!("builder={builder}");
    let task = ["train", "TerrainWalker2d", "--option", "course=adversary", "--option", &option];
    succeed(folder, &[&task[..], &["--steps", "16384", "--seed", "1", "--out", "run"]].concat());
}

#[test]
fn all_roles_play() {
    for (builder, others) in [("inverse", &["builder"][..]), ("regret", &["builder", "reference"])] {
        let temp = tempfile::tempdir().unwrap();
        let folder = temp.path();
        train(folder, builder);
        let eval = json(&succeed(folder, &["eval", "run", "--json"]));
        let summary = read_json(&folder.join("run/summary.json"));
        for (key, value) in summary["eval"].as_object().unwrap() {
            assert_eq!(&eval[key], value, "{builder}: {key}");
        }
        let roles = eval["roles"].as_object().unwrap();
        assert_eq!(roles.keys().map(String::as_str).collect::<Vec<_>>(), others);
        let of = |role: &str| roles[role]["return_mean"].as_f64().unwrap();
        let own = eval["return_mean"].as_f64().unwrap();
        let expected = if builder == "regret" { of("reference") - own } else { -own };
        assert!((of("builder") - expected).abs() < 1e-3 * (1.0 + expected.abs()), "{builder}: {eval}");
        let text = succeed(folder, &["eval", "run", "--episodes", "4"]);
        assert!(others.iter().all(|role| text.contains(&format!("  {role:<9} return "))), "{text}");

        succeed(folder, &RENDERED);
        assert!(folder.join("strip.png").metadata().unwrap().len() > 1000);
        // alone on a course without an adversary
        let alone = json(&succeed(folder, &["eval", "run", "--option", "course=bumps", "--episodes", "4", "--json"]));
        assert!(alone.get("roles").is_none(), "{alone}");
    }
}

#[test]
fn a_policy_that_is_missing_is_named() {
    let temp = tempfile::tempdir().unwrap();
    let folder = temp.path();
    train(folder, "inverse");
    std::fs::remove_file(folder.join("run/policy-builder.safetensors")).unwrap();
    for args in [&["eval", "run"][..], &RENDERED] {
        let error = fail(folder, 1, args);
        let wrong = ["policy-builder.safetensors", "no such file", "that of the role 'builder'"];
        assert!(wrong.iter().all(|part| error.contains(part)), "{error}");
    }
    assert!(!folder.join("strip.png").exists());
    assert_no_leftovers(folder);
}
