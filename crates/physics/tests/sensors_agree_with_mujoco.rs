//! Contract: sensors have MuJoCo's values.
//!
//! The models have every supported kind of sensor. Their states are random, with bodies that touch the ground and each
//! other. Double precision agrees to 1e-8 of the sensor's size. Single precision agrees in every lane width to the
//! rounding of its arithmetic.

use crate::common;
use crate::common::numbers::{largest, numbers};
use marathon_physics::lanes::Real;
use marathon_physics::model::{Cone, SensorType};
use marathon_physics::{Group, Isa, Model, Readings, Sim, SimOptions, Work, with_lanes};
use serde_json::{Value, json};
use std::path::PathBuf;

/// States per model.
const STATES: usize = 300;

fn models() -> Vec<PathBuf> {
    let folder = common::workspace().join("crates/physics/tests/models/sensors");
    let mut found: Vec<_> =
        std::fs::read_dir(folder).expect("the folder exists").map(|e| e.expect("readable").path()).collect();
    found.sort();
    found
}

/// Random states of the models, with MuJoCo's sensor values.
fn oracle(paths: &[PathBuf]) -> Value {
    let job = |(i, path): (usize, &PathBuf)| {
        let mut job = json!({"xml": path, "states": STATES, "seed": i, "ground_only": false, "pushes": true});
        // bodies near each other touch, but range finders see more from afar
        if !path.ends_with("rays.xml") {
            job["spread"] = json!(0.4);
        }
        job
    };
    common::oracle("dynamics.py", &Value::Array(paths.iter().enumerate().map(job).collect()))
}

/// The scale for a sensor's error. It is the sensor's own size, or, for forces without `exact`, the largest size of all
/// sensors, because forces are differences of others.
fn scale(kind: SensorType, exact: bool, wanted: &[f64], data: &[f64]) -> f64 {
    use SensorType as S;
    let size = |v: &[f64]| v.iter().fold(1.0, |a: f64, x| a.max(x.abs()));
    let force = [S::Touch, S::Force, S::Torque, S::Contact, S::JointLimitFrc, S::TendonLimitFrc].contains(&kind);
    size(if force && !exact { data } else { wanted })
}

/// Per sensor: errors over all states.
fn compare<T: Real>(model: &Model, states: &[Value]) -> Vec<Vec<f64>> {
    let mut model = model.clone();
    // double precision is solved to convergence; single precision keeps the model's own tolerance
    let double = T::scalar(1.0 + 1e-12) != T::scalar(1.0);
    if double {
        model.opt.tolerance = 1e-14;
        model.opt.ls_iterations = 100;
    }
    let exact = double && model.opt.cone == Cone::Pyramidal;
    let sim = Sim::<T>::new(&model, SimOptions::default()).unwrap_or_else(|e| panic!("{e}"));
    let mut work = Work::new(&sim);
    let mut errors = vec![Vec::new(); model.sensors.len()];
    for chunk in states.chunks(T::LANES) {
        let mut group = Group::new(&sim);
        for (i, s) in chunk.iter().enumerate() {
            group.reset_lane(&sim, i, &numbers(&s["qpos"]), &numbers(&s["qvel"]));
            for (u, x) in group.ctrl.iter_mut().zip(numbers(&s["ctrl"])) {
                u.set(i, T::scalar(x));
            }
            for (a, x) in group.act.iter_mut().zip(numbers(&s["act"])) {
                a.set(i, T::scalar(x));
            }
            for (body, x) in numbers(&s["xfrc"]).chunks(6).enumerate() {
                group.push(&sim, i, body, [x[0], x[1], x[2]], [x[3], x[4], x[5]]);
            }
        }
        sim.forward(&mut work, &group);
        let r = Readings::new(&sim, &group, &work);
        for (k, sensor) in model.sensors.iter().enumerate() {
            let got = r.sensor(k).unwrap_or_else(|| panic!("sensor {k} ({}) is evaluated", sensor.element));
            assert_eq!(got.len(), sensor.dim, "values of sensor {k} ({})", sensor.element);
            for (i, s) in chunk.iter().enumerate() {
                let data = numbers(&s["sensordata"]);
                let want = &data[sensor.adr..sensor.adr + sensor.dim];
                let scale = scale(sensor.kind, exact, want, &data);
                let worst = got.iter().zip(want).map(|(a, b)| (T::widen(a.get(i)) - b).abs() / scale);
                errors[k].push(largest(worst));
            }
        }
    }
    errors
}

/// The value below which a fraction of the numbers lies. NaN is the largest of all.
fn quantile(v: &[f64], share: f64) -> f64 {
    let mut v = v.to_vec();
    v.sort_by(f64::total_cmp);
    v[((v.len() - 1) as f64 * share) as usize]
}

#[test]
fn sensors_agree_with_mujoco() {
    let paths = models();
    assert!(paths.len() >= 5, "the models are there");
    let answers = oracle(&paths);
    let mut failures = Vec::new();
    for (path, answer) in paths.iter().zip(answers.as_array().expect("a list")) {
        let model = Model::from_xml_file(path).unwrap_or_else(|e| panic!("{e}"));
        let states = answer["states"].as_array().expect("a list");
        for isa in Isa::ALL.into_iter().filter(|i| i.supported()) {
            let errors = with_lanes!(isa, T => compare::<T>(&model, states));
            for (k, (sensor, errors)) in model.sensors.iter().zip(&errors).enumerate() {
                let (median, most, all) = (quantile(errors, 0.5), quantile(errors, 0.98), quantile(errors, 1.0));
                let name = format!("{} sensor {k} {} {:?}", isa.name(), sensor.element, sensor.object);
                println!("{:12} {name:60} {median:.0e} {most:.0e} {all:.0e}", model.name);
                // on the curved part of an elliptic cone both solvers stop at a tolerance
                // every state counts in double precision; a ray may pass an edge on the other side in single precision
                let bar = if model.opt.cone == Cone::Elliptic { 1e-7 } else { 1e-8 };
                let ok = if isa == Isa::F64 { all < bar } else { median < 2e-6 && most < 1e-3 };
                if !ok {
                    failures.push(format!("{}: {name}: {median:.0e} {most:.0e} {all:.0e}", path.display()));
                }
            }
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

/// Sensors of these models measure something: a value that is 0 in all states proves nothing.
#[test]
fn random_states_excite_the_sensors() {
    let paths = models();
    let answers = oracle(&paths);
    for (path, answer) in paths.iter().zip(answers.as_array().expect("a list")) {
        let model = Model::from_xml_file(path).unwrap_or_else(|e| panic!("{e}"));
        let states = answer["states"].as_array().expect("a list");
        for (k, sensor) in model.sensors.iter().enumerate() {
            let seen = |s: &Value| numbers(&s["sensordata"])[sensor.adr..][..sensor.dim].iter().any(|x| *x != 0.0);
            let excited = states.iter().any(seen);
            assert!(excited, "{}: sensor {k} ({}) is 0 in every state", path.display(), sensor.element);
        }
    }
}

/// A range finder measures the ground of its own agent, as in a model with those elevations.
#[test]
fn range_finders_see_the_agents_own_ground() {
    let path = common::workspace().join("crates/physics/tests/models/sensors/rays.xml");
    let model = Model::from_xml_file(&path).unwrap_or_else(|e| panic!("{e}"));
    let mut other = model.clone();
    let top = other.hfields[0].size[2];
    other.hfields[0].data.iter_mut().rev().enumerate().for_each(|(i, x)| *x = (i % 3) as f32 / 2.0);
    let elevations: Vec<f32> = other.hfields[0].data.iter().map(|x| (f64::from(*x) * top) as f32).collect();

    let read = |model: &Model, ground: Option<&[f32]>| {
        let sim = Sim::<f64>::new(model, SimOptions::default()).unwrap_or_else(|e| panic!("{e}"));
        let (mut work, mut group) = (Work::new(&sim), Group::new(&sim));
        if let Some(ground) = ground {
            group.set_ground(&sim, 0, 0, ground);
        }
        let mut seen = Vec::new();
        for turn in 0..12 {
            let mut qpos = model.qpos0.clone();
            let (s, c) = (0.25 * f64::from(turn)).sin_cos();
            qpos[3..7].copy_from_slice(&[c, 0.8 * s, 0.6 * s, 0.0]);
            group.reset_lane(&sim, 0, &qpos, &vec![0.0; model.nv]);
            sim.forward(&mut work, &group);
            let r = Readings::new(&sim, &group, &work);
            seen.extend((0..model.sensors.len()).flat_map(|k| r.sensor(k).expect("it is evaluated")));
        }
        seen
    };
    let (shared, own, wanted) = (read(&model, None), read(&model, Some(&elevations)), read(&other, None));
    assert!(shared != wanted, "some ray meets the field");
    assert!(own == wanted, "the agent's rays meet its own ground");
}
