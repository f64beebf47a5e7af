//! Agents and the motion clips that they follow: a ghost, errors in color, clips that are dropped on the window.

use crate::app::args::Mode;
use crate::app::keys::{Deed, Do};
use crate::app::notes::Notes;
use crate::app::policies::shipped_agents;
use crate::app::show::{Actor, Focus, Show, Source};
use crate::look::{ErrorColors, Ghost};
use crate::simulate::RagdollState;
use bevy::prelude::*;
use bevy::window::FileDragAndDrop;
use marathon_envs::agents::marathon::marathon_man::clips;
use marathon_envs::options::Value;
use marathon_envs::registry;
use marathon_runs::{Flags, RunError, Setting, TaskOptions};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

/// An agent that follows any clip.
pub const FOLLOWER: &str = "MarathonMan-v0";
/// The argument of agents that names their clip.
const CLIP: &str = "clip";
/// How far a ghost beside a character is from it, m: behind it, as the camera at its side sees it.
const BESIDE: Vec3 = Vec3::new(0.0, 0.0, -0.9);

/// Where the ghost of a clip is drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum GhostAt {
    /// Nowhere.
    #[default]
    Off,
    /// Where the clip is.
    Inside,
    /// Beside the character.
    Beside,
}

/// What is drawn about the clip of the character in focus.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Imitation {
    /// Its ghost.
    pub ghost: GhostAt,
    /// The character's parts have the color of their distance from the clip.
    pub errors: bool,
}

/// A clip that is being read on a thread of its own: to fit a recording to a body may take seconds.
#[derive(Resource)]
pub struct Reading {
    path: PathBuf,
    answer: Arc<Mutex<Option<Result<Setting, String>>>>,
}

/// Whether an agent follows a clip.
pub fn follows_clip(agent: &str) -> bool {
    registry::agent(agent).map(|agent| agent.facts()).is_ok_and(|facts| facts.follows_clips && !facts.clips.is_empty())
}

/// The clip that a show's agent follows, if it follows any that one likes.
pub fn clip_of(show: &Show) -> Option<String> {
    let setting = show.setting().ok()?;
    let infos = registry::agent(&setting.agent).ok()?.options();
    let default = infos.into_iter().find(|info| info.name == CLIP)?.value;
    match setting.options.get(CLIP).cloned().unwrap_or(default) {
        Value::Text(name) => Some(name),
        _ => None,
    }
}

/// Lets the agent of a show follow another clip.
pub fn choose_clip(show: &mut Show, name: &str) {
    let chosen = std::mem::take(&mut show.chosen);
    let mut chosen = if chosen.agent == show.agent { chosen } else { Setting::default() };
    chosen.agent.clone_from(&show.agent);
    chosen.options.set(CLIP, name);
    show.chosen = chosen;
}

/// Goes on to the next of the clips that come with Marathon; from an agent of one clip, to the next such that comes with a
/// policy.
pub fn next_clip(show: &mut Show, notes: &mut Notes) {
    let Some(clip) = clip_of(show) else {
        let all: Vec<String> = shipped_agents().into_iter().filter(|agent| follows_clip(agent)).collect();
        let next = all.iter().position(|agent| *agent == show.agent).map_or(0, |i| (i + 1) % all.len());
        if let Some(agent) = all.get(next) {
            show.agent.clone_from(agent);
            show.play(Source::Shipped);
            show.again();
        }
        return;
    };
    let all: Vec<String> = clips::all_names().into_iter().filter(|name| !name.ends_with(".motion")).collect();
    let next = all.iter().position(|name| *name == clip).map_or(0, |i| (i + 1) % all.len().max(1));
    if let Some(name) = all.get(next) {
        choose_clip(show, name);
        notes.say(format!("clip: {name}"));
        show.again();
    }
}

/// Reads clips that are dropped on the window.
pub fn take_files(
    mut commands: Commands,
    mut drops: MessageReader<FileDragAndDrop>,
    show: Res<Show>,
    mut notes: ResMut<Notes>,
) {
    for drop in drops.read() {
        let FileDragAndDrop::DroppedFile { path_buf: path, .. } = drop else { continue };
        if show.mode == Mode::Outside {
            notes.error(format!("{} is not read: another program moves the characters", path.display()));
            continue;
        }
        let base = match clip_of(&show) {
            Some(_) if show.chosen.agent == show.agent => show.chosen.clone(),
            Some(_) => Setting { agent: show.agent.clone(), ..default() },
            None => Setting { agent: FOLLOWER.into(), ..default() },
        };
        notes.say(format!("reading {}", path.display()));
        let answer = Arc::new(Mutex::new(None));
        let (theirs, file) = (answer.clone(), path.clone());
        let read = move || {
            let setting = with_clip(base, &file).map_err(|e| e.spelled(&Flags("marathon")));
            *theirs.lock().unwrap_or_else(PoisonError::into_inner) = Some(setting);
        };
        match std::thread::Builder::new().name("marathon-clip".into()).spawn(read) {
            // an earlier one that is still being read is forgotten
            Ok(_) => commands.insert_resource(Reading { path: path.clone(), answer }),
            Err(error) => notes.error(format!("the clip's thread cannot be started: {error}")),
        }
    }
}

/// A task with the clip of a file, whose environments can be made.
fn with_clip(base: Setting, path: &Path) -> Result<Setting, RunError> {
    let given = vec![(CLIP.to_string(), Value::Text(path.to_string_lossy().into_owned()))];
    let setting = base.with(&TaskOptions { given })?;
    setting.factory()?;
    Ok(setting)
}

/// Lets the characters follow the clip that has been read.
pub fn take_clip(
    mut commands: Commands,
    reading: Option<Res<Reading>>,
    mut show: ResMut<Show>,
    mut notes: ResMut<Notes>,
) {
    let Some(reading) = reading else { return };
    let Some(answer) = reading.answer.lock().unwrap_or_else(PoisonError::into_inner).take() else { return };
    commands.remove_resource::<Reading>();
    let setting = match answer {
        Ok(setting) => setting,
        Err(error) => return notes.error(error),
    };
    if show.mode != Mode::Learn {
        show.mode = Mode::Imitate;
    }
    if show.agent != setting.agent || (show.source == Source::Nothing && show.model.is_some()) {
        show.source = if show.mode == Mode::Learn { Source::Trainer } else { Source::Shipped };
    }
    (show.agent, show.chosen, show.model) = (setting.agent.clone(), setting, None);
    show.again();
    let key = if show.mode == Mode::Learn { "" } else { "; learn live: L" };
    notes.say(format!("following {}{key}", reading.path.display()));
}

/// Shows ghost and errors when the mode begins, and leaves them on while what it showed is learned.
pub fn enter(show: Res<Show>, mut imitation: ResMut<Imitation>, mut last: Local<Option<Mode>>) {
    let before = last.replace(show.mode);
    match (before, show.mode) {
        (before, now) if before == Some(now) => {}
        (_, Mode::Imitate) => *imitation = Imitation { ghost: GhostAt::Inside, errors: true },
        (Some(Mode::Imitate), Mode::Learn) => {}
        (Some(Mode::Imitate | Mode::Learn), _) => *imitation = Imitation::default(),
        _ => {}
    }
}

/// Switches ghost and errors.
pub fn obey(mut deeds: MessageReader<Do>, mut imitation: ResMut<Imitation>, show: Res<Show>, mut notes: ResMut<Notes>) {
    for Do(deed) in deeds.read() {
        if !matches!(deed, Deed::Ghost | Deed::Errors) {
            continue;
        }
        if !follows_clip(&show.agent) {
            notes.say(format!("{} follows no clip; {FOLLOWER} does", show.agent));
            continue;
        }
        if *deed == Deed::Errors {
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

/// Draws what is wanted about the focus.
#[expect(clippy::type_complexity, reason = "a query names what it reads")]
pub fn show(
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
