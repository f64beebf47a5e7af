//! Contract: a model with `noslip_iterations` moves as in MuJoCo.
//!
//! The second solver for friction takes a few sweeps over the friction rows. So its result depends on the order of the
//! rows, on the rule to stop, and on the islands. The tests compare the acceleration, the constraint forces and the
//! next state along trajectories, in double precision. They cover both cones, every `condim`, dry friction of joints
//! and tendons, several geoms per body, declared pairs, islands, low caps of the first solver, and all integrators.
//! Bits do not depend on the width of the lanes.

use crate::common;
use crate::common::numbers::{distance, largest, numbers};
use marathon_physics::lanes::{Isa, Real};
use marathon_physics::{Batch, BatchOptions, Group, Model, Readings, Sim, SimOptions, Work};
use serde::Deserialize;
use serde_json::{Value, json};
use std::collections::BTreeMap;

/// Largest relative error of a step, and of trajectories of [`LONG`] steps.
const BOUND: f64 = 5e-8;
const LONG_BOUND: f64 = 1e-6;
const LONG: usize = 150;
/// Steps of each trajectory from a random state, and their number per case.
const STEPS: usize = 40;
const TRAJECTORIES: usize = 2;

/// Shapes on an inclined plane. Two of them meet.
const SLOPE: &str = r#"<worldbody>
  <geom type="plane" size="20 20 1" euler="0 15 0"/>
  <body name="crate" pos="0 0 0.15" euler="0 15 0"><freejoint/><geom type="box" size="0.2 0.15 0.1"/></body>
  <body name="ball" pos="0.5 0.1 0.02"><freejoint/><geom size="0.15"/></body>
  <body name="stick" pos="-0.6 0 0.34" euler="0 15 0"><freejoint/><geom type="capsule" size="0.08 0.2" euler="90 0 0"/></body>
  <body name="lid" pos="0.03 0 0.29" euler="0 15 0"><freejoint/><geom type="box" size="0.1 0.1 0.05"/></body>
</worldbody>"#;

/// Bodies of several geoms on a level floor, next to each other and on a block. A declared pair is declared twice.
const FLOOR: &str = r#"<worldbody>
  <geom name="floor" type="plane" size="20 20 1"/>
  <geom type="box" size="0.5 0.5 0.1" pos="0.6 0 0"/>
  <body pos="0.2 0 0.25"><freejoint/>
    <geom name="bar" type="box" size="0.3 0.1 0.05"/><geom size="0.1" pos="0.3 0 0"/><geom type="capsule" size="0.07 0.1" pos="-0.3 0 0"/>
  </body>
  <body pos="0.2 0.05 0.42"><freejoint/>
    <geom name="top" type="box" size="0.2 0.2 0.05"/><geom size="0.08" pos="0.1 0.1 -0.05"/>
  </body>
  <body pos="-0.7 0 0.1"><freejoint/><geom name="ball" size="0.1"/></body>
</worldbody>
<contact><pair geom1="top" geom2="bar" condim="4" friction="0.6 0.5 0.02 0.001 0.001"/><pair geom1="ball" geom2="floor"/>
  <pair geom1="floor" geom2="top"/><pair geom1="top" geom2="bar" condim="3" friction="0.3 0.3 0.02 0.001 0.001"/></contact>"#;

/// An arm with dry friction in its joints and a tendon, a limit, and an equality constraint. It pushes a crate.
const ARM: &str = r#"<worldbody>
  <geom type="plane" size="20 20 1"/>
  <body pos="0 0 0.4">
    <joint name="a" axis="0 0 1" frictionloss="0.4" damping="0.1" range="-60 60" limited="true"/>
    <geom type="capsule" size="0.05" fromto="0 0 0 0.4 0 0"/>
    <body pos="0.4 0 0"><joint name="b" axis="0 1 0" frictionloss="1.5" armature="0.01"/>
      <geom type="capsule" size="0.04" fromto="0 0 0 0.3 0 -0.2"/>
      <body pos="0.3 0 -0.2"><joint name="c" type="slide" axis="0 1 0" frictionloss="0.5" range="-0.1 0.1" limited="true"/>
        <geom type="box" size="0.06 0.06 0.1"/></body>
    </body>
  </body>
  <body pos="0.2 0.5 0.5"><joint name="d" axis="1 0 0" frictionloss="0.05"/><geom type="capsule" size="0.04" fromto="0 0 0 0.2 0 -0.2"/></body>
  <body pos="0.83 0.02 0.1" euler="0 0 7"><freejoint/><geom type="box" size="0.1 0.1 0.1"/></body>
</worldbody>
<tendon><fixed name="t" frictionloss="0.6"><joint joint="b" coef="1"/><joint joint="c" coef="-2"/></fixed></tendon>
<equality><joint joint1="a" joint2="d" polycoef="0 0.5 0 0 0"/></equality>
<actuator><motor joint="a" gear="3"/><motor joint="b" gear="3"/></actuator>"#;

/// A planar walker.
const PLANAR: &str = r#"<worldbody>
  <geom type="plane" size="20 20 1"/>
  <body pos="0 0 0.5"><joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 0 1"/><joint axis="0 1 0"/>
    <geom type="capsule" size="0.06" fromto="-0.2 0 0 0.2 0 0"/>
    <body pos="0.2 0 0"><joint name="hip" axis="0 1 0" frictionloss="0.3"/><geom type="capsule" size="0.05" fromto="0 0 0 0.1 0 -0.4"/></body>
    <body pos="-0.2 0 0"><joint axis="0 1 0"/><geom type="capsule" size="0.05" fromto="0 0 0 -0.1 0 -0.4"/></body>
  </body>
</worldbody><actuator><motor joint="hip" gear="2"/></actuator>"#;

/// Shapes with several contacts, far from each other but for pairs of capsules and of a capsule and a box.
const SHAPES: &str = r#"<worldbody>
  <geom type="plane" size="20 20 1" euler="5 10 0"/>
  <body pos="0 0 0.12"><freejoint/><geom type="cylinder" size="0.15 0.1"/></body>
  <body pos="2 0 -0.2"><freejoint/><geom type="ellipsoid" size="0.15 0.1 0.2"/></body>
  <body pos="-2 0 0.4"><freejoint/><geom type="capsule" size="0.1 0.2"/></body>
  <body pos="-2 0 0.58"><freejoint/><geom type="capsule" size="0.1 0.2"/></body>
  <body pos="0 2 0.3"><freejoint/><geom type="box" size="0.2 0.2 0.1"/></body>
  <body pos="0 2 0.48"><freejoint/><geom type="capsule" size="0.1 0.2"/></body>
</worldbody>"#;

/// A state, and MuJoCo's results for it.
#[derive(Deserialize)]
struct State {
    qpos: Vec<f64>,
    qvel: Vec<f64>,
    ctrl: Vec<f64>,
    warm: Vec<f64>,
    qacc: Vec<f64>,
    qfrc_constraint: Vec<f64>,
    next_qpos: Vec<f64>,
    next_qvel: Vec<f64>,
    /// Whether MuJoCo's result is independent of rounding.
    settled: bool,
}

/// A model with the attributes `option` of its `<option>`. The first solver solves to the end, unless it has a low cap:
/// then rounding would decide its line search.
fn text(scene: &str, condim: usize, option: &str) -> String {
    let exact = if option.contains(" iterations=") { "" } else { "tolerance='0' ls_tolerance='1e-10'" };
    format!(
        r#"<mujoco model="no slip"><option {option} {exact}/>
        <default><geom condim="{condim}" friction="0.6 0.01 0.005" density="500"/></default>{scene}</mujoco>"#
    )
}

/// Models in the cases of this file.
fn cases() -> Vec<String> {
    let mut out = Vec::new();
    for scene in [SLOPE, FLOOR, ARM] {
        for cone in ["pyramidal", "elliptic"] {
            for condim in [1, 3, 4, 6] {
                for sweeps in [1, 4] {
                    out.push(text(scene, condim, &format!("cone='{cone}' noslip_iterations='{sweeps}'")));
                }
            }
            for more in [
                "noslip_iterations='30' noslip_tolerance='0'",
                "noslip_iterations='30' noslip_tolerance='1e-3'",
                "noslip_iterations='3' integrator='RK4'",
                "noslip_iterations='3' integrator='implicitfast'",
                "noslip_iterations='3' impratio='10'",
                "noslip_iterations='20' iterations='3' ls_iterations='6'",
                "noslip_iterations='3' iterations='5' solver='CG'",
                // the rest of the element is its own end tag
                "noslip_iterations='3'><flag island='disable'/></option><option",
                "noslip_iterations='3'><flag midphase='disable'/></option><option",
                "noslip_iterations='3' iterations='2'><flag island='disable' warmstart='disable'/></option><option",
            ] {
                out.push(text(scene, 3, &format!("cone='{cone}' {more}")));
            }
        }
    }
    for cone in ["pyramidal", "elliptic"] {
        for condim in [3, 6] {
            out.push(text(PLANAR, condim, &format!("cone='{cone}' noslip_iterations='5'")));
            out.push(text(SHAPES, condim, &format!("cone='{cone}' noslip_iterations='2'")));
        }
    }
    out
}

fn load(text: &str) -> Model {
    Model::from_xml_str(text, "noslip.xml").unwrap_or_else(|e| panic!("{e}"))
}

fn widen<T: Real>(values: &[T]) -> Vec<f64> {
    values.iter().map(|x| T::widen(x.get(0))).collect()
}

/// Errors of a state by quantity.
fn errors<T: Real>(sim: &Sim<T>, work: &mut Work<T>, state: &State) -> [(&'static str, f64); 4] {
    let mut group = Group::new(sim);
    group.reset_lane(sim, 0, &state.qpos, &state.qvel);
    for (to, from) in [(&mut group.ctrl, &state.ctrl), (&mut group.qacc_warmstart, &state.warm)] {
        to.iter_mut().zip(from).for_each(|(to, from)| to.set(0, T::scalar(*from)));
    }
    sim.forward(work, &group);
    let r = Readings::new(sim, &group, work);
    let acc: Vec<T> = (0..sim.model().nv).map(|d| r.qacc(d)).collect();
    let forces = r.constraint_forces();
    sim.step(work, &mut group, 1);
    [
        ("acceleration", distance(&widen(&acc), &state.qacc, 1.0)),
        ("constraint force", distance(&widen(&forces), &state.qfrc_constraint, 1.0)),
        ("next position", distance(&widen(&group.qpos), &state.next_qpos, 1.0)),
        ("next velocity", distance(&widen(&group.qvel), &state.next_qvel, 1.0)),
    ]
}

/// How a model is called in messages: its options.
fn label(text: &str) -> String {
    let scene = [(SLOPE, "slope"), (FLOOR, "floor"), (ARM, "arm"), (PLANAR, "planar"), (SHAPES, "shapes")];
    let scene = scene.iter().find(|(s, _)| text.contains(s)).map_or("", |(_, name)| name);
    let after = |tag: &str| text.split(tag).nth(1).and_then(|rest| rest.split("/>").next()).unwrap_or("").to_owned();
    format!("{scene} {} {}", after("<option "), after("<geom ").split(" fric").next().unwrap_or(""))
}

#[test]
fn steps_from_random_states_agree() {
    let cases = cases();
    let jobs: Vec<Value> = cases
        .iter()
        .enumerate()
        .map(|(i, xml)| json!({"xml": xml, "seed": i, "trajectories": TRAJECTORIES, "steps": STEPS}))
        .collect();
    let answers = common::oracle("low_caps.py", &json!(jobs));
    let (mut compared, mut unsettled, mut wrong, mut single_worst) = (0, 0, Vec::new(), Vec::new());
    let mut worst: BTreeMap<&str, f64> = BTreeMap::new();
    for (xml, answer) in cases.iter().zip(answers.as_array().expect("an answer per model")) {
        let sim = Sim::<f64>::new(&load(xml), SimOptions::default()).unwrap_or_else(|e| panic!("{e}"));
        let single = Sim::<f32>::new(sim.model(), SimOptions::default()).expect("as in double precision");
        let (mut work, mut single_work) = (Work::new(&sim), Work::new(&single));
        let states: Vec<State> = serde_json::from_value(answer["states"].clone()).expect("states");
        let (mut own, mut differing): (BTreeMap<&str, f64>, usize) = (BTreeMap::new(), 0);
        for state in &states {
            if !state.settled {
                unsettled += 1;
                continue;
            }
            compared += 1;
            single_worst.push(errors(&single, &mut single_work, state)[0].1);
            let errors = errors(&sim, &mut work, state);
            differing += usize::from(errors.iter().any(|(_, e)| !(*e <= BOUND)));
            for (what, error) in errors {
                let most = own.entry(what).or_default();
                *most = largest([*most, error]);
                let most = worst.entry(what).or_default();
                *most = largest([*most, error]);
            }
        }
        if differing > 0 {
            let own: Vec<String> = own.iter().map(|(what, e)| format!("{what} {e:.1e}")).collect();
            wrong.push(format!("{} ({differing} of {}): {}", label(xml), states.len(), own.join(", ")));
        }
    }
    single_worst.sort_by(f64::total_cmp);
    let quantile = |q: f64| single_worst[(q * (single_worst.len() - 1) as f64) as usize];
    println!(
        "{compared} states compared, {unsettled} left out, worst {worst:?}; single precision: median {:.1e}, 90 % {:.1e}, \
         99 % {:.1e}",
        quantile(0.5),
        quantile(0.9),
        quantile(0.99)
    );
    assert!(wrong.is_empty(), "{} of {} differ:\n{}", wrong.len(), cases.len(), wrong.join("\n"));
    let states = compared + unsettled;
    assert!(unsettled * 10 < states, "{unsettled} of {states} states depend on rounding");
    assert!(quantile(0.9) < 1e-3, "single precision: {:.1e}", quantile(0.9));
}

/// Crates that stick, slide and turn on a slope.
#[test]
fn long_trajectories_agree() {
    let mut cases = Vec::new();
    let slope = |angle: f64, shape: &str| {
        format!(
            r#"<worldbody><geom type="plane" size="20 20 1" euler="0 {angle} 0"/><body pos="0 0 0.12" euler="0 {angle} 0"><freejoint/>
            {shape}</body></worldbody>"#
        )
    };
    let shapes = [
        r#"<geom type="box" size="0.2 0.15 0.1"/>"#,
        r#"<geom size="0.1"/>"#,
        r#"<geom type="capsule" size="0.1 0.2" euler="90 0 0"/>"#,
    ];
    for cone in ["pyramidal", "elliptic"] {
        for condim in [3, 4, 6] {
            for angle in [0.0, 10.0, 35.0] {
                for shape in shapes {
                    let option = format!("cone='{cone}' noslip_iterations='8'");
                    cases.push((text(&slope(angle, shape), condim, &option), vec![0.3, 0.2, 0.0, 0.0, 0.0, 1.0]));
                }
            }
        }
        let arm = text(ARM, 3, &format!("cone='{cone}' noslip_iterations='8'"));
        cases.push((arm, vec![0.5, -0.4, 0.1, 0.25, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]));
    }
    let jobs: Vec<Value> =
        cases.iter().map(|(text, qvel)| json!({"text": text, "qvel": qvel, "steps": LONG})).collect();
    let answers = common::oracle("trajectories.py", &json!(jobs));
    let (mut worst, mut wrong) = (0.0_f64, Vec::new());
    for ((text, qvel), answer) in cases.iter().zip(answers.as_array().expect("an answer per model")) {
        let model = load(text);
        let sim = Sim::<f64>::new(&model, SimOptions::default()).unwrap_or_else(|e| panic!("{e}"));
        let (mut work, mut group) = (Work::new(&sim), Group::new(&sim));
        group.reset_lane(&sim, 0, &model.qpos0, qvel);
        let mut error = 0.0;
        for (qpos, qvel) in
            answer["qpos"].as_array().expect("a list").iter().zip(answer["qvel"].as_array().expect("a list"))
        {
            sim.step(&mut work, &mut group, 10);
            error = largest([
                error,
                distance(&group.qpos, &numbers(qpos), 1.0),
                distance(&group.qvel, &numbers(qvel), 1.0),
            ]);
        }
        worst = largest([worst, error]);
        if !(error <= LONG_BOUND) {
            wrong.push(format!("{}: {error:.1e}", label(text)));
        }
    }
    println!("{} trajectories, worst {worst:.1e}", cases.len());
    assert!(wrong.is_empty(), "{} of {} differ:\n{}", wrong.len(), cases.len(), wrong.join("\n"));
}

/// A crate on a slope creeps without the second solver, and stays with it.
#[test]
fn a_crate_on_a_slope_does_not_creep() {
    let scene = r#"<worldbody><geom type="plane" size="20 20 1" euler="0 10 0"/>
        <body pos="0 0 0.1" euler="0 10 0"><freejoint/><geom type="box" size="0.2 0.2 0.1"/></body></worldbody>"#;
    for cone in ["pyramidal", "elliptic"] {
        let speed = |sweeps: usize| {
            let model = load(&text(scene, 3, &format!("cone='{cone}' noslip_iterations='{sweeps}'")));
            let sim = Sim::<f64>::new(&model, SimOptions::default()).unwrap_or_else(|e| panic!("{e}"));
            let (mut work, mut group) = (Work::new(&sim), Group::new(&sim));
            sim.step(&mut work, &mut group, 1000);
            group.qvel[0].abs()
        };
        let (soft, hard) = (speed(0), speed(20));
        assert!(soft > 1e-4 && hard < 0.01 * soft, "{cone}: {soft:.1e} m/s, with the second solver {hard:.1e} m/s");
    }
}

/// Agents with different states in the lanes of a group.
#[test]
fn bits_do_not_depend_on_widths() {
    let run = |model: &Model, isa: Isa| {
        let agents = 16;
        let mut batch = Batch::new(model, &BatchOptions { agents, isa, ..BatchOptions::default() }).expect("supported");
        for slot in 0..agents {
            let noise = |k: usize| ((slot * 37 + k * 101) % 19) as f64 / 19.0 - 0.5;
            let qvel: Vec<f64> = (0..model.nv).map(|k| 2.0 * noise(k)).collect();
            batch.reset(slot, &model.qpos0, &qvel);
        }
        let mut out = Vec::new();
        for _ in 0..15 {
            batch.step(&vec![0.5; agents * model.nu], 5);
            for slot in 0..agents {
                out.extend(batch.qpos(slot).iter().chain(&batch.qvel(slot)).map(|x| x.to_bits()));
            }
        }
        out
    };
    let isas: Vec<Isa> = Isa::ALL.into_iter().filter(|isa| *isa != Isa::F64 && isa.supported()).collect();
    for cone in ["pyramidal", "elliptic"] {
        for more in ["", "iterations='4' ls_iterations='8'"] {
            for scene in [SLOPE, FLOOR, ARM, PLANAR] {
                let model = load(&text(scene, 4, &format!("cone='{cone}' noslip_iterations='5' {more}")));
                let want = run(&model, isas[0]);
                for isa in &isas[1..] {
                    assert!(run(&model, *isa) == want, "{cone} {more}: {} differs from {}", isa.name(), isas[0].name());
                }
            }
        }
    }
}
