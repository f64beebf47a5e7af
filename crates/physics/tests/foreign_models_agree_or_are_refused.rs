//! Contract: a model from another project either loads and agrees with MuJoCo, or is refused by name.
//!
//! The test covers all model files of the Python packages of `tests/oracle` (dm_control, Gymnasium, MuJoCo, MJX, MuJoCo
//! Warp, Brax and others). None may panic, or load and move differently. On random states, including contacts of all
//! kinds, the acceleration, the constraint forces, the number of contacts, the sensors and the next state equal
//! MuJoCo's to 1e-8 in double precision. A refusal names the file or the model, and the element or the feature.
//!
//! Every model runs under its own solver settings. If they stop MuJoCo's iteration before it converges, the test
//! compares with the point where it stops. If they let it converge, its answer is only as exact as the file's
//! tolerance. The accelerations then agree within that tolerance, and everything agrees to 1e-8 when both sides solve
//! to the end.
//!
//! `MARATHON_MODELS=FOLDER` tests the models of a folder instead. `docs/research/models.md` lists the result of each file. The
//! test fails if the list is out of date; run it with `MARATHON_BLESS=1` to update the list.

use crate::common;
use crate::common::numbers::{distance, largest};
use marathon_physics::mjcf::{MjcfError, MjcfErrorKind};
use marathon_physics::model::{Geom, Hull, Solver};
use marathon_physics::{Group, Model, Readings, Sim, SimError, SimOptions, Work};
use serde::Deserialize;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::fmt::Write;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

/// States per model.
const STATES: usize = 20;
/// Largest relative error.
const BOUND: f64 = 1e-8;
/// The same of models whose contacts MuJoCo finds by iteration: its tolerance is 1e-6.
const ITERATED_BOUND: f64 = 2e-6;
/// Of these models, states that may differ: ties between contacts that the oracle has not noticed.
const TIES: usize = 3;
/// Models that differ in more states, because MuJoCo orders the sides of hulls by Qhull and a hash table. They agree if it
/// orders them like Marathon.
const DIFFERING: [&str; 3] = [
    "dm_control/locomotion/walkers/assets/build_fruitfly/assets/drosophila_fused.xml",
    "gymnasium_robotics/envs/assets/fetch/slide.xml",
    "mujoco_warp/test_data/aloha_pot/scene.xml",
];
const BY_ORDER: &str = "the order of a hull's sides decides, in MuJoCo too; agrees if MuJoCo has Marathon's order";
/// Largest part of the models that differ.
const MOST_DIFFERING: f64 = 0.03;
/// Models that MuJoCo loads and that move: the subject of the contract.
const AT_LEAST: usize = 100;

/// A file in the list of `foreign_models.py`.
#[derive(Deserialize)]
struct File {
    id: String,
    path: PathBuf,
    /// Another file with the same text.
    same_as: Option<String>,
    /// Reason why MuJoCo does not load it.
    error: Option<String>,
    /// MuJoCo warns about its reference configuration.
    warns: bool,
    /// It has neither bodies nor geoms: a part for inclusion.
    empty: bool,
    #[serde(default)]
    nv: usize,
    #[serde(default)]
    nu: usize,
}

/// A state, and MuJoCo's results for it.
#[derive(Deserialize)]
struct State {
    qpos: Vec<f64>,
    qvel: Vec<f64>,
    ctrl: Vec<f64>,
    act: Vec<f64>,
    qacc: Vec<f64>,
    qfrc_constraint: Vec<f64>,
    ncon: usize,
    /// `None` where rounding decides.
    sensordata: Vec<Option<f64>>,
    next_qpos: Vec<f64>,
    next_qvel: Vec<f64>,
    next_act: Vec<f64>,
    /// Relative error of the acceleration that MuJoCo's iteration for contacts has.
    own_error: f64,
    /// Acceleration under the file's own settings, and the solver's number of iterations.
    own: Vec<f64>,
    iterations: usize,
    /// Relative change of the acceleration in another order of the hulls' sides.
    by_order: Option<f64>,
}

/// Results of `foreign_models.py` for a model.
#[derive(Deserialize)]
struct Answer {
    states: Vec<State>,
    /// States that were drawn and left out.
    skipped: usize,
    /// Whether MuJoCo finds some of the model's contacts by iteration.
    iterates: bool,
}

/// Result of a file.
enum Outcome {
    Loads(Box<Loaded>),
    Refused(Refusal),
}

/// A model under its own settings. It is solved to convergence if they let the solver converge.
struct Loaded {
    own: Sim<f64>,
    to_the_end: Option<Sim<f64>>,
}

/// Reason why a model was refused.
struct Refusal {
    /// The reason in the table's words.
    why: String,
    /// Information that the error lacks for the user to find the place.
    vague: Option<&'static str>,
    /// Whether the error says that the model is faulty, instead of needing an unsupported feature.
    faulty: bool,
}

/// Differences of a loaded model from MuJoCo.
#[derive(Default)]
struct Agreement {
    /// Largest error of each quantity.
    errors: BTreeMap<String, f64>,
    /// States with a different number of contacts.
    contacts: usize,
    /// Largest difference under the file's own settings, relative to the difference that its tolerance allows.
    in_tolerances: f64,
}

impl Agreement {
    /// `scale` divides the error.
    fn add(&mut self, what: &str, got: &[f64], want: &[f64], scale: f64) {
        let error = self.errors.entry(what.to_owned()).or_default();
        *error = error.max(distance(got, want, 1.0) / scale);
    }

    fn worst(&self) -> f64 {
        largest(self.errors.values().copied())
    }
}

/// Loads a file and prepares its simulation.
fn load(path: &Path) -> Outcome {
    let mut model = match Model::from_xml_file(path) {
        Ok(model) => model,
        Err(e) => return Outcome::Refused(mjcf_refusal(path, &e)),
    };
    if !model.hfields.is_empty() {
        // as in the oracle: contacts with height fields are found to the end
        (model.opt.ccd_tolerance, model.opt.ccd_iterations) = (1e-15, 1000);
    }
    match Sim::<f64>::new(&model, SimOptions::default()) {
        Ok(own) => {
            let converges = converges(&model);
            model.opt.tolerance = 1e-14;
            model.opt.iterations = 200;
            model.opt.ls_iterations = 100;
            let end = converges.then(|| Sim::new(&model, SimOptions::default()).expect("only its tolerance differs"));
            Outcome::Loads(Box::new(Loaded { own, to_the_end: end }))
        }
        Err(e) => {
            let text = e.to_string();
            let what = match e {
                SimError::Unsupported { what, .. } => what,
                SimError::Budget { over, .. } => over.to_string(),
            };
            let vague = if !text.contains(&format!("'{}'", model.name)) {
                Some("the error does not name the model")
            } else if what.contains("''") {
                Some("the error names an element by an empty name")
            } else {
                None
            };
            Outcome::Refused(Refusal { why: what, vague, faulty: false })
        }
    }
}

fn mjcf_refusal(path: &Path, e: &MjcfError) -> Refusal {
    let folder = format!("{}/", path.parent().expect("a file is in a folder").display());
    let text = e.to_string().replace(&folder, "");
    let own = format!("{}:", path.file_name().expect("a file has a name").display());
    // lines of the file itself need no name, those of included files do
    let why = text.strip_prefix(&own).map_or(text.clone(), |rest| match e.line {
        0 => rest.trim_start().to_owned(),
        _ => format!("line {rest}"),
    });
    let vague = if e.file.is_empty() || !text.contains(".xml") {
        Some("the error names no file")
    } else if e.line == 0 {
        Some("the error names no line")
    } else {
        None
    };
    Refusal { why, vague, faulty: !matches!(e.kind, MjcfErrorKind::Unsupported { .. }) }
}

/// Whether a file's settings let MuJoCo's solver converge. On these models, it needs at most 25 iterations.
fn converges(model: &Model) -> bool {
    model.opt.iterations >= 50
}

/// Compares the acceleration under the file's own settings with MuJoCo's, relative to the tolerance. Both are within
/// the tolerance of the minimum cost. The cost rises with the square of the distance, measured by the mass matrix.
fn in_tolerances(sim: &Sim<f64>, states: &[State]) -> f64 {
    let (model, mut work) = (sim.model(), Work::new(sim));
    let errors = states.iter().map(|state| {
        let mut group = Group::new(sim);
        group.reset_lane(sim, 0, &state.qpos, &state.qvel);
        group.ctrl.copy_from_slice(&state.ctrl);
        group.act.copy_from_slice(&state.act);
        sim.forward(&mut work, &group);
        let r = Readings::new(sim, &group, &work);
        let apart: Vec<f64> = (0..model.nv).map(|d| r.qacc(d) - state.own[d]).collect();
        let masses = r.mass_matrix();
        let momentum = |row: &Vec<f64>| row.iter().zip(&apart).map(|(m, x)| m * x).sum::<f64>();
        let square: f64 = masses.iter().zip(&apart).map(|(row, x)| x * momentum(row)).sum();
        let cost = 0.5 * square / (model.stat.mean_inertia * model.nv as f64);
        cost / (4.0 * model.opt.tolerance).max(1e-16)
    });
    largest(errors)
}

/// Compares a model with MuJoCo on the states.
fn compare(loaded: &Loaded, answer: &Answer) -> Agreement {
    let states = &answer.states;
    let mut out = Agreement::default();
    if loaded.to_the_end.is_some() {
        out.in_tolerances = in_tolerances(&loaded.own, states);
    }
    let sim = loaded.to_the_end.as_ref().unwrap_or(&loaded.own);
    let model = sim.model();
    let mut work = Work::new(sim);
    let mut each: Vec<Agreement> = Vec::new();
    for state in states {
        let mut out = Agreement::default();
        let mut group = Group::new(sim);
        group.reset_lane(sim, 0, &state.qpos, &state.qvel);
        group.ctrl.copy_from_slice(&state.ctrl);
        group.act.copy_from_slice(&state.act);
        sim.forward(&mut work, &group);
        let r = Readings::new(sim, &group, &work);
        // where MuJoCo's own answer has an error above the bound, agreement is within that error
        let scale = (state.own_error / ITERATED_BOUND).max(1.0);
        let acc: Vec<f64> = (0..model.nv).map(|d| r.qacc(d)).collect();
        out.add("acceleration", &acc, &state.qacc, scale);
        out.add("constraint force", &r.constraint_forces(), &state.qfrc_constraint, scale);
        out.contacts += usize::from(r.contact_count() as usize != state.ncon);
        for (i, sensor) in model.sensors.iter().enumerate() {
            let Some(values) = r.sensor(i) else { continue };
            let want = &state.sensordata[sensor.adr..sensor.adr + values.len()];
            if let Some(want) = want.iter().copied().collect::<Option<Vec<f64>>>() {
                out.add(&format!("sensor '{}'", sensor.name), &values, &want, scale);
            }
        }
        sim.step(&mut work, &mut group, 1);
        out.add("next position", &group.qpos, &state.next_qpos, scale);
        out.add("next velocity", &group.qvel, &state.next_qvel, scale);
        out.add("next activation", &group.act, &state.next_act, scale);
        each.push(out);
    }
    let mut may_differ = if answer.iterates { TIES } else { 0 };
    for state in each {
        if may_differ > 0 && (state.contacts > 0 || !(state.worst() <= ITERATED_BOUND)) {
            may_differ -= 1;
            continue;
        }
        out.contacts += state.contacts;
        for (what, error) in state.errors {
            let known = out.errors.entry(what).or_default();
            *known = known.max(error);
        }
    }
    out
}

/// A line of the table: a part that is the same everywhere, and measurements.
struct Row {
    package: String,
    /// The heading that counts it.
    verdict: &'static str,
    fixed: String,
    measured: String,
}

const AGREES: &str = "agree with MuJoCo";
const DIFFERS: &str = "differ";
const STILL: &str = "load, nothing to compare";
const REFUSED: &str = "refused by name";
const BROKEN: &str = "MuJoCo refuses them too";

/// An error bound in steps that do not depend on the processor's rounding.
fn bucket(error: f64) -> &'static str {
    match error {
        e if e <= 1e-12 => "1e-12",
        e if e <= 1e-10 => "1e-10",
        e if e <= 1e-9 => "1e-9",
        e if e <= BOUND => "1e-8",
        e if e <= ITERATED_BOUND => "2e-6",
        _ => "more",
    }
}

fn table(rows: &[Row], same: usize, empty: usize) -> String {
    let mut text = String::from(INTRODUCTION);
    let tally = |verdict: &str, rows: &[&Row]| rows.iter().filter(|r| r.verdict == verdict).count();
    let mut packages: BTreeMap<&str, Vec<&Row>> = BTreeMap::new();
    for row in rows {
        packages.entry(&row.package).or_default().push(row);
    }
    let verdicts = [AGREES, DIFFERS, STILL, REFUSED, BROKEN];
    writeln!(text, "| package | files | {} |", verdicts.join(" | ")).expect("text");
    writeln!(text, "|---|---|---|---|---|---|---|").expect("text");
    let everything: Vec<&Row> = rows.iter().collect();
    for (name, rows) in packages.iter().map(|(n, r)| (*n, r)).chain([("**all**", &everything)]) {
        let counts: Vec<String> = verdicts.iter().map(|v| tally(v, rows).to_string()).collect();
        writeln!(text, "| {name} | {} | {} |", rows.len(), counts.join(" | ")).expect("text");
    }
    let early = rows.iter().filter(|r| r.fixed.contains("that it allows")).count();
    writeln!(text, "\n{early} of them allow the solver fewer than 50 iterations.").expect("text");
    writeln!(text, "\nLeft out: {same} files with the text of another one and {empty} without a body or a geom.")
        .expect("text");
    for (name, rows) in packages {
        writeln!(text, "\n## {name}\n\n| file | outcome | error | states left out |\n|---|---|---|---|").expect("text");
        for row in rows {
            writeln!(text, "{}{}", row.fixed, row.measured).expect("text");
        }
    }
    text
}

const INTRODUCTION: &str = "\
# Models that were tried

This page lists every model file of the Python packages that the tests install, with its result. The test
[`foreign_models_agree_or_are_refused`](../../crates/physics/tests/foreign_models_agree_or_are_refused.rs) writes it, and fails when it is
out of date:

```text
MARATHON_BLESS=1 cargo test --release -p marathon-physics foreign_models_agree_or_are_refused::
```

The test draws 20 random states of each model: poses within the joint limits and a little beyond, any orientation, random velocities and
controls. A model *agrees* if these quantities equal MuJoCo's in double precision, under the file's own solver settings:

* acceleration, constraint forces, number of contacts, sensors and the next state;
* after the same number of iterations, where the file's cap ends MuJoCo's iteration early;
* within the file's tolerance where the iteration converges, and to 1e-8 when both solve to the end.

Models with ellipsoids, cylinders or meshes that collide agree to 2e-6, or to the error of MuJoCo's own answer where that is larger: MuJoCo finds
their contacts by an iteration that stops at this tolerance. Three of their 20 states may differ, because ties between contacts are common.
States are drawn again if any of eight changes of position by 1e-9 changes the contacts, or if a contact is less than 2 micrometers deep.

Models that differ in more states are marked, with the cause. MuJoCo merges the triangles of a hull to sides. Qhull and a hash table order
the sides, and the order decides between sides that are nearly parallel. In another order, MuJoCo's own accelerations change by up to 40 % in
these models. Another order of the triangles in the mesh files is enough: it changes those of `fetch/slide.xml` by up to 0.9 %. The test also
orders the sides of MuJoCo's hulls like Marathon's. Then these models agree.

The column *error* bounds the largest relative error of all these. States in which MuJoCo has no definite answer are drawn again: those
with accelerations above 1e8, and those in which a change of position by 1e-9 changes the contacts or the acceleration by more than 1e-4.

A refused model is refused by the loader, with the message shown.

";

/// The table without measurements.
fn without_measurements(text: &str) -> Vec<String> {
    let cut = |line: &str| {
        let cells: Vec<&str> = line.split(" | ").collect();
        if cells.len() == 4 { cells[..2].join(" | ") } else { line.to_owned() }
    };
    text.lines().map(cut).collect()
}

#[test]
fn foreign_models_agree_or_are_refused() {
    let answer = common::oracle("foreign_models.py", &Value::Null);
    let found: Vec<File> = serde_json::from_value(answer).expect("a list of files");
    let (same, files): (Vec<File>, Vec<File>) = found.into_iter().partition(|f| f.same_as.is_some());
    let (empty, files): (Vec<File>, Vec<File>) = files.into_iter().partition(|f| f.empty);
    let tried = files.iter().filter(|f| f.error.is_none() && f.nv > 0).count();
    let others = std::env::var_os("MARATHON_MODELS").is_some();
    assert!(others || tried >= AT_LEAST, "only {tried} foreign models were found: run ./test.sh, which installs them");

    // no input causes a panic
    let mut failures = Vec::new();
    let mut load = |file: &File| {
        let outcome = catch_unwind(AssertUnwindSafe(|| load(&file.path)));
        outcome.map_err(|_| failures.push(format!("{}: panicked while loading", file.id))).ok()
    };
    for file in same.iter().chain(&empty) {
        load(file);
    }
    let outcomes: Vec<(File, Outcome)> = files.into_iter().filter_map(|f| load(&f).map(|o| (f, o))).collect();

    // MuJoCo's part of the comparison
    let compared: Vec<&File> = outcomes
        .iter()
        .filter(|(f, o)| f.error.is_none() && f.nv > 0 && matches!(o, Outcome::Loads(_)))
        .map(|(f, _)| f)
        .collect();
    let mut answers = ask(compared.iter().map(|f| (*f, Value::Null)));
    // of other models, it is not known which differ
    let differs = |file: &File, loaded: &Loaded| match answers.get(&file.id).filter(|_| others) {
        Some(answer) if !answer.states.is_empty() => {
            let agreement = catch_unwind(AssertUnwindSafe(|| compare(loaded, answer)));
            agreement.is_ok_and(|a| disagreement(&file.id, loaded.own.model(), answer.iterates, &a).is_some())
        }
        _ => DIFFERING.contains(&&*file.id),
    };
    let mut in_order = ask(outcomes.iter().filter_map(|(file, outcome)| match outcome {
        Outcome::Loads(loaded) if differs(file, loaded) => Some((file, hulls(loaded.own.model()))),
        _ => None,
    }));

    let mut rows = Vec::new();
    for (file, outcome) in &outcomes {
        let mut measured = " |  |  |".to_owned();
        let (verdict, words) = match (outcome, &file.error) {
            (Outcome::Refused(refusal), error) => {
                if let Some(vague) = refusal.vague {
                    failures.push(format!("{}: {vague}: {}", file.id, refusal.why));
                }
                if refusal.faulty && error.is_none() && !file.warns {
                    failures.push(format!("{}: MuJoCo loads it, but: {}", file.id, refusal.why));
                }
                let verdict = if error.is_some() { BROKEN } else { REFUSED };
                (verdict, format!("refused: {}", refusal.why.replace('|', "\\|").replace('<', "&lt;")))
            }
            (Outcome::Loads(_), Some(error)) => {
                failures.push(format!("{}: loads, but MuJoCo refuses it: {error}", file.id));
                continue;
            }
            (Outcome::Loads(_), None) if file.nv == 0 => (STILL, "loads; nothing moves".into()),
            (Outcome::Loads(loaded), None) => {
                let m = loaded.own.model();
                if (m.nv, m.nu) != (file.nv, file.nu) {
                    failures.push(format!("{}: nv, nu are {}, {}, not {}, {}", file.id, m.nv, m.nu, file.nv, file.nu));
                    continue;
                }
                let answer = answers.remove(&file.id).expect("an answer per job");
                if answer.states.is_empty() {
                    (STILL, "loads; rounding decides what it touches".into())
                } else if let Ok(agreement) = catch_unwind(AssertUnwindSafe(|| compare(loaded, &answer))) {
                    let problem = disagreement(&file.id, m, answer.iterates, &agreement);
                    let same_order = in_order.remove(&file.id);
                    match (problem, &same_order) {
                        (Some(problem), None) => failures.push(problem),
                        (None, Some(_)) => println!("{}: agrees, although it is listed as differing", file.id),
                        _ => {}
                    }
                    if let Some(answer) = &same_order {
                        failures.extend(disagreement_in_order(&file.id, loaded, answer));
                    }
                    let cap = (m.opt.iterations, m.opt.ls_iterations, m.opt.solver);
                    let most = answer.states.iter().map(|s| s.iterations).max().unwrap_or(0);
                    println!(
                        "{}: caps {cap:?}, MuJoCo's iterations {most}: {:.1e}, {:.1e} tolerances",
                        file.id,
                        agreement.worst(),
                        agreement.in_tolerances
                    );
                    measured = format!(" | {} | {} |", bucket(agreement.worst()), answer.skipped);
                    match same_order {
                        Some(_) => (DIFFERS, format!("differs: {BY_ORDER}")),
                        None => (AGREES, agrees(m)),
                    }
                } else {
                    failures.push(format!("{}: panicked while stepping", file.id));
                    continue;
                }
            }
        };
        let package = if file.id.starts_with("mujoco/mjx/") { "mujoco_mjx" } else { &file.id };
        let package = package.split('/').next().expect("a first part").to_owned();
        rows.push(Row { package, verdict, fixed: format!("| `{}` | {words}", file.id), measured });
    }
    let count = |verdict: &str| rows.iter().filter(|row| row.verdict == verdict).count();
    let part = count(DIFFERS) as f64 / (count(DIFFERS) + count(AGREES)).max(1) as f64;
    let text = table(&rows, same.len(), empty.len());
    if others {
        println!("{text}");
    } else {
        assert!(part <= MOST_DIFFERING, "{part} of the models differ");
        check_document(&text, &mut failures);
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

/// MuJoCo's answers for models, by file. Those with hulls are for MuJoCo's hulls in this order.
fn ask<'a>(models: impl Iterator<Item = (&'a File, Value)>) -> BTreeMap<String, Answer> {
    let (ids, jobs): (Vec<String>, Vec<Value>) = models
        .map(|(file, hulls)| {
            let job = json!({"xml": file.path, "states": STATES, "seed": seed(&file.id), "hulls": hulls});
            (file.id.clone(), job)
        })
        .unzip();
    let answers = common::oracle("foreign_models.py", &Value::Array(jobs));
    ids.into_iter().zip(serde_json::from_value::<Vec<Answer>>(answers).expect("an answer per job")).collect()
}

/// The hulls of a model's meshes.
fn hulls(model: &Model) -> Value {
    let of_geom = |g: &Geom| Some((&model.meshes[g.mesh?].name, &model.hulls[g.hull?]));
    let hulls: BTreeMap<_, _> = model.geoms.iter().filter_map(of_geom).collect();
    let entry = |(mesh, hull): (_, &Hull)| json!({"mesh": mesh, "vertices": hull.vertices, "polygons": hull.polygons});
    hulls.into_iter().map(entry).collect()
}

/// The problem of a model whose hulls MuJoCo orders alike. Where it does not matter, the order is no cause of a
/// difference.
fn disagreement_in_order(id: &str, loaded: &Loaded, answer: &Answer) -> Option<String> {
    let changes = largest(answer.states.iter().filter_map(|s| s.by_order));
    let agreement = compare(loaded, answer);
    println!("{id}: {:.1e} in the same order of sides, {changes:.1e} by another order", agreement.worst());
    if changes <= ITERATED_BOUND {
        return Some(format!("{id}: the order of sides changes MuJoCo's acceleration only by {changes:.0e}"));
    }
    let problem = disagreement(id, loaded.own.model(), answer.iterates, &agreement);
    problem.map(|text| format!("{text}, in the same order of sides"))
}

/// A seed for a file that does not depend on other files (FNV-1a).
fn seed(id: &str) -> u32 {
    id.bytes().fold(0x811c_9dc5, |h, b| (h ^ u32::from(b)).wrapping_mul(0x0100_0193))
}

/// Agreement of a model: its cap, and whether MuJoCo's solver stops before the minimum.
fn agrees(model: &Model) -> String {
    let name = match model.opt.solver {
        Solver::Newton => "",
        Solver::Cg => "CG",
        Solver::Pgs => "PGS",
    };
    match (model.opt.iterations, name) {
        (_, "") if converges(model) => "agrees".into(),
        (1, "") => "agrees after the 1 iteration that it allows".into(),
        (n, "") => format!("agrees after the {n} iterations that it allows"),
        (n, name) => format!("agrees; its own solver, {name}, stops after {n} iterations near the minimum"),
    }
}

/// The problem of a loaded model, if any.
fn disagreement(id: &str, model: &Model, iterates: bool, a: &Agreement) -> Option<String> {
    let mut wrong = Vec::new();
    if a.contacts > 0 {
        wrong.push(format!("contacts differ in {} states", a.contacts));
    }
    let bound = if iterates { ITERATED_BOUND } else { BOUND };
    wrong.extend(a.errors.iter().filter(|(_, e)| **e > bound).map(|(what, e)| format!("{what} {e:.0e}")));
    // the other solvers converge slowly: their caps stop them within a few tolerances
    let allowed = if model.opt.solver == Solver::Newton { 1.0 } else { 10.0 };
    // contacts that are found by iteration have larger errors than the solver
    if !iterates && !(a.in_tolerances <= allowed) {
        wrong.push(format!("under its own settings {:.0e} tolerances", a.in_tolerances));
    }
    if !wrong.is_empty() && !converges(model) {
        wrong.push(format!("at its cap of {} iterations", model.opt.iterations));
    }
    (!wrong.is_empty()).then(|| format!("{id}: disagrees with MuJoCo: {}", wrong.join(", ")))
}

/// Compares `docs/research/models.md` with the expected text, or writes it.
fn check_document(text: &str, failures: &mut Vec<String>) {
    let path = common::workspace().join("docs/research/models.md");
    if std::env::var_os("MARATHON_BLESS").is_some_and(|v| v == "1") {
        std::fs::write(&path, text).expect("docs/research/models.md can be written");
        return;
    }
    let committed = std::fs::read_to_string(&path).unwrap_or_default();
    let (want, have) = (without_measurements(text), without_measurements(&committed));
    let different = want.iter().zip(&have).find(|(a, b)| a != b);
    if let Some((want, have)) = different {
        failures
            .push(format!("docs/research/models.md is out of date (MARATHON_BLESS=1 writes it):\n- {have}\n+ {want}"));
    } else if want.len() != have.len() {
        failures.push("docs/research/models.md is out of date (MARATHON_BLESS=1 writes it): its length differs".into());
    }
}
