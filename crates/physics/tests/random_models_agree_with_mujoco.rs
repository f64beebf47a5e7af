//! Contract: randomly generated models agree with MuJoCo.
//!
//! `tests/oracle/random_models.py` draws models from everything that `docs/reference/mjcf.md` lists as supported: every joint,
//! shape, actuator, tendon, constraint, sensor, integrator and option, in any combination. Each compiles to MuJoCo's
//! numbers. On random states, double precision has MuJoCo's mass matrix, bias, applied and constraint forces,
//! accelerations, contacts, sensors and next state to 1e-5, and mostly to 1e-12. Single precision has those of double
//! precision to 1e-2. One thing is left out (`docs/research/physics-agreement.md` names it): constraint forces on bodies that can only
//! turn about their centers of mass, and welds on bodies that can only slide. For those, single precision has the
//! motion of double precision, not the forces. Where an acceleration differs, the oracle computes which result is
//! closer to the minimum of MuJoCo's own problem. It counts as MuJoCo's error if Marathon's is closer by far.
//!
//! By default few models are drawn. A long run prints a table of differences, and writes the differing models to a
//! folder:
//!
//! ```sh
//! MARATHON_SEEDS=0..5000 MARATHON_OUT=/tmp/models \
//!     cargo test --release -p marathon-physics random_models_agree_with_mujoco:: -- --nocapture
//! ```
//!
//! `MARATHON_SEEDS=17..18` runs one model again; `tests/oracle/random_models.py 17` prints it.

use crate::common;
use crate::common::compiled::differ;
use crate::common::numbers::{distance, largest};
use marathon_physics::lanes::Real;
use marathon_physics::model::Sensor;
use marathon_physics::{Group, MeasurePlan, Model, Readings, Sim, SimOptions, Work};
use serde::Deserialize;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::ops::Range;
use std::path::PathBuf;

/// Seeds of the models that are drawn by default.
const SEEDS: Range<u64> = 0..1500;
/// States per model.
const STATES: usize = 3;
/// Largest relative difference of double precision from MuJoCo, and of single precision from double.
const DOUBLE: f64 = 1e-5;
const SINGLE: f64 = 1e-2;

/// Quantities that constraints do not affect.
const UNCONSTRAINED: [&str; 7] =
    ["bias force", "applied force", "actuator force", "mass matrix", "contacts", "body position", "geom position"];

/// Prefixes of the names of quantities that depend on constraint forces.
const FORCES: [&str; 3] = ["constraint force", "cfrc_ext", "sensor"];

/// A model, and MuJoCo's results for it.
#[derive(Deserialize)]
struct Answer {
    seed: u64,
    xml: String,
    /// Reason why MuJoCo does not compile it.
    error: Option<String>,
    #[serde(default)]
    compiled: Value,
    #[serde(default)]
    states: Vec<State>,
    #[serde(default)]
    skipped: usize,
}

/// A state, and the results for it.
#[derive(Deserialize)]
#[allow(non_snake_case)]
struct State {
    qpos: Vec<f64>,
    qvel: Vec<f64>,
    ctrl: Vec<f64>,
    act: Vec<f64>,
    xfrc: Vec<f64>,
    /// Positions and orientations of the mocap bodies.
    mocap: Vec<[f64; 7]>,
    /// Whether rounding to single precision hardly changes the answer.
    single: bool,
    /// A constraint acts on bodies that only turn about their centers of mass, or a weld on those that only slide.
    /// Rounding then decides MuJoCo's result.
    weightless: bool,
    qacc: Vec<f64>,
    qfrc_constraint: Vec<f64>,
    qfrc_bias: Vec<f64>,
    qfrc_applied: Vec<f64>,
    qfrc_actuator: Vec<f64>,
    qM: Vec<f64>,
    cfrc_ext: Vec<f64>,
    ncon: usize,
    xpos: Vec<f64>,
    geom_xpos: Vec<f64>,
    /// `None` where rounding decides.
    sensordata: Vec<Option<f64>>,
    /// Values of `sensordata` that the rounding of single precision decides.
    noisy: Vec<bool>,
    next_qpos: Vec<f64>,
    next_qvel: Vec<f64>,
    next_act: Vec<f64>,
}

/// Quantities by name, each a vector. NaN stands for an unknown value.
type Quantities = BTreeMap<String, Vec<f64>>;

fn widen<T: Real>(v: &[T]) -> Vec<f64> {
    v.iter().map(|x| T::widen(x.get(0))).collect()
}

/// The simulation's results for a state.
fn ours<T: Real>(sim: &Sim<T>, work: &mut Work<T>, state: &State) -> Quantities {
    let model = sim.model();
    let mut group = Group::new(sim);
    group.reset_lane(sim, 0, &state.qpos, &state.qvel);
    for (u, x) in group.ctrl.iter_mut().zip(&state.ctrl) {
        u.set(0, T::scalar(*x));
    }
    for (a, x) in group.act.iter_mut().zip(&state.act) {
        a.set(0, T::scalar(*x));
    }
    for (k, [x, y, z, quat @ ..]) in state.mocap.iter().enumerate() {
        group.set_mocap(0, k, &[*x, *y, *z], quat);
    }
    for (body, x) in state.xfrc.chunks(6).enumerate().filter(|(_, x)| x.iter().any(|x| *x != 0.0)) {
        group.push(sim, 0, body, [x[0], x[1], x[2]], [x[3], x[4], x[5]]);
    }
    sim.forward(work, &group);
    let plan = MeasurePlan { of_last_step: true, bodies: true, joints: true, ..MeasurePlan::default() };
    sim.measure(work, &group, &plan);
    let r = Readings::new(sim, &group, work);
    let mut out = Quantities::new();
    let mut put = |name: &str, values: Vec<T>| out.insert(name.to_owned(), widen(&values));
    put("acceleration", (0..model.nv).map(|d| r.qacc(d)).collect());
    put("constraint force", r.constraint_forces());
    put("bias force", r.qfrc_bias());
    put("applied force", r.applied_forces());
    put("actuator force", (0..model.nv).map(|d| r.qfrc_actuator(d)).collect());
    put("mass matrix", r.mass_matrix().into_iter().flatten().collect());
    let bodies = 1..model.bodies.len();
    put("cfrc_ext", bodies.clone().flat_map(|b| r.cfrc_ext(b)).collect());
    put("contacts", vec![r.contact_count()]);
    put("body position", bodies.flat_map(|b| r.body_pos(b)).collect());
    put("geom position", (0..model.geoms.len()).flat_map(|g| r.geom_pos(g)).collect());
    for (i, sensor) in model.sensors.iter().enumerate() {
        let values = r.sensor(i).unwrap_or_else(|| vec![T::lit(f64::NAN); sensor.dim]);
        put(&name_of(sensor), values);
    }
    sim.step(work, &mut group, 1);
    let mut put = |name: &str, values: &[T]| out.insert(name.to_owned(), widen(values));
    put("next position", &group.qpos);
    put("next velocity", &group.qvel);
    put("next activation", &group.act);
    out
}

/// MuJoCo's results for a state.
fn theirs(model: &Model, state: &State) -> Quantities {
    let mut out: Quantities = [
        ("acceleration", &state.qacc),
        ("constraint force", &state.qfrc_constraint),
        ("bias force", &state.qfrc_bias),
        ("applied force", &state.qfrc_applied),
        ("actuator force", &state.qfrc_actuator),
        ("mass matrix", &state.qM),
        ("cfrc_ext", &state.cfrc_ext),
        ("contacts", &vec![state.ncon as f64]),
        ("body position", &state.xpos[3..].to_vec()),
        ("geom position", &state.geom_xpos),
        ("next position", &state.next_qpos),
        ("next velocity", &state.next_qvel),
        ("next activation", &state.next_act),
    ]
    .into_iter()
    .map(|(name, values)| (name.to_owned(), values.clone()))
    .collect();
    for sensor in &model.sensors {
        let values = &state.sensordata[sensor.adr..sensor.adr + sensor.dim];
        let values = values.iter().map(|x| x.unwrap_or(f64::NAN)).collect();
        out.insert(name_of(sensor), values);
    }
    out
}

fn name_of(sensor: &Sensor) -> String {
    format!("sensor {} {}", sensor.name, sensor.element)
}

/// Differences above a bound: quantity and relative difference, absolute below 1. Sensor values that depend on rounding
/// are not compared.
fn differences(got: &Quantities, want: &Quantities, bound: f64) -> Vec<(String, f64)> {
    let mut out = Vec::new();
    for (name, want) in want {
        let got = &got[name];
        if name.starts_with("sensor") && want.iter().any(|x| x.is_nan()) {
            continue;
        }
        let d = distance(got, want, 1.0);
        if d > bound {
            out.push((name.clone(), d));
        }
    }
    out
}

/// Results of the models.
#[derive(Default)]
struct Report {
    models: usize,
    states: usize,
    skipped: usize,
    contacts: usize,
    /// Models whose cap stops the solver early.
    capped: usize,
    /// States in which rounding decides MuJoCo's constraint forces.
    weightless: usize,
    /// States that were compared in single precision.
    single: usize,
    /// Largest differences within the bounds: of double and of single precision.
    worst: [f64; 2],
    failures: BTreeMap<u64, Vec<String>>,
    /// Accelerations that differ. The oracle decides which engine has the error.
    judge: Vec<Value>,
}

impl Report {
    fn fail(&mut self, seed: u64, what: String) {
        println!("seed {seed:6} {what}");
        self.failures.entry(seed).or_default().push(what);
    }

    /// Compares a model.
    fn add(&mut self, answer: &Answer) {
        let seed = answer.seed;
        self.models += 1;
        if let Some(error) = &answer.error {
            return self.fail(seed, format!("MuJoCo refuses it: {error}"));
        }
        let model = match Model::from_xml_str(&answer.xml, "random.xml") {
            Ok(model) => model,
            Err(e) => return self.fail(seed, format!("refused: {e}")),
        };
        let mut compiled = Vec::new();
        differ("", &serde_json::to_value(&model).expect("a model is JSON"), &answer.compiled, &mut compiled);
        if !compiled.is_empty() {
            self.fail(seed, format!("compiled: {}", compiled[..compiled.len().min(3)].join("; ")));
        }
        let mut exact = model.clone();
        // a low cap is followed exactly; other models are solved to convergence on both sides
        self.capped += usize::from(model.opt.iterations < 50);
        if model.opt.iterations >= 50 {
            exact.opt.tolerance = 1e-14;
            exact.opt.iterations = 300;
            exact.opt.ls_iterations = 100;
        }
        let sim = match Sim::<f64>::new(&exact, SimOptions::default()) {
            Ok(sim) => sim,
            Err(e) => return self.fail(seed, format!("refused: {e}")),
        };
        let single = Sim::<f32>::new(&model, SimOptions::default()).expect("as in double precision");
        let (mut work, mut single_work) = (Work::new(&sim), Work::new(&single));
        self.skipped += answer.skipped;
        for (i, state) in answer.states.iter().enumerate() {
            self.states += 1;
            self.contacts += usize::from(state.ncon > 0);
            let (got, want) = (ours(&sim, &mut work, state), theirs(&model, state));
            let mut want = want;
            if state.weightless {
                self.weightless += 1;
                want.retain(|name, _| UNCONSTRAINED.contains(&name.as_str()));
            }
            let wrong = differences(&got, &want, DOUBLE);
            if wrong.iter().any(|(name, _)| name == "acceleration") {
                let entry = json!({"seed": seed, "state": i, "states": STATES, "qacc": got["acceleration"]});
                self.judge.push(entry);
            }
            if wrong.is_empty() {
                self.worst[0] = largest([self.worst[0], worst(&got, &want)]);
            } else {
                self.fail(seed, format!("state {i}: {}", list(&wrong)));
            }
            if state.single {
                self.single += 1;
                let rounded = ours(&single, &mut single_work, state);
                let mut got = got;
                if state.weightless {
                    got.retain(|name, _| !FORCES.iter().any(|f| name.starts_with(f)));
                }
                for sensor in model.sensors.iter().filter(|s| state.noisy[s.adr..s.adr + s.dim].contains(&true)) {
                    got.remove(&name_of(sensor));
                }
                let wrong = differences(&rounded, &got, SINGLE);
                if wrong.is_empty() {
                    self.worst[1] = largest([self.worst[1], worst(&rounded, &got)]);
                } else {
                    self.fail(seed, format!("state {i}: single precision: {}", list(&wrong)));
                }
            }
        }
    }
}

fn worst(got: &Quantities, want: &Quantities) -> f64 {
    largest(differences(got, want, 0.0).into_iter().map(|(_, d)| d))
}

fn list(wrong: &[(String, f64)]) -> String {
    wrong.iter().map(|(name, d)| format!("{name} {d:.0e}")).collect::<Vec<_>>().join(", ")
}

fn seeds() -> Range<u64> {
    let Ok(text) = std::env::var("MARATHON_SEEDS") else { return SEEDS };
    let range = text.split_once("..").and_then(|(a, b)| Some(a.parse().ok()?..b.parse().ok()?));
    range.unwrap_or_else(|| panic!("MARATHON_SEEDS is '{text}'; expected a range as 0..5000"))
}

#[test]
fn random_models_agree_with_mujoco() {
    let seeds = seeds();
    let count = seeds.end.saturating_sub(seeds.start);
    let job = json!({"first": seeds.start, "count": count, "states": STATES});
    let folder = std::env::var_os("MARATHON_OUT").map(PathBuf::from);
    let mut report = Report::default();
    for line in common::oracle_text("random_models.py", &job).lines() {
        let answer: Answer = serde_json::from_str(line).expect("an answer in JSON");
        report.add(&answer);
        if let (Some(folder), true) = (&folder, report.failures.contains_key(&answer.seed)) {
            std::fs::create_dir_all(folder).expect("the folder can be made");
            std::fs::write(folder.join(format!("{}.xml", answer.seed)), &answer.xml).expect("the model can be written");
        }
    }
    println!(
        "{} models ({} with low caps), {} states ({} with contacts, {} weightless, {} in single precision), {} draws left out; within the bounds at most \
         {:.0e} in double precision and {:.0e} in single",
        report.models,
        report.capped,
        report.states,
        report.contacts,
        report.weightless,
        report.single,
        report.skipped,
        report.worst[0],
        report.worst[1]
    );
    let verdicts = common::oracle("random_models.py", &json!({"judge": report.judge}));
    for (entry, verdict) in report.judge.iter().zip(verdicts.as_array().expect("a list")) {
        println!("seed {} state {}: distance from the minimum: {verdict}", entry["seed"], entry["state"]);
    }
    println!("{} of {} models differ", report.failures.len(), report.models);
    assert_eq!(report.models as u64, count);
    assert!(report.states as u64 >= 2 * count, "{} states of {count} models", report.states);
    let failures: Vec<String> = report.failures.iter().map(|(s, f)| format!("seed {s}: {}", f.join("; "))).collect();
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}
