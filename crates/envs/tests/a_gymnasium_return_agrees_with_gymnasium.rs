//! Policies, returns and start distributions carry over between Gymnasium's tasks here and in Gymnasium.
//!
//! The test covers every task of [`gymnasium`](marathon_envs::agents::gymnasium), with its default keyword arguments
//! and with others:
//!
//! - From the same state and with the same actions, observation, reward, its terms, info, terminated and truncated
//!   agree: for 100 decisions in double precision, and for every single decision in single precision.
//! - Starts have the same distribution.
//! - Keyword arguments have the same names and defaults.
//! - Returns of random actions are equal within their confidence interval.
//!
//! The other side is the installed `gymnasium`, run by `tests/oracle/gymnasium_tasks.py`.

use crate::common::numbers::largest;
use crate::common::{Noise, oracle, package};
use marathon_envs::{AgentState, Autoreset, Options, Step, Value, VecEnv, VecEnvOptions};
use marathon_physics::lanes::Isa;
use serde_json::{Value as Json, json};

/// Decisions per episode.
const DECISIONS: usize = 100;
/// Sizes of the actions of a task's episodes, relative to their bounds.
const SCALES: [f32; 4] = [0.1, 0.4, 1.0, 1.5];

/// Distance from a twin that began 1e-10 away above which an episode is too chaotic for a comparison.
const CHAOS: f64 = 1e-4;

/// A task with keyword arguments.
struct Case {
    id: &'static str,
    arguments: Vec<(&'static str, Value)>,
}

impl Case {
    fn new(id: &'static str) -> Self {
        Case { id, arguments: Vec::new() }
    }
    fn with(mut self, name: &'static str, value: impl Into<Value>) -> Self {
        self.arguments.push((name, value.into()));
        self
    }
    fn name(&self) -> String {
        let arguments: Vec<String> = self.arguments.iter().map(|(name, value)| format!("{name}={value}")).collect();
        format!("{}({})", self.id, arguments.join(", "))
    }
    fn kwargs(&self) -> Json {
        let one = |(name, value): &(&str, Value)| ((*name).to_string(), to_json(value));
        Json::Object(self.arguments.iter().map(one).collect())
    }
    /// The environment. With `converge`, its solver runs until it converges, which only a model can set.
    fn make(&self, agents: usize, isa: Option<Isa>, autoreset: Autoreset, converge: bool) -> VecEnv {
        let mut options: Options = self.arguments.iter().map(|(n, v)| ((*n).to_string(), v.clone())).collect();
        if converge && !self.is_capped() && options.get("xml_file").is_none() {
            options.set("xml_file", &*self.converging_model());
        }
        let options = VecEnvOptions { agents, isa, autoreset, options, seed: 5, ..Default::default() };
        VecEnv::new(self.id, &options).unwrap_or_else(|e| panic!("{}: {e}", self.name()))
    }
}

impl Case {
    /// Whether the model's own cap of iterations counts, which stops both solvers at the same point.
    fn is_capped(&self) -> bool {
        self.id == "Pusher-v5"
    }
    /// A copy of the task's model with a smaller tolerance.
    fn converging_model(&self) -> String {
        let agent = marathon_envs::agent(self.id).unwrap();
        let text = agent.facts().model.text().expect("the model is built in").to_string();
        let text = text.replacen("<option ", "<option tolerance=\"1e-14\" ", 1);
        let path = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{}-converging.xml", self.id));
        std::fs::write(&path, text).unwrap();
        path.to_string_lossy().into_owned()
    }
}

/// A Python keyword argument. Whole numbers become integers, because a body's number is one.
fn to_json(value: &Value) -> Json {
    match value {
        Value::Bool(x) => json!(x),
        Value::Number(x) if x.fract() == 0.0 => json!(*x as i64),
        Value::Number(x) => json!(x),
        Value::Pair(x) => json!(x),
        Value::Text(x) => json!(x),
        Value::Clips(x) => json!(x.to_string()),
    }
}

const TASKS: [&str; 11] = [
    "Hopper-v5",
    "Walker2d-v5",
    "HalfCheetah-v5",
    "Ant-v5",
    "Humanoid-v5",
    "HumanoidStandup-v5",
    "Swimmer-v5",
    "InvertedPendulum-v5",
    "InvertedDoublePendulum-v5",
    "Reacher-v5",
    "Pusher-v5",
];

fn cases() -> Vec<Case> {
    let assets = package("gymnasium").join("envs/mujoco/assets");
    let installed = |name: &str| assets.join(name).to_string_lossy().into_owned();
    // a case's seed is its place
    let (first, last) = TASKS.split_at(9);
    let mut cases: Vec<Case> = first.iter().copied().map(Case::new).collect();
    cases.extend([
        Case::new("Hopper-v5")
            .with("frame_skip", 2.0)
            .with("forward_reward_weight", 2.0)
            .with("ctrl_cost_weight", 0.01)
            .with("healthy_reward", 0.5)
            .with("healthy_z_range", [0.9, 1.5])
            .with("healthy_angle_range", [-0.1, 0.15])
            .with("healthy_state_range", [-5.0, 6.0])
            .with("exclude_current_positions_from_observation", false),
        Case::new("Hopper-v5").with("terminate_when_unhealthy", false).with("xml_file", &*installed("hopper.xml")),
        Case::new("Walker2d-v5")
            .with("healthy_z_range", [1.0, 1.4])
            .with("healthy_angle_range", [-0.3, 0.2])
            .with("healthy_reward", 2.0)
            .with("frame_skip", 3.0)
            .with("exclude_current_positions_from_observation", false),
        Case::new("Walker2d-v5").with("xml_file", &*installed("walker2d.xml")),
        Case::new("HalfCheetah-v5")
            .with("forward_reward_weight", 0.5)
            .with("ctrl_cost_weight", 0.3)
            .with("frame_skip", 3.0)
            .with("exclude_current_positions_from_observation", false),
        Case::new("Ant-v5")
            .with("main_body", "aux_1")
            .with("contact_force_range", [-0.5, 2.0])
            .with("contact_cost_weight", 0.01)
            .with("healthy_z_range", [0.3, 0.9])
            .with("exclude_current_positions_from_observation", false),
        Case::new("Ant-v5")
            .with("main_body", 13.0)
            .with("include_cfrc_ext_in_observation", false)
            .with("terminate_when_unhealthy", false)
            .with("xml_file", &*installed("ant.xml")),
        Case::new("Humanoid-v5")
            .with("contact_cost_range", [0.0, 0.1])
            .with("contact_cost_weight", 1e-5)
            .with("healthy_z_range", [1.2, 1.5])
            .with("exclude_current_positions_from_observation", false)
            .with("include_cvel_in_observation", false)
            .with("include_qfrc_actuator_in_observation", false),
        Case::new("Humanoid-v5")
            .with("terminate_when_unhealthy", false)
            .with("include_cinert_in_observation", false)
            .with("include_cfrc_ext_in_observation", false)
            .with("frame_skip", 2.0),
        Case::new("HumanoidStandup-v5")
            .with("uph_cost_weight", 3.0)
            .with("ctrl_cost_weight", 0.2)
            .with("impact_cost_weight", 1e-5)
            .with("impact_cost_range", [0.01, 1.0])
            .with("exclude_current_positions_from_observation", false),
        Case::new("Swimmer-v5")
            .with("forward_reward_weight", 3.0)
            .with("ctrl_cost_weight", 0.1)
            .with("frame_skip", 2.0)
            .with("exclude_current_positions_from_observation", false),
        Case::new("InvertedPendulum-v5").with("frame_skip", 3.0).with("reset_noise_scale", 0.15),
        // fast enough to hit the end of the rail
        Case::new("InvertedDoublePendulum-v5").with("healthy_reward", 3.0).with("reset_noise_scale", 0.5),
        Case::new("Reacher-v5")
            .with("reward_dist_weight", 2.0)
            .with("reward_control_weight", 0.1)
            .with("frame_skip", 3.0),
        Case::new("Reacher-v5").with("xml_file", &*installed("reacher.xml")),
        Case::new("Pusher-v5")
            .with("reward_near_weight", 2.0)
            .with("reward_dist_weight", 0.5)
            .with("reward_control_weight", 0.3)
            .with("frame_skip", 4.0),
        Case::new("Pusher-v5").with("xml_file", &*installed("pusher_v5.xml")),
    ]);
    cases.extend(last.iter().copied().map(Case::new));
    cases
}

fn numbers(v: &Json) -> Vec<f64> {
    v.as_array().expect("a list").iter().map(|x| x.as_f64().expect("a number")).collect()
}

/// Start states and actions of a case's episodes.
struct Plan {
    states: Vec<AgentState>,
    /// `[episode][decision][act]`.
    actions: Vec<Vec<Vec<f32>>>,
}

fn plan(case: &Case, seed: u64) -> Plan {
    let mut env = case.make(SCALES.len(), Some(Isa::F64), Autoreset::Disabled, false);
    let mut out = env.buffers();
    env.reset(Some(seed), &mut out.obs).unwrap();
    let spec = env.spec();
    let states = (0..SCALES.len())
        .map(|i| {
            let mut state = env.state(i).unwrap();
            // only normalized quaternions are compared here; `starts_have_the_same_distribution` covers the rest
            if spec.nq > spec.nv {
                let norm = state.qpos[3..7].iter().map(|x| x * x).sum::<f64>().sqrt();
                state.qpos[3..7].iter_mut().for_each(|x| *x /= norm);
            }
            state
        })
        .collect();
    let mut noise = Noise::new(seed);
    let mut action = |scale: f32| -> Vec<f32> {
        let bounds = spec.action_low.iter().zip(&spec.action_high);
        bounds.map(|(low, high)| 0.5 * (low + high) + 0.5 * scale * (high - low) * noise.next()).collect()
    };
    let actions = SCALES.iter().map(|scale| (0..DECISIONS).map(|_| action(*scale)).collect()).collect();
    Plan { states, actions }
}

fn request(case: &Case, plan: &Plan, alone: bool) -> Json {
    let one = |(state, actions): (&AgentState, &Vec<Vec<f32>>)| json!({ "qpos": state.qpos, "qvel": state.qvel, "actions": actions });
    let episodes: Vec<Json> = plan.states.iter().zip(&plan.actions).map(one).collect();
    json!({ "id": case.id, "kwargs": case.kwargs(), "converge": !case.is_capped(), "alone": alone, "episodes": episodes })
}

/// Moving bodies of the ant and the humanoids.
const BODIES: usize = 13;

/// Differences between the two sides.
#[derive(Default)]
struct Differences {
    /// For each decision, the largest difference in the observation.
    obs: Vec<f64>,
    /// For each decision, the largest difference in reward, its terms, and the info.
    reward: Vec<f64>,
    state: f64,
    flags: usize,
}

fn apart(ours: f64, theirs: f64) -> f64 {
    (ours - theirs).abs() / (1.0 + theirs.abs())
}

impl Differences {
    /// Compares an agent's decision with Gymnasium's.
    fn compare(&mut self, env: &VecEnv, step: &Step, agent: usize, theirs: &Json) {
        let spec = env.spec();
        let row = |array: &[f32], n: usize| array[agent * n..][..n].to_vec();
        let (ours, numbers) = (row(&step.obs, spec.obs), numbers(&theirs["obs"]));
        assert_eq!(ours.len(), numbers.len());
        // contact forces and torques come last; a small one is the difference of large ones
        let forces =
            if spec.options.get("include_cfrc_ext_in_observation") == Some(&true.into()) { BODIES * 6 } else { 0 };
        let force = largest(numbers[spec.obs - forces..].iter().map(|x| x.abs()));
        let size = |i: usize| if i < spec.obs - forces { numbers[i].abs() } else { force };
        let far = |(i, x): (usize, &f32)| (f64::from(*x) - numbers[i]).abs() / (1.0 + size(i));
        self.obs.push(largest(ours.iter().enumerate().map(far)));
        let mut worst = apart(f64::from(step.reward[agent]), theirs["reward"].as_f64().unwrap());
        let info = theirs["info"].as_object().unwrap();
        let named = spec.reward_terms.iter().zip(row(&step.terms, spec.reward_terms.len()));
        for (name, ours) in named.chain(spec.info.iter().zip(row(&step.info, spec.info.len()))) {
            match info.get(name) {
                Some(theirs) => worst = largest([worst, apart(f64::from(ours), theirs.as_f64().unwrap())]),
                // the only term that Gymnasium does not report
                None => assert_eq!((spec.id.as_str(), name.as_str()), ("HumanoidStandup-v5", "reward_alive")),
            }
        }
        self.reward.push(worst);
        let known: Vec<&String> = spec.reward_terms.iter().chain(&spec.info).collect();
        assert!(info.keys().all(|key| known.contains(&key)), "{}: {:?}", spec.id, info.keys());
        let flags = [step.terminated[agent], step.truncated[agent]];
        self.flags += usize::from(flags != ["terminated", "truncated"].map(|f| theirs[f].as_bool().unwrap()));
        assert!(!step.diverged[agent]);
    }
}

/// Executes all episodes in parallel, from start to end.
fn play(case: &Case, plan: &Plan, theirs: &Json) -> Differences {
    let n = plan.states.len();
    let mut env = case.make(n, Some(Isa::F64), Autoreset::Disabled, true);
    let mut out = env.buffers();
    env.reset(Some(1), &mut out.obs).unwrap();
    for (i, state) in plan.states.iter().enumerate() {
        env.set_state(i, state).unwrap();
    }
    env.observe(&vec![true; n], &mut out.obs).unwrap();
    let mut found = Differences::default();
    let columns = env.spec().obs;
    for (i, first) in out.obs.chunks_exact(columns).enumerate() {
        for (x, y) in first.iter().zip(numbers(&theirs["episodes"][i]["first"])) {
            assert!(apart(f64::from(*x), y) < 1e-6, "{}: first observation {x}, expected {y}", case.name());
        }
    }
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
            found.compare(&env, &out, i, theirs);
            let state = env.state(i).unwrap();
            let expected = [numbers(&theirs["qpos"]), numbers(&theirs["qvel"])].concat();
            for (x, y) in [state.qpos, state.qvel].concat().iter().zip(&expected) {
                found.state = largest([found.state, apart(*x, *y)]);
            }
        }
    }
    found
}

/// Executes every decision from Gymnasium's state before it, so that errors do not accumulate.
fn play_single(case: &Case, plan: &Plan, theirs: &Json) -> Differences {
    let n = plan.states.len() * DECISIONS;
    let mut env = case.make(n, None, Autoreset::Disabled, true);
    let mut out = env.buffers();
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
        found.compare(&env, &out, i, &theirs["episodes"][i / DECISIONS]["alone"][i % DECISIONS]);
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
}

/// Runs all cases in Gymnasium, compares, and fails if differences exceed the bars. Both sides solve their constraints
/// until convergence, within their arithmetic.
fn agree(alone: bool, compare: fn(&Case, &Plan, &Json) -> Differences, bars: &Bars) {
    let cases = cases();
    let plans: Vec<Plan> = cases.iter().enumerate().map(|(i, case)| plan(case, 3 + i as u64)).collect();
    let jobs: Vec<Json> = cases.iter().zip(&plans).map(|(case, plan)| request(case, plan, alone)).collect();
    let answers = oracle("gymnasium_tasks.py", &Json::Array(jobs));
    let mut failures = Vec::new();
    let (mut ended, mut contacts, mut count) = (0, 0, 0);
    for ((case, plan), theirs) in cases.iter().zip(&plans).zip(answers.as_array().unwrap()) {
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
            "{}: {n} decisions, observation {obs:.0e} (worst {worst_obs:.0e}), reward and info {reward:.0e} (worst \
             {worst_reward:.0e}), state {:.0e}, {} flags",
            case.name(),
            found.state,
            found.flags
        );
        println!("{text}");
        let within = obs <= bars.decision && reward <= bars.decision && found.state <= bars.state;
        if !within || found.flags > 0 {
            failures.push(text);
        }
        count += n;
        for step in theirs["episodes"].as_array().unwrap().iter().flat_map(|e| e["steps"].as_array().unwrap()) {
            ended += usize::from(step["terminated"].as_bool().unwrap());
            contacts += usize::from(step["info"]["reward_contact"].as_f64().is_some_and(|x| x != 0.0));
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
    // the comparison is meaningful only if these cases occurred
    let all = cases.len() * SCALES.len() * DECISIONS;
    assert!(100 * count >= 95 * all, "{count} decisions of {all} were not chaotic");
    assert!(ended > 500 && contacts > 500, "{ended} decisions in terminal states, {contacts} with contacts");
}

/// Observations and rewards are stored in single precision.
#[test]
fn a_hundred_decisions_agree_in_double_precision() {
    agree(false, play, &Bars { decision: 2e-7, exempt: 0.0, state: 1e-6 });
}

#[test]
fn every_decision_agrees_in_single_precision() {
    agree(true, play_single, &Bars { decision: 1e-4, exempt: 0.02, state: 0.0 });
}

/// The actuators clip an action far out of range, its full size has a cost, and the episode continues.
#[test]
fn actions_far_out_of_range_cost_what_they_cost_in_gymnasium() {
    const DECISIONS: usize = 5;
    let ids = ["Ant-v5", "Humanoid-v5", "Hopper-v5", "Walker2d-v5", "HalfCheetah-v5"];
    for size in [1e3, 1e6f32] {
        for id in ids {
            let case = Case::new(id);
            let mut plan = plan(&case, 11);
            let signs = |action: &[f32]| action.iter().map(|a| size * a.signum()).collect();
            for episode in &mut plan.actions {
                *episode = episode[..DECISIONS].iter().map(|action| signs(action)).collect();
            }
            let answer = oracle("gymnasium_tasks.py", &json!([request(&case, &plan, false)]));
            let n = plan.states.len();
            let mut env = case.make(n, Some(Isa::F64), Autoreset::Disabled, true);
            let mut out = env.buffers();
            env.reset(Some(1), &mut out.obs).unwrap();
            for (i, state) in plan.states.iter().enumerate() {
                env.set_state(i, state).unwrap();
            }
            env.observe(&vec![true; n], &mut out.obs).unwrap();
            let mut found = Differences::default();
            for t in 0..DECISIONS {
                let actions: Vec<f32> = plan.actions.iter().flat_map(|episode| episode[t].clone()).collect();
                env.step(&actions, &mut out).unwrap();
                for i in 0..n {
                    let theirs = &answer[0]["episodes"][i]["steps"][t];
                    let own = theirs["reward"].as_f64().unwrap();
                    assert!(own < -1e3, "{id}: Gymnasium's reward is {own}");
                    found.compare(&env, &out, i, theirs);
                }
            }
            let (obs, reward) = (largest(found.obs), largest(found.reward));
            println!("{id}, actions of {size}: observation {obs:.0e}, reward {reward:.0e}");
            assert!(obs < 1e-5 && reward < 1e-5 && found.flags == 0, "{id}, {size}: {obs}, {reward}, {}", found.flags);
        }
    }
}

/// A default value of Python as one of ours.
fn from_json(value: &Json) -> Value {
    let number = |x: &Json| x.as_f64().or_else(|| x.as_str()?.parse().ok());
    match value {
        Json::Bool(x) => Value::Bool(*x),
        Json::Array(pair) => Value::Pair([0, 1].map(|i| number(&pair[i]).unwrap())),
        Json::String(text) => Value::Text(text.clone()),
        other => Value::Number(number(other).unwrap()),
    }
}

#[test]
fn spaces_and_keyword_arguments_are_gymnasiums() {
    let cases = cases();
    let jobs = cases.iter().map(|case| json!({ "id": case.id, "kwargs": case.kwargs() })).collect();
    let answers = oracle("gymnasium_tasks.py", &Json::Array(jobs));
    for (case, theirs) in cases.iter().zip(answers.as_array().unwrap()) {
        let (spec, theirs) = (case.make(1, None, Autoreset::Disabled, false).spec().clone(), &theirs["spec"]);
        let single = |key: &str| -> Vec<f32> { numbers(&theirs[key]).iter().map(|x| *x as f32).collect() };
        assert_eq!(spec.obs as u64, theirs["obs"].as_u64().unwrap(), "{}", case.name());
        assert_eq!(spec.max_episode_steps as u64, theirs["max_episode_steps"].as_u64().unwrap(), "{}", case.name());
        assert_eq!((&spec.action_low, &spec.action_high), (&single("low"), &single("high")), "{}", case.name());
        assert!((spec.dt - theirs["dt"].as_f64().unwrap()).abs() < 1e-12, "{}", case.name());
        if case.arguments.is_empty() {
            let theirs = theirs["arguments"].as_object().unwrap();
            let known: Vec<&str> = spec.options.iter().map(|(name, _)| name).collect();
            assert_eq!(known.len(), theirs.len(), "{}: {known:?}, expected {:?}", case.id, theirs.keys());
            for (name, value) in spec.options.iter() {
                assert_eq!(*value, from_json(&theirs[name]), "{}: {name}", case.id);
            }
        }
    }
}

/// Mean and variance.
fn moments(values: impl Iterator<Item = f64> + Clone) -> (f64, f64) {
    let n = values.clone().count() as f64;
    let mean = values.clone().sum::<f64>() / n;
    (mean, values.map(|x| (x - mean) * (x - mean)).sum::<f64>() / n)
}

/// States and first observations, coordinate by coordinate.
#[test]
fn starts_have_the_same_distribution() {
    const OURS: usize = 4096;
    const THEIRS: usize = 1024;
    let mut cases: Vec<Case> = TASKS.map(Case::new).into();
    cases.push(Case::new("Ant-v5").with("reset_noise_scale", 0.3));
    cases.push(Case::new("HalfCheetah-v5").with("reset_noise_scale", 0.02));
    let jobs = cases.iter().map(|case| json!({ "id": case.id, "kwargs": case.kwargs(), "resets": THEIRS })).collect();
    let answers = oracle("gymnasium_tasks.py", &Json::Array(jobs));
    for (case, theirs) in cases.iter().zip(answers.as_array().unwrap()) {
        let theirs: Vec<Vec<f64>> = theirs["resets"].as_array().unwrap().iter().map(numbers).collect();
        let mut env = case.make(OURS, Some(Isa::F64), Autoreset::Disabled, false);
        let mut out = env.buffers();
        env.reset(Some(9), &mut out.obs).unwrap();
        let row = |i: usize| {
            let state = env.state(i).unwrap();
            let obs = out.obs[i * env.spec().obs..][..env.spec().obs].iter().map(|x| f64::from(*x));
            state.qpos.into_iter().chain(state.qvel).chain(obs).collect::<Vec<f64>>()
        };
        let ours: Vec<Vec<f64>> = (0..OURS).map(row).collect();
        assert_eq!(ours[0].len(), theirs[0].len(), "{}", case.name());
        for k in 0..ours[0].len() {
            let (a, b) = (ours.iter().map(|row| row[k]), theirs.iter().map(|row| row[k]));
            let ((mean_a, var_a), (mean_b, var_b)) = (moments(a.clone()), moments(b.clone()));
            let place =
                format!("{}, number {k}: mean {mean_a} and {mean_b}, variance {var_a} and {var_b}", case.name());
            let error = (var_a / OURS as f64 + var_b / THEIRS as f64).sqrt();
            assert!((mean_a - mean_b).abs() < 5.0 * error + 1e-6, "{place}");
            // the standard error of a variance is at most sqrt(2 / n) of it for these distributions: 4.9% together
            assert!((var_a - var_b).abs() < 0.25 * var_b + 1e-10, "{place}");
            if k < env.spec().nq + env.spec().nv {
                // uniform draws are bounded, normal ones are not
                let reach_a = largest(a.map(|x| (x - mean_b).abs())) / var_b.sqrt();
                let reach_b = largest(b.map(|x| (x - mean_b).abs())) / var_b.sqrt();
                let uniform = [reach_a < 1.9, reach_b < 1.9];
                assert_eq!(uniform[0], uniform[1], "{place}: reaches {reach_a} and {reach_b} standard deviations");
            }
        }
    }
}

/// Random actions earn the same on average.
#[test]
fn returns_of_random_play_agree() {
    const OURS: usize = 512;
    let theirs = |id: &str| match id {
        "HalfCheetah-v5" | "HumanoidStandup-v5" | "Swimmer-v5" => 16,
        "Ant-v5" => 64,
        _ => 256,
    };
    let jobs = TASKS.map(|id| json!({ "id": id, "returns": { "episodes": theirs(id), "scale": 1.0 } }));
    let answers = oracle("gymnasium_tasks.py", &json!(jobs));
    for (id, answer) in TASKS.iter().zip(answers.as_array().unwrap()) {
        let mut env = Case::new(id).make(OURS, None, Autoreset::Disabled, false);
        let mut out = env.buffers();
        env.reset(Some(1), &mut out.obs).unwrap();
        let (mut totals, mut playing) = (vec![0.0; OURS], vec![true; OURS]);
        let mut noise = Noise::new(2);
        let spec = env.spec().clone();
        while playing.contains(&true) {
            let actions: Vec<f32> = (0..OURS * spec.act).map(|i| spec.action_of(i % spec.act, noise.next())).collect();
            env.step(&actions, &mut out).unwrap();
            for i in 0..OURS {
                if playing[i] {
                    totals[i] += f64::from(out.reward[i]);
                    playing[i] = !(out.terminated[i] || out.truncated[i]);
                }
            }
        }
        let theirs = numbers(&answer["returns"]);
        let ((mean_a, var_a), (mean_b, var_b)) = (moments(totals.iter().copied()), moments(theirs.iter().copied()));
        let error = (var_a / OURS as f64 + var_b / theirs.len() as f64).sqrt();
        println!("{id}: {mean_a:.2} and {mean_b:.2}, standard error {error:.2}");
        assert!((mean_a - mean_b).abs() < 4.0 * error + 1e-9, "{id}: {mean_a} and {mean_b}, standard error {error}");
    }
}
