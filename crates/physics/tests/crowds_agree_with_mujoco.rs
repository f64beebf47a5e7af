//! Contract: agents with many contacts between bodies also agree with MuJoCo, and cost as much as their islands.
//!
//! Beyond a number of rows between moving bodies an agent is solved by another factorization, and models with many
//! pairs of geoms have a broad phase. A heap of crates and a crowd of small characters fall through all stages of
//! piling up. Contacts and accelerations equal MuJoCo's in double precision to 1e-8, and in single precision to its
//! rounding. Both factorizations give the same accelerations for every kind of row, also at the switch between them.
//! Crowded agents do not change the bits of others, and their own bits do not depend on others. The work is
//! proportional to the number of separate islands.

use crate::common;
use marathon_physics::lanes::Real;
use marathon_physics::model::JointType;
use marathon_physics::workload::Uniform;
use marathon_physics::{Batch, BatchOptions, Group, Isa, Model, Readings, Sim, SimOptions, Work};
use serde_json::{Value, json};
use std::fmt::Write;

/// A model of this test and its text.
struct Scene {
    text: String,
    model: Model,
}

impl Scene {
    fn new(body: &str) -> Self {
        let text = format!(
            r#"<mujoco><option timestep="0.004"/><worldbody><geom type="plane" size="9 9 1"/>{body}</worldbody></mujoco>"#
        );
        Self::whole(text)
    }

    fn whole(text: String) -> Self {
        let model = Model::from_xml_str(&text, "crowd").unwrap_or_else(|e| panic!("{e}"));
        Scene { text, model }
    }

    /// Crates that fall onto each other, several deep, beside a post and a ramp.
    fn heap() -> Self {
        let mut random = Uniform(7);
        let mut text = String::from(
            r#"<geom type="box" size=".1 .1 .6" pos=".5 0 .6"/>
               <geom type="plane" size="1 1 .1" zaxis="1 0 2" pos="-.6 0 0"/>"#,
        );
        for k in 0..36 {
            let [x, y, z] = [k % 3, k / 3 % 3, k / 9].map(f64::from);
            let [a, b, c] = [0.0; 3].map(|_| 0.1 + 0.02 * random.next());
            let turn = 0.1 * random.next();
            let (x, y, z) = (0.22 * x - 0.22, 0.22 * y - 0.22, 0.14 + 0.25 * z);
            write!(
                text,
                r#"<body pos="{x} {y} {z}" euler="{turn} 0 {turn}"><freejoint/><geom type="box" size="{a} {b} {c}"/></body>"#
            )
            .expect("a string takes all");
        }
        Self::new(&text)
    }

    /// Characters of nine bodies on a grid so narrow that they fall over each other. Their hamstrings are tendons.
    fn figures(rows: usize, spacing: f64) -> Self {
        let (mut bodies, mut tendons) = (String::new(), String::new());
        for i in 0..rows * rows {
            let (x, y) = ((i % rows) as f64 * spacing, (i / rows) as f64 * spacing);
            let limb = |name: &str, y: f64| {
                format!(
                    r#"<body pos="0 {y} -.1"><joint name="{name}{i}" axis="0 1 0" range="-100 60"/>
                       <geom fromto="0 0 0 .02 0 -.18" size=".045"/>
                       <body pos=".02 0 -.2"><joint name="{name}low{i}" axis="0 1 0" range="-140 5"/>
                       <joint axis="1 0 0" range="-20 20" damping="1"/>
                       <geom fromto="0 0 0 0 0 -.2" size=".04"/></body></body>"#
                )
            };
            let (left, right) = (limb("left", 0.08), limb("right", -0.08));
            let arm = |y: f64| {
                format!(
                    r#"<body pos="0 {y} .1"><joint type="ball" range="0 80" limited="true" damping=".1"/>
                       <geom fromto="0 0 0 .2 {y} 0" size=".035"/></body>"#
                )
            };
            let (up, down) = (arm(0.14), arm(-0.14));
            write!(
                bodies,
                r#"<body pos="{x} {y} .62"><freejoint/><geom fromto="0 0 -.1 0 0 .12" size=".08"/>
                   <body pos="0 0 .22"><joint axis="0 1 0" range="-30 30" stiffness="2"/><geom type="sphere" size=".08"/></body>
                   {left}{right}{up}{down}</body>"#
            )
            .expect("a string takes all");
            write!(
                tendons,
                r#"<fixed limited="true" range="-.5 .6"><joint joint="left{i}" coef=".5"/>
                   <joint joint="leftlow{i}" coef="-.5"/></fixed>"#
            )
            .expect("a string takes all");
        }
        Self::whole(format!(
            r#"<mujoco><option timestep="0.004"/>
               <default><joint limited="true" damping=".2" armature=".005"/><geom type="capsule" friction=".7 .01 .001"/></default>
               <worldbody><geom type="plane" size="9 9 1"/>{bodies}</worldbody><tendon>{tendons}</tendon></mujoco>"#
        ))
    }

    /// Balls that rest on each other: a series of contacts with three rows each.
    fn tower(balls: usize) -> Self {
        let mut text = String::new();
        for k in 0..balls {
            let (x, z) = (0.003 * (k % 3) as f64, 0.0999 + 0.1998 * k as f64);
            write!(text, r#"<body pos="{x} 0 {z}"><freejoint/><geom size=".1"/></body>"#).expect("a string takes all");
        }
        Self::new(&text)
    }
}

/// Options with a number of rows beyond which an agent is a crowd.
fn beyond(rows: usize) -> SimOptions {
    SimOptions { most_coupled_rows: Some(rows), ..Default::default() }
}

/// The model, solved to convergence.
fn exact(model: &Model) -> Model {
    let mut model = model.clone();
    model.opt.tolerance = 1e-14;
    model.opt.ls_iterations = 100;
    model
}

fn lane<T: Real>(v: &[T], i: usize) -> Vec<f64> {
    v.iter().map(|x| T::widen(x.get(i))).collect()
}

/// Distance of two vectors, relative to the second or to 1 if that is larger.
fn distance(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    let norm = |v: &mut dyn Iterator<Item = f64>| v.map(|x| x * x).sum::<f64>().sqrt();
    norm(&mut a.iter().zip(b).map(|(x, y)| x - y)) / norm(&mut b.iter().copied()).max(1.0)
}

/// A state of a falling scene, and its results.
struct Moment {
    qpos: Vec<f64>,
    qvel: Vec<f64>,
    warm: Vec<f64>,
    qacc: Vec<f64>,
    contacts: u64,
    crowded: bool,
}

/// Simulates a falling scene and keeps every n-th state.
fn fall(model: &Model, options: &SimOptions, steps: usize, every: usize) -> Vec<Moment> {
    let sim = Sim::<f64>::new(model, options.clone()).unwrap_or_else(|e| panic!("{e}"));
    let (mut work, mut group) = (Work::new(&sim), Group::new(&sim));
    let mut moments = Vec::new();
    for step in 0..steps {
        if step % every == 0 {
            moments.push(look(&sim, &mut work, &group));
        }
        sim.step(&mut work, &mut group, 1);
    }
    moments
}

/// The forces at a state.
fn look<T: Real>(sim: &Sim<T>, work: &mut Work<T>, group: &Group<T>) -> Moment {
    let before = work.stats().crowded;
    sim.forward(work, group);
    let readings = Readings::new(sim, group, work);
    let qacc: Vec<T> = (0..sim.model().nv).map(|d| readings.qacc(d)).collect();
    Moment {
        qpos: lane(&group.qpos, 0),
        qvel: lane(&group.qvel, 0),
        warm: lane(&group.qacc_warmstart, 0),
        qacc: lane(&qacc, 0),
        contacts: T::widen(readings.contact_count().get(0)) as u64,
        crowded: work.stats().crowded > before,
    }
}

fn agrees(scene: &Scene, name: &str, steps: usize) {
    let moments = fall(&exact(&scene.model), &SimOptions::default(), steps, 10);
    let crowded = moments.iter().filter(|m| m.crowded).count();
    assert!(crowded > moments.len() / 3, "{name}: only {crowded} of {} moments are crowded", moments.len());
    let states: Vec<Value> = moments
        .iter()
        .map(|m| json!({"qpos": m.qpos, "qvel": m.qvel, "ctrl": vec![0.0; scene.model.nu], "warm": m.warm}))
        .collect();
    let answers = common::oracle("crowds.py", &json!({"xml": scene.text, "states": states}));
    let single = Sim::<f32>::new(&scene.model, SimOptions::default()).expect("supported");
    let (mut work, mut group) = (Work::new(&single), Group::new(&single));
    let mut errors = Vec::new();
    let mut most = 0;
    for (k, (m, answer)) in moments.iter().zip(answers.as_array().expect("a list")).enumerate() {
        let qacc: Vec<f64> = answer["qacc"].as_array().expect("a list").iter().filter_map(Value::as_f64).collect();
        assert_eq!(answer["contacts"].as_u64(), Some(m.contacts), "{name}: contacts at moment {k}");
        let error = distance(&m.qacc, &qacc);
        assert!(error < 1e-8, "{name}: acceleration off by {error:.1e} at moment {k}, {} contacts", m.contacts);
        group.reset_lane(&single, 0, &m.qpos, &m.qvel);
        for (w, x) in group.qacc_warmstart.iter_mut().zip(&m.warm) {
            *w = *x as f32;
        }
        errors.push(distance(&look(&single, &mut work, &group).qacc, &qacc));
        most = most.max(m.contacts);
    }
    errors.sort_by(f64::total_cmp);
    let (median, worst) = (errors[errors.len() / 2], errors[errors.len() - 1]);
    println!("{name}: up to {most} contacts, single precision off by {median:.1e} (median), {worst:.1e} (largest)");
    // contacts at the margin depend on the rounding of positions
    assert!(median < 1e-3, "{name}: single precision is off by {median:.1e} in the median");
}

#[test]
fn a_heap_of_crates_agrees() {
    agrees(&Scene::heap(), "heap", 400);
}

#[test]
fn a_crowd_of_figures_agrees() {
    agrees(&Scene::figures(4, 0.3), "figures", 400);
}

/// Mean height of the bodies and largest velocity after so many steps.
fn rest<T: Real>(model: &Model, steps: usize) -> (f64, f64) {
    let sim = Sim::<T>::new(model, SimOptions::default()).expect("supported");
    let (mut work, mut group) = (Work::new(&sim), Group::new(&sim));
    for _ in 0..steps {
        sim.step(&mut work, &mut group, 1);
    }
    let heights: Vec<f64> = lane(&group.qpos, 0).chunks(7).map(|q| q[2]).collect();
    let fastest = lane(&group.qvel, 0).iter().fold(0.0, |a: f64, v| a.max(v.abs()));
    assert_eq!(work.stats().unconverged, 0, "every step is solved to the tolerance");
    (heights.iter().sum::<f64>() / heights.len() as f64, fastest)
}

#[test]
fn a_heap_comes_to_rest_in_single_precision() {
    let model = Scene::heap().model;
    let [(double, calm), (single, fastest)] = [rest::<f64>(&model, 1500), rest::<f32>(&model, 1500)];
    println!("mean heights {double} and {single}, largest velocities {calm} and {fastest}");
    // crates may tumble in different directions, but none may sink in
    assert!((double - single).abs() < 0.03, "mean height {single}, in double precision {double}");
    assert!(calm < 0.05 && fastest < 0.05, "something still moves at {calm}, {fastest}");
}

/// Both factorizations on every state of the falling scene, in double precision up to rounding.
fn paths_agree(model: &Model, name: &str, start: impl Fn(usize, &mut Vec<f64>, &mut Vec<f64>), states: usize) {
    let model = exact(model);
    let sims = [0, usize::MAX].map(|rows| Sim::<f64>::new(&model, beyond(rows)).unwrap_or_else(|e| panic!("{e}")));
    let mut crowded = 0;
    for state in 0..states {
        let (mut qpos, mut qvel) = (model.qpos0.clone(), vec![0.0; model.nv]);
        start(state, &mut qpos, &mut qvel);
        let [crowd, low_rank] = [&sims[0], &sims[1]].map(|sim| {
            let (mut work, mut group) = (Work::new(sim), Group::new(sim));
            group.reset_lane(sim, 0, &qpos, &qvel);
            look(sim, &mut work, &group)
        });
        assert!(!low_rank.crowded, "{name}: no number of rows is too many");
        crowded += usize::from(crowd.crowded);
        let error = distance(&crowd.qacc, &low_rank.qacc);
        assert!(error < 1e-8, "{name}: paths are {error:.1e} apart in state {state}, {} contacts", crowd.contacts);
    }
    println!("{name}: {crowded} of {states} states have coupled rows");
    assert!(crowded > 0, "{name}: nothing was coupled");
}

#[test]
fn every_kind_of_row_agrees_on_both_paths() {
    let folder = common::workspace().join("crates/physics/tests/models");
    for name in [
        "full/pile",
        "full/elliptic",
        "full/pyramidal",
        "full/equality",
        "full/tendons",
        "full/strings",
        "full/terrain",
    ] {
        let model = Model::from_xml_file(folder.join(format!("{name}.xml"))).unwrap_or_else(|e| panic!("{e}"));
        let start = |state: usize, qpos: &mut Vec<f64>, qvel: &mut Vec<f64>| {
            let mut random = Uniform(state as u64);
            qpos.iter_mut().for_each(|q| *q += 0.1 * random.next());
            qvel.iter_mut().for_each(|v| *v = random.next());
        };
        paths_agree(&model, name, start, 40);
    }
}

#[test]
fn one_factorization_takes_over_from_the_other() {
    // contacts between balls have three rows: eight contacts are the maximum for the correction
    for (balls, crowded) in [(8, false), (9, false), (10, true), (11, true)] {
        let scene = Scene::tower(balls);
        let moments = fall(&scene.model, &SimOptions::default(), 1, 1);
        assert_eq!(moments[0].contacts, balls as u64, "a tower of {balls} stands on itself");
        assert_eq!(moments[0].crowded, crowded, "a tower of {balls}");
        let start = |state: usize, _: &mut Vec<f64>, qvel: &mut Vec<f64>| {
            let mut random = Uniform(state as u64);
            qvel.iter_mut().for_each(|v| *v = 0.2 * random.next());
        };
        paths_agree(&scene.model, &format!("tower of {balls}"), start, 5);
    }
}

/// States of agents that are separate, lightly touching, or heaped, after a number of steps, as bits.
fn bits(model: &Model, ids: &[usize], isa: Isa, steps: usize) -> (Vec<Vec<u64>>, u64) {
    let options = BatchOptions { agents: ids.len(), isa, ..Default::default() };
    let mut batch = Batch::new(model, &options).expect("supported");
    for (slot, id) in ids.iter().enumerate() {
        let mut random = Uniform(*id as u64);
        let (mut qpos, mut qvel) = (model.qpos0.clone(), vec![0.0; model.nv]);
        for joint in model.joints.iter().filter(|j| j.kind == JointType::Free) {
            // a third is as in the model, a third is spread apart, and in a third few bodies touch
            let body = (joint.qpos_adr / 7) as f64;
            let apart = [0.0, 1.0, f64::from(u8::from(body > 9.0))][id % 3];
            qpos[joint.qpos_adr + 2] += 0.6 * apart * body;
            for v in &mut qvel[joint.dof_adr..joint.dof_adr + 6] {
                *v = 0.3 * random.next();
            }
        }
        batch.reset(slot, &qpos, &qvel);
    }
    let mut out = vec![Vec::new(); ids.len()];
    let ctrl = vec![0.0; ids.len() * model.nu];
    for _ in 0..steps {
        assert!(batch.step(&ctrl, 5).is_empty(), "the trajectory stays finite");
        for (slot, o) in out.iter_mut().enumerate() {
            o.extend(batch.qpos(slot).iter().chain(&batch.qvel(slot)).map(|x| x.to_bits()));
        }
    }
    (out, batch.stats().crowded)
}

#[test]
fn crowded_and_other_agents_share_lanes_and_nothing_else() {
    let scene = Scene::heap();
    let ids: Vec<usize> = (0..16).collect();
    let (want, crowded) = bits(&scene.model, &ids, Isa::F32, 12);
    assert!(crowded > 0, "nothing is crowded");
    let (_, apart) = bits(&scene.model, &[1, 4, 7], Isa::F32, 12);
    assert_eq!(apart, 0, "agents that are torn apart are no crowd");
    for isa in [Isa::X4, Isa::X8, Isa::X16].into_iter().filter(|i| i.supported()) {
        assert!(bits(&scene.model, &ids, isa, 12).0 == want, "{} differs from one lane", isa.name());
    }
    let best = Isa::best();
    for id in [0, 1, 2] {
        assert!(bits(&scene.model, &[id], best, 12).0[0] == want[id], "agent {id} alone");
    }
    // heaped agents among separate ones, and the other way round
    for among in [[1, 4, 0, 7, 10, 13, 5], [0, 3, 1, 6, 9, 12, 8]] {
        let (got, _) = bits(&scene.model, &among, best, 12);
        for (slot, id) in among.iter().enumerate() {
            assert!(got[slot] == want[*id], "agent {id} in slot {slot} of {among:?}");
        }
    }
}

#[test]
fn islands_cost_what_each_of_them_costs() {
    // towers far apart: each is an island
    let towers = |count: usize| {
        let mut text = String::new();
        for k in 0..12 * count {
            let (x, z) = (0.5 * (k / 12) as f64, 0.0999 + 0.1998 * (k % 12) as f64);
            write!(text, r#"<body pos="{x} 0 {z}"><freejoint/><geom size=".1"/></body>"#).expect("a string takes all");
        }
        let scene = Scene::new(&text);
        let sim = Sim::<f64>::new(&scene.model, SimOptions::default()).expect("supported");
        let (mut work, group) = (Work::new(&sim), Group::new(&sim));
        sim.forward(&mut work, &group);
        let stats = work.stats();
        assert_eq!(stats.contacts, 12 * count as u64);
        assert!(stats.crowded > 0);
        (stats.entries as f64 / stats.crowded as f64, stats.pairs as f64)
    };
    let (work, pairs) = [2, 4, 8, 16].map(towers).into_iter().unzip::<f64, f64, Vec<_>, Vec<_>>();
    println!("entries of the factors {work:?}, pairs looked at {pairs:?}");
    for k in 1..work.len() {
        let growth = work[k] / work[k - 1];
        assert!((1.8..2.2).contains(&growth), "twice the islands take {growth} times the work: {work:?}");
    }
    // all pairs of 192 balls are 18,336
    assert!(pairs[3] < 1000.0, "{pairs:?} pairs were looked at");
}
