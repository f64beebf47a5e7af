//! Helpers shared by the tests.

pub mod bvh;
#[path = "../../../physics/tests/common/oracle.rs"]
mod oracle;

use marathon_motion::{About, Clip, Cycle, Layout};
use marathon_physics::Model;
#[allow(unused_imports, reason = "every test file uses a part")]
pub use oracle::oracle;
use serde_json::Value;
use std::path::PathBuf;

/// A file of the repository.
pub fn file(name: &str) -> PathBuf {
    oracle::workspace().join(name)
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

/// Rows of an oracle's answer.
pub fn rows(value: &Value) -> Vec<Vec<f64>> {
    serde_json::from_value(value.clone()).expect("rows of numbers")
}
