//! Recordings of runs are made, shown again, scrubbed and filmed.

use crate::app::args::Mode;
use crate::app::error::GameError;
use crate::app::hud::{Hud, card};
use crate::app::keys::{Deed, Do};
use crate::app::notes::Notes;
use crate::app::puppets::{self, Kind};
use crate::app::recording::{Recording, Row};
use crate::app::show::{Actor, Script, Show, file_stem, free_name};
use crate::herd::Still;
use crate::look::FollowCamera;
use crate::ragdoll::{Anatomy, Episode, OwnGround, Part};
use crate::simulate::{Marathon, Seat};
use crate::stage;
use bevy::prelude::*;
use bevy_egui::EguiContexts;
use bevy_egui::egui::{Align2, Area, Id, Slider};
use marathon_physics::budget;
use marathon_runs::Setting;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

/// Seconds that the keys go back and ahead.
const LEAP: f64 = 0.5;
/// Longest recording, frames.
const LONGEST: usize = 60_000;
/// Share of the largest replay for states and actions. The rest is for grounds.
const FILLED: f64 = 0.75;

/// A recording that is being made.
#[derive(Resource)]
pub struct Recorder {
    recording: Recording,
    /// Time of the newest frame.
    until: Duration,
    /// The recorded stage, by the version of its show.
    stage: u64,
}

impl Recorder {
    /// Length so far, s.
    pub fn seconds(&self) -> f64 {
        self.recording.seconds()
    }

    /// Whether the replay has reached its maximum length.
    fn is_full(&self) -> bool {
        let most = budget::REPLAY_FILE.most().unwrap_or(0) as f64;
        self.recording.frames() >= LONGEST || self.recording.bytes() as f64 > FILLED * most
    }
}

/// A recording that is being shown.
#[derive(Resource)]
pub struct Playback {
    recording: Arc<Recording>,
    kind: Kind,
    /// Time of the picture, s.
    pub at: f64,
    staged: bool,
}

impl Playback {
    /// What is shown.
    pub fn recording(&self) -> &Recording {
        &self.recording
    }

    /// Shows a recording from its start.
    ///
    /// # Errors
    /// If its agent is not known here.
    pub fn new(recording: Recording) -> Result<Self, GameError> {
        let Setting { agent, options, .. } = &recording.setting;
        let make = || -> Result<_, GameError> { Ok(recording.ground.agent_with(agent, options)?.model()?) };
        let model = Arc::new(recording.setting.with_clips(make)?);
        let spec = Arc::new(recording.setting.factory()?.spec().clone());
        let kind = Kind::new(model, Some(spec), recording.dt);
        Ok(Playback { recording: Arc::new(recording), kind, at: 0.0, staged: false })
    }
}

/// Begins and ends recordings. One that is asked for before the characters are on stage begins with them.
pub fn obey(
    mut commands: Commands,
    mut deeds: MessageReader<Do>,
    (show, script): (Res<Show>, Res<Script>),
    recorder: Option<Res<Recorder>>,
    mut notes: ResMut<Notes>,
    mut wanted: Local<bool>,
    actors: Query<(&Actor, &Anatomy, &Transform), With<Seat>>,
) {
    let nothing = matches!(show.mode, Mode::Testbed | Mode::Replay | Mode::Outside);
    *wanted &= !nothing;
    for _ in deeds.read().filter(|d| d.0 == Deed::Record) {
        if let Some(recorder) = &recorder {
            commands.remove_resource::<Recorder>();
            finish(recorder, "", &mut notes);
        } else if nothing {
            notes.say("only agents can be recorded");
        } else {
            *wanted = !*wanted;
        }
    }
    if !*wanted {
        return;
    }
    let mut all: Vec<_> = actors.iter().collect();
    all.sort_by_key(|(actor, ..)| actor.0);
    let Some((_, anatomy, _)) = all.first() else { return };
    *wanted = false;
    let places = all.iter().flat_map(|(.., t)| t.translation.to_array()).collect();
    let recording = Recording::new(script.setting.clone(), script.ground, anatomy.dt, places);
    commands.insert_resource(Recorder { recording, until: Duration::ZERO, stage: script.version });
    notes.say("recording; the same key ends it");
}

/// Ends a recording when the characters change or the replay reaches its maximum length.
pub fn close(mut commands: Commands, show: Res<Show>, recorder: Option<Res<Recorder>>, mut notes: ResMut<Notes>) {
    let Some(recorder) = recorder else { return };
    let why = match () {
        () if recorder.stage != show.version => "other characters come on stage: ",
        () if recorder.is_full() => "the recording is as long as one may be: ",
        () => return,
    };
    commands.remove_resource::<Recorder>();
    finish(&recorder, why, &mut notes);
}

/// Saves an unfinished recording when the game ends.
pub fn keep_at_exit(world: &mut World) {
    if world.resource::<Messages<AppExit>>().is_empty() {
        return;
    }
    save_running(world);
}

/// Ends the current recording, if there is one, and saves it.
pub fn save_running(world: &mut World) {
    if let Some(recorder) = world.remove_resource::<Recorder>() {
        world.resource_scope(|_, mut notes: Mut<Notes>| finish(&recorder, "", &mut notes));
    }
}

/// Saves a recording and shows a note.
fn finish(recorder: &Recorder, why: &str, notes: &mut Notes) {
    if recorder.recording.frames() == 0 {
        notes.say(format!("{why}nothing was recorded"));
        return;
    }
    match keep(&recorder.recording) {
        Ok(path) => {
            let (path, film) = (path.display().to_string(), path.with_extension("mp4").display().to_string());
            notes.say(format!("{why}saved as {path}; a film of it: marathon-game --replay {path} --record {film}"));
        }
        Err(error) => notes.error(format!("{why}the recording cannot be saved: {error}")),
    }
}

/// Saves under the first free name.
fn keep(recording: &Recording) -> Result<PathBuf, GameError> {
    let path = free_name(&file_stem(&recording.setting.agent), "replay");
    recording.save(&path)?;
    Ok(path)
}

/// Takes in the decisions since the last tick.
pub fn record(
    recorder: Option<ResMut<Recorder>>,
    marathon: Res<Marathon>,
    actors: Query<(&Actor, &Seat, &Episode, &Anatomy)>,
) {
    let Some(mut recorder) = recorder else { return };
    let mut all: Vec<_> = actors.iter().collect();
    all.sort_by_key(|(actor, ..)| actor.0);
    let Recorder { recording, until, .. } = &mut *recorder;
    if all.len() != recording.agents {
        return;
    }
    let trails: Vec<_> = all.iter().filter_map(|(_, seat, ..)| marathon.resident(**seat)).map(|r| &r.trail).collect();
    let Some(first) = trails.first() else { return };
    let times: Vec<Duration> = first.iter().map(|s| s.time).filter(|t| *t > *until).collect();
    for time in times {
        let stills: Option<Vec<_>> = trails.iter().map(|t| t.iter().rfind(|s| s.time == time)).collect();
        let Some(stills) = stills else { continue };
        *until = time;
        for (still, (.., episode, anatomy)) in stills.iter().zip(&all) {
            take(recording, still, episode, anatomy);
        }
    }
}

/// Appends a state of the next agent. All rows of a recording have the same width, but an episode has no terms of the reward
/// before its first decision.
pub fn take(recording: &mut Recording, still: &Still, episode: &Episode, anatomy: &Anatomy) {
    let mut earned = episode.terms.clone();
    earned.resize(anatomy.spec.as_ref().map_or(0, |spec| spec.reward_terms.len()), 0.0);
    let fresh = if still.fresh { 1.0 } else { 0.0 };
    recording.push(&Row {
        qpos: &still.qpos,
        numbers: [episode.distance as f32, episode.speed, episode.reward, episode.total as f32, fresh],
        terms: &earned,
        action: &still.action,
        command: &still.command,
        grounds: &still.grounds,
        untimed: episode.untimed,
    });
}

/// Puts the recorded characters on stage.
pub fn set_stage(mut commands: Commands, playback: Option<ResMut<Playback>>, mut cameras: Query<&mut FollowCamera>) {
    let Some(mut playback) = playback.filter(|p| !p.staged) else { return };
    playback.staged = true;
    let places = playback.recording.places.as_chunks::<3>().0.iter().map(|place| Vec3::from_array(*place));
    puppets::stage(&mut commands, &playback.kind, places, &mut cameras);
}

/// Moves the recorded characters.
pub fn play(
    playback: Option<ResMut<Playback>>,
    time: Res<Time<Virtual>>,
    mut puppets: Query<(&Actor, &Anatomy, &mut Episode, &mut OwnGround), Without<Seat>>,
    mut parts: Query<&mut Transform, With<Part>>,
) {
    let Some(mut playback) = playback else { return };
    let end = playback.recording.seconds();
    playback.at += time.delta_secs_f64();
    if playback.at > end {
        playback.at = 0.0;
    }
    let (recording, at) = (&playback.recording, playback.at);
    let (now, ..) = recording.between(at);
    for (actor, anatomy, mut episode, mut ground) in &mut puppets {
        let qpos = recording.pose(&anatomy.model, actor.0, at);
        puppets::pose(anatomy, &qpos, &mut parts);
        if let Some(lies) = recording.grounds(now, actor.0).filter(|lies| !Arc::ptr_eq(lies, &ground.0)) {
            ground.0 = lies.clone();
        }
        let numbers = recording.numbers(now, actor.0);
        episode.number = 1;
        episode.decisions = now as u64;
        episode.seconds = at;
        episode.distance = f64::from(numbers[0]);
        (episode.speed, episode.reward, episode.total) = (numbers[1], numbers[2], f64::from(numbers[3]));
        let fresh = numbers[4] > 0.5 || now == 0;
        let before = (!fresh).then(|| recording.qpos(now - 1, actor.0));
        let here = recording.qpos(now, actor.0);
        let own = before.and_then(|before| stage::own_velocity(&anatomy.model, before, here, recording.dt));
        episode.own_velocity = own.unwrap_or_default();
        episode.terms = recording.terms(now, actor.0).to_vec();
        episode.action = recording.action(now, actor.0).to_vec();
        episode.command = recording.command(now, actor.0).to_vec();
        episode.untimed = recording.untimed(now, actor.0);
    }
}

/// Goes back and ahead, no further than the ends.
pub fn scrub(mut deeds: MessageReader<Do>, playback: Option<ResMut<Playback>>) {
    let Some(mut playback) = playback else {
        deeds.clear();
        return;
    };
    for Do(deed) in deeds.read() {
        let leap = match deed {
            Deed::Back => -LEAP,
            Deed::Ahead => LEAP,
            _ => continue,
        };
        playback.at = (playback.at + leap).clamp(0.0, playback.recording.seconds());
    }
}

/// The time line.
pub fn time_line(mut contexts: EguiContexts, hud: Res<Hud>, playback: Option<ResMut<Playback>>) -> Result {
    let Some(mut playback) = playback.filter(|_| hud.on) else { return Ok(()) };
    let ctx = contexts.ctx_mut()?.clone();
    let width = (ctx.content_rect().width() * 0.4).max(120.0);
    Area::new(Id::new("time line")).anchor(Align2::CENTER_BOTTOM, [0.0, -48.0]).show(&ctx, |ui| {
        card().show(ui, |ui| {
            ui.spacing_mut().slider_width = width;
            let (mut at, end) = (playback.at, playback.recording.seconds());
            ui.add(Slider::new(&mut at, 0.0..=end.max(0.01)).suffix(" s").fixed_decimals(2));
            if at != playback.at {
                playback.at = at;
            }
        });
    });
    Ok(())
}
