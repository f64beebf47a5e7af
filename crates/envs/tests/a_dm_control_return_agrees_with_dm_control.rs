//! Policies, returns and start distributions carry over between dm_control's tasks here and in dm_control.
//!
//! The test covers every task of [`dm_control`](marathon_envs::agents::dm_control), with default and with other
//! arguments:
//!
//! - From the same state and with the same actions, observation and reward agree: for 100 decisions in double
//!   precision, and for every single decision in single precision.
//! - Rewards are between 0 and 1.
//! - Starts have the same distribution.
//! - Episodes have the same length, and only the time limit ends them.
//! - Returns of random actions are equal within their confidence interval.
//!
//! The other side is the installed `dm_control`, run by `tests/oracle/dm_control_tasks.py`.

use crate::common::numbers::largest;
use crate::common::{Noise, oracle, package};
use marathon_envs::{AgentState, Autoreset, Options, Sigmoid, Step, Tolerance, Value, VecEnv, VecEnvOptions};
use marathon_physics::lanes::Isa;
use serde_json::{Value as Json, json};

/// Decisions per episode.
const DECISIONS: usize = 100;
/// Sizes of the actions of a task's episodes, relative to their bounds.
const SCALES: [f32; 4] = [0.1, 0.4, 1.0, 1.5];
/// Distance from a twin that began 1e-10 away above which an episode is too chaotic for a comparison.
const CHAOS: f64 = 1e-4;

/// A task with arguments.
struct Case {
    domain: &'static str,
    task: &'static str,
    arguments: Vec<(&'static str, Value)>,
}

impl Case {
    fn new(domain: &'static str, task: &'static str) -> Self {
        Case { domain, task, arguments: Vec::new() }
    }

    fn with(mut self, name: &'static str, value: impl Into<Value>) -> Self {
        self.arguments.push((name, value.into()));
        self
    }

    fn id(&self) -> String {
        format!("{}-{}-v0", self.domain, self.task)
    }

    fn name(&self) -> String {
        let arguments: Vec<String> = self.arguments.iter().map(|(name, value)| format!("{name}={value}")).collect();
        format!("{}({})", self.id(), arguments.join(", "))
    }

    /// The environment. With `converge`, its solver runs until it converges, which only a model can set.
    fn make(&self, agents: usize, isa: Option<Isa>, converge: bool) -> VecEnv {
        let mut options: Options = self.arguments.iter().map(|(n, v)| ((*n).to_string(), v.clone())).collect();
        if converge && options.get("xml_file").is_none() {
            let agent = marathon_envs::agent(&self.id()).unwrap();
            let text = agent.facts().model.text().expect("the model is built in").to_string();
            let text = text.replacen("<option ", "<option tolerance=\"1e-14\" ", 1);
            let path = format!("{}/{}-converging.xml", env!("CARGO_TARGET_TMPDIR"), self.domain);
            std::fs::write(&path, text).unwrap();
            options.set("xml_file", &*path);
        }
        let autoreset = Autoreset::Disabled;
        let options = VecEnvOptions { agents, isa, autoreset, options, seed: 5, ..Default::default() };
        VecEnv::new(&self.id(), &options).unwrap_or_else(|e| panic!("{}: {e}", self.name()))
    }

    /// A request to the oracle, with additional entries.
    fn job(&self, more: Json) -> Json {
        let of_task = self.arguments.iter().filter(|(name, _)| *name != "xml_file");
        let kwargs = of_task.map(|(name, value)| {
            let value = match value {
                Value::Bool(x) => json!(x),
                Value::Number(x) => json!(x),
                other => panic!("{other} is no argument of dm_control's"),
            };
            ((*name).to_string(), value)
        });
        let mut job = json!({ "domain": self.domain, "task": self.task, "kwargs": Json::Object(kwargs.collect()) });
        job.as_object_mut().unwrap().extend(more.as_object().unwrap().clone());
        job
    }
}

fn tasks() -> Vec<Case> {
    [
        ("hopper", "stand"),
        ("hopper", "hop"),
        ("walker", "stand"),
        ("walker", "walk"),
        ("walker", "run"),
        ("humanoid", "stand"),
        ("humanoid", "walk"),
        ("humanoid", "run"),
        ("cheetah", "run"),
    ]
    .map(|(domain, task)| Case::new(domain, task))
    .into()
}

fn cases() -> Vec<Case> {
    let installed = |name: &str| package("dm_control").join("suite").join(name).to_string_lossy().into_owned();
    let mut cases = tasks();
    cases.extend([
        Case::new("hopper", "stand").with("hopping", true).with("xml_file", &*installed("hopper.xml")),
        Case::new("walker", "walk").with("move_speed", 3.0),
        Case::new("walker", "run").with("xml_file", &*installed("walker.xml")),
        Case::new("humanoid", "run").with("pure_state", true),
        Case::new("humanoid", "walk").with("move_speed", 2.5).with("xml_file", &*installed("humanoid.xml")),
        Case::new("cheetah", "run").with("xml_file", &*installed("cheetah.xml")),
    ]);
    cases
}

fn numbers(v: &Json) -> Vec<f64> {
    v.as_array().expect("a list").iter().map(|x| x.as_f64().expect("a number")).collect()
}

fn ask(jobs: Vec<Json>) -> Vec<Json> {
    oracle("dm_control_tasks.py", &json!({ "jobs": jobs }))["jobs"].as_array().expect("one answer per job").clone()
}

/// Start states and actions of a case's episodes.
struct Plan {
    states: Vec<AgentState>,
    /// `[episode][decision][act]`.
    actions: Vec<Vec<Vec<f32>>>,
}

impl Plan {
    fn new(case: &Case, seed: u64) -> Self {
        let mut env = case.make(SCALES.len(), Some(Isa::F64), false);
        let mut out = env.buffers();
        env.reset(Some(seed), &mut out.obs).unwrap();
        let (act, mut noise) = (env.spec().act, Noise::new(seed));
        let mut action = |scale: f32| -> Vec<f32> { (0..act).map(|_| scale * noise.next()).collect() };
        Plan {
            states: (0..SCALES.len()).map(|i| env.state(i).unwrap()).collect(),
            actions: SCALES.iter().map(|scale| (0..DECISIONS).map(|_| action(*scale)).collect()).collect(),
        }
    }

    fn episodes(&self) -> Vec<Json> {
        let one = |(state, actions): (&AgentState, &Vec<Vec<f32>>)| json!({ "qpos": state.qpos, "qvel": state.qvel, "actions": actions });
        self.states.iter().zip(&self.actions).map(one).collect()
    }
}

/// Differences between the two sides.
#[derive(Default)]
struct Differences {
    /// For each decision, the largest difference in the observation.
    obs: Vec<f64>,
    /// For each decision, the difference in reward.
    reward: Vec<f64>,
    state: f64,
}

fn apart(ours: f64, theirs: f64) -> f64 {
    (ours - theirs).abs() / (1.0 + theirs.abs())
}

impl Differences {
    /// Compares an agent's decision with dm_control's.
    fn compare(&mut self, step: &Step, columns: usize, agent: usize, theirs: &Json) {
        let numbers = numbers(&theirs["obs"]);
        assert_eq!(columns, numbers.len());
        let ours = &step.obs[agent * columns..][..columns];
        self.obs.push(largest(ours.iter().zip(&numbers).map(|(x, y)| apart(f64::from(*x), *y))));
        self.reward.push(apart(f64::from(step.reward[agent]), theirs["reward"].as_f64().unwrap()));
        assert!(!step.terminated[agent] && !step.diverged[agent]);
    }
}

/// Executes all episodes in parallel, from start to end.
fn play(case: &Case, plan: &Plan, theirs: &Json) -> Differences {
    let n = plan.states.len();
    let mut env = case.make(n, Some(Isa::F64), true);
    let (mut out, columns) = (env.buffers(), env.spec().obs);
    env.reset(Some(1), &mut out.obs).unwrap();
    for (i, state) in plan.states.iter().enumerate() {
        env.set_state(i, state).unwrap();
    }
    env.observe(&vec![true; n], &mut out.obs).unwrap();
    for (i, first) in out.obs.chunks_exact(columns).enumerate() {
        for (x, y) in first.iter().zip(numbers(&theirs["episodes"][i]["first"])) {
            assert!(apart(f64::from(*x), y) < 1e-6, "{}: first observation {x}, expected {y}", case.name());
        }
    }
    let mut found = Differences::default();
    let mut chaotic = vec![false; n];
    for t in 0..DECISIONS {
        let actions: Vec<f32> = plan.actions.iter().flat_map(|episode| episode[t].clone()).collect();
        env.step(&actions, &mut out).unwrap();
        for i in 0..n {
            let theirs = &theirs["episodes"][i]["steps"][t];
            if chaotic[i] || theirs["chaos"].as_f64().unwrap() > CHAOS {
                chaotic[i] = true;
                continue;
            }
            found.compare(&out, columns, i, theirs);
            let state = env.state(i).unwrap();
            let expected = [numbers(&theirs["qpos"]), numbers(&theirs["qvel"])].concat();
            let state = [state.qpos, state.qvel].concat();
            let moved = largest(state.iter().zip(&expected).map(|(x, y)| apart(*x, *y)));
            found.state = found.state.max(moved);
        }
    }
    found
}

/// Executes every decision from dm_control's state before it, so that errors do not accumulate.
fn play_single(case: &Case, plan: &Plan, theirs: &Json) -> Differences {
    let n = plan.states.len() * DECISIONS;
    let mut env = case.make(n, None, true);
    let (mut out, columns) = (env.buffers(), env.spec().obs);
    env.reset(Some(1), &mut out.obs).unwrap();
    let mut actions = Vec::new();
    for (i, (state, episode)) in plan.states.iter().zip(&plan.actions).enumerate() {
        for t in 0..DECISIONS {
            let steps = &theirs["episodes"][i]["steps"];
            let before = match t {
                0 => state.clone(),
                _ => AgentState { qpos: numbers(&steps[t - 1]["qpos"]), qvel: numbers(&steps[t - 1]["qvel"]) },
            };
            env.set_state(i * DECISIONS + t, &before).unwrap();
            actions.extend(&episode[t]);
        }
    }
    env.step(&actions, &mut out).unwrap();
    let mut found = Differences::default();
    for i in 0..n {
        found.compare(&out, columns, i, &theirs["episodes"][i / DECISIONS]["alone"][i % DECISIONS]);
    }
    found
}

/// Largest allowed differences.
struct Bars {
    /// All numbers of a decision.
    decision: f64,
    /// Fraction of the decisions that may differ by more, because rounding decides whether a contact or a limit is
    /// active.
    exempt: f64,
    /// Coordinates and velocities.
    state: f64,
    /// Least fraction of the decisions that are compared.
    least: f64,
}

/// Runs all cases in dm_control, compares, and fails if differences exceed the bars. Both sides solve their constraints
/// until convergence, within their arithmetic.
fn agree(alone: bool, compare: fn(&Case, &Plan, &Json) -> Differences, bars: &Bars) {
    let cases = cases();
    let plans: Vec<Plan> = cases.iter().enumerate().map(|(i, case)| Plan::new(case, 3 + i as u64)).collect();
    let job = |(case, plan): (&Case, &Plan)| {
        case.job(json!({ "converge": true, "alone": alone, "episodes": plan.episodes() }))
    };
    let answers = ask(cases.iter().zip(&plans).map(job).collect());
    let mut failures = Vec::new();
    let (mut count, mut paid) = (0, 0);
    for ((case, plan), theirs) in cases.iter().zip(&plans).zip(&answers) {
        let found = compare(case, plan, theirs);
        let n = found.obs.len();
        // the exempt fraction is at the end
        let sorted = |list: &[f64]| -> [f64; 2] {
            let mut list = list.to_vec();
            list.sort_by(f64::total_cmp);
            [list[((1.0 - bars.exempt) * (n - 1) as f64) as usize], list[n - 1]]
        };
        let ([obs, worst_obs], [reward, worst_reward]) = (sorted(&found.obs), sorted(&found.reward));
        let text = format!(
            "{}: {n} decisions, observation {obs:.0e} (worst {worst_obs:.0e}), reward {reward:.0e} (worst \
             {worst_reward:.0e}), state {:.0e}",
            case.name(),
            found.state
        );
        println!("{text}");
        if !(obs <= bars.decision && reward <= bars.decision && found.state <= bars.state) {
            failures.push(text);
        }
        count += n;
        for step in theirs["episodes"].as_array().unwrap().iter().flat_map(|e| e["steps"].as_array().unwrap()) {
            paid += usize::from(step["reward"].as_f64().unwrap() > 0.05);
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
    // the comparison is meaningful only if these cases occurred
    let all = cases.len() * SCALES.len() * DECISIONS;
    assert!(count as f64 >= bars.least * all as f64, "{count} decisions of {all} were not chaotic");
    assert!(paid > 500, "{paid} decisions had a reward");
}

/// Observations and rewards are stored in single precision.
#[test]
fn a_hundred_decisions_agree_in_double_precision() {
    agree(false, play, &Bars { decision: 2e-7, exempt: 0.0, state: 2e-7, least: 0.9 });
}

#[test]
fn every_decision_agrees_in_single_precision() {
    agree(true, play_single, &Bars { decision: 1e-4, exempt: 0.02, state: 0.0, least: 1.0 });
}

#[test]
fn spaces_and_time_limits_are_dm_controls() {
    let cases = cases();
    let answers = ask(cases.iter().map(|case| case.job(json!({}))).collect());
    for (case, theirs) in cases.iter().zip(&answers) {
        let (spec, theirs) = (case.make(1, None, false).spec().clone(), &theirs["spec"]);
        let single = |key: &str| -> Vec<f32> { numbers(&theirs[key]).iter().map(|x| *x as f32).collect() };
        assert_eq!(spec.obs as u64, theirs["obs"].as_u64().unwrap(), "{}", case.name());
        let parts: Vec<Json> = spec.observations.iter().map(|part| json!([part.name, part.range.len()])).collect();
        assert_eq!(Json::Array(parts), theirs["observations"], "{}", case.name());
        assert_eq!(spec.max_episode_steps as u64, theirs["max_episode_steps"].as_u64().unwrap(), "{}", case.name());
        assert_eq!((&spec.action_low, &spec.action_high), (&single("low"), &single("high")), "{}", case.name());
        assert!((spec.dt - theirs["dt"].as_f64().unwrap()).abs() < 1e-12, "{}", case.name());
    }
}

/// Largest distance of two empirical distributions (Kolmogorov-Smirnov), in units of its standard deviation under equal
/// distributions.
fn distance(a: &mut [f64], b: &mut [f64]) -> f64 {
    a.sort_by(f64::total_cmp);
    b.sort_by(f64::total_cmp);
    let (mut i, mut j, mut most) = (0, 0, 0.0_f64);
    while i < a.len() && j < b.len() {
        let x = a[i].min(b[j]);
        i += a[i..].iter().take_while(|y| **y <= x).count();
        j += b[j..].iter().take_while(|y| **y <= x).count();
        most = most.max((i as f64 / a.len() as f64 - j as f64 / b.len() as f64).abs());
    }
    let n = (a.len() * b.len()) as f64 / (a.len() + b.len()) as f64;
    most * n.sqrt()
}

/// States and first observations, coordinate by coordinate.
#[test]
fn starts_have_the_same_distribution() {
    const OURS: usize = 4096;
    const THEIRS: usize = 1024;
    let cases = [("hopper", "stand"), ("walker", "run"), ("humanoid", "walk"), ("cheetah", "run")];
    let cases = cases.map(|(domain, task)| Case::new(domain, task));
    let answers = ask(cases.iter().map(|case| case.job(json!({ "resets": THEIRS }))).collect());
    for (case, theirs) in cases.iter().zip(&answers) {
        let theirs: Vec<Vec<f64>> = theirs["resets"].as_array().unwrap().iter().map(numbers).collect();
        let mut env = case.make(OURS, Some(Isa::F64), false);
        let mut out = env.buffers();
        env.reset(Some(9), &mut out.obs).unwrap();
        let columns = env.spec().obs;
        let row = |i: usize| {
            let state = env.state(i).unwrap();
            let obs = out.obs[i * columns..][..columns].iter().map(|x| f64::from(*x));
            state.qpos.into_iter().chain(state.qvel).chain(obs).collect::<Vec<f64>>()
        };
        let ours: Vec<Vec<f64>> = (0..OURS).map(row).collect();
        assert_eq!(ours[0].len(), theirs[0].len(), "{}", case.name());
        let mut farthest = 0.0_f64;
        for k in 0..ours[0].len() {
            // observations are in single precision, so numbers that are equal in all starts are rounded too
            let column = |rows: &[Vec<f64>]| rows.iter().map(|row| f64::from(row[k] as f32)).collect::<Vec<f64>>();
            let far = distance(&mut column(&ours), &mut column(&theirs));
            // with equal distributions, one in 1e5 numbers exceeds 2.5
            assert!(far < 2.5, "{}, number {k}: {far}", case.name());
            farthest = farthest.max(far);
        }
        println!("{}: at most {farthest:.2}", case.name());
    }
}

/// The first of the cheetah's 200 steps is a free fall. As in dm_control, it computes its forces from the pose before.
#[test]
fn a_cheetah_settles_as_in_dm_control() {
    const STARTS: usize = 8;
    let case = Case::new("cheetah", "run");
    let answer = ask(vec![case.job(json!({ "converge": true, "settled": STARTS }))])[0]["settled"].clone();
    let mut env = case.make(STARTS, Some(Isa::F64), true);
    let mut out = env.buffers();
    env.reset(None, &mut out.obs).unwrap();
    for i in 0..STARTS {
        let mut qvel = vec![0.0; 9];
        qvel[1] = -0.0981;
        let mut qpos = vec![0.0, -0.000_981, 0.0];
        qpos.extend(numbers(&answer[i]["drawn"]));
        env.set_state(i, &AgentState { qpos, qvel }).unwrap();
    }
    let actions = vec![0.0; STARTS * env.spec().act];
    for _ in 0..199 {
        env.step(&actions, &mut out).unwrap();
    }
    for i in 0..STARTS {
        let state = env.state(i).unwrap();
        let expected = [numbers(&answer[i]["qpos"]), numbers(&answer[i]["qvel"])].concat();
        for (x, y) in [state.qpos, state.qvel].concat().iter().zip(expected) {
            assert!(apart(*x, y) < 1e-6, "start {i}: {x}, expected {y}");
        }
    }
}

#[test]
fn a_humanoid_starts_without_touching_anything() {
    const STARTS: usize = 256;
    let case = Case::new("humanoid", "stand");
    let mut env = case.make(STARTS, Some(Isa::F64), false);
    let mut out = env.buffers();
    env.reset(Some(2), &mut out.obs).unwrap();
    let one = |i: usize| {
        let state = env.state(i).unwrap();
        json!({ "qpos": state.qpos, "qvel": state.qvel, "actions": [] })
    };
    let episodes: Vec<Json> = (0..STARTS).map(one).collect();
    let answer = ask(vec![case.job(json!({ "episodes": episodes }))])[0].clone();
    assert!(answer["episodes"].as_array().unwrap().iter().all(|episode| episode["contacts"] == 0));
}

/// Mean, and its variance.
fn mean(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    (mean, values.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / (n * (n - 1.0)))
}

/// Random actions earn the same on average. Episodes end at the time limit only, with a discount of 1.
#[test]
fn returns_of_random_play_agree() {
    const OURS: usize = 256;
    const THEIRS: usize = 16;
    let tasks = [("hopper", "stand"), ("walker", "walk"), ("humanoid", "stand"), ("cheetah", "run")];
    let tasks = tasks.map(|(domain, task)| Case::new(domain, task));
    let answers = ask(tasks.iter().map(|case| case.job(json!({ "returns": THEIRS }))).collect());
    for (case, answer) in tasks.iter().zip(&answers) {
        let mut env = case.make(OURS, None, false);
        let mut out = env.buffers();
        env.reset(Some(1), &mut out.obs).unwrap();
        let (mut totals, mut noise, act) = (vec![0.0; OURS], Noise::new(2), env.spec().act);
        for t in 1..=1000 {
            let actions: Vec<f32> = (0..OURS * act).map(|_| noise.next()).collect();
            env.step(&actions, &mut out).unwrap();
            assert!(out.reward.iter().all(|r| (0.0..=1.0).contains(r)), "{}", case.name());
            assert!(out.terminated.iter().all(|end| !end), "{}", case.name());
            assert!(out.truncated.iter().all(|end| *end == (t == 1000)), "{}, decision {t}", case.name());
            totals.iter_mut().zip(&out.reward).for_each(|(total, r)| *total += f64::from(*r));
        }
        let theirs = answer["returns"].as_array().unwrap();
        assert!(theirs.iter().all(|e| e["length"] == 1000 && e["discount"] == 1.0), "{}", case.name());
        let theirs: Vec<f64> = theirs.iter().map(|e| e["return"].as_f64().unwrap()).collect();
        let ((ours, own), (theirs, other)) = (mean(&totals), mean(&theirs));
        // the variance of their few episodes is at least that of our many
        let error = (own + other.max(own * OURS as f64 / THEIRS as f64)).sqrt();
        println!("{}: {ours:.2} and {theirs:.2}, standard error {error:.2}", case.name());
        assert!((ours - theirs).abs() < 4.0 * error, "{}: {ours} and {theirs}, error {error}", case.name());
    }
}

#[test]
fn a_tolerance_is_dm_controls() {
    let sigmoids = [
        (Sigmoid::Gaussian, "gaussian"),
        (Sigmoid::Hyperbolic, "hyperbolic"),
        (Sigmoid::LongTail, "long_tail"),
        (Sigmoid::Reciprocal, "reciprocal"),
        (Sigmoid::Cosine, "cosine"),
        (Sigmoid::Linear, "linear"),
        (Sigmoid::Quadratic, "quadratic"),
        (Sigmoid::TanhSquared, "tanh_squared"),
    ];
    let x: Vec<f64> = (-60..=60).map(|i| 0.1 * f64::from(i)).collect();
    let mut ours = Vec::new();
    for (sigmoid, name) in sigmoids {
        for (bounds, margin, value_at_margin) in
            [([0.0, 0.0], 1.0, 0.1), ([-1.0, 2.0], 3.0, 0.5), ([1.0, 4.0], 0.0, 0.1)]
        {
            ours.push((Tolerance { bounds, margin, sigmoid, value_at_margin }, name));
        }
    }
    for (sigmoid, name) in &sigmoids[4..7] {
        ours.push((Tolerance { sigmoid: *sigmoid, value_at_margin: 0.0, ..Tolerance::around_zero(2.0) }, name));
    }
    let ask = |(t, name): &(Tolerance, &str)| {
        let Tolerance { bounds, margin, value_at_margin, .. } = t;
        json!({ "x": x, "bounds": bounds, "margin": margin, "sigmoid": name, "value_at_margin": value_at_margin })
    };
    let request = json!({ "tolerances": ours.iter().map(ask).collect::<Vec<_>>() });
    let answer = oracle("dm_control_tasks.py", &request);
    for ((t, _), theirs) in ours.iter().zip(answer["tolerances"].as_array().unwrap()) {
        for (x, expected) in x.iter().zip(numbers(theirs)) {
            let (double, single): (f64, f32) = (t.of(*x), t.of(*x as f32));
            assert!((double - expected).abs() < 1e-6, "{t:?} of {x} is {double}, expected {expected}");
            // single precision may move the value across a bound
            let at_a_bound = t.margin == 0.0 && t.bounds.iter().any(|bound| (x - bound).abs() < 1e-6);
            assert!(at_a_bound || (f64::from(single) - expected).abs() < 2e-6, "{t:?} of {x} is {single}");
        }
    }
}
