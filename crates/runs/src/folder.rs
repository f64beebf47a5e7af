//! The folder of a run: its contents, its lock, and writing files completely or not at all.

use crate::error::RunError;
use crate::run_file::RunFile;
use crate::task_config::TaskConfig;
use crate::text;
use marathon_envs::NamedClip;
use marathon_learn::{Checkpoint, checksum, write_atomic, write_description};
use marathon_physics::budget;
use marathon_physics::hint::did_you_mean;
use serde::Serialize;
use std::ffi::{OsStr, OsString};
use std::fs::{self, File, TryLockError};
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

const RUN: &str = "run.json";
/// Description of a recipe's folder.
pub(crate) const RECIPE: &str = "recipe.json";
const LOCK: &str = ".lock";
const PROGRESS: &str = "progress.csv";
/// Folder of the checkpoint.
const CHECKPOINT: &str = "checkpoint";
/// Folder of policies from during the run.
pub const POLICIES: &str = "policies";
/// Default folder of runs.
pub(crate) const RUNS: &str = "runs";
/// Part of the name of every file that TensorBoard reads.
pub const EVENTS: &str = "events.out.tfevents";

/// The folder of a run, locked against other writers while this value lives.
#[derive(Debug)]
pub struct RunFolder {
    path: PathBuf,
    /// For a new run: folders that were created for it, the deepest first.
    made: Option<Vec<PathBuf>>,
    _lock: File,
}

impl RunFolder {
    /// Creates the folder of a new run: `out`, or the first free `runs/<agent>-<n>`.
    ///
    /// # Errors
    /// If `out` holds anything other than a run without an iteration, or the folder cannot be created or written to.
    pub fn create(out: Option<&Path>, agent: &str) -> Result<Self, RunError> {
        let (path, made) = match out {
            Some(out) => {
                refuse_file(out)?;
                refuse(out)?;
                let missing = out.ancestors().take_while(|p| !p.as_os_str().is_empty() && !p.exists());
                let made = missing.map(Path::to_path_buf).collect();
                fs::create_dir_all(out).map_err(RunError::io(out, "create folder"))?;
                (out.to_path_buf(), made)
            }
            None => free_folder(agent)?,
        };
        let folder = Self { made: Some(made), ..Self::lock(path)? };
        // another process may have used the folder in between
        refuse(&folder.path)?;
        refuse_links(&folder.path)?;
        folder.clear();
        Ok(folder)
    }

    /// Opens the folder of a run to resume it.
    ///
    /// # Errors
    /// If it holds no run or contains links, or another process is writing to it.
    pub fn open(path: &Path) -> Result<(Self, RunFile), RunError> {
        let file = path.join(RUN);
        if !file.is_file() {
            let found = if path.is_dir() { "no run.json" } else { "no such folder" };
            return Err(RunError::NoRun { folder: path.into(), found, nearest: nearest_run(path) });
        }
        refuse_links(path)?;
        let folder = Self::lock(path.into())?;
        let run = RunFile::read(&file)?;
        folder.place_clips(&run)?;
        folder.remove_leftovers();
        Ok((folder, run))
    }

    fn lock(path: PathBuf) -> Result<Self, RunError> {
        let lock = lock(&path)?;
        Ok(Self { path, made: None, _lock: lock })
    }

    /// Reads the last checkpoint of a run. A run that ended before its first checkpoint has none.
    ///
    /// # Errors
    /// If it is damaged, lost, or belongs to another run.
    pub fn last_checkpoint(&self, run: &RunFile) -> Result<Option<Checkpoint>, RunError> {
        let file = self.checkpoint().join("checkpoint.json");
        if file.exists() {
            let checkpoint = Checkpoint::load(&self.checkpoint())?;
            run.check(&self.path.join(RUN), &checkpoint)?;
            return Ok(Some(checkpoint));
        }
        // these files are written after the checkpoint
        match [self.policy(), self.summary()].into_iter().find(|later| later.exists()) {
            None => Ok(None),
            Some(later) => {
                let name = later.file_name().unwrap_or_default().to_string_lossy();
                let expected =
                    format!("the checkpoint that was written before {name}; without it, train in another folder");
                Err(RunError::file(&file, "checkpoint", "no such file", expected))
            }
        }
    }

    /// Removes the folder of a new run that could not start: its contents, and the folders that were created for it.
    pub fn discard(self) {
        let Some(made) = self.made.as_ref().filter(|_| is_blank(&self.path)) else { return };
        self.clear();
        let _ = fs::remove_file(self.path.join(RUN));
        let _ = fs::remove_file(self.path.join(LOCK));
        for folder in made {
            // fails for folders that meanwhile hold other files
            let _ = fs::remove_dir(folder);
        }
    }

    /// Removes the files of a run without an iteration, except its description.
    fn clear(&self) {
        self.remove_leftovers();
        let _ = fs::remove_file(self.progress());
        if let Ok(run) = RunFile::read(&self.path.join(RUN)) {
            run.clips.keys().for_each(|name| _ = fs::remove_file(self.path.join(name)));
        }
        for events in self.events().into_iter().flatten() {
            let _ = fs::remove_file(events);
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
    /// The policy of a role other than the first.
    pub fn policy_of(&self, role: &str) -> PathBuf {
        policy_of_role(&self.policy(), role)
    }
    /// The folder of the checkpoint.
    pub fn checkpoint(&self) -> PathBuf {
        self.path.join(CHECKPOINT)
    }
    /// The table with the numbers of all iterations.
    pub fn progress(&self) -> PathBuf {
        self.path.join(PROGRESS)
    }
    /// The learning curve.
    pub fn curve(&self) -> PathBuf {
        self.path.join("curve.png")
    }
    /// The summary of the run.
    pub fn summary(&self) -> PathBuf {
        self.path.join("summary.json")
    }
    /// Policies from during the run.
    pub fn policies(&self) -> PathBuf {
        self.path.join(POLICIES)
    }

    /// Event files for TensorBoard, in their order.
    ///
    /// # Errors
    /// If the folder cannot be read.
    pub fn events(&self) -> Result<Vec<PathBuf>, RunError> {
        let read = |e| RunError::io(&self.path, "read folder")(e);
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

    /// Writes the files of a new run: `run.json`, and the clips that do not ship with Marathon. If the process is
    /// killed here, the folder has a run that can resume, or only files that do not block a new run.
    ///
    /// # Errors
    /// If a file cannot be written.
    pub fn begin(&self, run: &RunFile) -> Result<(), RunError> {
        for (i, (name, clip)) in run.options.given_clips().into_iter().enumerate() {
            // temporary names until `run.json` lists the clips
            let path = self.path.join(format!(".clip-{i}.{}.tmp", std::process::id()));
            let _ = fs::remove_file(&path);
            let write = || {
                let mut file = File::options().write(true).create_new(true).open(&path)?;
                file.write_all(&clip.to_bytes())?;
                file.sync_all()
            };
            write().map_err(RunError::io(&self.path.join(name), "write"))?;
        }
        self.write_run(run)?;
        self.place_clips(run)
    }

    /// Writes `run.json`.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn write_run(&self, run: &RunFile) -> Result<(), RunError> {
        Ok(write_description(&self.path.join(RUN), run)?)
    }

    /// Gives a run's clips their final names, if they still have temporary ones.
    fn place_clips(&self, run: &RunFile) -> Result<(), RunError> {
        let missing = run.clips.iter().filter(|(name, _)| !self.path.join(name).exists());
        for (name, sum) in missing {
            let staged = fs::read_dir(&self.path).into_iter().flatten().flatten();
            let staged = staged.filter(|entry| is_leftover(&entry.file_name())).map(|entry| entry.path());
            let is_it =
                |path: &PathBuf| budget::read(path, &budget::CLIP_FILE).is_ok_and(|bytes| checksum(&bytes) == *sum);
            if let Some(path) = staged.into_iter().find(is_it) {
                let place = self.path.join(name);
                fs::rename(path, &place).map_err(RunError::io(&place, "write"))?;
            }
        }
        Ok(())
    }

    /// The task of a run, with its clips.
    ///
    /// # Errors
    /// If a clip is missing, or has changed since the run began.
    pub fn task_config(&self, run: &RunFile) -> Result<TaskConfig, RunError> {
        let mut clips = Vec::new();
        for (name, sum) in &run.clips {
            let path = self.path.join(name);
            let text = budget::read_to_string(&path, &budget::CLIP_FILE).map_err(RunError::io(&path, "read"))?;
            let found = checksum(text.as_bytes());
            if found != *sum {
                return Err(RunError::file(
                    &path,
                    "checksum",
                    found,
                    format!("{sum}, as in {RUN}; the clip has changed"),
                ));
            }
            clips.push(NamedClip::parse(name, text.as_bytes())?);
        }
        Ok(TaskConfig { agent: run.agent.clone(), options: run.options.clone().bind_clips(&clips) })
    }

    /// Removes temporary files of a killed writer. Errors are ignored.
    fn remove_leftovers(&self) {
        for folder in [self.path.clone(), self.checkpoint(), self.policies()] {
            for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
                if is_leftover(&entry.file_name()) {
                    let _ = fs::remove_file(entry.path());
                }
            }
        }
    }
}

/// Locks a folder against other processes that write to it, while the file lives.
///
/// # Errors
/// If another process has locked it, or the lock cannot be written.
pub(crate) fn lock(path: &Path) -> Result<File, RunError> {
    let name = path.join(LOCK);
    refuse_link(&name)?;
    let mut options = File::options();
    options.read(true).write(true).create(true).truncate(false);
    #[cfg(unix)]
    {
        use std::os::unix::fs::OpenOptionsExt;
        // refuses a link that was created a moment ago, or a pipe without a reader
        options.custom_flags(libc::O_NOFOLLOW | libc::O_NONBLOCK);
    }
    let lock = options.open(&name).map_err(RunError::io(path, "write to folder"))?;
    match lock.try_lock() {
        Err(TryLockError::WouldBlock) => {
            Err(RunError::file(path, "run", "another process that is writing to it", "no other"))
        }
        // some network file systems have no locks: then no other process can have one
        Ok(()) | Err(TryLockError::Error(_)) => Ok(lock),
    }
}

/// Refuses a name that something other than a folder has.
pub(crate) fn refuse_file(out: &Path) -> Result<(), RunError> {
    let Ok(facts) = fs::symlink_metadata(out) else { return Ok(()) };
    if out.is_dir() {
        return Ok(());
    }
    let found = if facts.is_symlink() && !out.exists() { "a link to nothing" } else { "a file" };
    Err(RunError::option("out", format!("is {}: found {found}, expected a folder", text::path_word(out))))
}

/// Refuses a folder that holds anything other than a run without an iteration.
fn refuse(out: &Path) -> Result<(), RunError> {
    if is_blank(out) {
        return Ok(());
    }
    if RunFile::read(&out.join(RUN)).is_ok() {
        return Err(RunError::HoldsRun(out.into()));
    }
    let mut names: Vec<OsString> = fs::read_dir(out).into_iter().flatten().flatten().map(|e| e.file_name()).collect();
    names.retain(|name| name != LOCK);
    names.sort();
    let first = names.first().map(|name| name.to_string_lossy()).unwrap_or_default();
    let more = match names.len() {
        0 | 1 => String::new(),
        n => format!(" and {} more", n - 1),
    };
    let folder = text::path_word(out);
    let problem =
        format!("{folder} holds '{first}'{more}, expected a new or empty folder; choose another, or move that away");
    Err(RunError::option("out", problem))
}

/// Whether the program writes an entry of this name to a run's folder, and whether the entry is a folder.
fn kind_of_entry(name: &OsStr) -> Option<bool> {
    let name = name.to_str()?;
    let files =
        [LOCK, RUN, PROGRESS, "policy.safetensors", "summary.json", "curve.png", "stage.json", "until.json", "done"];
    let starts = ["policy-", EVENTS].iter().any(|start| name.starts_with(start));
    let ends = [".motion", ".gif"].iter().any(|end| name.ends_with(end));
    match name {
        CHECKPOINT | POLICIES => Some(true),
        _ if files.contains(&name) || starts || ends || is_leftover(name.as_ref()) => Some(false),
        _ => None,
    }
}

/// Refuses links among the entries that the program writes to a run's folder. The folder may come from another person,
/// and writing would change files outside it.
fn refuse_links(folder: &Path) -> Result<(), RunError> {
    for entry in fs::read_dir(folder).map_err(RunError::io(folder, "read folder"))? {
        let entry = entry.map_err(RunError::io(folder, "read folder"))?;
        refuse_link(&entry.path())?;
    }
    Ok(())
}

/// Refuses an entry of a run's folder that is not the expected file or folder.
fn refuse_link(path: &Path) -> Result<(), RunError> {
    let Some(is_folder) = path.file_name().and_then(kind_of_entry) else { return Ok(()) };
    let kind = match fs::symlink_metadata(path) {
        Ok(facts) => facts.file_type(),
        Err(e) if e.kind() == ErrorKind::NotFound => return Ok(()),
        Err(e) => return Err(RunError::io(path, "read")(e)),
    };
    let found = match (kind.is_symlink(), kind.is_dir(), kind.is_file()) {
        (_, folder, file) if folder == is_folder && file != is_folder => return Ok(()),
        (true, ..) => "a link",
        (_, true, _) => "a folder",
        (_, _, true) => "a file",
        _ => "a device, pipe or socket",
    };
    let expected = if is_folder { "a folder of the run's own" } else { "a file of the run's own" };
    Err(RunError::file(path, "kind", found, expected))
}

/// Whether a folder has nothing to lose. It may be missing or empty, hold a run without a finished iteration, or hold
/// only the files of a killed start.
fn is_blank(folder: &Path) -> bool {
    let entries = match fs::read_dir(folder) {
        Ok(entries) => entries,
        Err(e) => return e.kind() == ErrorKind::NotFound || !folder.is_dir(),
    };
    let mut names: Vec<OsString> = Vec::new();
    for entry in entries {
        let Ok(entry) = entry else { return false };
        names.push(entry.file_name());
    }
    names.retain(|name| name != LOCK);
    if names.iter().all(|name| is_leftover(name)) {
        return true;
    }
    let rows = || {
        let text = budget::read_to_string(&folder.join(PROGRESS), &budget::TABLE_FILE);
        text.map_or_else(|e| usize::from(e.kind() != ErrorKind::NotFound), |text| text.lines().skip(1).count())
    };
    let run = RunFile::read(&folder.join(RUN));
    let ours = |name: &OsString| {
        let is_clip = || run.as_ref().is_ok_and(|run| run.clips.keys().any(|clip| **name == **clip));
        let of_events = || name.to_str().is_some_and(|n| n.starts_with(EVENTS) && n.contains(".marathon."));
        name == RUN || name == PROGRESS || is_leftover(name) || of_events() || is_clip()
    };
    names.iter().all(ours) && run.is_ok() && rows() == 0
}

/// Whether a file has a temporary name: `.<name>.<process ID>.tmp`.
fn is_leftover(name: &OsStr) -> bool {
    let name = name.as_encoded_bytes();
    let inner = name.strip_prefix(b".").and_then(|name| name.strip_suffix(b".tmp"));
    let number = inner.and_then(|inner| inner.rsplit(|byte| *byte == b'.').next().filter(|n| n.len() < inner.len()));
    number.is_some_and(|number| !number.is_empty() && number.iter().all(u8::is_ascii_digit))
}

/// Creates the first free `runs/<agent>-<n>`. Also returns the folders that were created for it.
fn free_folder(agent: &str) -> Result<(PathBuf, Vec<PathBuf>), RunError> {
    let runs = Path::new(RUNS);
    let first = !runs.exists();
    fs::create_dir_all(runs).map_err(RunError::io(runs, "create folder"))?;
    let base = text::short_name(agent);
    let mut n = 1;
    loop {
        let path = runs.join(format!("{base}-{n}"));
        match fs::create_dir(&path) {
            Ok(()) => {
                let mut made = vec![path.clone()];
                made.extend(first.then(|| runs.to_path_buf()));
                return Ok((path, made));
            }
            Err(e) if e.kind() == ErrorKind::AlreadyExists => n += 1,
            Err(e) => return Err(RunError::io(&path, "create folder")(e)),
        }
    }
}

/// The folder of a run with a name similar to `path`, such as `runs/hopper-3`.
fn nearest_run(path: &Path) -> Option<String> {
    text::nearest_path(path, &[Path::new(RUNS)], |entry| entry.join(RUN).is_file())
}

/// The policy file at a path, or in the folder of a run.
///
/// # Errors
/// If there is none.
pub fn policy_path(given: &Path) -> Result<PathBuf, RunError> {
    let path = if given.is_dir() { given.join("policy.safetensors") } else { given.to_path_buf() };
    if path.exists() {
        return Ok(path);
    }
    let found = if given.is_dir() { "no policy.safetensors" } else { "no such file" };
    let fits = |entry: &Path| {
        let is_policy = entry.extension().is_some_and(|end| end == "safetensors" || end == "onnx");
        is_policy || entry.join("policy.safetensors").is_file()
    };
    let near = did_you_mean(text::nearest_path(given, &[Path::new(RUNS)], fits));
    let expected = format!("a policy file or the folder of a run{near}");
    Err(RunError::file(given, "policy", found, expected))
}

/// Path of the policy of a role other than the first, next to that of the first.
pub fn policy_of_role(first: &Path, role: &str) -> PathBuf {
    let part = |part: Option<&OsStr>| part.unwrap_or_default().to_string_lossy().into_owned();
    first.with_file_name(format!("{}-{role}.{}", part(first.file_stem()), part(first.extension())))
}

/// Writes a JSON document.
///
/// # Errors
/// If the file cannot be written.
pub fn write_json(path: &Path, document: &impl Serialize) -> Result<(), RunError> {
    let bad = |e: serde_json::Error| RunError::file(path, "JSON", e, "plain data");
    let mut json = serde_json::to_string_pretty(document).map_err(bad)?;
    json.push('\n');
    Ok(write_atomic(path, json.as_bytes())?)
}
