//! Cylinders, ellipsoids, capsules and boxes move as in MuJoCo.
//!
//! Each model is stepped for 200 steps under MuJoCo's defaults, in double precision on both sides, and the states are
//! compared every ten steps. The difference is relative to the distances and speeds that occur. Two answers within
//! MuJoCo's tolerance of 1e-6 m per contact differ by more than rounding, and rolling bodies amplify that. Upright
//! cylinders have quadrilaterals of contacts with equal areas, among which rounding chooses.

use crate::common;
use crate::common::numbers::largest;
use marathon_physics::lanes::Isa;
use marathon_physics::{Batch, BatchOptions, Model};
use serde_json::{Value, json};

const STEPS: usize = 200;

/// Models and the largest difference.
const CASES: &[(&str, f64)] = &[
    (
        r#"<mujoco model="a tower of cylinders"><worldbody><geom type="plane" size="2 2 1"/>
        <body pos="0 0 0.1"><freejoint/><geom type="cylinder" size="0.2 0.1"/></body>
        <body pos="0.03 0 0.301" euler="0 0.3 20"><freejoint/><geom type="cylinder" size="0.15 0.1"/></body>
        <body pos="0 0.02 0.502" euler="0.2 0 0"><freejoint/><geom type="cylinder" size="0.1 0.1"/></body>
        </worldbody></mujoco>"#,
        1e-2,
    ),
    (
        r#"<mujoco model="a cylinder on boxes"><worldbody>
        <geom type="box" size="0.3 0.1 0.1" pos="0 -0.2 0" euler="3 0 0"/><geom type="box" size="0.3 0.1 0.1" pos="0 0.2 0"/>
        <body pos="0 0 0.19" euler="88 0 0"><freejoint/><geom type="cylinder" size="0.08 0.3"/></body>
        <body pos="0.01 0.02 0.41" euler="1 2 10"><freejoint/><geom type="box" size="0.12 0.1 0.1"/></body>
        </worldbody></mujoco>"#,
        1e-9,
    ),
    (
        r#"<mujoco model="ellipsoids in a trough"><worldbody>
        <geom type="box" size="0.5 0.3 0.02" pos="0 -0.2 0.1" euler="-35 0 0"/>
        <geom type="box" size="0.5 0.3 0.02" pos="0 0.2 0.1" euler="35 0 0"/>
        <body pos="0 0.02 0.25" euler="10 20 30"><freejoint/><geom type="ellipsoid" size="0.15 0.1 0.08"/></body>
        <body pos="0.02 -0.02 0.5" euler="40 0 10"><freejoint/><geom type="ellipsoid" size="0.1 0.12 0.07"/></body>
        </worldbody></mujoco>"#,
        1e-8,
    ),
    (
        r#"<mujoco model="a capsule across cylinders"><worldbody>
        <geom type="cylinder" size="0.1 0.3" euler="90 0 0" pos="-0.25 0 0"/>
        <geom type="cylinder" size="0.1 0.3" euler="90 0 0" pos="0.25 0 0"/>
        <body pos="0 0.05 0.16" euler="0 90 5"><freejoint/><geom type="capsule" size="0.05 0.35"/></body>
        <body pos="0.05 0.03 0.31"><freejoint/><geom type="ellipsoid" size="0.1 0.1 0.05"/></body>
        </worldbody></mujoco>"#,
        1e-4,
    ),
    (
        r#"<mujoco model="one contact per pair"><option><flag multiccd="disable"/></option><worldbody>
        <geom type="cylinder" size="0.3 0.1"/>
        <body pos="0.02 0.01 0.21" euler="4 3 0"><freejoint/><geom type="cylinder" size="0.1 0.1" margin="0.005"/></body>
        </worldbody></mujoco>"#,
        1e-2,
    ),
    (
        r#"<mujoco model="closed forms beside libccd"><option><flag nativeccd="disable"/></option><worldbody>
        <geom type="plane" size="2 2 1"/><geom type="cylinder" size="0.1 0.2" pos="-0.3 0 0" contype="2" conaffinity="0"/>
        <body pos="0 0 0.12" euler="5 0 0"><freejoint/><geom type="box" size="0.2 0.2 0.1"/></body>
        <body pos="0.05 0.02 0.34" euler="0 3 20"><freejoint/><geom type="box" size="0.1 0.1 0.1"/></body>
        <body pos="-0.32 0.02 0.3"><freejoint/><geom size="0.08" conaffinity="3"/></body></worldbody></mujoco>"#,
        1e-8,
    ),
    (
        r#"<mujoco model="cylinders and ellipsoids on hills"><asset>
        <hfield name="h" nrow="4" ncol="4" size="1 1 0.2 0.1" elevation="0 1 0 1 1 0 1 0 0 1 1 0 1 0 0 1"/></asset><worldbody>
        <geom type="hfield" hfield="h"/>
        <body pos="0.1 0.1 0.3" euler="30 60 0"><freejoint/><geom type="cylinder" size="0.1 0.08"/></body>
        <body pos="-0.4 -0.3 0.35"><freejoint/><geom type="ellipsoid" size="0.15 0.1 0.08"/></body>
        </worldbody></mujoco>"#,
        1e-8,
    ),
];

#[test]
fn convex_shapes_move_as_in_mujoco() {
    let jobs: Vec<Value> = CASES.iter().map(|(text, _)| json!({ "text": text, "steps": STEPS })).collect();
    let answers = common::oracle("trajectories.py", &json!(jobs));
    let mut failures = Vec::new();
    for ((text, bound), answer) in CASES.iter().zip(answers.as_array().expect("an answer per model")) {
        let model = Model::from_xml_str(text, "case.xml").unwrap_or_else(|e| panic!("{e}"));
        let mut batch =
            Batch::new(&model, &BatchOptions { isa: Isa::F64, ..BatchOptions::default() }).expect("supported");
        batch.reset(0, &model.qpos0, &vec![0.0; model.nv]);
        let mut worst = Vec::new();
        for at in 0..STEPS / 10 {
            batch.step(&[], 10);
            let mut now = 0.0f64;
            for (ours, name) in [(batch.qpos(0), "qpos"), (batch.qvel(0), "qvel")] {
                let list = answer[name][at].as_array().expect("numbers");
                let theirs = list.iter().map(|x| x.as_f64().expect("a number"));
                now = now.max(largest(ours.iter().zip(theirs).map(|(a, b)| (a - b).abs() / (1.0 + b.abs()))));
            }
            worst.push(now);
        }
        let last = worst.iter().copied().fold(0.0, f64::max);
        println!("{}: {last:.1e} ({:.0e} after 50 steps, {:.0e} after 100)", model.name, worst[4], worst[9]);
        if !(last < *bound) {
            failures.push(format!("{}: {last:.1e}", model.name));
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}
