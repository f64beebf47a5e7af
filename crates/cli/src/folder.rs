//! The folder of a run: what is in it, who may write to it, and how files get there whole.

use crate::error::CliError;
use crate::text;
use marathon_learn::{PpoConfig, write_atomic};
use serde::{Deserialize, Serialize};
use std::fs::{self, File, TryLockError};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

const FORMAT: &str = "marathon-run";
const VERSION: u32 = 1;
/// Where runs go unless the user says otherwise.
const RUNS: &str = "runs";
/// Part of the name of every file that TensorBoard reads.
pub const EVENTS: &str = "events.out.tfevents";

/// What a run is: everything that a resumed run must agree on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RunFile {
    /// Kind of file: `marathon-run`.
    pub format: String,
    /// Version of the format.
    pub version: u32,
    /// Registry name of the agent.
    pub agent: String,
    /// Steps between progress lines where there is no terminal.
    pub summary_freq: u64,
    /// Steps between checkpoints.
    pub checkpoint_interval: u64,
    /// Policies kept in `policies/`.
    pub keep_checkpoints: usize,
    /// The trainer's configuration.
    pub config: PpoConfig,
}

impl RunFile {
    /// Of a new run.
    pub fn new(agent: &str, loaded: &crate::config::Loaded) -> Self {
        Self {
            format: FORMAT.into(),
            version: VERSION,
            agent: agent.into(),
            summary_freq: loaded.summary_freq,
            checkpoint_interval: loaded.checkpoint_interval,
            keep_checkpoints: loaded.keep_checkpoints,
            config: loaded.ppo.clone(),
        }
    }
}

/// The folder of a run, locked against a second writer while this value lives.
#[derive(Debug)]
pub struct RunFolder {
    path: PathBuf,
    _lock: File,
}

impl RunFolder {
    /// Makes the folder of a new run: `out`, or the first free `runs/<agent>-<n>`.
    ///
    /// # Errors
    /// If `out` holds a run already, or the folder cannot be made or written to.
    pub fn create(out: Option<&Path>, agent: &str) -> Result<Self, CliError> {
        let path = match out {
            Some(out) => {
                refuse_run(out)?;
                fs::create_dir_all(out).map_err(CliError::io(out, "create folder"))?;
                out.to_path_buf()
            }
            None => free_folder(agent)?,
        };
        Self::lock(path)
    }

    /// Opens the folder of a run to go on with it.
    ///
    /// # Errors
    /// If it holds no run, or another process is writing to it.
    pub fn open(path: &Path) -> Result<(Self, RunFile), CliError> {
        let file = path.join("run.json");
        if !file.is_file() {
            let found = if path.is_dir() { "no run.json" } else { "no such folder" };
            return Err(CliError::file(path, "--resume", found, format!("the folder of a run{}", nearest_run(path))));
        }
        let folder = Self::lock(path.into())?;
        let run = folder.read_run()?;
        folder.remove_leftovers();
        Ok((folder, run))
    }

    fn lock(path: PathBuf) -> Result<Self, CliError> {
        let name = path.join(".lock");
        let lock = File::create(&name).map_err(CliError::io(&path, "write to folder"))?;
        match lock.try_lock() {
            Err(TryLockError::WouldBlock) => {
                Err(CliError::file(&path, "run", "another process that is writing to it", "no other"))
            }
            // some network file systems know no locks; then nobody else can have one
            Ok(()) | Err(TryLockError::Error(_)) => Ok(Self { path, _lock: lock }),
        }
    }

    /// The folder.
    pub fn path(&self) -> &Path {
        &self.path
    }
    /// The policy.
    pub fn policy(&self) -> PathBuf {
        self.path.join("policy.safetensors")
    }
    /// The folder of the checkpoint.
    pub fn checkpoint(&self) -> PathBuf {
        self.path.join("checkpoint")
    }
    /// Numbers of all iterations.
    pub fn progress(&self) -> PathBuf {
        self.path.join("progress.csv")
    }
    /// The learning curve.
    pub fn curve(&self) -> PathBuf {
        self.path.join("curve.png")
    }
    /// The run in numbers.
    pub fn summary(&self) -> PathBuf {
        self.path.join("summary.json")
    }
    /// Policies on the way.
    pub fn policies(&self) -> PathBuf {
        self.path.join("policies")
    }

    /// Files with events for TensorBoard, in their order.
    ///
    /// # Errors
    /// If the folder cannot be read.
    pub fn events(&self) -> Result<Vec<PathBuf>, CliError> {
        let read = |e| CliError::io(&self.path, "read folder")(e);
        let mut files = Vec::new();
        for entry in fs::read_dir(&self.path).map_err(read)? {
            let entry = entry.map_err(read)?;
            if entry.file_name().to_string_lossy().starts_with(EVENTS) {
                files.push(entry.path());
            }
        }
        files.sort();
        Ok(files)
    }

    /// Writes `run.json`.
    ///
    /// # Errors
    /// If that fails.
    pub fn write_run(&self, run: &RunFile) -> Result<(), CliError> {
        write_json(&self.path.join("run.json"), run)
    }

    fn read_run(&self) -> Result<RunFile, CliError> {
        let path = self.path.join("run.json");
        let text = fs::read_to_string(&path).map_err(CliError::io(&path, "read"))?;
        let bad = |e: serde_json::Error| CliError::file(&path, "JSON", format!("'{e}'"), "a run's description");
        let run: RunFile = serde_json::from_str(&text).map_err(bad)?;
        if run.format != FORMAT || run.version != VERSION {
            let found = format!("{} {}", run.format, run.version);
            return Err(CliError::file(&path, "format", found, format!("{FORMAT} {VERSION}")));
        }
        run.config.validate().map_err(|e| CliError::file(&path, "config", e, "a valid configuration"))?;
        Ok(run)
    }

    /// Removes temporary files of a writer that was killed; failing to harms nobody.
    fn remove_leftovers(&self) {
        for folder in [self.path.clone(), self.checkpoint(), self.policies()] {
            for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
                let name = entry.file_name().to_string_lossy().into_owned();
                if name.starts_with('.') && name.ends_with(".tmp") {
                    let _ = fs::remove_file(entry.path());
                }
            }
        }
    }
}

/// Refuses a folder that holds a run.
fn refuse_run(out: &Path) -> Result<(), CliError> {
    let signs = ["run.json", "policy.safetensors", "progress.csv", "summary.json", "checkpoint"];
    let Some(sign) = signs.iter().find(|sign| out.join(sign).exists()) else { return Ok(()) };
    let program = text::program();
    let folder = text::path_word(out);
    Err(CliError::Usage(format!(
        "--out {folder} holds a run already ({sign}); go on with it by `{program} train --resume {folder}`, or choose \
         another folder"
    )))
}

/// Claims the first free `runs/<agent>-<n>`.
fn free_folder(agent: &str) -> Result<PathBuf, CliError> {
    let runs = Path::new(RUNS);
    fs::create_dir_all(runs).map_err(CliError::io(runs, "create folder"))?;
    let base = text::short_name(agent);
    let mut n = 1;
    loop {
        let path = runs.join(format!("{base}-{n}"));
        match fs::create_dir(&path) {
            Ok(()) => return Ok(path),
            Err(e) if e.kind() == ErrorKind::AlreadyExists => n += 1,
            Err(e) => return Err(CliError::io(&path, "create folder")(e)),
        }
    }
}

/// `; did you mean 'runs/hopper-3'?` if there is a run whose folder is called almost like `path`.
pub fn nearest_run(path: &Path) -> String {
    let asked = path.display().to_string();
    let parent = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut near: Vec<(usize, String)> = Vec::new();
    for folder in [parent, Path::new(RUNS)] {
        for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
            let run = entry.path();
            if run.join("run.json").is_file() {
                let name = run.display().to_string();
                let name = name.strip_prefix("./").unwrap_or(&name).to_string();
                near.push((strsim::damerau_levenshtein(&asked, &name), name));
            }
        }
    }
    near.sort();
    let close = near.first().filter(|(distance, name)| *distance <= 3 || name.ends_with(&asked));
    close.map_or(String::new(), |(_, name)| format!("; did you mean '{name}'?"))
}

/// The policy that a user means: the file, or the one in a run's folder.
///
/// # Errors
/// If there is neither.
pub fn policy_path(given: &Path) -> Result<PathBuf, CliError> {
    let path = if given.is_dir() { given.join("policy.safetensors") } else { given.to_path_buf() };
    if path.exists() {
        return Ok(path);
    }
    let found = if given.is_dir() { "no policy.safetensors" } else { "no such file" };
    let expected = format!("a policy file or the folder of a run{}", nearest_run(given));
    Err(CliError::file(given, "policy", found, expected))
}

/// Writes a JSON document.
///
/// # Errors
/// If that fails.
pub fn write_json(path: &Path, document: &impl Serialize) -> Result<(), CliError> {
    let mut json = serde_json::to_string_pretty(document).expect("documents are plain data");
    json.push('\n');
    Ok(write_atomic(path, json.as_bytes())?)
}
