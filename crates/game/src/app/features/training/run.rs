//! A run of the trainer of `marathon train`, on a thread beside the picture.

use crate::app::files::{file_stem, free_name};
use crate::app::notifications::Notifications;
use bevy::prelude::*;
use bevy_marathon::Ground;
use marathon_learn::{Control, IterationStats, Policy, Snapshot, TrainConfig, train};
use marathon_physics::lanes::Isa;
use marathon_runs::{Flags, LearnOptions, RunError, RunOptions, Session, Task, TaskConfig};
use std::path::PathBuf;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};

/// Options of the trainer.
#[derive(Resource, Clone, Debug, Default)]
pub struct TrainingOptions {
    /// Options of the command line. By default, the trainer leaves one processor to the picture.
    pub learn: LearnOptions,
    /// Seed of the next run.
    pub seed: u64,
}

/// A point of the learning curve.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Point {
    /// Seconds of learning.
    pub seconds: f64,
    /// Agent-steps.
    pub steps: u64,
    /// Mean return of the episodes that have ended.
    pub total: f64,
}

/// The progress of a run.
#[derive(Clone, Debug, Default)]
pub struct Progress {
    /// The curve so far.
    pub curve: Vec<Point>,
    /// The state in a word.
    pub state: String,
    /// Whether it waits.
    pub paused: bool,
    /// Seconds of training after which it waits; `None` for no limit.
    limit: Option<f64>,
}

/// The state that trainer and app share.
#[derive(Default)]
struct Shared {
    progress: Progress,
    newest: Option<Arc<Policy>>,
    /// The last policy that was saved, and its training time in seconds.
    settled: (Option<Arc<Policy>>, f64),
    /// The user has discarded the run.
    discarded: bool,
    stop: bool,
}

/// A run of the trainer. It ends when it is dropped.
#[derive(Resource)]
pub struct TrainingRun {
    shared: Arc<(Mutex<Shared>, Condvar)>,
    task_config: TaskConfig,
    ground: Ground,
    shown: Option<Arc<Policy>>,
    /// Seconds of the picture since the start.
    age: f64,
}

/// The configuration of the trainer: the fast one of the agent, or that of a file, and the options.
///
/// # Errors
/// If the options make no sense, or the file is no configuration for the agent.
pub fn settings(task_config: &TaskConfig, options: &TrainingOptions) -> Result<TrainConfig, RunError> {
    let cores = marathon_physics::threads(0);
    let threads = options.learn.threads.unwrap_or(cores.saturating_sub(1).max(1));
    let learn = LearnOptions { seed: Some(options.seed), threads: Some(threads), ..options.learn.clone() };
    let run = RunOptions { learn, ..Default::default() };
    let (session, _) = Session::open(Some(Task::set(task_config.clone())), &run, None, true)?;
    Ok(session.run.config)
}

impl TrainingRun {
    /// Starts a run.
    ///
    /// # Errors
    /// If the configuration cannot be used.
    pub fn start(task_config: &TaskConfig, ground: Ground, options: &TrainingOptions) -> Result<Self, String> {
        let spelled = |error: RunError| error.spelled(&Flags("marathon"));
        let config = settings(task_config, options).map_err(spelled)?;
        let agent =
            ground.agent_with(&task_config.agent, &task_config.options).map_err(|error| spelled(error.into()))?;
        let factory = agent.shards(Isa::best()).map_err(|error| spelled(error.into()))?;
        let shared = Arc::new((Mutex::new(Shared::default()), Condvar::new()));
        lock(&shared).progress.state = "first steps".into();
        let ours = shared.clone();
        let learn = move || {
            let mut observer =
                |stats: &IterationStats, snapshot: &Snapshot<'_>| observe(&ours, stats, Arc::new(snapshot.policy()));
            let result = train(&*factory, Isa::best(), &config, None, &mut observer);
            let mut state = lock(&ours);
            state.progress.state = match result {
                Ok(output) => {
                    state.newest = Some(Arc::new(output.policy));
                    "finished".into()
                }
                Err(error) => error.to_string(),
            };
        };
        let thread = std::thread::Builder::new().name("marathon-trainer".into()).spawn(learn);
        thread.map_err(|e| format!("the trainer's thread cannot be started: {e}"))?;
        Ok(TrainingRun { shared, task_config: task_config.clone(), ground, shown: None, age: 0.0 })
    }

    /// The progress.
    pub fn progress(&self) -> Progress {
        lock(&self.shared).progress.clone()
    }

    /// The newest policy.
    pub fn newest(&self) -> Option<Arc<Policy>> {
        lock(&self.shared).newest.clone()
    }

    /// Seconds of training since the last save; `None` if there is nothing to save.
    pub fn unsaved(&self) -> Option<f64> {
        let state = lock(&self.shared);
        let (settled, at) = &state.settled;
        let newest = state.newest.as_ref().filter(|_| !state.discarded)?;
        let same = settled.as_ref().is_some_and(|settled| Arc::ptr_eq(settled, newest));
        let now = state.progress.curve.last().map_or(0.0, |point| point.seconds);
        (!same).then_some(now - at)
    }

    /// Whether the user has discarded the run.
    pub fn is_discarded(&self) -> bool {
        lock(&self.shared).discarded
    }

    /// Whether the run is for this task and ground.
    pub fn is_for(&self, task_config: &TaskConfig, ground: Ground) -> bool {
        self.task_config == *task_config && self.ground == ground
    }

    /// The newest policy, if it has changed since the last call or `again` is set.
    pub fn take_newest(&mut self, again: bool) -> Option<Arc<Policy>> {
        let newest = self.newest()?;
        if !again && self.shown.as_ref().is_some_and(|shown| Arc::ptr_eq(shown, &newest)) {
            return None;
        }
        self.shown = Some(newest.clone());
        Some(newest)
    }

    /// Allows as much training as seconds of the picture have passed.
    pub fn keep_pace(&mut self, seconds: f64) {
        self.age += seconds;
        lock(&self.shared).progress.limit = Some(self.age);
        self.shared.1.notify_all();
    }

    /// Discards the run: its policies, and those still to come, are not saved when it ends.
    pub fn discard(&self) {
        lock(&self.shared).discarded = true;
    }

    /// Saves the newest policy and shows a note.
    pub fn save(&self, why: &str, notes: &mut Notifications) {
        let (newest, now) = {
            let state = lock(&self.shared);
            (state.newest.clone(), state.progress.curve.last().map_or(0.0, |point| point.seconds))
        };
        let Some(policy) = newest else {
            notes.say(format!("{why}there is nothing to save yet"));
            return;
        };
        match save(&policy, &self.task_config.agent) {
            Ok(path) => {
                lock(&self.shared).settled = (Some(policy), now);
                notes.say(format!("{why}saved as {}", path.display()));
            }
            Err(error) => {
                // the end of the run tries again
                lock(&self.shared).discarded = false;
                notes.error(format!("{why}{error}"));
            }
        }
    }

    /// Saves an unsaved policy before the run ends, unless the user has discarded it.
    pub fn finish(&self, notes: &mut Notifications) {
        if self.unsaved().is_some() {
            self.save("the policy that was learning is ", notes);
        }
    }

    /// Pauses the run at the end of an iteration, or continues it.
    pub fn pause(&self, paused: bool) {
        lock(&self.shared).progress.paused = paused;
        self.shared.1.notify_all();
    }
}

impl Drop for TrainingRun {
    fn drop(&mut self) {
        lock(&self.shared).stop = true;
        // the thread ends after its iteration
        self.shared.1.notify_all();
    }
}

fn lock(shared: &(Mutex<Shared>, Condvar)) -> MutexGuard<'_, Shared> {
    // a thread that panicked has left valid numbers
    shared.0.lock().unwrap_or_else(PoisonError::into_inner)
}

fn observe(shared: &(Mutex<Shared>, Condvar), stats: &IterationStats, policy: Arc<Policy>) -> Control {
    let mut state = lock(shared);
    state.newest = Some(policy);
    state.progress.state = "from random weights".into();
    if let Some(total) = stats.learned.return_mean {
        state.progress.curve.push(Point { seconds: stats.wall_seconds, steps: stats.steps, total });
    }
    // time spent here does not count as training
    let early = |progress: &Progress| progress.limit.is_some_and(|limit| stats.wall_seconds > limit) || progress.paused;
    while early(&state.progress) && !state.stop {
        state = shared.1.wait(state).unwrap_or_else(PoisonError::into_inner);
    }
    if state.stop { Control::Stop } else { Control::Continue }
}

/// Saves a policy under the first free name of the agent, such as `hopper-live-1.safetensors`.
fn save(policy: &Policy, agent: &str) -> Result<PathBuf, String> {
    let path = free_name(&format!("{}-live", file_stem(agent)), "safetensors");
    policy.save(&path).map_err(|e| e.to_string())?;
    Ok(path)
}
