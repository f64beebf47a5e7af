//! The `marathon-game` app: an app around the plugin.

mod args;
mod ask;
mod control;
mod costume;
mod course;
mod cues;
mod error;
mod feed;
mod film;
mod hands;
mod hints;
mod hud;
mod imitate;
mod interrupt;
mod keys;
mod learn;
mod menu;
mod mlagents;
mod notes;
mod policies;
mod puppets;
mod recording;
mod replay;
mod show;
mod steer;
mod stream;
mod weather;

pub use args::{Args, CameraArg, GroundArg, Mode, QualityArg};
pub use ask::{Asked, Question};
pub use costume::{Costume, Fitting};
pub use course::{Choice, Course, KEPT, List, MOST_STEPS, Part, Place, ROWS, Run, Runs, Site, Step, Table};
pub use cues::{Cue, Cues};
pub use error::GameError;
pub use feed::{Board, Feed, Sight};
pub use hands::{Hands, Hold};
pub use hud::Hud;
pub use imitate::{GhostAt, Imitation, Reading};
pub use keys::{Bindings, Deed, Do, KeysPlugin, Pressed, Rebinding};
pub use learn::{Lesson, Teaching};
pub use menu::Menu;
pub use notes::{Note, Notes};
pub use recording::{Recording, Row};
pub use replay::{Playback, Recorder};
pub use show::{Actor, Focus, Show, Source};
pub use steer::{Mapping, Mappings, Steering};
pub use weather::{Ball, Weather, WeatherPlugin};

use crate::ground::Ground;
use crate::look::{
    FollowCamera, FollowCameraPlugin, GhostPlugin, LookPlugin, MarksPlugin, Quality, SceneryPlugin, SkinPlugin,
};
use crate::plugin::{MarathonPlugin, MarathonSystems};
use bevy::app::TerminalCtrlCHandlerPlugin;
use bevy::prelude::*;
use bevy::window::{PresentMode, WindowResolution};
use bevy_egui::{EguiPlugin, EguiPrimaryContextPass, PrimaryEguiContext, egui};
use clap::Parser;
use marathon_runs::RunError;
use marathon_runs::text::printable;
use std::ffi::OsString;
use std::io::{BufReader, Write};
use std::process::ExitCode;
use std::time::{Duration, Instant};

/// Ticks of the simulation per second: most tasks decide at a divisor of it.
const TICKS: f64 = 100.0;

/// Runs the app with the words of a command line and returns its exit code: 0 after a proper end, 1 if it could not start,
/// 2 if the command line makes no sense, 130 after Ctrl-C.
pub fn main(words: impl IntoIterator<Item = OsString>) -> ExitCode {
    let args = match Args::try_parse_from(words) {
        Ok(args) => args,
        Err(answer) => {
            let _ = answer.print();
            return ExitCode::from(answer.exit_code() as u8);
        }
    };
    match run(&args) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            let told = error.to_string();
            let told = printable(&told);
            if let GameError::Interrupted(_) = error {
                eprintln!("{told}");
                return ExitCode::from(interrupt::CODE);
            }
            eprintln!("error: {told}");
            ExitCode::FAILURE
        }
    }
}

/// Runs the app.
///
/// # Errors
/// What keeps it from starting, found out before anything is drawn.
pub fn run(args: &Args) -> Result<(), GameError> {
    if args.runs {
        let path = args.table.clone().map_or_else(course::default_path, Ok)?;
        // whoever reads may have had enough
        let _ = std::io::stdout().write_all(course::listing(&path)?.as_bytes());
        return Ok(());
    }
    let mut game = GamePlugin::new(args)?;
    if let Some(out) = &args.record {
        return film::film(args, out, game);
    }
    check_display()?;
    if check_graphics()? && args.quality.is_none() {
        game.quality = Quality::Low;
    }
    game.feed = match args.mlagents_port {
        Some(port) => Some(mlagents::serve(&game.show, port, args.learn.threads.unwrap_or(0))?),
        None if args.watch_stream => Some(stream::watch(BufReader::new(std::io::stdin()), std::io::stdout())?),
        None => None,
    };
    let outside = game.feed.as_ref().map(|feed| feed.shared.clone());
    let (width, height) = args.size();
    let window = Window {
        title: "Marathon".into(),
        resolution: WindowResolution::new(width, height),
        present_mode: PresentMode::AutoVsync,
        ..default()
    };
    interrupt::listen();
    let mut app = App::new();
    // closing the window may ask first
    let windows = WindowPlugin { primary_window: Some(window), close_when_requested: false, ..default() };
    app.add_plugins(DefaultPlugins.set(windows).disable::<TerminalCtrlCHandlerPlugin>()).add_plugins(game);
    app.add_systems(Update, (ask::close, interrupt::obey));
    if args.max_fps > 0 {
        app.insert_resource(Pace(Duration::from_secs_f64(1.0 / f64::from(args.max_fps))));
    }
    app.add_systems(Last, rest.run_if(resource_exists::<Pace>));
    match (app.run(), outside.and_then(|shared| feed::board(&shared).end.take())) {
        (_, Some(Err(text))) => Err(GameError::Outside(text)),
        (AppExit::Success, _) => Ok(()),
        _ if interrupt::requested() => Err(GameError::Interrupted(None)),
        (AppExit::Error(_), _) => {
            Err(GameError::System("the window system or the graphics driver has stopped the game; see above".into()))
        }
    }
}

/// Whether there is a screen to open a window on.
fn check_display() -> Result<(), GameError> {
    if cfg!(any(target_os = "windows", target_os = "macos")) {
        return Ok(());
    }
    let display = std::env::var("DISPLAY").unwrap_or_default();
    if display.is_empty() {
        return Err(GameError::NoDisplay("not set".into()));
    }
    // the socket of a display on this machine; others are left to the window system to find
    let number = display.strip_prefix(':').map(|rest| rest.split('.').next().unwrap_or(rest).to_string());
    match number {
        Some(number) if !std::path::Path::new("/tmp/.X11-unix").join(format!("X{number}")).exists() => {
            Err(GameError::NoDisplay(format!("'{display}', where nothing answers")))
        }
        _ => Ok(()),
    }
}

/// Whether there is something to draw with, and if so whether it is a processor.
fn check_graphics() -> Result<bool, GameError> {
    let instance = wgpu::Instance::default();
    let options = wgpu::RequestAdapterOptions::default();
    let adapter = bevy::tasks::block_on(instance.request_adapter(&options));
    let software = |adapter: wgpu::Adapter| adapter.get_info().device_type == wgpu::DeviceType::Cpu;
    adapter.map(software).map_err(|_| GameError::NoGraphics)
}

/// Shortest frame.
#[derive(Resource)]
pub(crate) struct Pace(Duration);

/// What the command line has chosen, and no other program may change.
#[derive(Resource)]
pub(crate) struct Given {
    quality: bool,
    size: bool,
    rate: bool,
}

fn rest(pace: Res<Pace>, mut last: Local<Option<Instant>>) {
    if let Some(left) = last.and_then(|last| pace.0.checked_sub(last.elapsed())) {
        std::thread::sleep(left);
    }
    *last = Some(Instant::now());
}

/// Everything that the app adds to Bevy's own plugins.
pub struct GamePlugin {
    args: Args,
    show: Show,
    playback: Option<Recording>,
    feed: Option<Feed>,
    skin: Option<costume::File>,
    quality: Quality,
}

impl GamePlugin {
    /// The game that a command line asks for.
    ///
    /// # Errors
    /// If an agent, a policy, a model or a recording cannot be used.
    pub fn new(args: &Args) -> Result<Self, GameError> {
        let mut show = Show::of(args)?;
        let mut playback = None;
        if let Some(path) = &args.replay {
            let recording = Recording::load(path)?;
            if !args.task.given.is_empty() {
                return Err(RunError::option("option", "does not go with a recording, which has its run's").into());
            }
            (show.mode, show.agent, show.agents) = (Mode::Replay, recording.setting.agent.clone(), recording.agents);
            if Ground::ALL.contains(&recording.ground) {
                show.ground = recording.ground;
            }
            playback = Some(recording);
        }
        if show.mode == Mode::Learn {
            learn::settings(&show.setting()?, &Teaching { learn: args.learn.clone(), seed: 0 })?;
        }
        if show.mode == Mode::Course {
            course::check_table(args.table.as_deref())?;
        }
        if args.mlagents_port.is_some() || args.watch_stream {
            show.mode = Mode::Outside;
        }
        let skin = args.skin.as_deref().map(|skin| costume::File::read(skin, args.mapping.as_deref())).transpose()?;
        Ok(GamePlugin { args: args.clone(), show, playback, feed: None, skin, quality: args.quality() })
    }
}

impl Plugin for GamePlugin {
    fn build(&self, app: &mut App) {
        let args = &self.args;
        app.add_plugins((
            EguiPlugin::default(),
            MarathonPlugin,
            LookPlugin,
            FollowCameraPlugin,
            MarksPlugin,
            GhostPlugin,
            SkinPlugin,
            WeatherPlugin,
            KeysPlugin,
        ))
        .add_plugins(SceneryPlugin(self.quality))
        .insert_resource(Time::<Fixed>::from_hz(TICKS))
        .insert_resource(self.show.clone())
        .insert_resource(Hud { on: !args.no_hud, help: false })
        .insert_resource(show::Shown { contacts: args.contacts, joints: args.joints })
        .insert_resource(Teaching { learn: args.learn.clone(), seed: args.seed() })
        .insert_resource(Start(args.camera.into()))
        .insert_resource(Given { quality: args.quality.is_some(), size: args.size.is_some(), rate: args.max_fps > 0 })
        .insert_resource(Cues::new(args.press.clone()))
        .insert_resource(Hands::new(&args.hold))
        .init_resource::<Focus>()
        .init_resource::<show::Script>()
        .init_resource::<Imitation>()
        .init_resource::<Steering>()
        .insert_resource(args.mappings())
        .init_resource::<notes::Notes>()
        .init_resource::<menu::Menu>()
        .init_resource::<hud::Monitor>()
        .add_systems(Startup, (open, hands::connect))
        .add_systems(PreUpdate, hands::play.before(bevy::input::InputSystems))
        .add_systems(
            PreUpdate,
            (cues::perform.before(ask::gate), steer::steer.after(bevy::input::InputSystems).before(keys::read)),
        )
        .add_systems(
            Update,
            (
                (control::time, control::stage, learn::obey, replay::obey, replay::scrub, feed::obey).chain(),
                (imitate::take_files, imitate::take_clip, imitate::enter, imitate::obey).chain(),
                (
                    replay::close,
                    show::set_stage,
                    replay::set_stage,
                    feed::set_stage,
                    learn::attend,
                    learn::pace,
                    learn::perform,
                    learn::tell,
                )
                    .chain(),
                (
                    show::reload,
                    show::follow_focus,
                    show::show_marks,
                    imitate::show,
                    control::look,
                    notes::fade,
                    hud::clock,
                ),
                (control::picture, replay::play, feed::play, leave_replay, feed::leave),
            )
                .chain(),
        )
        .add_systems(Last, (replay::keep_at_exit, learn::keep_at_exit))
        .add_systems(FixedUpdate, (hud::watch, replay::record).after(MarathonSystems::Report))
        .add_systems(
            EguiPrimaryContextPass,
            (
                style,
                hud::fit,
                course::card,
                hud::draw,
                menu::circumstances,
                menu::motors,
                replay::time_line,
                course::list,
                menu::draw,
                ask::draw,
            )
                .chain(),
        );
        course::lay_out(app, args);
        if let Some(skin) = &self.skin {
            costume::lay_out(app, skin);
        }
        if let Some(feed) = self.feed.clone() {
            app.insert_resource(feed);
        }
        if let Some(recording) = self.playback.clone() {
            match Playback::new(recording) {
                Ok(playback) => {
                    app.insert_resource(playback);
                }
                Err(error) => error!("{error}"),
            }
        }
    }
}

/// Where the camera begins.
#[derive(Resource)]
struct Start(crate::look::CameraMode);

fn open(mut commands: Commands, start: Res<Start>) {
    let mut camera = FollowCamera::default();
    camera.set_mode(start.0);
    commands.spawn((camera, PrimaryEguiContext));
}

/// A show of something else ends a replay.
fn leave_replay(mut commands: Commands, show: Res<Show>, playback: Option<Res<Playback>>) {
    if show.is_changed() && show.mode != Mode::Replay && playback.is_some() {
        commands.remove_resource::<Playback>();
    }
}

/// The look of menus and sliders.
fn style(mut contexts: bevy_egui::EguiContexts, mut done: Local<bool>) -> Result {
    if *done {
        return Ok(());
    }
    let ctx = contexts.ctx_mut()?;
    ctx.set_visuals(egui::Visuals::dark());
    ctx.global_style_mut(|style| {
        style.interaction.selectable_labels = false;
        // the first picture of a film is whole
        style.animation_time = 0.0;
        style.visuals.window_corner_radius = egui::CornerRadius::same(10);
        style.visuals.override_text_color = Some(egui::Color32::from_rgb(236, 240, 244));
        style.visuals.selection.bg_fill = egui::Color32::from_rgb(190, 96, 20);
        style.spacing.slider_width = 140.0;
    });
    *done = true;
    Ok(())
}
