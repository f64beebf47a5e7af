//! The runs of a course: each is recorded from its start, ends by its task or by the referee, and enters the table.

use crate::app::error::GameError;
use crate::app::features::course::leaderboard::{Course, Place, Run, Table, default_path};
use crate::app::mode::{AppSet, Mode};
use crate::app::notifications::Notifications;
use crate::app::stage::actors::Actor;
use crate::app::stage::course::{BUILT, PlayerRole};
use crate::app::stage::loaded::LoadedPolicy;
use crate::app::stage::recording::Recording;
use crate::app::stage::scenario::{LoadScenario, Scenario};
use bevy::prelude::*;
use bevy_marathon::{
    Anatomy, End, Episode, EpisodeEnded, Ground, Marathon, MarathonSystems, RagdollState, RestartNow, TRACK_HALF_WIDTH,
    Track,
};
use marathon_envs::agents::marathon::terrain::course::TO;
use marathon_envs::options::Value;
use std::collections::VecDeque;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Shorter runs are not kept, m.
pub const LEAST: f64 = 1.0;
/// The end of a run at the finish.
const THROUGH: &str = "through";
/// Limits of the referee, as in the tasks on courses: time without a new meter, s, and distance from the edge, m.
const PATIENCE: f64 = 5.0;
const EDGE: f64 = 0.2;
/// Distances of the checkpoints, m. The last one is the finish.
pub const GATES: [f64; 4] = [0.25 * FINISH, 0.5 * FINISH, 0.75 * FINISH, FINISH];
/// Distance of the finish, m: the tasks on courses end there.
const FINISH: f64 = TO - 2.0;
/// Longest recording, frames.
const LONGEST: usize = 60_000;

/// The runs of the present characters, and the place of the last one in the table.
#[derive(Resource)]
pub struct Runs {
    table: Option<PathBuf>,
    player: String,
    under_way: Vec<UnderWay>,
    /// The present record of the course.
    pub standing: Option<Place>,
    /// The last run that has ended, and its place.
    pub last: Option<(Run, Place)>,
}

/// A run that goes on.
struct UnderWay {
    ragdoll: Entity,
    recording: Recording,
    /// Time of the newest frame.
    until: Duration,
    /// The slowest time factor.
    slowest: f64,
    /// Its distance at the first decision, as its task reports it, m.
    start: Option<f64>,
    /// Its times at the gates that it has passed, s.
    gates: Vec<f64>,
    /// Full meters made, and when the last one was, s.
    meters: f64,
    since: f64,
    /// The referee's reason to end it.
    verdict: Option<&'static str>,
    /// Whether it has ended, and the character lies.
    over: bool,
}

pub(super) fn plugin(app: &mut App) {
    app.add_systems(
        Update,
        enter.run_if(on_message::<LoadScenario>).run_if(in_state(Mode::Course)).in_set(AppSet::Present),
    )
    .add_systems(
        FixedUpdate,
        // ends of episodes are read in every mode, so that none waits for the next course
        (follow, referee.run_if(in_state(Mode::Course))).chain().after(MarathonSystems::Report),
    );
}

/// Looks up the longest run of the course.
fn enter(scenario: Res<Scenario>, mut runs: ResMut<Runs>) {
    runs.enter(&scenario);
}

impl Runs {
    /// No runs yet. Without a path, the table is in the user's folder for data; without a name, the player has that of the user.
    pub fn new(table: Option<PathBuf>, player: Option<String>) -> Self {
        let player = player.or_else(|| std::env::var("USER").ok()).filter(|name| !name.trim().is_empty());
        let player = player.unwrap_or_else(|| "player".into());
        Runs { table, player, under_way: Vec::new(), standing: None, last: None }
    }

    /// The table's file.
    ///
    /// # Errors
    /// If the command line does not name it, and the system has no folder for the user's data.
    pub fn path(&self) -> Result<PathBuf, GameError> {
        self.table.clone().map_or_else(default_path, Ok)
    }

    /// The name of the player in the table.
    pub fn player(&self) -> &str {
        &self.player
    }

    /// Looks up the present record of the course.
    fn enter(&mut self, scenario: &Scenario) {
        (self.last, self.standing) = (None, None);
        // an error of the table is shown when a run ends
        let table = self.path().and_then(|path| if path.exists() { Table::open(&path).map(Some) } else { Ok(None) });
        if let Ok(Some(table)) = table {
            self.standing = table.place(&course(scenario), f64::INFINITY).ok().flatten();
        }
    }

    /// Distance of a character at the first decision of its run, m.
    pub(super) fn start(&self, ragdoll: Entity) -> Option<f64> {
        self.under_way.iter().find(|run| run.ragdoll == ragdoll)?.start
    }

    /// Times of a character at the gates that it has passed in its run, s.
    pub fn gates(&self, ragdoll: Entity) -> &[f64] {
        self.under_way.iter().find(|run| run.ragdoll == ragdoll).map_or(&[], |run| &run.gates)
    }

    /// Adds a run that has ended.
    fn finish(&mut self, run: Run, recording: &Recording, notes: &mut Notifications) {
        let added = self.path().and_then(|path| Table::open(&path)?.add(&run, recording));
        let result = format!("{:.1} m in {:.1} s ({})", run.distance, run.seconds, run.ended);
        match added {
            Ok(place) => {
                // the card tells it on the screen
                info!("{result}: place {} of {}", place.rank, place.of);
                if run.ended == THROUGH {
                    let best = place.fastest.is_some_and(|fastest| run.seconds <= fastest);
                    let best = if best { ", the best time" } else { "" };
                    notes.say(format!("finish after {:.2} s{best}", run.seconds));
                }
                self.standing = Some(place);
                self.last = Some((run, place));
            }
            Err(error) => notes.error(format!("{result} is not kept: {error}")),
        }
    }
}

/// The course of a scenario.
pub fn course(scenario: &Scenario) -> Course {
    let choice = &scenario.course;
    Course {
        agent: scenario.agent.clone(),
        kind: choice.kind().into(),
        difficulty: choice.difficulty,
        role: choice.role.name().into(),
    }
}

/// The names of runner and builder in the table.
pub fn names(scenario: &Scenario, loaded: &LoadedPolicy, player: &str) -> [String; 2] {
    let [runner, builder] = loaded.names.clone();
    let runner = runner.unwrap_or_else(|| "nobody".into());
    let built = scenario.course.kind() == BUILT;
    match scenario.course.role {
        PlayerRole::Watch if built => [runner, builder.unwrap_or_else(|| "nobody".into())],
        PlayerRole::Watch => [runner, "seed".into()],
        PlayerRole::Run => [format!("{player}, leading {runner}"), "seed".into()],
        PlayerRole::Build => [runner, player.into()],
    }
}

/// Records the runs, and adds those that have ended to the table.
fn follow(
    (mode, scenario, loaded): (Res<State<Mode>>, Res<Scenario>, Res<LoadedPolicy>),
    time: Res<Time<Virtual>>,
    marathon: Res<Marathon>,
    mut runs: ResMut<Runs>,
    mut notes: ResMut<Notifications>,
    mut ended: MessageReader<EpisodeEnded>,
    actors: Query<(Entity, &Actor, &RagdollState, &Anatomy, &Track, &Episode)>,
) {
    if *mode != Mode::Course {
        ended.clear();
        return;
    }
    let ended: Vec<EpisodeEnded> = ended.read().cloned().collect();
    runs.under_way.retain(|run| actors.contains(run.ragdoll));
    for (entity, actor, state, anatomy, track, episode) in &actors {
        let Some(history) = marathon.history(state) else { continue };
        let (mut finished, pace) = (None, f64::from(time.relative_speed()));
        let at = runs.under_way.iter().position(|run| run.ragdoll == entity);
        let mut run = at.map(|at| runs.under_way.swap_remove(at));
        let until = run.as_ref().map(|run| run.until);
        for sample in history.iter().filter(|sample| until.is_none_or(|until| sample.time > until)) {
            if sample.fresh {
                let place = track.place().translation.to_array().to_vec();
                let recording = Recording::new(loaded.task_config.clone(), loaded.ground, anatomy.dt, place);
                let begun = UnderWay {
                    ragdoll: entity,
                    recording,
                    until: sample.time,
                    slowest: pace,
                    start: None,
                    gates: Vec::new(),
                    meters: 0.0,
                    since: 0.0,
                    verdict: None,
                    over: false,
                };
                finished = run.replace(begun).filter(|run| !run.over);
            }
            let Some(run) = run.as_mut().filter(|run| !run.over && run.recording.frames() < LONGEST) else { continue };
            (run.until, run.slowest) = (sample.time, run.slowest.min(pace));
            // an episode that begins has neither distance nor reward
            let so_far = if sample.fresh { &Episode::default() } else { episode };
            run.recording.push_state(sample, so_far, anatomy);
        }
        if let Some(run) = &mut run {
            let index = anatomy.spec.as_ref().and_then(|spec| spec.info.iter().position(|name| name == "distance"));
            let distance = index.and_then(|i| episode.info.get(i)).map(|x| f64::from(*x));
            run.start = run.start.or(distance);
            let fresh = history.back().is_some_and(|sample| sample.fresh);
            while !run.over && !fresh && GATES.get(run.gates.len()).is_some_and(|gate| episode.farthest >= *gate) {
                run.gates.push(episode.seconds);
            }
        }
        for EpisodeEnded { end, episode, .. } in
            ended.iter().filter(|ended| ended.ragdoll == entity && ended.end != End::Broke)
        {
            // a fallen character lies, so that its last frame is there; otherwise the next run has begun
            let Some(gone) = finished.take().or_else(|| run.take_if(|_| true)) else { continue };
            if episode.farthest >= LEAST {
                let [runner, builder] = names(&scenario, &loaded, &runs.player);
                let row = Run {
                    course: course(&scenario),
                    options: arguments(&loaded),
                    draw: [scenario.seed, actor.0 as u64, episode.number],
                    runner,
                    builder,
                    distance: episode.farthest,
                    seconds: episode.seconds,
                    slowest: gone.slowest,
                    ended: gone.verdict.unwrap_or_else(|| verdict(*end, episode, anatomy)).into(),
                    date: String::new(),
                    version: String::new(),
                    replay: None,
                };
                runs.finish(row, &gone.recording, &mut notes);
            }
            run = run.or(Some(UnderWay { over: true, ..gone })).filter(|run| !run.over || *end == End::Fell);
        }
        runs.under_way.extend(run);
    }
}

/// Arguments of the task, as on a command line.
fn arguments(loaded: &LoadedPolicy) -> String {
    let all = loaded.task_config.options.iter().map(|(name, value)| match value {
        Value::Text(text) => format!("{name}={text}"),
        Value::Clips(clips) => format!("{name}={clips}"),
        other => format!("{name}={other}"),
    });
    all.collect::<Vec<_>>().join(" ")
}

/// The reason of the end of a run, in words.
fn verdict(end: End, episode: &Episode, anatomy: &Anatomy) -> &'static str {
    let most = anatomy.spec.as_ref().map_or(usize::MAX, |spec| spec.max_episode_steps);
    match end {
        End::Fell => "fell",
        End::Asked => "given up",
        End::Broke => "broke",
        End::TimeUp if episode.decisions as usize >= most => "time up",
        End::TimeUp if episode.farthest > FINISH => THROUGH,
        End::TimeUp => "stuck",
    }
}

/// Ends the runs of agents whose tasks have no courses.
fn referee(
    loaded: Res<LoadedPolicy>,
    marathon: Res<Marathon>,
    mut runs: ResMut<Runs>,
    actors: Query<(Entity, &RagdollState, &Episode)>,
    mut restarts: MessageWriter<RestartNow>,
) {
    if loaded.ground != Ground::Track {
        return;
    }
    for run in runs.under_way.iter_mut().filter(|run| run.verdict.is_none() && !run.over) {
        let Ok((ragdoll, state, episode)) = actors.get(run.ragdoll) else { continue };
        let Some(newest) = marathon.history(state).and_then(VecDeque::back) else { continue };
        if episode.farthest >= run.meters + 1.0 {
            (run.meters, run.since) = (episode.farthest.floor(), episode.seconds);
        }
        let aside = newest.qpos.get(1).filter(|_| newest.qpos.len() > newest.qvel.len()).map_or(0.0, |y| y.abs());
        run.verdict = match () {
            () if episode.farthest > FINISH => Some(THROUGH),
            () if aside > TRACK_HALF_WIDTH - EDGE => Some("off the edge"),
            // a player may look around before the first meter
            () if run.meters > 0.0 && episode.seconds - run.since > PATIENCE => Some("stuck"),
            () => continue,
        };
        restarts.write(RestartNow { ragdoll });
    }
}

/// Refuses a table that cannot be used; one that is not there yet is made when the first run ends.
///
/// # Errors
/// See [`Table::open`].
pub fn check(table: Option<&Path>) -> Result<(), GameError> {
    match table {
        Some(path) if path.exists() => Table::open(path).map(drop),
        Some(_) => Ok(()),
        None => check(Some(&default_path()?)),
    }
}
