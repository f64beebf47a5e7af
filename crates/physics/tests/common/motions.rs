//! Motions of small models beside MuJoCo's.

use crate::common::numbers::{distance, largest, numbers};
use marathon_physics::lanes::Real;
use marathon_physics::{Group, Isa, MeasurePlan, Model, Readings, Sim, SimOptions, Work, with_lanes};
use serde_json::{Value, json};

/// A case: the model without its outer element, initial velocities, controls and the number of steps.
pub struct Case {
    pub name: &'static str,
    pub text: &'static str,
    pub qvel: &'static [f64],
    pub ctrl: &'static [f64],
    pub steps: usize,
}

/// A case that starts at rest.
pub const fn case(name: &'static str, text: &'static str) -> Case {
    Case { name, text, qvel: &[], ctrl: &[], steps: 300 }
}

fn xml(case: &Case) -> String {
    let name = case.name;
    // sections come in any order
    format!(r#"<mujoco model="{name}">{}</mujoco>"#, case.text)
}

/// A state of MuJoCo's motion.
#[derive(Clone)]
struct State {
    qpos: Vec<f64>,
    qvel: Vec<f64>,
    act: Vec<f64>,
}

/// Errors of the states, the sensors, and the accelerations and actuator forces of a motion.
fn follow(model: &Model, case: &Case, answer: &Value) -> [f64; 3] {
    let sim = Sim::<f64>::new(model, SimOptions::default()).unwrap_or_else(|e| panic!("{}: {e}", case.name));
    let (mut work, mut group, mut look) = (Work::new(&sim), Group::new(&sim), Work::new(&sim));
    let start = if case.qvel.is_empty() { vec![0.0; model.nv] } else { case.qvel.to_vec() };
    group.reset_lane(&sim, 0, &model.qpos0, &start);
    group.ctrl.copy_from_slice(case.ctrl);
    let plan = MeasurePlan { actuators: true, ..Default::default() };
    let mut worst = [0.0f64; 3];
    for at in 0..case.steps / 10 {
        sim.step(&mut work, &mut group, 10);
        let apart = |ours: &[f64], theirs: &Value| {
            largest(ours.iter().zip(numbers(theirs)).map(|(a, b)| (a - b).abs() / (1.0 + b.abs())))
        };
        worst[0] = worst[0].max(apart(&group.qpos, &answer["qpos"][at]));
        worst[0] = worst[0].max(apart(&group.qvel, &answer["qvel"][at]));
        worst[0] = worst[0].max(apart(&group.act, &answer["act"][at]));
        sim.forward(&mut look, &group);
        sim.measure(&mut look, &group, &plan);
        let readings = Readings::new(&sim, &group, &look);
        let sensors = (0..model.sensors.len()).flat_map(|k| readings.sensor(k).expect("it is evaluated"));
        worst[1] = worst[1].max(apart(&sensors.collect::<Vec<_>>(), &answer["sensordata"][at]));
        let of_dofs = |read: &dyn Fn(usize) -> f64| (0..model.nv).map(read).collect::<Vec<f64>>();
        worst[2] = worst[2].max(apart(&of_dofs(&|d| readings.qacc(d)), &answer["qacc"][at]));
        worst[2] = worst[2].max(apart(&of_dofs(&|d| readings.qfrc_actuator(d)), &answer["qfrc_actuator"][at]));
    }
    worst
}

/// Accelerations in given states, lane by lane.
fn accelerations<T: Real>(model: &Model, ctrl: &[f64], states: &[State]) -> Vec<Vec<f64>> {
    let sim = Sim::<T>::new(model, SimOptions::default()).expect("as in double precision");
    let mut work = Work::new(&sim);
    let mut out = Vec::new();
    for chunk in states.chunks(T::LANES) {
        let mut group = Group::new(&sim);
        for (lane, state) in chunk.iter().enumerate() {
            group.reset_lane(&sim, lane, &state.qpos, &state.qvel);
            for (a, x) in group.act.iter_mut().zip(&state.act) {
                a.set(lane, T::scalar(*x));
            }
        }
        for (u, x) in group.ctrl.iter_mut().zip(ctrl) {
            *u = T::lit(*x);
        }
        sim.forward(&mut work, &group);
        let readings = Readings::new(&sim, &group, &work);
        for lane in 0..chunk.len() {
            out.push((0..model.nv).map(|d| T::widen(readings.qacc(d).get(lane))).collect());
        }
    }
    out
}

/// Compares motions with MuJoCo's in double precision, and accelerations in MuJoCo's states on all lane types.
pub fn compare(cases: &[Case]) {
    let jobs: Vec<Value> =
        cases.iter().map(|c| json!({ "text": xml(c), "qvel": c.qvel, "ctrl": c.ctrl, "steps": c.steps })).collect();
    let answers = crate::common::oracle("trajectories.py", &json!(jobs));
    let mut failures = Vec::new();
    for (case, answer) in cases.iter().zip(answers.as_array().expect("an answer per model")) {
        let model = Model::from_xml_str(&xml(case), "case.xml").unwrap_or_else(|e| panic!("{}: {e}", case.name));
        let worst = follow(&model, case, answer);
        let at = |name: &str, at: usize| numbers(&answer[name][at]);
        let states: Vec<State> = (0..case.steps / 10)
            .map(|i| State { qpos: at("qpos", i), qvel: at("qvel", i), act: at("act", i) })
            .collect();
        let exact = accelerations::<f64>(&model, case.ctrl, &states);
        // from MuJoCo's states, errors do not add up
        let mut at_once = 0.0f64;
        for (a, b) in exact.iter().zip(answer["qacc"].as_array().expect("accelerations")) {
            at_once = at_once.max(distance(a, &numbers(b), 1.0));
        }
        let mut rounding = 0.0f64;
        for isa in Isa::ALL.into_iter().filter(|i| i.supported() && *i != Isa::F64) {
            let rounded = with_lanes!(isa, T => accelerations::<T>(&model, case.ctrl, &states));
            for (state, company) in states.iter().zip(&rounded) {
                let alone = with_lanes!(isa, T => accelerations::<T>(&model, case.ctrl, std::slice::from_ref(state)));
                assert_eq!(alone[0], *company, "{}: other lanes change a lane's bits", case.name);
            }
            for (a, b) in rounded.iter().zip(&exact) {
                let size = b.iter().fold(1.0f64, |m, x| m.max(x.abs()));
                rounding = rounding.max(largest(a.iter().zip(b).map(|(x, y)| (x - y).abs() / size)));
            }
        }
        let line = format!(
            "{}: states {:.1e}, sensors {:.1e}, accelerations {:.1e} and {at_once:.1e}, single precision {rounding:.1e}",
            case.name, worst[0], worst[1], worst[2]
        );
        println!("{line}");
        if !(worst[0] < 1e-6 && worst[1] < 1e-6 && worst[2] < 1e-4 && at_once < 1e-8 && rounding < 1e-3) {
            failures.push(line);
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}
