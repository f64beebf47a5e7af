//! Characters that another program moves, seen in the window: a trainer of ML-Agents, or an environment of the Python package
//! through a pipe. A thread talks to each program, and the picture takes the newest poses from its mailbox.

pub mod mailbox;
pub mod mlagents;
pub mod pipe;

pub use mailbox::{Mailbox, RemotePose, RemoteSource};

use crate::app::input::actions::Action;
use crate::app::mode::{AppSet, Mode};
use crate::app::pacing::{FixedSettings, FramePace};
use crate::app::stage::actors::{Actor, place};
use crate::app::stage::puppets;
use crate::app::stage::scenario::LoadScenario;
use crate::app::stage::spawn::spawn;
use crate::app::ui::hints::{KeyHints, ModeKeys};
use bevy::prelude::*;
use bevy::window::PrimaryWindow;
use bevy_marathon::look::{FollowCamera, Quality};
use bevy_marathon::{Anatomy, Episode, Part, RagdollState, Track};
use std::time::Duration;

/// The window's size that ML-Agents sends by default, pixels.
const DEFAULT_SIZE: (i32, i32) = (84, 84);
/// Levels of quality, of Unity's six, from which the picture is of medium and of high quality.
const LEVELS: [i32; 2] = [2, 4];

pub(super) fn plugin(app: &mut App) {
    app.init_resource::<FixedSettings>()
        .add_systems(
            Update,
            (
                apply_settings.in_set(AppSet::Input),
                spawn_puppets.run_if(on_message::<LoadScenario>).in_set(AppSet::Simulate).after(spawn),
                play.in_set(AppSet::Present),
            )
                .distributive_run_if(in_state(Mode::Outside))
                .distributive_run_if(resource_exists::<RemoteSource>),
        )
        .add_systems(OnExit(Mode::Outside), |mut commands: Commands| commands.remove_resource::<RemoteSource>());
}

pub(super) fn key_hints(hints: &mut KeyHints) {
    const KEYS: ModeKeys = ModeKeys {
        useful: &[Action::Menu, Action::NextFocus, Action::Camera, Action::Hud],
        without: &[Action::Push, Action::Throw, Action::Restart, Action::NextAgent, Action::Record],
        ..ModeKeys::COMMON
    };
    hints.add(|scenario| scenario.mode == Mode::Outside, &KEYS);
}

/// Spawns the characters.
fn spawn_puppets(mut commands: Commands, source: Res<RemoteSource>, mut cameras: Query<&mut FollowCamera>) {
    let places = (0..source.agents).map(|i| place(i, source.kind.spacing(), source.kind.level()));
    puppets::spawn(&mut commands, &source.kind, places, &mut cameras);
    info!("loaded: {} of another program", source.agents);
}

/// Shows the newest poses.
#[expect(clippy::type_complexity, reason = "a query names what it reads")]
fn play(
    source: Res<RemoteSource>,
    mut actors: Query<(&Actor, (&Anatomy, &Track), &mut Episode), Without<RagdollState>>,
    mut parts: Query<&mut Transform, With<Part>>,
) {
    let mut mailbox = mailbox::open(&source.shared);
    for (actor, (anatomy, track), mut episode) in &mut actors {
        let Some(pose) = mailbox.poses.get(actor.0) else { continue };
        puppets::pose(anatomy, track, &pose.qpos, &mut parts);
        if *episode != pose.episode {
            episode.clone_from(&pose.episode);
        }
    }
    mailbox.taken = true;
}

/// Applies the size, quality and rate that the other side requests, unless the command line sets them. The game ends with the
/// other side.
fn apply_settings(
    mut commands: Commands,
    mut source: ResMut<RemoteSource>,
    fixed: Res<FixedSettings>,
    mut quality: ResMut<Quality>,
    mut windows: Query<&mut Window, With<PrimaryWindow>>,
    mut exit: MessageWriter<AppExit>,
) {
    let (engine, end) = {
        let mailbox = mailbox::open(&source.shared);
        (mailbox.engine, mailbox.end.clone())
    };
    match end {
        Some(Ok(())) => {
            info!("the other side has closed");
            exit.write(AppExit::Success);
        }
        // the function that started the app reports the error
        Some(Err(_)) => {
            exit.write(AppExit::error());
        }
        None => {}
    }
    if engine == source.applied {
        return;
    }
    let before = std::mem::replace(&mut source.bypass_change_detection().applied, engine);
    let chosen = |size: &(i32, i32)| *size != DEFAULT_SIZE && size.0 >= 16 && size.1 >= 16 && !fixed.size;
    if let Some((width, height)) = engine.resolution.filter(|size| chosen(size) && before.resolution != Some(*size)) {
        info!("window: {width} x {height}");
        windows.iter_mut().for_each(|mut w| w.resolution.set(width as f32, height as f32));
    }
    if let Some(level) = engine.quality.filter(|level| before.quality != Some(*level) && !fixed.quality) {
        let wanted = match level {
            _ if level < LEVELS[0] => Quality::Low,
            _ if level < LEVELS[1] => Quality::Medium,
            _ => Quality::High,
        };
        if *quality != wanted {
            info!("quality: {wanted:?}");
            *quality = wanted;
        }
    }
    if let Some(rate) = engine.target_frame_rate.filter(|rate| before.target_frame_rate != Some(*rate) && !fixed.rate) {
        let shortest = if rate > 0 { Duration::from_secs(1) / rate as u32 } else { Duration::ZERO };
        commands.insert_resource(FramePace(shortest));
    }
}
