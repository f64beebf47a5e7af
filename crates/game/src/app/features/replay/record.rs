//! Recordings of runs.

use crate::app::error::GameError;
use crate::app::files::{file_stem, free_name};
use crate::app::input::actions::{Action, ActionPressed};
use crate::app::input::control::ControlSet;
use crate::app::mode::{AppSet, Mode};
use crate::app::notifications::Notifications;
use crate::app::stage::actors::Actor;
use crate::app::stage::loaded::LoadedPolicy;
use crate::app::stage::recording::Recording;
use crate::app::stage::recording::tape::Tape;
use crate::app::stage::scenario::{LoadScenario, Scenario};
use crate::app::stage::spawn::{enter_mode, spawn};
use crate::app::ui::question::{AtStake, ReportSet};
use crate::app::ui::status::StatusLines;
use crate::app::ui::theme::BAD;
use bevy::prelude::*;
use bevy_marathon::{Anatomy, Episode, Marathon, MarathonSystems, RagdollState, Track};
use marathon_physics::budget;
use std::path::PathBuf;

/// Longest recording, frames.
const LONGEST: usize = 60_000;
/// Share of the largest replay for states and actions. The rest is for grounds.
const FILLED: f64 = 0.75;

/// A recording that is being made.
#[derive(Resource)]
pub struct Recorder(Tape);

impl Recorder {
    /// Length so far, s.
    pub fn seconds(&self) -> f64 {
        self.0.recording.seconds()
    }

    /// Whether the replay has reached its maximum length.
    fn is_full(&self) -> bool {
        let most = budget::REPLAY_FILE.most().unwrap_or(0) as f64;
        self.0.recording.frames() >= LONGEST || self.0.recording.bytes() as f64 > FILLED * most
    }
}

pub(super) fn plugin(app: &mut App) {
    app.add_systems(PreUpdate, report_at_stake.in_set(ReportSet))
        .add_systems(
            Update,
            (
                control.in_set(AppSet::Input).after(ControlSet),
                (end_with_scenario.run_if(on_message::<LoadScenario>), end_when_full)
                    .chain()
                    .in_set(AppSet::Simulate)
                    .after(enter_mode)
                    .before(spawn),
                report.in_set(AppSet::Present),
            ),
        )
        .add_systems(FixedUpdate, record.after(MarathonSystems::Report))
        .add_systems(Last, save_running.run_if(on_message::<AppExit>));
}

/// Starts and ends recordings. One that is requested before the characters are on stage starts with them.
fn control(
    mut commands: Commands,
    mut actions: MessageReader<ActionPressed>,
    (scenario, loaded): (Res<Scenario>, Res<LoadedPolicy>),
    recorder: Option<Res<Recorder>>,
    mut notes: ResMut<Notifications>,
    mut requested: Local<bool>,
    actors: Query<(&Actor, &Anatomy, &Track), With<RagdollState>>,
) {
    let recordable = scenario.mode.is_simulated() && scenario.mode != Mode::Testbed;
    *requested &= recordable;
    for _ in actions.read().filter(|action| action.0 == Action::Record) {
        if let Some(recorder) = &recorder {
            commands.remove_resource::<Recorder>();
            finish(recorder, "", &mut notes);
        } else if !recordable {
            notes.say("only agents can be recorded");
        } else {
            *requested = !*requested;
        }
    }
    if !*requested {
        return;
    }
    let mut all: Vec<_> = actors.iter().collect();
    all.sort_by_key(|(actor, ..)| actor.0);
    let Some((_, anatomy, _)) = all.first() else { return };
    *requested = false;
    let tracks = all.iter().map(|(.., track)| track.place());
    commands.insert_resource(Recorder(Tape::new(&loaded, anatomy.dt, tracks)));
    notes.say("recording; the same key ends it");
}

/// Ends a recording when other characters come. The recording is complete up to now.
fn end_with_scenario(mut commands: Commands, recorder: Option<Res<Recorder>>, mut notes: ResMut<Notifications>) {
    if let Some(recorder) = recorder {
        commands.remove_resource::<Recorder>();
        finish(&recorder, "other characters come: ", &mut notes);
    }
}

/// Ends a recording that has reached its maximum length.
fn end_when_full(mut commands: Commands, recorder: Option<Res<Recorder>>, mut notes: ResMut<Notifications>) {
    if let Some(recorder) = recorder.filter(|recorder| recorder.is_full()) {
        commands.remove_resource::<Recorder>();
        finish(&recorder, "the recording has its maximum length: ", &mut notes);
    }
}

/// Shows that a recording is being made.
fn report(recorder: Option<Res<Recorder>>, mut lines: ResMut<StatusLines>) {
    if let Some(recorder) = recorder {
        lines.0.push((BAD, format!("recording {:.1} s", recorder.seconds())));
    }
}

/// Reports what the end of the game would interrupt.
fn report_at_stake(recorder: Option<Res<Recorder>>, mut at_stake: ResMut<AtStake>) {
    at_stake.recording = recorder.map(|recorder| recorder.seconds());
}

/// Ends the current recording, if there is one, and saves it.
pub fn save_running(world: &mut World) {
    if let Some(recorder) = world.remove_resource::<Recorder>() {
        world.resource_scope(|_, mut notes: Mut<Notifications>| finish(&recorder, "", &mut notes));
    }
}

/// Saves a recording and shows a note.
fn finish(recorder: &Recorder, why: &str, notes: &mut Notifications) {
    if recorder.0.recording.frames() == 0 {
        notes.say(format!("{why}nothing was recorded"));
        return;
    }
    match keep(&recorder.0.recording) {
        Ok(path) => {
            let (path, video) = (path.display().to_string(), path.with_extension("mp4").display().to_string());
            notes.say(format!("{why}saved as {path}; a video of it: marathon-game --replay {path} --record {video}"));
        }
        Err(error) => notes.error(format!("{why}the recording cannot be saved: {error}")),
    }
}

/// Saves under the first free name.
fn keep(recording: &Recording) -> Result<PathBuf, GameError> {
    let path = free_name(&file_stem(&recording.task_config.agent), "replay");
    recording.save(&path)?;
    Ok(path)
}

/// Appends the decisions since the last tick.
fn record(
    recorder: Option<ResMut<Recorder>>,
    marathon: Res<Marathon>,
    actors: Query<(&Actor, &RagdollState, &Episode, &Anatomy)>,
) {
    let Some(mut recorder) = recorder else { return };
    let mut all: Vec<_> = actors.iter().collect();
    all.sort_by_key(|(actor, ..)| actor.0);
    let all: Vec<_> = all.into_iter().map(|(_, state, episode, anatomy)| (state, episode, anatomy)).collect();
    recorder.0.append(&marathon, &all);
}
