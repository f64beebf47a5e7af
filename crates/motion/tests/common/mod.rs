//! Helpers shared by the tests.

#![allow(dead_code)]

pub mod bvh;

use marathon_motion::{About, Clip, Cycle, Layout};
use marathon_physics::Model;
use serde_json::Value;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// A file of the repository.
pub fn file(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(name)
}

/// An agent's model.
pub fn model(name: &str) -> Model {
    Model::from_xml_file(file(&format!("assets/agents/{name}.xml"))).unwrap_or_else(|error| panic!("{error}"))
}

/// One of Marathon's clips, by character and name.
pub fn shipped(character: &str, name: &str) -> Clip {
    let path = file(&format!("assets/motions/{character}/{name}.motion"));
    let bytes = std::fs::read(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    Clip::parse(&path, &bytes).unwrap_or_else(|error| panic!("{error}"))
}

/// Names of all of Marathon's clips of a character.
pub fn all_shipped(character: &str) -> Vec<String> {
    let folder = file(&format!("assets/motions/{character}"));
    let mut names: Vec<String> = std::fs::read_dir(&folder)
        .expect("the folder can be read")
        .map(|entry| entry.expect("an entry").path())
        .filter(|path| path.extension().is_some_and(|ending| ending == "motion"))
        .map(|path| path.file_stem().expect("a name").to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

/// A smooth motion of a model with a free root, composed of sines. It turns, tumbles and moves all joints. Its period
/// is 1 s, after which it has traveled by the cycle.
pub fn waves(model: &Model, frames: usize, cycle: Cycle) -> Clip {
    let rows: Vec<Vec<f64>> = (0..frames).map(|i| wave(model, i as f64 / frames as f64, cycle)).collect();
    let about = About { name: "waves".into(), model: model.name.clone(), ..About::default() };
    Clip::new("waves".as_ref(), about, Layout::of(model), 1.0 / frames as f64, Some(cycle), &rows)
        .unwrap_or_else(|error| panic!("{error}"))
}

/// `qpos` of the motion of [`waves`] at a time from 0 to 1.
pub fn wave(model: &Model, time: f64, cycle: Cycle) -> Vec<f64> {
    let angle = std::f64::consts::TAU * time;
    let mut qpos = model.qpos0.clone();
    // tilts about a slanted axis, and turns by the cycle's yaw
    let tilt = 0.3 * angle.sin();
    let (w, x, y) = ((tilt / 2.0).cos(), 0.6 * (tilt / 2.0).sin(), 0.8 * (tilt / 2.0).sin());
    let (c, s) = ((cycle.yaw * time / 2.0).cos(), (cycle.yaw * time / 2.0).sin());
    let radius = if cycle.yaw.abs() > 1e-9 { cycle.pos[0] / (2.0 * (cycle.yaw / 2.0).sin()) } else { 0.0 };
    let around = cycle.yaw * time;
    if cycle.yaw.abs() > 1e-9 {
        // along a circle whose chord is the cycle's displacement
        let (a, b) = (cycle.yaw / 2.0, around - cycle.yaw / 2.0);
        qpos[0] = radius * (b.sin() + a.sin());
        qpos[1] = radius * (a.cos() - b.cos());
    } else {
        qpos[0] = cycle.pos[0] * time;
        qpos[1] = cycle.pos[1] * time;
    }
    qpos[2] += 0.1 * angle.cos();
    qpos[3..7].copy_from_slice(&[c * w, c * x - s * y, c * y + s * x, s * w]);
    for (k, joint) in model.joints.iter().enumerate().skip(1) {
        let middle = 0.5 * (joint.range[0] + joint.range[1]);
        let half = 0.3 * (joint.range[1] - joint.range[0]);
        qpos[joint.qpos_adr] = middle + half * (angle + k as f64).sin();
    }
    qpos
}

/// The Python that has MuJoCo.
fn python() -> PathBuf {
    if let Some(path) = std::env::var_os("MARATHON_PYTHON") {
        return path.into();
    }
    let path = file(".venv/bin/python");
    assert!(path.exists(), "no Python with MuJoCo at {}: run ./test.sh, which sets up .venv", path.display());
    path
}

/// Runs a script of `tests/oracle`.
pub fn oracle(script: &str, input: &Value) -> Value {
    let mut child = Command::new(python())
        .arg(file("tests/oracle").join(script))
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

/// Rows of an oracle's answer.
pub fn rows(value: &Value) -> Vec<Vec<f64>> {
    serde_json::from_value(value.clone()).expect("rows of numbers")
}
