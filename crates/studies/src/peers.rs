//! Trainers of other projects: Stable-Baselines3 and ML-Agents, each in its own Python.

use crate::error::StudyError;
use crate::training::{EPISODES, Run};
use marathon_envs::registry;
use marathon_learn::{Algorithm, EvalOptions, Evaluation, LrSchedule, TrainConfig, evaluate, write_atomic};
use marathon_physics::budget;
use marathon_physics::lanes::Isa;
use marathon_runs::python::{self, VARIABLE};
use marathon_runs::{policy_file, text};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use std::io::Write;
use std::path::{Path, PathBuf};

/// Program of the Python processes; it documents requests and answers.
const SCRIPT: &str = include_str!("peers.py");
/// Environment variable that names the Python with ML-Agents, which needs its own versions of packages.
const MLAGENTS_VARIABLE: &str = "MARATHON_MLAGENTS_PYTHON";
/// Agents of the paper's scenes.
const AGENTS: usize = 16;

/// Answer of a process.
#[derive(Deserialize)]
struct Answer {
    steps: u64,
    wall: f64,
    cpu: f64,
    curve: Vec<(f64, f64)>,
    #[serde(default, rename = "return")]
    return_mean: f64,
    #[serde(default)]
    length: f64,
    #[serde(default)]
    speed: f64,
    policy: Option<PathBuf>,
    versions: String,
    rate: Option<f64>,
}

/// An algorithm of Stable-Baselines3 with the settings of OpenAI Baselines, which the paper used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sb3 {
    /// PPO with the settings of PPO2 for MuJoCo.
    Ppo,
    /// A2C with the learning rate of the paper's authors.
    A2c,
}

impl Sb3 {
    /// Its name in Stable-Baselines3.
    pub fn name(self) -> &'static str {
        match self {
            Sb3::Ppo => "PPO",
            Sb3::A2c => "A2C",
        }
    }

    fn settings(self) -> Value {
        match self {
            Sb3::Ppo => json!({
                "learning_rate": 3e-4, "n_steps": 128, "batch_size": 64, "n_epochs": 10, "clip_range": 0.2,
                "clip_range_vf": 0.2, "ent_coef": 0.0, "max_grad_norm": 0.5, "gae_lambda": 0.95,
            }),
            Sb3::A2c => json!({
                "learning_rate": 3e-4, "n_steps": 5, "ent_coef": 0.01, "vf_coef": 0.25, "max_grad_norm": 0.5,
                "gae_lambda": 1.0, "rms_prop_eps": 1e-5, "use_rms_prop": true,
            }),
        }
    }
}

/// A finished training in a file.
#[derive(Serialize, Deserialize)]
struct Kept {
    job: Value,
    run: Run,
    versions: String,
}

/// Returns the training of `job` from the folder `keep`. Otherwise trains, which takes minutes, and keeps the result
/// there.
fn once(
    keep: Option<&Path>,
    (name, seed): (&str, u64),
    job: &Value,
    make: impl FnOnce() -> Result<(Run, String), StudyError>,
) -> Result<(Run, String), StudyError> {
    let Some(folder) = keep else { return make() };
    let agent = job["agent"].as_str().unwrap_or_default();
    let path = folder.join(format!("{name}-{agent}-{seed}.json"));
    if path.exists() {
        let bytes = budget::read(&path, &budget::TABLE_FILE).map_err(StudyError::io(&path, "read"))?;
        let kept: Kept = serde_json::from_slice(&bytes)
            .map_err(|e| StudyError::file(&path, "kept run", e, "a run that a study has put there"))?;
        if kept.job == *job {
            kept.run.note(&format!("{name} seed {seed}, kept"));
            return Ok((kept.run, kept.versions));
        }
    }
    let (run, versions) = make()?;
    let kept = Kept { job: job.clone(), run, versions };
    std::fs::create_dir_all(folder).map_err(StudyError::io(folder, "create folder"))?;
    let bytes = serde_json::to_vec(&kept).map_err(|e| StudyError::file(&path, "kept run", e, "numbers and words"))?;
    write_atomic(&path, &bytes)?;
    Ok((kept.run, kept.versions))
}

/// Trains sixteen agents with Stable-Baselines3 on a device of PyTorch (`cpu`, `cuda`). The standard deviation of
/// actions starts at `exp(log_std)`. A training in `keep` is reused. Returns the run and the versions of the packages.
///
/// # Errors
/// If the packages are missing, or training fails.
pub fn sb3(
    (agent, algorithm): (&str, Sb3),
    (device, log_std): (&str, f64),
    (seed, steps): (u64, u64),
    keep: Option<&Path>,
) -> Result<(Run, String), StudyError> {
    let job = json!({
        "trainer": "sb3", "agent": agent, "algorithm": algorithm.name(), "settings": algorithm.settings(),
        "device": device, "log_std": log_std, "agents": AGENTS, "seed": seed, "steps": steps, "threads": 1,
        "episodes": EPISODES,
    });
    once(keep, (&format!("sb3-{}-{device}", algorithm.name()), seed), &job, || {
        let advice = "pip install stable-baselines3 torch marathon-rl";
        let answer = trained(ask(&python::find(), VARIABLE, advice, &job)?)?;
        let eval = Evaluation {
            episodes: EPISODES as u64,
            return_mean: answer.return_mean,
            length_mean: answer.length,
            speed_mean: answer.speed,
            ..Default::default()
        };
        Ok((finish(&answer, eval, (&format!("Stable-Baselines3's {}", algorithm.name()), seed)), answer.versions))
    })
}

/// Trains with `mlagents-learn` and `marathon-player`, with the settings of a PPO configuration from a file of
/// ML-Agents, and evaluates the policy in Marathon. A training in `keep` is reused. Returns the run and the versions of
/// the packages.
///
/// # Errors
/// If ML-Agents or the player is missing, or training fails.
pub fn mlagents(
    agent: &str,
    config: &TrainConfig,
    time_horizon: u64,
    keep: Option<&Path>,
) -> Result<(Run, String), StudyError> {
    let factory = registry::factory(agent, Isa::best())?;
    let id = &factory.spec().id;
    let job = json!({
        "trainer": "mlagents", "agent": id, "config": file(id, config, time_horizon), "agents": config.run.agents,
        "seed": config.run.seed, "threads": 1,
    });
    once(keep, ("mlagents", config.run.seed), &job, || {
        let mut job = job.clone();
        let folder =
            std::env::temp_dir().join(format!("marathon-study-{}-{id}-{}", std::process::id(), config.run.seed));
        std::fs::create_dir_all(&folder).map_err(StudyError::io(&folder, "create folder"))?;
        (job["player"], job["folder"]) = (json!(player()?), json!(folder));
        let named = std::env::var_os(MLAGENTS_VARIABLE).filter(|name| !name.is_empty());
        let python = named.map_or_else(|| ".venv-mlagents/bin/python".into(), PathBuf::from);
        let advice = "tests/mlagents/run.sh, which makes .venv-mlagents";
        let answer = trained(ask(&python, MLAGENTS_VARIABLE, advice, &job)?)?;
        let path = answer.policy.as_deref().unwrap_or(&folder);
        let policy = policy_file::read(path, Some(factory.spec()))?;
        let options = EvalOptions { episodes: EPISODES, threads: 1, ..Default::default() };
        let eval = evaluate(&*factory, Isa::best(), &policy, &options)?;
        let _ = std::fs::remove_dir_all(&folder);
        Ok((finish(&answer, eval, ("ML-Agents' PPO", config.run.seed)), answer.versions))
    })
}

/// Name of the GPU that PyTorch can use, if any.
///
/// # Errors
/// If there is no Python with PyTorch.
pub fn gpu() -> Result<Option<String>, StudyError> {
    let answer = ask(&python::find(), VARIABLE, "pip install torch", &json!({ "trainer": "gpu" }))?;
    Ok(answer["gpu"].as_str().map(Into::into))
}

fn finish(answer: &Answer, eval: Evaluation, (who, seed): (&str, u64)) -> Run {
    let Answer { steps, wall, cpu, rate, .. } = *answer;
    let run = Run { curve: answer.curve.clone(), steps, wall, cpu, rate: rate.unwrap_or(steps as f64 / wall), eval };
    run.note(&format!("{who} seed {seed}"));
    run
}

/// The configuration file of ML-Agents (JSON is YAML).
fn file(behavior: &str, config: &TrainConfig, time_horizon: u64) -> Value {
    let Algorithm::Ppo(ppo) = &config.algorithm else { unreachable!("the comparison is of PPO") };
    let schedule = if ppo.lr_schedule == LrSchedule::Linear { "linear" } else { "constant" };
    let rollout = config.run.rollout_steps();
    json!({ "behaviors": { behavior: {
        "trainer_type": "ppo",
        "hyperparameters": {
            "batch_size": rollout / ppo.minibatches as u64,
            "buffer_size": rollout,
            "learning_rate": ppo.lr,
            "learning_rate_schedule": schedule,
            "beta": ppo.entropy_coef.from,
            "epsilon": ppo.clip.from,
            "lambd": ppo.gae_lambda,
            "num_epoch": ppo.epochs,
        },
        "network_settings": {
            "normalize": config.statistics.normalize_observations,
            "hidden_units": config.network.hidden.first(),
            "num_layers": config.network.hidden.len(),
        },
        "reward_signals": { "extrinsic": { "gamma": config.task_reward().gamma, "strength": 1.0 } },
        "max_steps": config.run.total_steps,
        "time_horizon": time_horizon,
        "summary_freq": (config.run.total_steps / 60).max(1000),
    }}})
}

/// `marathon-player`, which is built next to this program.
fn player() -> Result<PathBuf, StudyError> {
    let name = if cfg!(windows) { "marathon-player.exe" } else { "marathon-player" };
    let own = std::env::current_exe().map_err(StudyError::io(Path::new("marathon-studies"), "find"))?;
    let player = own.with_file_name(name);
    if player.exists() {
        return Ok(player);
    }
    Err(StudyError::Python(format!(
        "{}: no such file, expected ML-Agents' player; build it by `cargo build --release -p marathon-mlagents`",
        player.display()
    )))
}

/// Runs a job in a Python process.
fn ask(python: &Path, variable: &str, advice: &str, job: &Value) -> Result<Value, StudyError> {
    let place = text::path_word(python);
    let advice = format!("install it by `{advice}`, or let the variable {variable} name a Python that has it");
    let failed = |e: &dyn std::fmt::Display| StudyError::Python(format!("{place}: cannot be started: {e}; {advice}"));
    let mut child = python::command(python, SCRIPT).spawn().map_err(|e| failed(&e))?;
    let mut requests = child.stdin.take().ok_or_else(|| failed(&"no pipe"))?;
    // if the process has ended already, its error output is reported below
    let _ = writeln!(requests, "{job}");
    drop(requests);
    let output = child.wait_with_output().map_err(|e| failed(&e))?;
    let said = String::from_utf8_lossy(&output.stdout);
    let answer: Value = said.lines().next_back().and_then(|line| serde_json::from_str(line).ok()).unwrap_or_default();
    if let Some(missing) = answer["missing"].as_str() {
        return Err(StudyError::Python(format!("{place}: found no {missing}; {advice}")));
    }
    if answer.is_object() && answer["error"].is_null() {
        return Ok(answer);
    }
    let said = String::from_utf8_lossy(&output.stderr);
    let complaint = python::complaint(answer["error"].as_str().unwrap_or(&said));
    Err(StudyError::Python(format!("{place}: failed ({}):\n{complaint}", output.status)))
}

/// Reads the answer of a trainer.
fn trained(answer: Value) -> Result<Answer, StudyError> {
    serde_json::from_value(answer).map_err(|e| StudyError::Python(format!("invalid answer of Python: {e}")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use marathon_config as config;

    #[test]
    fn a_configuration_survives_the_way_to_mlagents_and_back() {
        let text = marathon_configs::text("hopper-mlagents.yaml").as_bytes();
        let mut ppo = config::parse(Path::new("a.yaml"), text, "Hopper-v0").unwrap().config;
        let written = file("Hopper-v0", &ppo, 128).to_string();
        let read = config::parse(Path::new("b.yaml"), written.as_bytes(), "Hopper-v0").unwrap().config;
        ppo.run.agents = read.run.agents;
        ppo.run.horizon = read.run.horizon;
        assert_eq!(read, ppo);
    }
    #[test]
    fn a_kept_training_is_not_made_again_unless_another_is_asked_for() {
        let folder = tempfile::tempdir().unwrap();
        let mut made = 0;
        let mut train = |steps: u64| {
            let run =
                Run { curve: vec![(1.0, 2.0)], steps, wall: 1.0, cpu: 1.0, rate: 1.0, eval: Evaluation::default() };
            let job = json!({ "agent": "Hopper-v0", "steps": steps });
            let make = || {
                made += 1;
                Ok((run, "1.0".to_string()))
            };
            once(Some(folder.path()), ("peer", 1), &job, make).unwrap().0.steps
        };
        assert_eq!([train(10), train(10), train(20), train(20)], [10, 10, 20, 20]);
        assert_eq!(made, 2);
        std::fs::write(folder.path().join("peer-Hopper-v0-1.json"), "{").unwrap();
        let job = json!({ "agent": "Hopper-v0" });
        let error = once(Some(folder.path()), ("peer", 1), &job, || unreachable!()).err().unwrap().to_string();
        assert!(error.contains("peer-Hopper-v0-1.json"), "{error}");
    }
}
