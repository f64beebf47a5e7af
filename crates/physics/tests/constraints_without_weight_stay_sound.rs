//! Promise: constraints without inverse weight throw no body. One is a contact with a body that can only turn about its
//! own center. Another one is the limit of a string that no joint moves in the reference configuration.
//!
//! MuJoCo makes such constraints harder than double precision resolves. Here single precision has the accelerations and
//! velocities of double precision to 1e-2, in every lane width, and both stay near MuJoCo's next velocities.

use crate::common;
use crate::common::numbers::{distance, largest, numbers};
use marathon_physics::lanes::Real;
use marathon_physics::{Group, Isa, Model, Readings, Sim, SimOptions, Work, with_lanes};
use serde_json::{Value, json};

const MODELS: [(&str, &str); 5] = [
    (
        "a ball joint, pushed at off its center",
        r#"<geom pos=".1 .1 .139" size=".1"/><body><joint type="ball"/><geom size=".1"/></body>"#,
    ),
    (
        "two parallel hinges through the center",
        r#"<geom pos=".1 .1 .139" size=".1"/><body><joint axis="0 0 1" armature=".001"/><joint axis="0 0 1" armature=".001"/>
           <geom size=".1"/></body>"#,
    ),
    (
        "a box on an axle, deep in the floor",
        r#"<geom type="plane" size="1 1 1" pos="0 0 -.05"/><body><joint axis="0 1 0"/><geom type="box" size=".1 .2 .1"/></body>"#,
    ),
    (
        "spheres on upright axles, at the edge of a box and at each other",
        r#"<geom type="box" size="1 1 1"/><body pos="1.2 1.2 0"><joint/><geom size="1"/></body>
           <body pos="1.2 2.9 0"><joint/><geom size=".8"/></body>"#,
    ),
    (
        "a ball joint that is held and welded",
        r#"<body name="b"><joint type="ball" armature=".04"/><geom type="box" size=".05 .12 .11"/></body>"#,
    ),
];

/// Bodies that move in two parallel planes, and a string from one to the other. In the reference configuration, no joint
/// changes its length.
const STRING: &str = r#"<default><geom conaffinity="0" contype="1"/><joint armature="0.1"/></default><worldbody>
    <geom type="plane" size="9 9 1" conaffinity="1"/>
    <body pos="0 -1 0.5"><joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 0 1"/><joint axis="0 1 0"/>
      <geom type="capsule" size="0.1" fromto="-0.3 0 0 0.3 0 0"/><site name="a"/><body pos="0.3 0 0">
      <joint axis="0 1 0" range="-60 60"/><geom type="capsule" size="0.08" fromto="0 0 0 0.2 0 -0.4"/></body></body>
    <body pos="0 1 0.5"><joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 0 1"/><joint axis="0 1 0"/>
      <geom type="capsule" size="0.1" fromto="-0.3 0 0 0.3 0 0"/><site name="b"/><body pos="0.3 0 0">
      <joint axis="0 1 0" range="-60 60"/><geom type="capsule" size="0.08" fromto="0 0 0 0.2 0 -0.4"/></body></body>
    </worldbody><tendon><spatial name="s" range="0 2.2"><site site="a"/><site site="b"/></spatial></tendon>
    <sensor><tendonlimitfrc tendon="s"/></sensor>"#;
/// The same string with a fixed length.
const TIE: &str = r#"<option><flag limit="disable"/></option><equality><tendon tendon1="s"/></equality>"#;

/// Acceleration in a state, and velocity after a step.
struct Motion {
    qacc: Vec<f64>,
    next: Vec<f64>,
}

fn play<T: Real>(model: &Model, states: &[Value]) -> Vec<Motion> {
    let sim = Sim::<T>::new(model, SimOptions::default()).expect("it can be simulated");
    let mut work = Work::new(&sim);
    let mut out = Vec::new();
    for chunk in states.chunks(T::LANES) {
        let mut group = Group::new(&sim);
        for (i, s) in chunk.iter().enumerate() {
            group.reset_lane(&sim, i, &numbers(&s["qpos"]), &numbers(&s["qvel"]));
        }
        sim.forward(&mut work, &group);
        let r = Readings::new(&sim, &group, &work);
        let qacc: Vec<T> = (0..model.nv).map(|d| r.qacc(d)).collect();
        sim.step(&mut work, &mut group, 1);
        let lane = |v: &[T], i: usize| v.iter().map(|x| T::widen(x.get(i))).collect();
        out.extend((0..chunk.len()).map(|i| Motion { qacc: lane(&qacc, i), next: lane(&group.qvel, i) }));
    }
    out
}

#[test]
fn constraints_without_weight_stay_sound() {
    let folder = std::path::PathBuf::from(env!("CARGO_TARGET_TMPDIR"));
    let ties = r#"<equality><connect body1="b" anchor=".04 -.03 -.11"/><weld body1="b" anchor=".1 -.1 0"/></equality>"#;
    let jobs: Vec<Value> = MODELS
        .iter()
        .enumerate()
        .map(|(i, (_, body))| {
            let ties = if body.contains("name=\"b\"") { ties } else { "" };
            let path = folder.join(format!("weightless-{i}.xml"));
            std::fs::write(&path, format!("<mujoco><worldbody>{body}</worldbody>{ties}</mujoco>"))
                .expect("it is written");
            json!({"xml": path, "states": 40, "seed": i, "ground_only": false, "near_floor": false})
        })
        .collect();
    let answers = common::oracle("dynamics.py", &Value::Array(jobs.clone()));
    let mut failures = Vec::new();
    for (((name, _), job), answer) in MODELS.iter().zip(&jobs).zip(answers.as_array().expect("a list")) {
        let model = Model::from_xml_file(job["xml"].as_str().expect("a path")).unwrap_or_else(|e| panic!("{e}"));
        let states = answer["states"].as_array().expect("a list");
        let truth = play::<f64>(&model, states);
        let mut off: Vec<f64> =
            truth.iter().zip(states).map(|(m, s)| distance(&m.next, &numbers(&s["next_qvel"]), 1.0)).collect();
        off.sort_by(f64::total_cmp);
        println!(
            "{name}: next velocity off MuJoCo's by {:.0e}, at most {:.0e}",
            off[off.len() / 2],
            off[off.len() - 1]
        );
        if off[off.len() / 2] > 0.05 {
            failures.push(format!("{name}: the next velocity is off MuJoCo's by {}", off[off.len() / 2]));
        }
        for isa in Isa::ALL.into_iter().filter(|i| i.supported() && *i != Isa::F64) {
            let found = with_lanes!(isa, T => play::<T>(&model, states));
            let pairs = || found.iter().zip(&truth);
            let qacc = largest(pairs().map(|(a, b)| distance(&a.qacc, &b.qacc, 1.0)));
            let qvel = largest(pairs().map(|(a, b)| distance(&a.next, &b.next, 1.0)));
            println!("{name}, {}: acceleration {qacc:.0e}, velocity {qvel:.0e}", isa.name());
            if qacc > 1e-2 || qvel > 1e-2 {
                failures.push(format!("{name}, {}: acceleration {qacc:.1e}, velocity {qvel:.1e}", isa.name()));
            }
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

#[test]
fn strings_without_weight_move_as_in_mujoco() {
    for (name, more) in [("limit", ""), ("tie", TIE)] {
        let path = std::path::PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("weightless-{name}.xml"));
        std::fs::write(&path, format!("<mujoco>{STRING}{more}</mujoco>")).expect("it is written");
        let answer = common::oracle("foreign_models.py", &json!([{"xml": path, "states": 40, "seed": 1}]));
        let states = answer[0]["states"].as_array().expect("a list");
        let tight = states.iter().filter(|s| s["sensordata"][0].as_f64().is_some_and(|force| force > 1.0)).count();
        assert!(tight >= 10 || name == "tie", "the string pulls in {tight} states only");

        let mut model = Model::from_xml_file(&path).unwrap_or_else(|e| panic!("{e}"));
        assert!(model.tendons[0].invweight0 < 1e-15);
        // as in the oracle: the solver ends at rounding
        (model.opt.tolerance, model.opt.iterations) = (1e-14, 200);
        let sim = Sim::<f64>::new(&model, SimOptions::default()).expect("it can be simulated");
        let mut work = Work::new(&sim);
        let [mut acceleration, mut force] = [0.0f64; 2];
        for s in states {
            let mut group = Group::new(&sim);
            group.reset_lane(&sim, 0, &numbers(&s["qpos"]), &numbers(&s["qvel"]));
            sim.forward(&mut work, &group);
            let r = Readings::new(&sim, &group, &work);
            let qacc: Vec<f64> = (0..model.nv).map(|d| r.qacc(d)).collect();
            acceleration = acceleration.max(distance(&qacc, &numbers(&s["qacc"]), 1.0));
            force = force.max(distance(&r.constraint_forces(), &numbers(&s["qfrc_constraint"]), 1.0));
        }
        println!("{name}: accelerations {acceleration:.1e}, forces {force:.1e}");
        assert!(acceleration < 1e-8 && force < 1e-7, "{name}: accelerations {acceleration:.1e}, forces {force:.1e}");

        let truth = play::<f64>(&model, states);
        for isa in Isa::ALL.into_iter().filter(|i| i.supported() && *i != Isa::F64) {
            let found = with_lanes!(isa, T => play::<T>(&model, states));
            let off = largest(found.iter().zip(&truth).map(|(a, b)| distance(&a.qacc, &b.qacc, 1.0)));
            println!("{name}, {}: accelerations {off:.0e}", isa.name());
            assert!(off < 1e-3, "{name}, {}: accelerations {off:.1e}", isa.name());
        }
    }
}
