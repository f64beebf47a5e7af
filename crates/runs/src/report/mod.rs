//! The output of a run: rows, events, checkpoints, the curve, the summary.

mod canvas;
pub mod chart;
pub mod csv;
pub mod curve;
pub mod progress;
pub mod summary;
pub mod tensorboard;

use crate::error::RunError;
use crate::folder::{POLICIES, RunFolder};
use crate::run_file::RunFile;
use csv::CsvLog;
use marathon_learn::{Checkpoint, Control, IterationStats, Observer, Policy, Snapshot, TrainOutput};
pub(crate) use progress::Progress;
use std::path::{Path, PathBuf};
use tensorboard::EventLog;

/// Callback after every iteration that decides whether to continue.
pub type Watch<'a> = dyn FnMut(&IterationStats) -> Control + 'a;

/// Follows a run: shows progress, and writes rows, events and checkpoints. Ends the run on request, or when a file
/// cannot be written.
pub struct Reporter<'a> {
    folder: &'a RunFolder,
    run: &'a RunFile,
    terms: Vec<String>,
    progress: Option<Progress>,
    watch: &'a mut Watch<'a>,
    csv: CsvLog,
    events: EventLog,
    /// Steps at which the next checkpoint is due.
    due: u64,
    /// Steps and wall-clock seconds of the last iteration.
    last: (u64, f64),
    /// The error that ended the run, if any.
    pub error: Option<RunError>,
    /// Whether all iterations have their rows and events, and `policies/` has every policy that was due.
    pub told: bool,
}

impl<'a> Reporter<'a> {
    /// Prepares a new or resumed run. `terms`: names of its reward terms. Rows and events of later iterations are removed.
    /// `show`: show progress on stderr. `watch` may end the run.
    ///
    /// # Errors
    /// If a file cannot be read or written.
    pub fn new(
        folder: &'a RunFolder,
        run: &'a RunFile,
        terms: &[String],
        resume: Option<&Checkpoint>,
        (show, watch): (bool, &'a mut Watch<'a>),
    ) -> Result<Self, RunError> {
        let (iteration, steps) = resume.map_or((0, 0), |c| (c.iteration(), c.steps()));
        let csv = CsvLog::open(&folder.progress(), iteration)?;
        let events = EventLog::open(folder, steps)?;
        let wall = csv.before("wall_seconds").unwrap_or(0.0);
        let mut reporter = Self {
            folder,
            run,
            terms: terms.to_vec(),
            progress: show.then(|| Progress::new(run.config.run.total_steps, steps, run.summary_freq)),
            watch,
            csv,
            events,
            due: 0,
            last: (steps, wall),
            error: None,
            told: true,
        };
        reporter.plan(steps);
        reporter.prune(steps);
        Ok(reporter)
    }

    /// Removes the progress bar.
    pub fn finish(&self) {
        if let Some(progress) = &self.progress {
            progress.finish();
        }
    }

    fn plan(&mut self, steps: u64) {
        self.due = (steps / self.run.checkpoint_interval + 1).saturating_mul(self.run.checkpoint_interval);
    }

    fn report(&mut self, stats: &IterationStats, snapshot: &Snapshot<'_>) -> Result<(), RunError> {
        let (steps, wall) = self.last;
        let rate = (stats.steps - steps) as f64 / (stats.wall_seconds - wall).max(1e-9);
        self.last = (stats.steps, stats.wall_seconds);
        self.told = false;
        self.csv.push(&csv::columns(stats, rate, &self.terms))?;
        self.events.push(stats.steps, &tensorboard::scalars(stats, rate, &self.terms))?;
        if stats.steps < self.due {
            self.told = true;
        } else {
            let output = snapshot.output();
            // if the run is interrupted before this completes, the resumed run repeats it
            self.keep(&output.policy)?;
            self.told = true;
            self.plan(stats.steps);
            save(self.folder, &output)?;
            self.prune(stats.steps);
        }
        Ok(())
    }

    /// Keeps the first role's policy in `policies/`.
    fn keep(&self, policy: &Policy) -> Result<(), RunError> {
        if self.run.keep_checkpoints == 0 {
            return Ok(());
        }
        let folder = self.folder.policies();
        std::fs::create_dir_all(&folder).map_err(RunError::io(&folder, "create folder"))?;
        let steps = policy.meta().training.as_ref().map_or(0, |t| t.steps);
        policy.save(&kept_policy(self.folder.path(), steps))?;
        Ok(())
    }

    /// Removes policies of later steps, which the run will write again, and the oldest ones.
    fn prune(&self, steps: u64) {
        let (kept, later): (Vec<_>, Vec<_>) =
            kept_policies(self.folder.path()).into_iter().partition(|(n, _)| *n <= steps);
        let old = kept.into_iter().rev().skip(self.run.keep_checkpoints);
        for (_, path) in old.chain(later) {
            // an extra policy does no harm
            let _ = std::fs::remove_file(path);
        }
    }
}

impl Observer for Reporter<'_> {
    fn iteration(&mut self, stats: &IterationStats, snapshot: &Snapshot<'_>) -> Control {
        if let Some(progress) = &mut self.progress {
            progress.update(stats);
        }
        if let Err(error) = self.report(stats, snapshot) {
            self.error = Some(error);
            return Control::Stop;
        }
        (self.watch)(stats)
    }
}

/// The policy that a run keeps after a number of steps.
pub fn kept_policy(run: &Path, steps: u64) -> PathBuf {
    run.join(POLICIES).join(format!("policy-{steps}.safetensors"))
}

/// The policies in `policies/` of a run's folder with their steps, in the order of the steps.
pub fn kept_policies(run: &Path) -> Vec<(u64, PathBuf)> {
    let entries = std::fs::read_dir(run.join(POLICIES)).into_iter().flatten().flatten();
    let of = |path: PathBuf| {
        let steps = path.file_stem()?.to_str()?.strip_prefix("policy-")?.parse().ok()?;
        Some((steps, path))
    };
    let mut kept: Vec<_> = entries.filter_map(|entry| of(entry.path())).collect();
    kept.sort();
    kept
}

/// Writes the checkpoint, then the policies.
///
/// # Errors
/// If a file cannot be written. The old one then stays intact.
pub fn save(folder: &RunFolder, output: &TrainOutput) -> Result<(), RunError> {
    output.checkpoint.save(&folder.checkpoint())?;
    save_policies(folder, &output.policy, &output.others)
}

/// Writes the policies of all roles.
///
/// # Errors
/// If a file cannot be written. The old one then stays intact.
pub fn save_policies(folder: &RunFolder, policy: &Policy, others: &[(String, Policy)]) -> Result<(), RunError> {
    policy.save(&folder.policy())?;
    for (role, policy) in others {
        policy.save(&folder.policy_of(role))?;
    }
    Ok(())
}
