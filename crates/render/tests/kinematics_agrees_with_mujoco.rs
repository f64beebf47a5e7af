//! Geoms have MuJoCo's poses, at random configurations of Marathon's models and others.

use crate::common;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use marathon_physics::Model;
use marathon_render::{Pose, RenderError, Scene};
use serde_json::{Value, json};

fn workspace() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn python() -> PathBuf {
    if let Some(path) = std::env::var_os("MARATHON_PYTHON") {
        return path.into();
    }
    let path = workspace().join(".venv/bin/python");
    assert!(path.exists(), "no Python with MuJoCo at {}: run ./test.sh, which sets up .venv", path.display());
    path
}

/// Runs `tests/oracle/poses.py`.
fn oracle(input: &Value) -> Value {
    let mut child = Command::new(python())
        .arg(workspace().join("tests/oracle/poses.py"))
        // MuJoCo writes a log of its warnings to the working directory
        .current_dir(std::env::temp_dir())
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("Python starts");
    child.stdin.take().expect("piped").write_all(input.to_string().as_bytes()).expect("the oracle reads its input");
    let output = child.wait_with_output().expect("the oracle ends");
    assert!(output.status.success(), "the oracle failed: run ./test.sh, which sets up its packages");
    serde_json::from_slice(&output.stdout).expect("the oracle prints JSON")
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().expect("a list").iter().map(|x| x.as_f64().expect("a number")).collect()
}

fn difference(a: impl IntoIterator<Item = f64>, b: &[f64]) -> f64 {
    a.into_iter()
        .zip(b)
        .map(|(a, b)| (a - b).abs())
        .fold(0.0, |worst, x| if x.is_nan() { f64::INFINITY } else { x.max(worst) })
}

#[test]
fn geoms_are_where_mujoco_puts_them() {
    let here =
        ["hopper", "walker2d", "humanoid", "ant"].map(|name| workspace().join(format!("assets/agents/{name}.xml")));
    let files: Vec<_> = here.into_iter().chain([common::file("models/joints.xml")]).collect();
    let packaged = ["humanoid", "hopper", "walker", "cheetah", "acrobot"].map(|name| format!("suite/{name}.xml"));
    let answer = oracle(&json!({ "files": files, "dm_control": packaged, "count": 12, "seed": 5 }));

    let answers = answer["models"].as_array().expect("a list of models");
    assert_eq!(answers.len(), 10);
    for answer in answers {
        let path = answer["path"].as_str().expect("a path");
        let model = Model::from_xml_file(path).unwrap_or_else(|error| panic!("{error}"));
        let mut worst = 0.0_f64;
        for sample in answer["samples"].as_array().expect("a list of samples") {
            let pose: Pose = Scene::pose_from_qpos(&model, &numbers(&sample["qpos"])).unwrap();
            assert_eq!(3 * pose.geoms.len(), numbers(&sample["geom_xpos"]).len(), "{path}");
            let pos = pose.geoms.iter().flat_map(|geom| geom.pos);
            let mat = pose.geoms.iter().flat_map(|geom| geom.mat.into_iter().flatten());
            worst = worst
                .max(difference(pos, &numbers(&sample["geom_xpos"])))
                .max(difference(mat, &numbers(&sample["geom_xmat"])))
                .max(difference(pose.com, &numbers(&sample["com"])))
                .max(difference(pose.root, &numbers(&sample["root"])));
        }
        assert!(worst < 1e-12, "{path}: off by {worst:e}");
    }
}

#[test]
fn a_wrong_qpos_is_named() {
    let model = common::model("joints.xml");
    let scene = Scene::new(&model);
    let short = vec![0.0; 3];
    let error = scene.frame(&[&model.qpos0, &short]).unwrap_err();
    let expected = format!("agent 1: qpos has 3 values, expected {} for model 'joints'", model.nq);
    assert_eq!(error.to_string(), expected);

    let mut wild = model.qpos0.clone();
    wild[2] = f64::NAN;
    let error = scene.frame(&[&wild]).unwrap_err();
    assert!(matches!(error, RenderError::NotFinite { agent: 0, index: 2, .. }), "{error}");
}

#[test]
fn a_row_stands_side_by_side() {
    let model = common::model("shapes.xml");
    let scene = Scene::new(&model).with_spacing(1.5);
    let frame = scene.frame(&[&model.qpos0, &model.qpos0, &model.qpos0]).unwrap();
    for (i, agent) in frame.agents().iter().enumerate() {
        let first = frame.agents()[0];
        let want = [first.com[0], first.com[1] + 1.5 * i as f64, first.com[2]];
        assert!(difference(agent.com, &want) < 1e-12, "agent {i}: {:?}", agent.com);
    }
}
