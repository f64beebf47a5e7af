//! Checkpoints: a folder that holds everything a run needs to go on with the same bits.
//!
//! `checkpoint.json` describes the run and names the file with its numbers, `state-<iteration>.safetensors`. The state is
//! written first and the description last, each under a temporary name, so an interruption at any moment leaves the old
//! or the new checkpoint, never half of one. Both have checksums.

use super::config::{MAX_STEPS, TrainConfig};
use super::{Clocks, Trainer, states};
use crate::algorithms::{Numbers, Saved};
use crate::error::Error;
use crate::files::{self, Dtype, TensorReader, TensorWriter, read_versions, write_atomic, write_description};
use crate::nets::normalize::Moments;
use crate::rewards::RewardConfig;
use crate::rollout::states::AgentStates;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::Path;

const FORMAT: &str = "marathon-checkpoint";
/// Since version 2, each algorithm keeps its own state by its own names.
const VERSION: u32 = 2;
const DESCRIPTION: &str = "checkpoint.json";
/// Lists beside those of the learner and of the agents.
const OBSERVATIONS: [&str; 2] = ["obs_mean", "obs_var"];

/// Everything a run needs to go on.
#[derive(Clone, Debug, PartialEq)]
pub struct Checkpoint {
    about: About,
    /// Lists of the learner.
    lists: Vec<(String, Numbers)>,
    obs_mean: Vec<f64>,
    obs_var: Vec<f64>,
    agents: AgentStates,
}

/// The description.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct About {
    format: String,
    version: u32,
    agent: String,
    obs: usize,
    act: usize,
    config: TrainConfig,
    iteration: u64,
    steps: u64,
    /// Single numbers of the learner.
    learner: BTreeMap<String, f64>,
    observation_count: f64,
    return_count: f64,
    return_mean: f64,
    return_var: f64,
    wall_seconds: f64,
    cpu_seconds: f64,
    state: StateFile,
}

impl About {
    /// Refuses values that no run has: files of earlier versions have no checksum.
    fn check(&self, path: &Path) -> Result<(), Error> {
        self.config.validate_in(path, "config")?;
        let others = [
            ("observation_count", self.observation_count),
            ("return_count", self.return_count),
            ("return_var", self.return_var),
            ("wall_seconds", self.wall_seconds),
            ("cpu_seconds", self.cpu_seconds),
        ];
        let learner = self.learner.iter().map(|(key, x)| (key.as_str(), *x));
        let mut numbers = learner.clone().chain(others);
        if let Some((key, x)) = numbers.find(|(_, x)| !(x.is_finite() && *x >= 0.0)) {
            return Err(Error::file(path, key, x, "a number not below 0"));
        }
        if let Some((key, x)) = learner.clone().find(|(key, x)| key.starts_with("adam_power") && *x > 1.0) {
            return Err(Error::file(path, key, x, "a number between 0 and 1"));
        }
        // rollouts may have had another horizon before
        let agents = self.config.run.agents as u64;
        let least = self.iteration.checked_mul(agents).filter(|least| *least <= self.steps);
        let none = (self.iteration == 0) != (self.steps == 0);
        if least.is_none() || none || self.steps > MAX_STEPS || !self.steps.is_multiple_of(agents) {
            let expected = format!(
                "a multiple of the {agents} agents, of at least as many as {} iterations make, and at most {MAX_STEPS}",
                self.iteration
            );
            return Err(Error::file(path, "steps", self.steps, expected));
        }
        if self.state.name.contains(['/', '\\']) {
            return Err(Error::file(path, "state.name", &self.state.name, "a file in the same folder"));
        }
        Ok(())
    }
}

/// The file with the numbers.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
struct StateFile {
    name: String,
    bytes: u64,
    checksum: String,
}

/// The rewards of a configuration, as far as a run cannot change them on its way.
fn rewards(config: &TrainConfig) -> String {
    let of = |reward: &RewardConfig| match reward.kind.networks() {
        Some(networks) => format!("{} {:?}", reward.kind.name(), networks.hidden),
        None => reward.kind.name().into(),
    };
    config.rewards.iter().map(of).collect::<Vec<_>>().join(", ")
}

/// Makes a description of version 1 into one of version 2.
fn upgrade(_: u64, mut about: Value) -> Result<Value, (String, String)> {
    let Some(keys) = about.as_object_mut() else { return Ok(about) };
    let config = keys.remove("config").unwrap_or_default();
    let config = TrainConfig::upgrade(config).map_err(|e| (format!("config.{}", e.path()), e.inner().to_string()))?;
    let mut learner = serde_json::Map::new();
    let powers = keys.remove("adam_powers").unwrap_or_default();
    if !config["algorithm"]["ppo"].is_null() || !config["algorithm"]["sac"].is_null() {
        learner.insert("adam_power_1".into(), powers[0].clone());
        learner.insert("adam_power_2".into(), powers[1].clone());
    }
    for (old, new) in [("lr", "lr"), ("skipped_minibatches", "skipped")] {
        learner.insert(new.into(), keys.remove(old).unwrap_or_default());
    }
    keys.insert("config".into(), config);
    keys.insert("learner".into(), learner.into());
    keys.insert("version".into(), json!(VERSION));
    Ok(about)
}

/// The name today of a learner's list in a file of version 1, which had Adam's for every algorithm.
fn renamed<'n>(name: &'n str, algorithm: &str) -> Option<&'n str> {
    match (name, algorithm) {
        ("adam_v", "a2c") => Some("mean_square"),
        ("adam_m", "acktr") => Some("momentum"),
        ("adam_m", "a2c") | ("adam_v", "acktr") => None,
        (name, _) => Some(name),
    }
}

impl Checkpoint {
    pub(super) fn of(trainer: &Trainer) -> Self {
        let Trainer { shared, replica, clocks, .. } = trainer;
        let (progress, statistics) = (&replica.progress, &replica.statistics);
        let Saved { scalars, lists } = replica.learner.save();
        let about = About {
            format: FORMAT.into(),
            version: VERSION,
            agent: shared.spec.id.clone(),
            obs: shared.spec.obs,
            act: shared.spec.act,
            config: shared.config.clone(),
            iteration: progress.iteration,
            steps: progress.steps,
            learner: scalars.into_iter().collect(),
            observation_count: statistics.observations.count,
            return_count: statistics.returns.count,
            return_mean: statistics.returns.mean[0],
            return_var: statistics.returns.var[0],
            wall_seconds: clocks.wall,
            cpu_seconds: clocks.cpu,
            state: StateFile::default(),
        };
        let collectors = shared.crew.collectors.iter().map(|c| c.lock().expect("no worker has panicked"));
        Self {
            about,
            lists,
            obs_mean: statistics.observations.mean.clone(),
            obs_var: statistics.observations.var.clone(),
            agents: AgentStates::of(collectors, 0..shared.config.run.blocks()),
        }
    }

    /// Name of the agent and its task.
    pub fn agent(&self) -> &str {
        &self.about.agent
    }
    /// Configuration of the run.
    pub fn config(&self) -> &TrainConfig {
        &self.about.config
    }
    /// Rollouts done.
    pub fn iteration(&self) -> u64 {
        self.about.iteration
    }
    /// Agent-steps done.
    pub fn steps(&self) -> u64 {
        self.about.steps
    }
    /// Wall-clock and processor seconds of training so far.
    pub fn seconds(&self) -> (f64, f64) {
        (self.about.wall_seconds, self.about.cpu_seconds)
    }

    /// Puts a fresh run into the state of the checkpoint.
    pub(super) fn restore(self, trainer: &mut Trainer) -> Result<(), Error> {
        let (about, old, new, spec) = (&self.about, &self.about.config, &trainer.shared.config, &trainer.shared.spec);
        let (before, after) = (&old.network, &new.network);
        let pairs = [
            ("agent", about.agent.clone(), spec.id.clone()),
            ("observation length", about.obs.to_string(), spec.obs.to_string()),
            ("action length", about.act.to_string(), spec.act.to_string()),
            ("algorithm", old.algorithm.name().into(), new.algorithm.name().into()),
            ("agents", old.run.agents.to_string(), new.run.agents.to_string()),
            ("seed", old.run.seed.to_string(), new.run.seed.to_string()),
            ("actor_hidden", format!("{:?}", before.actor_hidden), format!("{:?}", after.actor_hidden)),
            ("critic_hidden", format!("{:?}", before.critic_hidden), format!("{:?}", after.critic_hidden)),
            ("rewards", rewards(old), rewards(new)),
            ("activation", before.activation.name().into(), after.activation.name().into()),
        ];
        let mismatch = |what: &str, found: String, expected: String| {
            Err(Error::Mismatch { what: format!("checkpoint: {what}"), found, expected })
        };
        for (what, found, expected) in pairs {
            if found != expected {
                return mismatch(what, found, expected);
            }
        }
        for (what, found) in OBSERVATIONS.into_iter().zip([self.obs_mean.len(), self.obs_var.len()]) {
            if found != spec.obs {
                return mismatch(what, format!("{found} numbers"), format!("{}", spec.obs));
            }
        }
        let blocks = new.run.blocks();
        self.agents.check("checkpoint", blocks, spec.obs)?;
        let replica = &mut trainer.replica;
        let about = self.about;
        replica.learner.load(&Saved { scalars: about.learner.into_iter().collect(), lists: self.lists })?;
        replica.statistics.observations =
            Moments { count: about.observation_count, mean: self.obs_mean, var: self.obs_var };
        replica.statistics.returns =
            Moments { count: about.return_count, mean: vec![about.return_mean], var: vec![about.return_var] };
        (replica.progress.iteration, replica.progress.steps) = (about.iteration, about.steps);
        trainer.clocks = Clocks { wall: about.wall_seconds, cpu: about.cpu_seconds };
        for collector in &trainer.shared.crew.collectors {
            let collector = &mut *collector.lock().expect("no worker has panicked");
            self.agents.put("checkpoint", 0..blocks, collector)?;
        }
        Ok(())
    }

    /// Writes the checkpoint into a folder, replacing the one there.
    ///
    /// # Errors
    /// If a file cannot be written; the old checkpoint is whole then.
    pub fn save(&self, folder: &Path) -> Result<(), Error> {
        std::fs::create_dir_all(folder).map_err(Error::io(folder, "create folder"))?;
        let mut file = TensorWriter::default();
        for (name, numbers) in &self.lists {
            match numbers {
                Numbers::F32(list) => file.list(name, list),
                Numbers::F64(list) => file.list(name, list),
                Numbers::U32(list) => file.list(name, list),
                Numbers::U64(list) => file.list(name, list),
            }
        }
        for (name, list) in OBSERVATIONS.into_iter().zip([&self.obs_mean, &self.obs_var]) {
            file.list(name, list);
        }
        states::write(&self.agents, &mut file);
        let bytes = file.bytes(&serde_json::json!({ "format": FORMAT, "version": VERSION }));
        let checksum = files::checksum(&bytes);
        // a name of its own for every state: the old description must keep naming the old state
        let name = format!("state-{}-{}.safetensors", self.about.iteration, &checksum[..8]);
        write_atomic(&folder.join(&name), &bytes)?;
        let state = StateFile { name: name.clone(), bytes: bytes.len() as u64, checksum };
        let about = About { state, ..self.about.clone() };
        write_description(&folder.join(DESCRIPTION), &about)?;

        // states that no description names any more; failing to remove one harms nobody
        for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
            let old = entry.file_name().to_string_lossy().into_owned();
            if old.starts_with("state-") && old.ends_with(".safetensors") && old != name {
                let _ = std::fs::remove_file(entry.path());
            }
        }
        Ok(())
    }

    /// Reads the checkpoint in a folder.
    ///
    /// # Errors
    /// If a file is missing, damaged or of another format.
    pub fn load(folder: &Path) -> Result<Self, Error> {
        let path = folder.join(DESCRIPTION);
        let about: About = read_versions(&path, FORMAT, VERSION, Some(upgrade))?;
        about.check(&path)?;

        let path = folder.join(&about.state.name);
        let bytes = std::fs::read(&path).map_err(Error::io(&path, "read"))?;
        if bytes.len() as u64 != about.state.bytes {
            return Err(Error::file(&path, "length", bytes.len(), format!("{} bytes", about.state.bytes)));
        }
        let checksum = files::checksum(&bytes);
        if checksum != about.state.checksum {
            return Err(Error::file(&path, "checksum", checksum, &about.state.checksum));
        }
        let file = TensorReader::new(&path, &bytes)?;
        let others = states::NAMES.into_iter().chain(OBSERVATIONS);
        let mut lists = Vec::new();
        for (name, kind) in file.names() {
            if others.clone().any(|other| other == name) {
                continue;
            }
            // observations of a task may be anything
            let finite = !name.starts_with("replay_");
            let numbers = match kind {
                Dtype::F32 if finite => Numbers::F32(file.finite_list(name)?),
                Dtype::F32 => Numbers::F32(file.list(name)?),
                Dtype::F64 => Numbers::F64(file.list(name)?),
                Dtype::U32 => Numbers::U32(file.list(name)?),
                _ => Numbers::U64(file.list(name)?),
            };
            if let Some(name) = renamed(name, about.config.algorithm.name()) {
                lists.push((name.to_string(), numbers));
            }
        }
        let [obs_mean, obs_var] = OBSERVATIONS;
        Ok(Self {
            lists,
            obs_mean: file.list(obs_mean)?,
            obs_var: file.list(obs_var)?,
            agents: states::read(&file)?,
            about,
        })
    }
}
