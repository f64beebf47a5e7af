//! Spatial tendons act as in MuJoCo.
//!
//! Small models with strings through sites, over pulleys and around geoms move under springs, dampers, friction, limits
//! and actuators with every integrator. Double precision follows MuJoCo's states, sensors and accelerations every ten
//! steps. From MuJoCo's states, the other lane types find the same accelerations up to their rounding.

mod common;

use common::numbers::{distance, largest, numbers};
use marathon_physics::lanes::Real;
use marathon_physics::{Group, Isa, Model, Readings, Sim, SimOptions, Work, with_lanes};
use serde_json::{Value, json};

/// A case: the model without its outer element, initial velocities, controls and the number of steps.
struct Case {
    name: &'static str,
    text: &'static str,
    qvel: &'static [f64],
    ctrl: &'static [f64],
    steps: usize,
}

const fn case(name: &'static str, text: &'static str) -> Case {
    Case { name, text, qvel: &[], ctrl: &[], steps: 300 }
}

/// Two arms on a turntable, and posts to tie them to.
macro_rules! arms {
    ($more:literal) => {
        concat!(
            r#"<default><geom contype="0" conaffinity="0"/><joint damping="0.05" armature="0.005"/></default>
            <worldbody><site name="post" pos="0.2 0.3 0.5"/><site name="peg" pos="-0.3 0 0.4"/>
            <body><joint name="turn" axis="0.2 0 1"/><geom size="0.1" mass="1"/><site name="hub" pos="0 0.1 0.15"/>
              <body pos="0.1 0 0"><joint name="right" axis="0 1 0" springref="20"/>
                <geom type="capsule" size="0.02" fromto="0 0 0 0.3 0 0"/><site name="r1" pos="0.1 0 0.03"/><site name="r2" pos="0.28 0 0.03"/>
                <body pos="0.3 0 0"><joint name="hand" axis="0 1 0"/>
                  <geom name="wrist" size="0.05"/>
                  <geom type="capsule" size="0.02" fromto="0.06 0 0 0.2 0 0"/><site name="h" pos="0.15 0 0.02"/>
                  <site name="cap" pos="0 0 0.06"/><site name="core" pos="0.01 0 0.01"/></body></body>
              <body pos="-0.1 0 0"><joint name="left" type="ball"/>
                <geom type="capsule" size="0.02" fromto="0 0 0 -0.3 0 0"/><site name="l" pos="-0.25 0 0.03"/></body>
            </body>"#,
            $more,
        )
    };
}

const CASES: &[Case] = &[
    case(
        "a spring rests at its length in the spring configuration",
        arms!(
            r#"</worldbody><tendon><spatial stiffness="40" damping="0.3"><site site="r2"/><site site="hub"/><site site="l"/></spatial>
            </tendon>"#
        ),
    ),
    case(
        "a dead band and a pulley",
        arms!(
            r#"</worldbody><tendon><spatial stiffness="60" springlength="0.3 0.5"><site site="post"/><site site="r1"/><site site="r2"/>
            <pulley divisor="2"/><site site="l"/><site site="peg"/></spatial></tendon>"#
        ),
    ),
    case(
        "Runge-Kutta",
        arms!(
            r#"</worldbody><option integrator="RK4"/><tendon><spatial stiffness="100" damping="1" springlength="0.2"><site site="post"/>
            <site site="h"/><site site="l"/></spatial></tendon>"#
        ),
    ),
    Case {
        ctrl: &[2.0, 0.4, -0.5, 1.0],
        ..case(
            "every actuator",
            arms!(
                r#"</worldbody><tendon><spatial name="a"><site site="post"/><site site="r2"/></spatial>
                <spatial name="b" damping="0.1"><site site="l"/><site site="hub"/><site site="h"/></spatial>
                <spatial name="c"><site site="r1"/><site site="peg"/></spatial></tendon>
                <actuator><motor tendon="a" gear="3"/><position name="servo" tendon="b" kp="30" kv="1"/><velocity tendon="c" kv="2" gear="0.5"/>
                <general tendon="a" dyntype="filter" dynprm="0.05" gaintype="affine" gainprm="5 1 -0.2" biastype="affine" biasprm="0 -3 -0.1"
                 forcerange="-4 4"/></actuator>
                <sensor><tendonpos tendon="a"/><tendonvel tendon="b"/><actuatorpos actuator="servo"/><tendonactuatorfrc tendon="a"/>
                <tendonactuatorfrc tendon="c"/><jointactuatorfrc joint="right"/><e_potential/><e_kinetic/></sensor>"#
            ),
        )
    },
    Case {
        ctrl: &[0.3, -0.2],
        qvel: &[1.0, 2.0, -3.0, 0.5, 0.2, -1.0],
        ..case(
            "implicitfast with damping across branches",
            arms!(
                r#"</worldbody><option integrator="implicitfast" timestep="0.005"/><tendon>
                <spatial name="a" damping="20"><site site="l"/><site site="hub"/><site site="h"/></spatial>
                <spatial name="b"><site site="r1"/><site site="peg"/></spatial>
                <fixed name="f" damping="0.5"><joint joint="right" coef="1"/><joint joint="hand" coef="-2"/></fixed></tendon>
                <actuator><velocity tendon="b" kv="30" gear="0.5"/><position tendon="f" kp="3" kv="0.4" forcerange="-1 1"/></actuator>"#
            ),
        )
    },
    Case {
        qvel: &[1.0, 0.0, 0.0, 5.0, 2.0, -4.0, 0.5, 0.0, 0.0, 0.0, 3.0, 1.0, 2.0],
        ..case(
            "implicitfast with a free body",
            r#"<option integrator="implicitfast" gravity="0 0 -1"/><worldbody><site name="post" pos="0 0 1"/>
            <body><freejoint/><geom type="box" size="0.1 0.2 0.05"/><geom size="0.05" pos="0.2 0.1 0"/><site name="a" pos="0.2 0.1 0.05"/>
            </body><body pos="0.5 0 0"><freejoint/><geom type="box" size="0.1 0.05 0.15"/><site name="b" pos="0 0.05 0.1"/>
            <body pos="0 0.1 0"><joint axis="1 0 0" damping="0.1"/><geom size="0.04" pos="0 0.1 0"/></body></body></worldbody>
            <tendon><spatial damping="30"><site site="post"/><site site="a"/><site site="b"/></spatial></tendon>"#,
        )
    },
    Case {
        qvel: &[1.0, 2.0, -3.0, 0.5, 0.2, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        ..case(
            "implicitfast with a low cap",
            arms!(
                r#"<geom type="plane" size="2 2 1" pos="0 0 -0.3" conaffinity="1"/><body pos="0 0 -0.22"><freejoint/><geom size="0.1" contype="1"/></body></worldbody><option integrator="implicitfast" iterations="2"/>
                <tendon><spatial damping="20" range="0.3 0.6"><site site="l"/><site site="hub"/><site site="h"/></spatial></tendon>"#
            ),
        )
    },
    Case {
        qvel: &[3.0, 2.0, -3.0, 0.5, 0.2, -1.0],
        ..case(
            "limits and dry friction",
            arms!(
                r#"</worldbody><tendon><spatial name="a" range="0.3 0.5" margin="0.01"><site site="l"/><site site="hub"/><site site="r2"/></spatial>
                <spatial frictionloss="2"><site site="post"/><site site="h"/></spatial>
                <spatial name="b" limited="true" range="0 0.45" solreflimit="0.01 1"><site site="peg"/><site site="h"/></spatial></tendon>
                <sensor><tendonlimitpos tendon="b"/><tendonlimitvel tendon="b"/><tendonlimitfrc tendon="b"/><tendonlimitfrc tendon="a"/></sensor>"#
            ),
        )
    },
    Case {
        qvel: &[1.0, 2.0, -1.0, 0.5, 0.2, -1.0],
        ..case(
            "tied lengths",
            arms!(
                r#"</worldbody><tendon><spatial name="a"><site site="l"/><site site="hub"/></spatial>
                <spatial name="b"><site site="post"/><site site="r2"/></spatial>
                <spatial name="c"><site site="r1"/><site site="h"/></spatial>
                <fixed name="f"><joint joint="turn" coef="0.3"/></fixed></tendon>
                <equality><tendon tendon1="a"/><tendon tendon1="b" tendon2="f" polycoef="0 0.5 0.3"/>
                <tendon tendon1="f" tendon2="c" polycoef="0 1"/></equality>"#
            ),
        )
    },
    Case {
        qvel: &[0.0, 2.0, 12.0, 0.0, 0.0, 0.0],
        ..case(
            "around a wrist",
            arms!(
                r#"</worldbody><tendon><spatial name="over" stiffness="80" springlength="0.2"><site site="r1"/><geom geom="wrist" sidesite="cap"/>
            <site site="h"/></spatial>
            <spatial name="any" stiffness="50" springlength="0.1" damping="0.1"><site site="r1"/><geom geom="wrist"/><site site="h"/></spatial>
            </tendon><sensor><tendonpos tendon="over"/><tendonvel tendon="over"/><tendonpos tendon="any"/></sensor>"#
            ),
        )
    },
    case(
        "through a ring",
        arms!(
            r#"</worldbody><tendon><spatial name="in" stiffness="80" springlength="0.1"><site site="r1"/><geom geom="wrist" sidesite="core"/>
            <site site="h"/></spatial></tendon><sensor><tendonpos tendon="in"/><tendonvel tendon="in"/></sensor>"#
        ),
    ),
    Case {
        qvel: &[4.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0],
        steps: 600,
        ..case(
            "around poles and balls that start and end to touch",
            r#"<default><joint damping="0.05" armature="0.002"/></default><worldbody><site name="anchor" pos="0 0 1"/><site name="side" pos="-0.1 0 0.3"/><site name="inner" pos="0.52 0 0.52"/>
            <geom name="pole" type="cylinder" size="0.08 0.5" pos="0 0 0.6" euler="90 20 0" contype="0" conaffinity="0"/>
            <geom name="tube" type="cylinder" size="0.1 0.5" pos="0.5 0 0.5" euler="90 0 10" contype="0" conaffinity="0"/>
            <body pos="0.02 0 0"><joint name="x" type="slide" axis="1 0 0"/><joint type="slide" axis="0 0 1"/><joint type="slide" axis="0 1 0"/>
              <geom size="0.05" mass="1"/><site name="load" pos="0 0 0.05"/></body>
            <body pos="0.9 0 0.2"><joint axis="0 1 0"/><geom type="capsule" size="0.02" fromto="0 0 0 0.3 0 0" contype="0" conaffinity="0"/>
              <geom name="ball" size="0.07" pos="0.15 0.02 0" mass="0.2" contype="0" conaffinity="0"/>
              <site name="tip" pos="0.3 0 0.02"/>
              <body pos="0.3 0 0"><joint type="ball"/><geom size="0.04" pos="0.1 0 0"/><site name="end" pos="0.1 0 0.02"/></body></body>
            </worldbody><option integrator="implicitfast"/><tendon>
            <spatial name="a" stiffness="60" damping="0.5" springlength="0.4"><site site="anchor"/><geom geom="pole"/><site site="load"/></spatial>
            <spatial name="b" stiffness="5" damping="0.2" springlength="0.9"><site site="anchor"/><geom geom="pole" sidesite="side"/><site site="end"/></spatial>
            <spatial name="c" stiffness="10" springlength="0.2"><site site="load"/><geom geom="tube" sidesite="inner"/><site site="tip"/>
              <geom geom="ball"/><site site="anchor"/></spatial></tendon>
            <sensor><tendonpos tendon="a"/><tendonpos tendon="b"/><tendonpos tendon="c"/><tendonvel tendon="c"/></sensor>"#,
        )
    },
    case(
        "strings without length and strings that nothing moves",
        arms!(
            r#"<site name="hub2" pos="0 0 0"/><body><site name="still"/></body></worldbody>
            <tendon><spatial name="a" stiffness="10" damping="1"><site site="post"/><site site="peg"/></spatial>
            <spatial name="b" stiffness="5"><site site="hub2"/><site site="still"/><site site="r1"/></spatial>
            <spatial name="c" stiffness="5" range="0.01 0.02"><site site="r1"/><site site="r2"/></spatial></tendon>
            <sensor><tendonpos tendon="a"/><tendonvel tendon="a"/></sensor>"#
        ),
    ),
    Case {
        ctrl: &[6.0, 3.0, -8.0, -1.0],
        ..case(
            "bounded sums of forces",
            arms!(
                r#"</worldbody><option integrator="implicitfast"/><tendon>
                <spatial name="a" actuatorfrcrange="-1 2"><site site="post"/><site site="r2"/></spatial>
                <spatial name="b" actuatorfrcrange="-3 1"><site site="l"/><site site="hub"/></spatial></tendon>
                <actuator><motor tendon="a" forcerange="-1 1.5"/><velocity tendon="a" kv="2" gear="0.5"/>
                <motor tendon="b"/><general tendon="b" gaintype="affine" gainprm="2 0 1" forcerange="-1 9"/></actuator>
                <sensor><tendonactuatorfrc tendon="a"/><tendonactuatorfrc tendon="b"/></sensor>"#
            ),
        )
    },
    case(
        "switched off",
        arms!(
            r#"</worldbody><option><flag spring="disable" limit="disable" damper="disable"/></option>
            <tendon><spatial stiffness="10" damping="1" range="0.1 0.2"><site site="post"/><site site="h"/></spatial></tendon>"#
        ),
    ),
];

fn xml(case: &Case) -> String {
    let name = case.name;
    // sections come in any order
    format!(r#"<mujoco model="{name}">{}</mujoco>"#, case.text)
}

/// Errors of the states, the sensors and the accelerations of a motion.
fn follow(model: &Model, case: &Case, answer: &Value) -> [f64; 3] {
    let sim = Sim::<f64>::new(model, SimOptions::default()).unwrap_or_else(|e| panic!("{}: {e}", case.name));
    let (mut work, mut group, mut look) = (Work::new(&sim), Group::new(&sim), Work::new(&sim));
    let start = if case.qvel.is_empty() { vec![0.0; model.nv] } else { case.qvel.to_vec() };
    group.reset_lane(&sim, 0, &model.qpos0, &start);
    group.ctrl.copy_from_slice(case.ctrl);
    let mut worst = [0.0f64; 3];
    for at in 0..case.steps / 10 {
        sim.step(&mut work, &mut group, 10);
        let apart = |ours: &[f64], theirs: &Value| {
            largest(ours.iter().zip(numbers(theirs)).map(|(a, b)| (a - b).abs() / (1.0 + b.abs())))
        };
        worst[0] = worst[0].max(apart(&group.qpos, &answer["qpos"][at]));
        worst[0] = worst[0].max(apart(&group.qvel, &answer["qvel"][at]));
        sim.forward(&mut look, &group);
        let readings = Readings::new(&sim, &group, &look);
        let sensors = (0..model.sensors.len()).flat_map(|k| readings.sensor(k).expect("it is evaluated"));
        worst[1] = worst[1].max(apart(&sensors.collect::<Vec<_>>(), &answer["sensordata"][at]));
        let acc: Vec<f64> = (0..model.nv).map(|d| readings.qacc(d)).collect();
        worst[2] = worst[2].max(apart(&acc, &answer["qacc"][at]));
    }
    worst
}

/// Accelerations in given states, lane by lane.
fn accelerations<T: Real>(model: &Model, ctrl: &[f64], states: &[(Vec<f64>, Vec<f64>)]) -> Vec<Vec<f64>> {
    let sim = Sim::<T>::new(model, SimOptions::default()).expect("as in double precision");
    let mut work = Work::new(&sim);
    let mut out = Vec::new();
    for chunk in states.chunks(T::LANES) {
        let mut group = Group::new(&sim);
        for (lane, (qpos, qvel)) in chunk.iter().enumerate() {
            group.reset_lane(&sim, lane, qpos, qvel);
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

#[test]
fn strings_move_as_in_mujoco() {
    let jobs: Vec<Value> =
        CASES.iter().map(|c| json!({ "text": xml(c), "qvel": c.qvel, "ctrl": c.ctrl, "steps": c.steps })).collect();
    let answers = common::oracle("trajectories.py", &json!(jobs));
    let mut failures = Vec::new();
    for (case, answer) in CASES.iter().zip(answers.as_array().expect("an answer per model")) {
        let model = Model::from_xml_str(&xml(case), "case.xml").unwrap_or_else(|e| panic!("{}: {e}", case.name));
        let worst = follow(&model, case, answer);
        let states: Vec<_> =
            (0..case.steps / 10).map(|at| (numbers(&answer["qpos"][at]), numbers(&answer["qvel"][at]))).collect();
        let exact = accelerations::<f64>(&model, case.ctrl, &states);
        // from MuJoCo's states, errors do not add up
        let mut at_once = 0.0f64;
        for (a, b) in exact.iter().zip(answer["qacc"].as_array().expect("accelerations")).filter(|_| model.na == 0) {
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
