//! Bodies are where MuJoCo's `mj_kinematics` puts them in every frame of the shipped clips, and velocities are those of
//! `mj_differentiatePos`.

mod common;

use common::{all_shipped, file, model, shipped};
use glam::{DQuat, DVec3};
use marathon_motion::kinematics::Pose;
use serde_json::{Value, json};
use std::io::Write;
use std::path::PathBuf;
use std::process::{Command, Stdio};

fn python() -> PathBuf {
    if let Some(path) = std::env::var_os("MARATHON_PYTHON") {
        return path.into();
    }
    let path = file(".venv/bin/python");
    assert!(path.exists(), "no Python with MuJoCo at {}: run ./test.sh, which sets up .venv", path.display());
    path
}

/// Runs `tests/oracle/motion.py`.
fn oracle(input: &Value) -> Value {
    let mut child = Command::new(python())
        .arg(file("tests/oracle/motion.py"))
        // MuJoCo leaves a log of its warnings where it runs
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

fn rows(value: &Value) -> Vec<Vec<f64>> {
    serde_json::from_value(value.clone()).expect("rows of numbers")
}

#[test]
fn kinematics_and_velocities_are_mujocos() {
    for (character, xml) in [("marathon_man", "marathon_man"), ("humanoid", "humanoid"), ("walker2d", "walker2d")] {
        let model = model(xml);
        let free = model.nq > model.nv;
        for name in all_shipped(character) {
            let clip = shipped(character, &name);
            let mut frames: Vec<Vec<f64>> = (0..clip.frames()).map(|i| clip.frame(i).to_vec()).collect();
            if free {
                // files have six digits, and mj_differentiatePos does not normalize
                for frame in &mut frames {
                    let length = frame[3..7].iter().map(|x| x * x).sum::<f64>().sqrt();
                    frame[3..7].iter_mut().for_each(|x| *x /= length);
                }
            }
            let path = file(&format!("assets/agents/{xml}.xml"));
            let answer = oracle(&json!({ "model": path, "dt": clip.dt(), "frames": frames }));

            for (i, (xpos, xquat)) in rows(&answer["xpos"]).iter().zip(rows(&answer["xquat"])).enumerate() {
                let pose = Pose::of(&model, clip.frame(i));
                for (body, (pos, quat)) in pose.pos.iter().zip(&pose.quat).enumerate() {
                    let off = (*pos - DVec3::from_slice(&xpos[3 * body..])).length();
                    let theirs = &xquat[4 * body..];
                    let theirs = DQuat::from_xyzw(theirs[1], theirs[2], theirs[3], theirs[0]);
                    let turned = 1.0 - quat.dot(theirs).abs();
                    assert!(off < 1e-12 && turned < 1e-12, "{name}, frame {i}, body {body}: {off:e} m, {turned:e}");
                }
            }
            for (i, mut theirs) in (1..).zip(rows(&answer["qvel"])) {
                if free {
                    // MuJoCo's angular velocity is in the body's axes before the step, ours in those of the frame itself
                    let turn = |i: usize| {
                        let q = clip.frame(i);
                        DQuat::from_xyzw(q[4], q[5], q[6], q[3]).normalize()
                    };
                    let world = turn(i - 1) * DVec3::from_slice(&theirs[3..]);
                    theirs[3..6].copy_from_slice(&(turn(i).conjugate() * world).to_array());
                }
                for (dof, (ours, theirs)) in clip.velocity(i).iter().zip(&theirs).enumerate() {
                    assert!((ours - theirs).abs() < 1e-9, "{name}, frame {i}, dof {dof}: {ours}, MuJoCo {theirs}");
                }
            }
        }
    }
}
