//! Characters that another program moves, seen in the window: a trainer of ML-Agents through its door, or an environment of
//! the Python package through a pipe. Each has a thread that talks to its program; the picture takes the newest state.

use crate::app::args::Mode;
use crate::app::puppets::{self, Kind};
use crate::app::show::{Actor, Show, place};
use crate::app::{Given, Pace};
use crate::look::{FollowCamera, Quality};
use crate::ragdoll::{Anatomy, Episode, Part};
use crate::simulate::Seat;
use bevy::prelude::*;
use bevy::window::PrimaryWindow;
use marathon_mlagents::EngineSettings;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// What ML-Agents sends for the window's size when nobody has chosen one, pixels.
const NOBODYS_SIZE: (i32, i32) = (84, 84);
/// Levels of quality, of Unity's six, from which the picture is of medium and of high quality.
const LEVELS: [i32; 2] = [2, 4];

/// A character as its program last told of it.
#[derive(Clone, Debug, Default)]
pub struct Sight {
    /// Its configuration.
    pub qpos: Vec<f64>,
    /// How its episode goes.
    pub episode: Episode,
}

/// What the thread writes and the picture reads.
#[derive(Default)]
pub struct Board {
    /// The characters.
    pub sights: Vec<Sight>,
    /// The picture has taken the sights: new ones are welcome.
    pub taken: bool,
    /// How the other side wants the picture.
    pub engine: EngineSettings,
    /// The other side has closed, or there is an error.
    pub end: Option<Result<(), String>>,
}

/// Board of a thread.
pub type Shared = Arc<Mutex<Board>>;

/// Looks at the board.
pub fn board(shared: &Shared) -> MutexGuard<'_, Board> {
    // whoever panicked has left whole numbers behind
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Characters that another program moves.
#[derive(Resource, Clone)]
pub struct Feed {
    /// What they are.
    pub kind: Kind,
    /// How many are shown.
    pub agents: usize,
    /// Where their poses come from.
    pub shared: Shared,
    pub(crate) staged: bool,
    pub(crate) applied: EngineSettings,
}

impl Feed {
    /// Characters of a kind, of which nothing is known yet.
    pub fn new(kind: Kind, agents: usize) -> Self {
        Feed { kind, agents, shared: Shared::default(), staged: false, applied: EngineSettings::default() }
    }
}

/// Puts the characters on stage.
pub fn set_stage(mut commands: Commands, feed: Option<ResMut<Feed>>, mut cameras: Query<&mut FollowCamera>) {
    let Some(mut feed) = feed.filter(|f| !f.staged) else { return };
    feed.staged = true;
    let places = (0..feed.agents).map(|i| place(i, feed.kind.spacing(), feed.kind.level()));
    puppets::stage(&mut commands, &feed.kind, places, &mut cameras);
    info!("on stage: {} from outside", feed.agents);
}

/// Shows the newest states.
pub fn play(
    feed: Option<Res<Feed>>,
    mut actors: Query<(&Actor, &Anatomy, &mut Episode), Without<Seat>>,
    mut parts: Query<&mut Transform, With<Part>>,
) {
    let Some(feed) = feed else { return };
    let mut board = board(&feed.shared);
    for (actor, anatomy, mut episode) in &mut actors {
        let Some(sight) = board.sights.get(actor.0) else { continue };
        puppets::pose(anatomy, &sight.qpos, &mut parts);
        if *episode != sight.episode {
            episode.clone_from(&sight.episode);
        }
    }
    board.taken = true;
}

/// Gives the picture the size, the quality and the rate that the other side wants, where the command line has chosen none; ends
/// with it.
pub fn obey(
    mut commands: Commands,
    feed: Option<ResMut<Feed>>,
    given: Res<Given>,
    mut quality: ResMut<Quality>,
    mut windows: Query<&mut Window, With<PrimaryWindow>>,
    mut exit: MessageWriter<AppExit>,
) {
    let Some(mut feed) = feed else { return };
    let (engine, end) = {
        let board = board(&feed.shared);
        (board.engine, board.end.clone())
    };
    match end {
        Some(Ok(())) => {
            info!("the other side has closed");
            exit.write(AppExit::Success);
        }
        // told by whoever started the app
        Some(Err(_)) => {
            exit.write(AppExit::error());
        }
        None => {}
    }
    if engine == feed.applied {
        return;
    }
    let before = std::mem::replace(&mut feed.bypass_change_detection().applied, engine);
    let chosen = |size: &(i32, i32)| *size != NOBODYS_SIZE && size.0 >= 16 && size.1 >= 16 && !given.size;
    if let Some((width, height)) = engine.resolution.filter(|size| chosen(size) && before.resolution != Some(*size)) {
        info!("window: {width} x {height}");
        windows.iter_mut().for_each(|mut w| w.resolution.set(width as f32, height as f32));
    }
    if let Some(level) = engine.quality.filter(|level| before.quality != Some(*level) && !given.quality) {
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
    if let Some(rate) = engine.target_frame_rate.filter(|rate| before.target_frame_rate != Some(*rate) && !given.rate) {
        let shortest = if rate > 0 { Duration::from_secs(1) / rate as u32 } else { Duration::ZERO };
        commands.insert_resource(Pace(shortest));
    }
}

/// A show of something else ends the feed.
pub fn leave(mut commands: Commands, show: Res<Show>, feed: Option<Res<Feed>>) {
    if show.is_changed() && show.mode != Mode::Outside && feed.is_some() {
        commands.remove_resource::<Feed>();
    }
}
