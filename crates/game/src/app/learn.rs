//! Learning beside the picture: the trainer of `marathon train` on threads of its own, its newest policy on stage.

use crate::app::args::Mode;
use crate::app::keys::{Deed, Do};
use crate::app::notes::Notes;
use crate::app::show::{Script, Show, Source, file_stem, free_name};
use crate::asset::PolicyAsset;
use crate::ground::Ground;
use bevy::prelude::*;
use marathon_learn::{Control, IterationStats, Policy, Snapshot, TrainConfig, train};
use marathon_physics::lanes::Isa;
use marathon_runs::{Flags, LearnOptions, RunError, RunOptions, Session, Setting, Task};
use std::path::PathBuf;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};

/// Seconds between two lines of the log.
const TELL: f32 = 5.0;

/// How the trainer is made.
#[derive(Resource, Clone, Debug, Default)]
pub struct Teaching {
    /// What the command line says of it; without threads, it leaves one processor to the picture.
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

/// How it goes.
#[derive(Clone, Debug, Default)]
pub struct Progress {
    /// The curve so far.
    pub curve: Vec<Point>,
    /// In a word.
    pub state: String,
    /// It waits.
    pub paused: bool,
    /// Seconds of learning that may pass, and then it waits; `None`: any.
    limit: Option<f64>,
}

/// The picture's time goes its own way, as in films: a second of it is a second of learning.
#[derive(Resource)]
pub(crate) struct Filmed;

/// What both sides see.
#[derive(Default)]
struct Board {
    progress: Progress,
    newest: Option<Arc<Policy>>,
    /// The last policy that was saved, and its training time in seconds.
    settled: (Option<Arc<Policy>>, f64),
    /// The user has discarded the lesson.
    discarded: bool,
    stop: bool,
}

/// A run of the trainer. Dropped, it ends.
#[derive(Resource)]
pub struct Lesson {
    shared: Arc<(Mutex<Board>, Condvar)>,
    setting: Setting,
    ground: Ground,
    shown: Option<Arc<Policy>>,
    /// Seconds of the picture since it began.
    age: f64,
}

/// What the trainer for a task is told: the agent's own fast configuration, or that of a file, and the options.
///
/// # Errors
/// If the options make no sense, or the file is no configuration for the agent.
pub fn settings(setting: &Setting, teaching: &Teaching) -> Result<TrainConfig, RunError> {
    let cores = std::thread::available_parallelism().map_or(1, |n| n.get());
    let threads = teaching.learn.threads.unwrap_or(cores.saturating_sub(1).max(1));
    let learn = LearnOptions { seed: Some(teaching.seed), threads: Some(threads), ..teaching.learn.clone() };
    let options = RunOptions { learn, ..Default::default() };
    let (session, _) = Session::open(Some(Task::set(setting.clone())), &options, None, true)?;
    Ok(session.run.config)
}

impl Lesson {
    /// Begins to learn.
    ///
    /// # Errors
    /// If the configuration cannot be used.
    pub fn begin(setting: &Setting, ground: Ground, teaching: &Teaching) -> Result<Self, String> {
        let spelled = |error: RunError| error.spelled(&Flags("marathon"));
        let config = settings(setting, teaching).map_err(spelled)?;
        let make =
            || -> Result<_, RunError> { Ok(ground.agent_with(&setting.agent, &setting.options)?.shards(Isa::best())?) };
        let factory = setting.with_clips(make).map_err(spelled)?;
        let shared = Arc::new((Mutex::new(Board::default()), Condvar::new()));
        board(&shared).progress.state = "first steps".into();
        let ours = shared.clone();
        let (options, clips) = (factory.spec().options.clone(), setting.clips.clone());
        let learn = move || {
            let noted = |mut policy: Policy| {
                policy.set_task(options.clone(), clips.clone());
                Arc::new(policy)
            };
            let mut observer =
                |stats: &IterationStats, snapshot: &Snapshot<'_>| observe(&ours, stats, noted(snapshot.policy()));
            let result = train(&*factory, Isa::best(), &config, None, &mut observer);
            let mut board = board(&ours);
            board.progress.state = match result {
                Ok(output) => {
                    board.newest = Some(noted(output.policy));
                    "finished".into()
                }
                Err(error) => error.to_string(),
            };
        };
        let thread = std::thread::Builder::new().name("marathon-trainer".into()).spawn(learn);
        thread.map_err(|e| format!("the trainer's thread cannot be started: {e}"))?;
        Ok(Lesson { shared, setting: setting.clone(), ground, shown: None, age: 0.0 })
    }

    /// How it goes.
    pub fn progress(&self) -> Progress {
        board(&self.shared).progress.clone()
    }

    /// The newest policy.
    pub fn newest(&self) -> Option<Arc<Policy>> {
        board(&self.shared).newest.clone()
    }

    /// Seconds of training since the last save; `None` if there is nothing to save.
    pub fn unsaved(&self) -> Option<f64> {
        let board = board(&self.shared);
        let (settled, at) = &board.settled;
        let newest = board.newest.as_ref().filter(|_| !board.discarded)?;
        let same = settled.as_ref().is_some_and(|settled| Arc::ptr_eq(settled, newest));
        let now = board.progress.curve.last().map_or(0.0, |point| point.seconds);
        (!same).then_some(now - at)
    }

    /// Discards the lesson: its policies, and those still to come, are not saved when it ends.
    pub fn discard(&self) {
        board(&self.shared).discarded = true;
    }

    /// Saves the newest policy and shows a note.
    fn save(&self, why: &str, notes: &mut Notes) {
        let (newest, now) = {
            let board = board(&self.shared);
            (board.newest.clone(), board.progress.curve.last().map_or(0.0, |point| point.seconds))
        };
        let Some(policy) = newest else {
            notes.say(format!("{why}there is nothing to save yet"));
            return;
        };
        match save(&policy, &self.setting.agent) {
            Ok(path) => {
                board(&self.shared).settled = (Some(policy), now);
                notes.say(format!("{why}saved as {}", path.display()));
            }
            Err(error) => notes.error(format!("{why}{error}")),
        }
    }

    /// Saves an unsaved policy before the lesson ends, unless the user has discarded it.
    fn leave(&self, notes: &mut Notes) {
        if self.unsaved().is_some() {
            self.save("the policy that was learning is ", notes);
        }
    }

    /// Lets it wait at the end of an iteration, or go on.
    pub fn pause(&self, paused: bool) {
        board(&self.shared).progress.paused = paused;
        self.shared.1.notify_all();
    }
}

impl Drop for Lesson {
    fn drop(&mut self) {
        board(&self.shared).stop = true;
        // it ends after its iteration; nobody waits for it
        self.shared.1.notify_all();
    }
}

fn board(shared: &(Mutex<Board>, Condvar)) -> MutexGuard<'_, Board> {
    // whoever panicked has left whole numbers behind
    shared.0.lock().unwrap_or_else(PoisonError::into_inner)
}

fn observe(shared: &(Mutex<Board>, Condvar), stats: &IterationStats, policy: Arc<Policy>) -> Control {
    let mut board = board(shared);
    board.newest = Some(policy);
    board.progress.state = "from random weights".into();
    if let Some(total) = stats.learned.return_mean {
        board.progress.curve.push(Point { seconds: stats.wall_seconds, steps: stats.steps, total });
    }
    // what is spent here does not count as learning
    let early = |progress: &Progress| progress.limit.is_some_and(|limit| stats.wall_seconds > limit) || progress.paused;
    while early(&board.progress) && !board.stop {
        board = shared.1.wait(board).unwrap_or_else(PoisonError::into_inner);
    }
    if board.stop { Control::Stop } else { Control::Continue }
}

/// Begins and ends lessons as the show wants.
pub fn attend(
    mut commands: Commands,
    show: Res<Show>,
    script: Res<Script>,
    lesson: Option<Res<Lesson>>,
    mut teaching: ResMut<Teaching>,
    mut notes: ResMut<Notes>,
    mut failed: Local<bool>,
) {
    if show.is_changed() {
        *failed = false;
    }
    let wanted = show.mode == Mode::Learn && show.source == Source::Trainer;
    let right = lesson.as_ref().is_some_and(|lesson| {
        lesson.setting == script.setting && lesson.ground == show.ground && !board(&lesson.shared).discarded
    });
    if let Some(lesson) = lesson.filter(|_| !(wanted && right)) {
        lesson.leave(&mut notes);
        commands.remove_resource::<Lesson>();
    }
    if wanted && !right && !*failed {
        match Lesson::begin(&script.setting, show.ground, &teaching) {
            Ok(lesson) => {
                info!("learning {} from random weights, seed {}", show.agent, teaching.seed);
                commands.insert_resource(lesson);
            }
            Err(error) => {
                *failed = true;
                notes.error(error);
            }
        }
        teaching.seed += 1;
    }
}

/// Lets the trainer wait for the picture where that is drawn more slowly than its time passes.
pub fn pace(lesson: Option<ResMut<Lesson>>, filmed: Option<Res<Filmed>>, time: Res<Time<Real>>) {
    let (Some(mut lesson), Some(_)) = (lesson, filmed) else { return };
    lesson.age += time.delta_secs_f64();
    board(&lesson.shared).progress.limit = Some(lesson.age);
    lesson.shared.1.notify_all();
}

/// Puts the newest policy on stage.
pub fn perform(mut lesson: Option<ResMut<Lesson>>, script: Res<Script>, mut policies: ResMut<Assets<PolicyAsset>>) {
    let (Some(lesson), Some(handle)) = (&mut lesson, &script.policy) else { return };
    let Some(newest) = lesson.newest() else { return };
    if lesson.shown.as_ref().is_some_and(|p| Arc::ptr_eq(p, &newest)) && policies.contains(handle.id()) {
        return;
    }
    let _ = policies.insert(handle.id(), PolicyAsset(newest.clone()));
    lesson.shown = Some(newest);
}

/// Frame times since the last line of the log, s.
#[derive(Default)]
pub struct Frames(Vec<f32>);

/// Tells every few seconds how learning goes and whether the picture stutters.
pub fn tell(time: Res<Time<Real>>, lesson: Option<Res<Lesson>>, mut frames: Local<Frames>, mut last: Local<f32>) {
    let Some(lesson) = lesson else {
        frames.0.clear();
        *last = time.elapsed_secs();
        return;
    };
    frames.0.push(time.delta_secs());
    if time.elapsed_secs() - *last < TELL {
        return;
    }
    *last = time.elapsed_secs();
    frames.0.sort_unstable_by(f32::total_cmp);
    let share = |share: f32| 1e3 * frames.0[((frames.0.len() - 1) as f32 * share) as usize];
    let (median, most, slowest) = (share(0.5), share(0.95), share(1.0));
    let Point { seconds, steps, total } = lesson.progress().curve.last().copied().unwrap_or_default();
    info!(
        "learning: {seconds:.0} s, {steps} steps, return {total:.0}; frames of the last {TELL} s: median {median:.0} ms, \
         95 % within {most:.0} ms, slowest {slowest:.0} ms"
    );
    frames.0.clear();
}

/// Pause, save, begin anew.
pub fn obey(
    mut deeds: MessageReader<Do>,
    mut show: ResMut<Show>,
    lesson: Option<Res<Lesson>>,
    time: Res<Time<Virtual>>,
    mut commands: Commands,
    mut notes: ResMut<Notes>,
) {
    for Do(deed) in deeds.read() {
        match (deed, &lesson) {
            (Deed::Pause, Some(lesson)) => lesson.pause(time.is_paused()),
            (Deed::Save, Some(lesson)) => lesson.save("", &mut notes),
            (Deed::Restart, Some(lesson)) if show.mode == Mode::Learn => {
                lesson.leave(&mut notes);
                commands.remove_resource::<Lesson>();
                notes.say("from random weights again");
                show.again();
            }
            (Deed::Learn, _) => {
                let learning = show.mode == Mode::Learn;
                show.mode = if learning { Mode::Watch } else { Mode::Learn };
                show.play(if learning { Source::Shipped } else { Source::Trainer });
                show.again();
            }
            _ => {}
        }
    }
}

/// Saves the trained policy when the game ends, unless the user has discarded it.
pub fn keep_at_exit(exit: MessageReader<AppExit>, lesson: Option<Res<Lesson>>, mut notes: ResMut<Notes>) {
    if let Some(lesson) = lesson.filter(|_| !exit.is_empty()) {
        lesson.leave(&mut notes);
    }
}

/// Saves a policy under the first free name of the agent, such as `hopper-live-1.safetensors`.
fn save(policy: &Policy, agent: &str) -> Result<PathBuf, String> {
    let path = free_name(&format!("{}-live", file_stem(agent)), "safetensors");
    policy.save(&path).map_err(|e| e.to_string())?;
    Ok(path)
}
