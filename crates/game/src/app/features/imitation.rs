//! Agents and the motion clips that they follow: a ghost, errors in color, clips that are dropped on the window.

use crate::app::input::actions::{Action, ActionPressed};
use crate::app::input::control::ControlSet;
use crate::app::mode::{AppSet, Mode};
use crate::app::notifications::Notifications;
use crate::app::stage::actors::{Actor, Focus};
use crate::app::stage::clips::{CLIP, FOLLOWER, clip_of, follows_clip};
use crate::app::stage::policies::ShippedPolicies;
use crate::app::stage::scenario::{LoadScenario, PolicySource, Scenario};
use crate::app::ui::hints::{KeyHints, ModeKeys};
use bevy::prelude::*;
use bevy::window::FileDragAndDrop;
use bevy_marathon::RagdollState;
use bevy_marathon::look::{ErrorColors, Ghost};
use marathon_envs::options::Value;
use marathon_runs::{Flags, RunError, TaskConfig, TaskOptions};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

/// Offset of a ghost beside a character, m: behind it, as the camera at its side sees it.
const BESIDE: Vec3 = Vec3::new(0.0, 0.0, -0.9);

/// The place of the ghost of a clip.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum GhostAt {
    /// Nowhere.
    #[default]
    Off,
    /// At the pose of the clip.
    Inside,
    /// Beside the character.
    Beside,
}

/// The drawing of the clip of the character in focus.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Imitation {
    /// The ghost.
    pub ghost: GhostAt,
    /// Whether the color of the character's parts is their distance from the clip.
    pub errors: bool,
}

/// A clip that a thread reads: fitting a recording to a body may take seconds.
#[derive(Resource)]
pub struct Reading {
    path: PathBuf,
    answer: Arc<Mutex<Option<Result<TaskConfig, String>>>>,
}

pub(super) fn plugin(app: &mut App) {
    app.init_resource::<Imitation>()
        .add_systems(OnEnter(Mode::Imitate), show_all)
        .add_systems(OnExit(Mode::Imitate), hide_all.run_if(not(in_state(Mode::Learn))))
        .add_systems(OnExit(Mode::Learn), hide_all)
        .add_systems(Update, (take_files, take_clip).chain().in_set(AppSet::Input).after(ControlSet))
        .add_systems(Update, (switch, apply).chain().in_set(AppSet::Present));
}

pub(super) fn key_hints(hints: &mut KeyHints) {
    const KEYS: ModeKeys = ModeKeys {
        useful: &[
            Action::Menu,
            Action::Ghost,
            Action::Errors,
            Action::NextAgent,
            Action::Push,
            Action::Throw,
            Action::Camera,
            Action::Learn,
        ],
        names: &[(Action::NextAgent, "next clip")],
        ..ModeKeys::COMMON
    };
    hints.add(|scenario| scenario.mode == Mode::Imitate, &KEYS);
}

fn show_all(mut imitation: ResMut<Imitation>) {
    *imitation = Imitation { ghost: GhostAt::Inside, errors: true };
}

/// Hides ghost and errors. They stay while the clip that they showed is learned.
fn hide_all(mut imitation: ResMut<Imitation>) {
    *imitation = Imitation::default();
}

/// Reads clips that are dropped on the window.
fn take_files(
    mut commands: Commands,
    mut drops: MessageReader<FileDragAndDrop>,
    (scenario, shipped): (Res<Scenario>, Res<ShippedPolicies>),
    mut notes: ResMut<Notifications>,
) {
    for drop in drops.read() {
        let FileDragAndDrop::DroppedFile { path_buf: path, .. } = drop else { continue };
        if scenario.mode == Mode::Outside {
            notes.error(format!("{} is not read: another program moves the characters", path.display()));
            continue;
        }
        let base = match clip_of(&scenario, &shipped) {
            Some(_) if scenario.chosen.agent == scenario.agent => scenario.chosen.clone(),
            Some(_) => TaskConfig { agent: scenario.agent.clone(), ..default() },
            None => TaskConfig { agent: FOLLOWER.into(), ..default() },
        };
        notes.say(format!("reading {}", path.display()));
        let answer = Arc::new(Mutex::new(None));
        let (theirs, file) = (answer.clone(), path.clone());
        let read = move || {
            let task_config = with_clip(base, &file).map_err(|e| e.spelled(&Flags("marathon")));
            *theirs.lock().unwrap_or_else(PoisonError::into_inner) = Some(task_config);
        };
        match std::thread::Builder::new().name("marathon-clip".into()).spawn(read) {
            // this replaces a clip that is still being read
            Ok(_) => commands.insert_resource(Reading { path: path.clone(), answer }),
            Err(error) => notes.error(format!("the clip's thread cannot be started: {error}")),
        }
    }
}

/// Sets the clip of a file in a task, and checks that its environments can be made.
fn with_clip(base: TaskConfig, path: &Path) -> Result<TaskConfig, RunError> {
    let given = vec![(CLIP.to_string(), Value::Text(path.to_string_lossy().into_owned()))];
    let task_config = base.with(&TaskOptions { given })?;
    task_config.factory()?;
    Ok(task_config)
}

/// Lets the characters follow the clip that has been read.
fn take_clip(
    mut commands: Commands,
    reading: Option<Res<Reading>>,
    mut scenario: ResMut<Scenario>,
    mut loads: MessageWriter<LoadScenario>,
    mut notes: ResMut<Notifications>,
) {
    let Some(reading) = reading else { return };
    let Some(answer) = reading.answer.lock().unwrap_or_else(PoisonError::into_inner).take() else { return };
    commands.remove_resource::<Reading>();
    let task_config = match answer {
        Ok(task_config) => task_config,
        Err(error) => return notes.error(error),
    };
    if scenario.mode != Mode::Learn {
        scenario.mode = Mode::Imitate;
    }
    if scenario.agent != task_config.agent || (scenario.source == PolicySource::Nothing && scenario.model.is_some()) {
        scenario.source = if scenario.mode == Mode::Learn { PolicySource::Trainer } else { PolicySource::Shipped };
    }
    (scenario.agent, scenario.chosen, scenario.model) = (task_config.agent.clone(), task_config, None);
    loads.write(LoadScenario);
    let key = if scenario.mode == Mode::Learn { "" } else { "; learn live: L" };
    notes.say(format!("following {}{key}", reading.path.display()));
}

/// Switches ghost and errors.
fn switch(
    mut actions: MessageReader<ActionPressed>,
    mut imitation: ResMut<Imitation>,
    scenario: Res<Scenario>,
    mut notes: ResMut<Notifications>,
) {
    for ActionPressed(action) in actions.read() {
        if !matches!(action, Action::Ghost | Action::Errors) {
            continue;
        }
        if !follows_clip(&scenario.agent) {
            notes.say(format!("{} follows no clip; {FOLLOWER} does", scenario.agent));
            continue;
        }
        if *action == Action::Errors {
            imitation.errors = !imitation.errors;
            continue;
        }
        let (next, name) = match imitation.ghost {
            GhostAt::Off => (GhostAt::Inside, "inside"),
            GhostAt::Inside => (GhostAt::Beside, "beside"),
            GhostAt::Beside => (GhostAt::Off, "off"),
        };
        imitation.ghost = next;
        notes.say(format!("ghost: {name}"));
    }
}

/// Shows ghost and errors of the character in focus.
#[expect(clippy::type_complexity, reason = "a query names what it reads")]
fn apply(
    mut commands: Commands,
    imitation: Res<Imitation>,
    focus: Res<Focus>,
    actors: Query<(Entity, &Actor, Option<&Ghost>, Has<ErrorColors>), With<RagdollState>>,
) {
    for (entity, actor, ghost, errors) in &actors {
        let here = actor.0 == focus.0;
        let wanted = match imitation.ghost {
            GhostAt::Inside if here => Some(Ghost(Vec3::ZERO)),
            GhostAt::Beside if here => Some(Ghost(BESIDE)),
            _ => None,
        };
        if ghost.copied() != wanted {
            match wanted {
                Some(ghost) => commands.entity(entity).insert(ghost),
                None => commands.entity(entity).remove::<Ghost>(),
            };
        }
        if errors != (here && imitation.errors) {
            match errors {
                true => commands.entity(entity).remove::<ErrorColors>(),
                false => commands.entity(entity).insert(ErrorColors),
            };
        }
    }
}
