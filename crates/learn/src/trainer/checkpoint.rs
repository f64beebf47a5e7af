//! Checkpoints: a folder that holds everything a run needs to go on with the same bits.
//!
//! `checkpoint.json` describes the run and names the file with its numbers, `state-<iteration>.safetensors`. The state is
//! written first and the description last, each under a temporary name, so an interruption at any moment leaves the old
//! or the new checkpoint, never half of one. Both have checksums.

use crate::algorithms::parameters::Learner;
use crate::error::Error;
use crate::files::{self, TensorReader, TensorWriter, read_description, write_atomic, write_description};
use crate::nets::normalize::Moments;
use crate::optim::kfac::Kfac;
use crate::rewards::Signal;
use crate::rollout::replay::Saved;
use crate::rollout::states::Agents;
use crate::trainer::config::Algorithm;
use crate::trainer::config::MAX_STEPS;
use crate::trainer::config::PpoConfig;
use crate::trainer::{Clocks, Run};
use serde::{Deserialize, Serialize};
use std::path::Path;

const FORMAT: &str = "marathon-checkpoint";
const VERSION: u32 = 1;
/// Tensors of a replay, see [`Saved`].
const REPLAY: [&str; 4] = ["replay_obs", "replay_next", "replay_action", "replay_reward"];
const REPLAY_FLAGS: [&str; 2] = ["replay_done", "replay_failed"];
const DESCRIPTION: &str = "checkpoint.json";

/// Everything a run needs to go on.
#[derive(Clone, Debug, PartialEq)]
pub struct Checkpoint {
    about: About,
    params: Vec<f32>,
    adam_m: Vec<f32>,
    adam_v: Vec<f32>,
    /// Factors of the Fisher matrix and their inverses, of ACKTR.
    kfac: (Vec<f64>, Vec<f32>),
    /// Slow value networks and replay of SAC.
    targets: Vec<f32>,
    replay: Saved,
    obs_mean: Vec<f64>,
    obs_var: Vec<f64>,
    agents: Agents,
}

/// The description.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct About {
    format: String,
    version: u32,
    agent: String,
    obs: usize,
    act: usize,
    config: PpoConfig,
    iteration: u64,
    steps: u64,
    skipped_minibatches: u64,
    lr: f64,
    adam_powers: [f64; 2],
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
        self.config.validate().map_err(|e| e.in_file(path, "config"))?;
        let positive = [
            ("lr", self.lr),
            ("observation_count", self.observation_count),
            ("return_count", self.return_count),
            ("return_var", self.return_var),
            ("wall_seconds", self.wall_seconds),
            ("cpu_seconds", self.cpu_seconds),
        ];
        if let Some((key, x)) = positive.into_iter().find(|(_, x)| !(x.is_finite() && *x >= 0.0)) {
            return Err(Error::file(path, key, x, "a number not below 0"));
        }
        if let Some(x) = self.adam_powers.into_iter().find(|x| !(0.0..=1.0).contains(x)) {
            return Err(Error::file(path, "adam_powers", x, "a number between 0 and 1"));
        }
        // rollouts may have had another horizon before
        let agents = self.config.agents as u64;
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

/// The signals of a configuration, as far as a run cannot change them on its way.
fn signals(config: &PpoConfig) -> String {
    let of = |s: &Signal| format!("{} {:?}", s.kind.name(), s.hidden);
    config.signals.iter().map(of).collect::<Vec<_>>().join(", ")
}

impl Checkpoint {
    pub(crate) fn of(run: &Run<'_>, learner: &Learner, clocks: &Clocks) -> Self {
        let about = About {
            format: FORMAT.into(),
            version: VERSION,
            agent: run.spec.id.clone(),
            obs: run.spec.obs,
            act: run.spec.act,
            config: run.config.clone(),
            iteration: learner.iteration,
            steps: learner.steps,
            skipped_minibatches: learner.skipped,
            lr: learner.lr,
            adam_powers: learner.adam.powers,
            observation_count: learner.observations.count,
            return_count: learner.returns.count,
            return_mean: learner.returns.mean[0],
            return_var: learner.returns.var[0],
            wall_seconds: clocks.wall,
            cpu_seconds: clocks.cpu,
            state: StateFile::default(),
        };
        let actors = run.actors.iter().map(|actor| actor.lock().expect("no worker has panicked"));
        let mut replay = Saved::default();
        for of_worker in run.sac.iter().flat_map(|sac| &sac.replays) {
            let of_worker = of_worker.read().expect("no worker has panicked");
            (0..of_worker.blocks()).for_each(|b| of_worker.save(b, &mut replay));
        }
        Self {
            about,
            params: learner.params.clone(),
            adam_m: learner.adam.m.clone(),
            adam_v: learner.adam.v.clone(),
            kfac: run.kfac.as_ref().map(Kfac::save).unwrap_or_default(),
            targets: learner.targets.clone(),
            replay,
            obs_mean: learner.observations.mean.clone(),
            obs_var: learner.observations.var.clone(),
            agents: Agents::of(actors, 0..run.config.blocks()),
        }
    }

    /// Name of the agent and its task.
    pub fn agent(&self) -> &str {
        &self.about.agent
    }
    /// Configuration of the run.
    pub fn config(&self) -> &PpoConfig {
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
    pub(crate) fn restore(self, run: &Run<'_>, learner: &mut Learner, clocks: &mut Clocks) -> Result<(), Error> {
        let (about, old, new) = (&self.about, &self.about.config, run.config);
        let pairs = [
            ("agent", about.agent.clone(), run.spec.id.clone()),
            ("observation length", about.obs.to_string(), run.spec.obs.to_string()),
            ("action length", about.act.to_string(), run.spec.act.to_string()),
            ("algorithm", old.algorithm.name().into(), new.algorithm.name().into()),
            ("agents", old.agents.to_string(), new.agents.to_string()),
            ("seed", old.seed.to_string(), new.seed.to_string()),
            ("actor_hidden", format!("{:?}", old.actor_hidden), format!("{:?}", new.actor_hidden)),
            ("critic_hidden", format!("{:?}", old.critic_hidden), format!("{:?}", new.critic_hidden)),
            ("signals", signals(old), signals(new)),
            ("activation", old.activation.name().into(), new.activation.name().into()),
        ];
        let mismatch = |what: &str, found: String, expected: String| {
            Err(Error::Mismatch { what: format!("checkpoint: {what}"), found, expected })
        };
        for (what, found, expected) in pairs {
            if found != expected {
                return mismatch(what, found, expected);
            }
        }
        let (blocks, len) = (new.blocks(), run.layout.len);
        let lengths = [
            ("params", self.params.len(), len),
            ("adam_m", self.adam_m.len(), len),
            ("adam_v", self.adam_v.len(), len),
            ("targets", self.targets.len(), learner.targets.len()),
            ("obs_mean", self.obs_mean.len(), run.spec.obs),
            ("obs_var", self.obs_var.len(), run.spec.obs),
        ];
        for (what, found, expected) in lengths {
            if found != expected {
                return mismatch(what, format!("{found} numbers"), format!("{expected}"));
            }
        }
        self.agents.check("checkpoint", blocks, run.spec.obs)?;
        if let Some(kfac) = &run.kfac
            && !kfac.load(&self.kfac.0, &self.kfac.1)
        {
            return mismatch("kfac", format!("{} numbers", self.kfac.0.len()), "those of the networks".into());
        }

        let mut block = 0;
        for of_worker in run.sac.iter().flat_map(|sac| &sac.replays) {
            let mut of_worker = of_worker.write().expect("no worker has panicked");
            for b in 0..of_worker.blocks() {
                if !of_worker.load(b, block, &self.replay) {
                    let found = format!("{} decisions", self.replay.filled);
                    return mismatch("replay", found, "what the settings make room for".into());
                }
                block += 1;
            }
        }
        learner.targets.clone_from(&self.targets);

        learner.adam.powers = about.adam_powers;
        learner.lr = about.lr;
        learner.observations = Moments { count: about.observation_count, mean: self.obs_mean, var: self.obs_var };
        learner.returns =
            Moments { count: about.return_count, mean: vec![about.return_mean], var: vec![about.return_var] };
        learner.iteration = about.iteration;
        learner.steps = about.steps;
        learner.skipped = about.skipped_minibatches;
        *clocks = Clocks { wall: about.wall_seconds, cpu: about.cpu_seconds };
        learner.params = self.params;
        learner.adam.m = self.adam_m;
        learner.adam.v = self.adam_v;

        for actor in &run.actors {
            let actor = &mut *actor.lock().expect("no worker has panicked");
            self.agents.put("checkpoint", 0..blocks, actor)?;
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
        file.list("params", &self.params);
        file.list("adam_m", &self.adam_m);
        file.list("adam_v", &self.adam_v);
        if !self.kfac.0.is_empty() {
            file.list("kfac", &self.kfac.0);
            file.list("kfac_inverse", &self.kfac.1);
        }
        if !self.targets.is_empty() {
            file.list("targets", &self.targets);
            file.list("replay_filled", &[self.replay.filled]);
            for (name, numbers) in REPLAY.into_iter().zip(&self.replay.numbers) {
                file.list(name, numbers);
            }
            for (name, flags) in REPLAY_FLAGS.into_iter().zip(&self.replay.flags) {
                file.list(name, flags);
            }
        }
        file.list("obs_mean", &self.obs_mean);
        file.list("obs_var", &self.obs_var);
        self.agents.write(&mut file);
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
        let about: About = read_description(&path, FORMAT, VERSION)?;
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
        fn list<N: files::Number>(file: &TensorReader<'_>, name: &str) -> Result<Vec<N>, Error> {
            file.get(name, &[file.list_len(name)])
        }
        let finite = |name| file.finite(name, &[file.list_len(name)]);
        let kfac = match about.config.algorithm {
            Algorithm::Acktr(_) => (list(&file, "kfac")?, finite("kfac_inverse")?),
            _ => Default::default(),
        };
        let (mut targets, mut replay) = (Vec::new(), Saved::default());
        if let Algorithm::Sac(_) = about.config.algorithm {
            targets = finite("targets")?;
            replay.filled = list(&file, "replay_filled")?.first().copied().unwrap_or(0);
            for (name, numbers) in REPLAY.into_iter().zip(&mut replay.numbers) {
                *numbers = list(&file, name)?;
            }
            for (name, flags) in REPLAY_FLAGS.into_iter().zip(&mut replay.flags) {
                *flags = list(&file, name)?;
            }
        }
        Ok(Self {
            targets,
            replay,
            params: finite("params")?,
            adam_m: finite("adam_m")?,
            adam_v: finite("adam_v")?,
            kfac,
            obs_mean: list(&file, "obs_mean")?,
            obs_var: list(&file, "obs_var")?,
            agents: Agents::read(&file)?,
            about,
        })
    }
}
