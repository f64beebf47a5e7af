//! Models in special cases move as in MuJoCo.
//!
//! Each model is stepped from its reference configuration under its own settings, in double precision on both sides.
//! The states are compared every ten steps.

use crate::common;
use crate::common::numbers::largest;
use marathon_physics::lanes::Isa;
use marathon_physics::{Batch, BatchOptions, Model};
use serde_json::{Value, json};

/// A model, its initial velocities (zeros if there are none), and the number of steps.
const CASES: &[(&str, &[f64], usize)] = &[
    // the centers of two shapes coincide at the pivot: the normal is perpendicular to both z axes
    (
        r#"<mujoco model="coincident spheres"><worldbody>
        <geom type="sphere" size="0.07" pos="0 0 2"/>
        <body pos="0 0 2" euler="0 -80 0"><joint type="hinge" axis="0 1 0"/>
          <geom type="sphere" size="0.05"/><geom type="sphere" size="0.05" pos="0 0 -0.5"/></body>
        </worldbody></mujoco>"#,
        &[],
        100,
    ),
    (
        r#"<mujoco model="a ball at the pivot of a capsule"><worldbody>
        <geom type="sphere" size="0.07" pos="0 0 2"/>
        <body pos="0 0 2" euler="0 -80 0"><joint type="hinge" axis="0 1 0"/>
          <geom type="capsule" size="0.05 0.5" pos="0 0 -0.5"/></body>
        </worldbody></mujoco>"#,
        &[],
        100,
    ),
    (
        r#"<mujoco model="a ball on the axis of a cylinder"><worldbody>
        <geom type="sphere" size="0.07" pos="0 0 2"/>
        <body pos="0 0 2" euler="0 -80 0"><joint type="hinge" axis="0 1 0"/>
          <geom type="cylinder" size="0.05 0.5" pos="0 0 -0.25"/></body>
        </worldbody></mujoco>"#,
        &[],
        100,
    ),
    // a slider at its limit, on a static body that is not a child of the world
    (
        r#"<mujoco model="a slider three bodies deep"><worldbody><body><body><body>
        <joint type="slide" axis="0 0 1" armature="0.01" limited="true" range="-0.1 0.1"/>
        <inertial pos="0 0 0" mass="0.01" diaginertia="0.001 0.001 0.001"/>
        </body></body></body></worldbody></mujoco>"#,
        &[-1.0],
        200,
    ),
    // a largest angle of zero
    (
        r#"<mujoco model="a ball joint limited by its class"><default><joint limited="true"/></default><worldbody><body>
        <joint type="ball"/><geom size="0.1" pos="0.3 0 0"/>
        <body pos="0.3 0 0"><joint range="-30 30" axis="0 1 0"/><geom size="0.05" pos="0.2 0 0"/></body>
        </body></worldbody></mujoco>"#,
        &[0.3, -0.2, 0.1, 1.0],
        200,
    ),
    (
        r#"<mujoco model="a servo as MuJoCo saves it"><worldbody><body>
        <joint name="hinge" axis="0 1 0" armature="0.01"/><geom size="0.1" pos="0.3 0 0"/>
        </body></worldbody><actuator>
        <general joint="hinge" gainprm="20" biastype="affine" biasprm="0 -20" input="pos"/>
        <general joint="hinge" gainprm="2" biastype="affine" biasprm="0 0 -2" input="vel"/>
        </actuator></mujoco>"#,
        &[2.0],
        200,
    ),
    // frames less than a millionth apart are the same: spun this fast or held this stiffly, the difference would show
    (
        r#"<mujoco model="an almost centered top"><option integrator="RK4"/><worldbody><body><freejoint/>
        <inertial pos="9e-7 0 0" quat="1 9e-7 0 0" mass="1" diaginertia="1 2 2"/></body></worldbody></mujoco>"#,
        &[0.0, 0.0, 0.0, 0.0, 0.0, 1000.0],
        10,
    ),
    (
        r#"<mujoco model="an almost centered ball"><option timestep="0.0001"/><worldbody>
        <geom type="plane" size="1 1 1" pos="0 0 -0.1"/><body><joint type="slide" axis="0 0 1"/>
        <geom size="0.1" pos="0 0 9e-7" solref="-1000000 -1"/></body></worldbody></mujoco>"#,
        &[0.0],
        100,
    ),
    (
        r#"<mujoco model="a ball almost in its center of mass"><option timestep="0.0001"/><worldbody>
        <geom type="plane" size="1 1 1" pos="0 0 0.1"/><body><joint type="slide" axis="0 0 1"/>
        <inertial pos="0 0 0.2" quat="1 1 0 0" mass="1" diaginertia="1 1 1"/>
        <geom size="0.1" pos="0 0 0.2000009" quat="1 1 0 0" solref="-1000000 -1"/></body></worldbody></mujoco>"#,
        &[0.0],
        100,
    ),
    // each declaration is a contact of its own
    (
        r#"<mujoco model="pairs that are declared twice"><worldbody>
        <geom name="floor" type="plane" size="1 1 1"/><geom name="wall" type="box" size="0.1 1 1" pos="0.22 0 0"/>
        <body pos="0 0 0.12"><freejoint/><geom name="ball" size="0.1"/></body></worldbody>
        <contact><pair geom1="ball" geom2="floor"/><pair geom1="floor" geom2="ball" condim="1" solref="0.01 1"/>
        <pair geom1="wall" geom2="ball"/><pair geom1="ball" geom2="wall"/></contact></mujoco>"#,
        &[0.5, 0.2, 0.0, 0.0, 0.0, 0.0],
        200,
    ),
    // no element uses the muscle, and the motor keeps its class's range
    (
        r#"<mujoco model="an unused muscle"><default><muscle ctrlrange="0 1" force="5" gear="3"/></default><worldbody><body>
        <joint name="hinge" axis="0 1 0" armature="0.01"/><geom size="0.1" pos="0.3 0 0"/>
        </body></worldbody><actuator><motor joint="hinge"/></actuator></mujoco>"#,
        &[2.0],
        100,
    ),
];

#[test]
fn special_cases_move_as_in_mujoco() {
    let jobs: Vec<Value> =
        CASES.iter().map(|(text, qvel, steps)| json!({ "text": text, "qvel": qvel, "steps": steps })).collect();
    let answers = common::oracle("trajectories.py", &json!(jobs));
    let mut failures = Vec::new();
    for ((text, qvel, steps), answer) in CASES.iter().zip(answers.as_array().expect("an answer per model")) {
        let model = Model::from_xml_str(text, "case.xml").unwrap_or_else(|e| panic!("{e}"));
        let options = BatchOptions { isa: Isa::F64, ..BatchOptions::default() };
        let mut batch = Batch::new(&model, &options).expect("it is simulated");
        let start = if qvel.is_empty() { vec![0.0; model.nv] } else { qvel.to_vec() };
        batch.reset(0, &model.qpos0, &start);
        let mut worst = 0.0f64;
        for at in 0..steps / 10 {
            batch.step(&vec![0.0; model.nu], 10);
            for (ours, name) in [(batch.qpos(0), "qpos"), (batch.qvel(0), "qvel")] {
                let theirs =
                    answer[name][at].as_array().expect("numbers").iter().map(|x| x.as_f64().expect("a number"));
                worst = worst.max(largest(ours.iter().zip(theirs).map(|(a, b)| (a - b).abs() / (1.0 + b.abs()))));
            }
        }
        println!("{}: {worst:.1e}", model.name);
        if !(worst < 1e-6) {
            failures.push(format!("{}: {worst:.1e}", model.name));
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}
