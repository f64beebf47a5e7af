//! Replays of recordings, with a time line.

use crate::app::error::GameError;
use crate::app::input::actions::{Action, ActionPressed};
use crate::app::mode::{AppSet, Mode};
use crate::app::notifications::Notifications;
use crate::app::stage::actors::Actor;
use crate::app::stage::puppets::{self, Kind};
use crate::app::stage::recording::{PlayRecording, Recording};
use crate::app::stage::scenario::{LoadScenario, Scenario};
use crate::app::stage::spawn;
use crate::app::ui::theme::{Hud, UiSet, card};
use bevy::prelude::*;
use bevy_egui::egui::{Align2, Area, Id, Slider};
use bevy_egui::{EguiContexts, EguiPrimaryContextPass};
use bevy_marathon::look::FollowCamera;
use bevy_marathon::{Anatomy, Episode, OwnGround, Part, RagdollState, Track, pose};
use marathon_runs::TaskConfig;
use std::path::Path;
use std::sync::Arc;

/// Seconds that the keys go back and ahead.
const LEAP: f64 = 0.5;

/// A recording that is being shown.
#[derive(Resource, Clone)]
pub struct Playback {
    recording: Arc<Recording>,
    kind: Kind,
    /// Time in the recording, s.
    pub at: f64,
}

impl Playback {
    /// The recording.
    pub fn recording(&self) -> &Recording {
        &self.recording
    }

    /// Plays a recording from its start.
    ///
    /// # Errors
    /// If there is no such agent.
    pub fn new(recording: Recording) -> Result<Self, GameError> {
        let TaskConfig { agent, options } = &recording.task_config;
        let model = Arc::new(recording.ground.agent_with(agent, options)?.model()?);
        let spec = Arc::new(recording.task_config.factory()?.spec().clone());
        let kind = Kind::new(model, Some(spec), recording.dt);
        Ok(Playback { recording: Arc::new(recording), kind, at: 0.0 })
    }
}

pub(super) fn plugin(app: &mut App) {
    app.add_message::<PlayRecording>()
        .add_systems(
            Update,
            (
                scrub.in_set(AppSet::Input),
                open.in_set(AppSet::Simulate).before(spawn::enter_mode),
                spawn_puppets
                    .run_if(on_message::<LoadScenario>)
                    .run_if(in_state(Mode::Replay))
                    .in_set(AppSet::Simulate)
                    .after(spawn::spawn),
                play.in_set(AppSet::Present),
            ),
        )
        .add_systems(OnExit(Mode::Replay), |mut commands: Commands| commands.remove_resource::<Playback>())
        .add_systems(EguiPrimaryContextPass, draw.run_if(in_state(Mode::Replay)).in_set(UiSet::Panels));
}

/// Plays the recording that a message asks for.
fn open(
    mut commands: Commands,
    mut requests: MessageReader<PlayRecording>,
    mut scenario: ResMut<Scenario>,
    mut loads: MessageWriter<LoadScenario>,
    mut notes: ResMut<Notifications>,
) {
    let read = |path: &Path| Playback::new(Recording::load(path)?);
    for PlayRecording(path) in requests.read() {
        match read(path) {
            Ok(playback) => {
                let recording = playback.recording();
                scenario.mode = Mode::Replay;
                (scenario.agent, scenario.agents) = (recording.task_config.agent.clone(), recording.agents);
                commands.insert_resource(playback);
                loads.write(LoadScenario);
            }
            Err(error) => notes.error(error.to_string()),
        }
    }
}

/// Spawns the recorded characters.
fn spawn_puppets(mut commands: Commands, playback: Option<ResMut<Playback>>, mut cameras: Query<&mut FollowCamera>) {
    let Some(playback) = playback else { return };
    let places = playback.recording.places.as_chunks::<3>().0.iter().map(|place| Vec3::from_array(*place));
    puppets::spawn(&mut commands, &playback.kind, places, &mut cameras);
}

/// Moves the recorded characters.
#[expect(clippy::type_complexity, reason = "a query names what it reads")]
fn play(
    playback: Option<ResMut<Playback>>,
    time: Res<Time<Virtual>>,
    mut puppets: Query<(&Actor, (&Anatomy, &Track), &mut Episode, &mut OwnGround), Without<RagdollState>>,
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
    for (actor, (anatomy, track), mut episode, mut ground) in &mut puppets {
        let qpos = recording.pose(&anatomy.model, actor.0, at);
        puppets::pose(anatomy, track, &qpos, &mut parts);
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
        let own = before.and_then(|before| pose::own_velocity(&anatomy.model, before, here, recording.dt));
        episode.own_velocity = own.unwrap_or_default();
        episode.terms = recording.terms(now, actor.0).to_vec();
        episode.action = recording.action(now, actor.0).to_vec();
        episode.command = recording.command(now, actor.0).to_vec();
        episode.untimed = recording.untimed(now, actor.0);
    }
}

/// Goes back and ahead in time, within the recording.
fn scrub(mut actions: MessageReader<ActionPressed>, playback: Option<ResMut<Playback>>) {
    let Some(mut playback) = playback else {
        actions.clear();
        return;
    };
    for ActionPressed(action) in actions.read() {
        let leap = match action {
            Action::Back => -LEAP,
            Action::Ahead => LEAP,
            _ => continue,
        };
        playback.at = (playback.at + leap).clamp(0.0, playback.recording.seconds());
    }
}

/// Draws the time line.
fn draw(mut contexts: EguiContexts, hud: Res<Hud>, playback: Option<ResMut<Playback>>) -> Result {
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
