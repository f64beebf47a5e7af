//! In every frame of the shipped clips, bodies have the poses of MuJoCo's `mj_kinematics`, and velocities equal those
//! of `mj_differentiatePos`.

use crate::common::{all_shipped, file, model, oracle, rows, shipped};
use glam::{DQuat, DVec3};
use marathon_motion::kinematics::Pose;
use serde_json::json;

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
            let answer = oracle("motion.py", &json!({ "model": path, "dt": clip.dt(), "frames": frames }));

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
                    // MuJoCo's angular velocity is in the body's axes before the step, ours in those of the frame
                    // itself
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
