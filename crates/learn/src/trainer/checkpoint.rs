//! Checkpoints: a folder that holds everything a run needs to go on with the same bits.
//!
//! `checkpoint.json` describes the run and names the file with its numbers, `state-<iteration>.safetensors`. The state is
//! written first and the description last, each under a temporary name, so an interruption at any moment leaves the old
//! or the new checkpoint, never half of one. Both have checksums.

use super::config::{MAX_STEPS, TrainConfig};
use super::roles::RoleReplica;
use super::{Clocks, TrainLoop, states};
use crate::algorithms::{Numbers, Saved};
use crate::error::Error;
use crate::files::{self, Dtype, TensorReader, TensorWriter, read_description, write_atomic, write_description};
use crate::nets::normalize::Moments;
use crate::rewards::RewardConfig;
use crate::rollout::states::{AgentStates, StatesShape};
use marathon_physics::budget;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

const FORMAT: &str = "marathon-checkpoint";
const VERSION: u32 = 3;
const DESCRIPTION: &str = "checkpoint.json";
/// Lists of a role beside those of its learner.
const OBSERVATIONS: [&str; 2] = ["obs_mean", "obs_var"];
/// The mean of the last policies, which lies with the lists of the learner.
const AVERAGE: &str = "policy_average";

/// Everything a run needs to go on.
#[derive(Clone, Debug, PartialEq)]
pub struct Checkpoint {
    about: About,
    roles: Vec<RoleLists>,
    agents: AgentStates,
}

/// Lists of a role.
#[derive(Clone, Debug, Default, PartialEq)]
struct RoleLists {
    /// Of the learner.
    learner: Vec<(String, Numbers)>,
    obs_mean: Vec<f64>,
    obs_var: Vec<f64>,
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
    /// Of the first role.
    #[serde(flatten)]
    first: AboutRole,
    /// Of the others, with their names.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    others: Vec<(String, AboutRole)>,
    wall_seconds: f64,
    cpu_seconds: f64,
    state: StateFile,
}

/// A role in the description.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct AboutRole {
    /// Single numbers of the learner.
    learner: BTreeMap<String, f64>,
    observation_count: f64,
    return_count: f64,
    return_mean: f64,
    return_var: f64,
}

impl AboutRole {
    /// Its numbers that are not below 0, by their keys.
    fn numbers(&self) -> impl Iterator<Item = (&str, f64)> {
        let others = [
            ("observation_count", self.observation_count),
            ("return_count", self.return_count),
            ("return_var", self.return_var),
        ];
        self.learner.iter().map(|(key, x)| (key.as_str(), *x)).chain(others)
    }
}

impl About {
    /// Refuses values that no run has. A file that was edited by hand has no checksum.
    fn check(&self, path: &Path) -> Result<(), Error> {
        self.config.validate_in(path, "config")?;
        let roles = || [&self.first].into_iter().chain(self.others.iter().map(|(_, role)| role));
        let clocks = [("wall_seconds", self.wall_seconds), ("cpu_seconds", self.cpu_seconds)];
        let mut numbers = roles().flat_map(AboutRole::numbers).chain(clocks);
        if let Some((key, x)) = numbers.find(|(_, x)| !(x.is_finite() && *x >= 0.0)) {
            return Err(Error::file(path, key, x, "a number not below 0"));
        }
        let is_power = |(key, x): &(&str, f64)| key.starts_with("adam_power") && *x > 1.0;
        if let Some((key, x)) = roles().flat_map(AboutRole::numbers).find(is_power) {
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
        Some((hidden, _)) => format!("{} {hidden:?}", reward.kind.name()),
        None => reward.kind.name().into(),
    };
    config.rewards.iter().map(of).collect::<Vec<_>>().join(", ")
}

impl Checkpoint {
    pub(super) fn of(trainer: &TrainLoop) -> Self {
        let TrainLoop { shared, replica, clocks, .. } = trainer;
        let (mut roles, mut about_roles) = (Vec::new(), Vec::new());
        for (role, RoleReplica { learner, statistics, average }) in shared.roles.iter().zip(&replica.roles) {
            let mut saved = learner.save();
            if let Some(average) = average {
                saved.list(AVERAGE, average);
            }
            let Saved { scalars, lists } = saved;
            let about = AboutRole {
                learner: scalars.into_iter().collect(),
                observation_count: statistics.observations.count,
                return_count: statistics.returns.count,
                return_mean: statistics.returns.mean[0],
                return_var: statistics.returns.var[0],
            };
            about_roles.push((role.role.name.clone(), about));
            let (obs_mean, obs_var) = (statistics.observations.mean.clone(), statistics.observations.var.clone());
            roles.push(RoleLists { learner: lists, obs_mean, obs_var });
        }
        let (_, first) = about_roles.remove(0);
        let about = About {
            format: FORMAT.into(),
            version: VERSION,
            agent: shared.spec.id.clone(),
            obs: shared.spec.obs,
            act: shared.spec.act,
            config: shared.config.clone(),
            iteration: replica.progress.iteration,
            steps: replica.progress.steps,
            first,
            others: about_roles,
            wall_seconds: clocks.wall,
            cpu_seconds: clocks.cpu,
            state: StateFile::default(),
        };
        let collectors = shared.collectors.iter().map(|c| c.lock().expect("no worker has panicked"));
        Self { about, roles, agents: AgentStates::of(collectors, 0..shared.config.run.blocks()) }
    }

    /// Prefix of the names of each role's lists.
    fn prefixes(about: &About) -> Vec<String> {
        let others = about.others.iter().enumerate().map(|(i, (name, _))| states::prefix(i + 1, name));
        [states::prefix(0, "")].into_iter().chain(others).collect()
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
    pub(super) fn restore(self, trainer: &mut TrainLoop) -> Result<(), Error> {
        let (about, old, new, spec) = (&self.about, &self.about.config, &trainer.shared.config, &trainer.shared.spec);
        let names = |roles: &mut dyn Iterator<Item = &String>| roles.map(String::as_str).collect::<Vec<_>>().join(", ");
        let mut pairs = vec![
            ("agent", about.agent.clone(), spec.id.clone()),
            ("observation length", about.obs.to_string(), spec.obs.to_string()),
            ("action length", about.act.to_string(), spec.act.to_string()),
            (
                "roles but the first",
                names(&mut about.others.iter().map(|(name, _)| name)),
                names(&mut spec.roles.iter().skip(1).map(|role| &role.name)),
            ),
            ("agents", old.run.agents.to_string(), new.run.agents.to_string()),
            ("seed", old.run.seed.to_string(), new.run.seed.to_string()),
        ];
        for role in &trainer.shared.roles {
            let (old, new) = (old.of_role(&role.role.name), &role.config);
            let (before, after) = (&old.network, &new.network);
            pairs.extend([
                ("algorithm", old.algorithm.name().into(), new.algorithm.name().into()),
                ("hidden", format!("{:?}", before.hidden), format!("{:?}", after.hidden)),
                ("critic_hidden", format!("{:?}", before.critic()), format!("{:?}", after.critic())),
                ("rewards", rewards(&old), rewards(new)),
                ("activation", before.activation.name().into(), after.activation.name().into()),
            ]);
        }
        let mismatch = |what: &str, found: String, expected: String| {
            Err(Error::Mismatch { what: format!("checkpoint: {what}"), found, expected })
        };
        for (what, found, expected) in pairs {
            if found != expected {
                return mismatch(what, found, expected);
            }
        }
        let lengths: Vec<usize> = trainer.shared.roles.iter().map(|role| role.spec.obs).collect();
        for (lists, expected) in self.roles.iter().zip(&lengths) {
            for (what, found) in OBSERVATIONS.into_iter().zip([lists.obs_mean.len(), lists.obs_var.len()]) {
                if found != *expected {
                    return mismatch(what, format!("{found} numbers"), expected.to_string());
                }
            }
        }
        let (blocks, averages) = (new.run.blocks(), new.run.policy_average > 0.0);
        self.agents.check("checkpoint", StatesShape { blocks, obs: &lengths, act: spec.act })?;
        let replica = &mut trainer.replica;
        let about = self.about;
        let about_roles = [about.first].into_iter().chain(about.others.into_iter().map(|(_, role)| role));
        let roles = replica.roles.iter_mut().zip(&trainer.shared.roles);
        for (((role, part), about), lists) in roles.zip(about_roles).zip(self.roles) {
            let RoleLists { learner, obs_mean, obs_var } = lists;
            let saved = Saved { scalars: about.learner.into_iter().collect(), lists: learner };
            role.learner.load(&saved)?;
            // a run that no longer averages hands out its last policy
            if averages && saved.get::<f64>(AVERAGE).is_ok() {
                let policy = part.last_policy(role);
                let mut average = vec![0.0; policy.numbers().count()];
                saved.copy(AVERAGE, &mut average)?;
                role.average = Some(average);
            }
            role.statistics.observations = Moments { count: about.observation_count, mean: obs_mean, var: obs_var };
            role.statistics.returns =
                Moments { count: about.return_count, mean: vec![about.return_mean], var: vec![about.return_var] };
        }
        (replica.progress.iteration, replica.progress.steps) = (about.iteration, about.steps);
        trainer.clocks = Clocks { wall: about.wall_seconds, cpu: about.cpu_seconds };
        for collector in &trainer.shared.collectors {
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
        let prefixes = Self::prefixes(&self.about);
        for (role, prefix) in self.roles.iter().zip(&prefixes) {
            for (name, numbers) in &role.learner {
                let name = format!("{prefix}{name}");
                match numbers {
                    Numbers::F32(list) => file.list(&name, list),
                    Numbers::F64(list) => file.list(&name, list),
                    Numbers::U32(list) => file.list(&name, list),
                    Numbers::U64(list) => file.list(&name, list),
                }
            }
            for (name, list) in OBSERVATIONS.into_iter().zip([&role.obs_mean, &role.obs_var]) {
                file.list(&format!("{prefix}{name}"), list);
            }
        }
        states::write(&self.agents, &prefixes, &mut file);
        let bytes = file.bytes(&serde_json::json!({ "format": FORMAT, "version": VERSION }));
        let checksum = files::checksum(&bytes);
        // a name of its own for every state: the old description must keep naming the old state
        let name = format!("state-{}-{}.safetensors", self.about.iteration, &checksum[..8]);
        write_atomic(&folder.join(&name), &bytes)?;
        let state = StateFile { name: name.clone(), bytes: bytes.len() as u64, checksum };
        let about = About { state, ..self.about.clone() };
        write_description(&folder.join(DESCRIPTION), &about)?;

        // states that no description names any more; failing to remove one does no harm
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
        let about: About = read_description(&path, FORMAT, VERSION)?;
        about.check(&path)?;

        let path = folder.join(&about.state.name);
        // the experience of an off-policy learner is as large as the memory of its agents
        let bytes = budget::read(&path, &budget::AGENTS_MEMORY).map_err(Error::io(&path, "read"))?;
        if bytes.len() as u64 != about.state.bytes {
            return Err(Error::file(&path, "length", bytes.len(), format!("{} bytes", about.state.bytes)));
        }
        let checksum = files::checksum(&bytes);
        if checksum != about.state.checksum {
            return Err(Error::file(&path, "checksum", checksum, &about.state.checksum));
        }
        let file = TensorReader::new(&path, &bytes)?;
        let prefixes = Self::prefixes(&about);
        let mut roles = Vec::new();
        for prefix in &prefixes {
            let [obs_mean, obs_var] = OBSERVATIONS.map(|name| format!("{prefix}{name}"));
            let (obs_mean, obs_var) = (file.list(&obs_mean)?, file.list(&obs_var)?);
            roles.push(RoleLists { learner: learner_lists(&file, prefix)?, obs_mean, obs_var });
        }
        Ok(Self { roles, agents: states::read(&file, &prefixes)?, about })
    }
}

/// The lists of a role's learner with their names.
fn learner_lists(file: &TensorReader<'_>, prefix: &str) -> Result<Vec<(String, Numbers)>, Error> {
    let mut lists = Vec::new();
    for (full, kind) in file.names() {
        let Some(name) = full.strip_prefix(prefix).filter(|name| !name.contains('/')) else { continue };
        if states::has(name) || OBSERVATIONS.contains(&name) {
            continue;
        }
        // observations of a task may be anything
        let finite = !name.starts_with("replay_");
        let numbers = match kind {
            Dtype::F32 if finite => Numbers::F32(file.finite_list(full)?),
            Dtype::F32 => Numbers::F32(file.list(full)?),
            Dtype::F64 => Numbers::F64(file.list(full)?),
            Dtype::U32 => Numbers::U32(file.list(full)?),
            _ => Numbers::U64(file.list(full)?),
        };
        lists.push((name.to_string(), numbers));
    }
    Ok(lists)
}
