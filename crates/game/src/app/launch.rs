//! The start of the app: from a command line to a window or a video.

#[cfg(feature = "sound")]
use crate::app::audio;
use crate::app::cli::Args;
use crate::app::error::GameError;
use crate::app::features::course::leaderboard;
use crate::app::features::remote::{mailbox, mlagents, pipe};
use crate::app::game::GamePlugin;
use crate::app::pacing::FramePace;
use crate::app::settings::apply;
use crate::app::settings::file::{self as settings_file, FileNotes, Loaded, SettingsFile};
use crate::app::settings::values::Display;
use crate::app::ui::question;
use crate::app::video::{self, Video};
use crate::app::{display, interrupt};
use bevy::app::{PluginGroupBuilder, TerminalCtrlCHandlerPlugin};
use bevy::prelude::*;
use bevy::window::{WindowMode, WindowResolution};
use bevy_marathon::look::Quality;
use clap::Parser;
use marathon_physics::lanes::Isa;
use marathon_runs::text::printable;
use std::ffi::OsString;
use std::io::{BufReader, Write};
use std::process::ExitCode;
use std::time::Duration;

/// Runs the app with the words of a command line.
///
/// Returns the exit code: 0 after a normal end, 1 if the app cannot start, 2 for a wrong command line, 130 after Ctrl-C.
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
            let text = error.to_string();
            let text = printable(&text);
            if let GameError::Interrupted(_) = error {
                eprintln!("{text}");
                return ExitCode::from(interrupt::CODE);
            }
            eprintln!("error: {text}");
            ExitCode::FAILURE
        }
    }
}

/// Runs the app.
///
/// # Errors
/// If the app cannot start; nothing has been drawn then.
pub fn run(args: &Args) -> Result<(), GameError> {
    if let Some(obstacle) = Isa::best().obstacle() {
        return Err(GameError::Processor(obstacle));
    }
    if args.runs {
        let path = args.table.clone().map_or_else(leaderboard::default_path, Ok)?;
        // the reader of a pipe may have closed it
        let _ = std::io::stdout().write_all(leaderboard::listing(&path)?.as_bytes());
        return Ok(());
    }
    let mut game = GamePlugin::new(args)?;
    if let Some(out) = &args.record {
        args.video.validate()?;
        let video = Video { out, size: args.size(), fps: args.fps(), start: args.video.start, seconds: args.seconds() };
        return video::record(&video, game);
    }
    display::check_display()?;
    let software = display::check_graphics()?;
    if software {
        game.set_automatic_quality(Quality::Low);
    }
    let file = settings_file::default_path();
    let Loaded { settings, mut notes } = file.as_deref().map(settings_file::load).unwrap_or_default();
    let window = settings.clone();
    if let Err(error) = game.set_settings(settings) {
        notes.push(error.to_string());
    }
    let remote = match args.mlagents_port {
        Some(port) => {
            let (task_config, agents) = (game.task_config()?, usize::from(args.agents));
            Some(mlagents::serve(&task_config, agents, port, args.learn.threads.unwrap_or(0))?)
        }
        None if args.watch_stream => Some(pipe::watch(BufReader::new(std::io::stdin()), std::io::stdout())?),
        None => None,
    };
    interrupt::listen();
    let mut app = App::new();
    app.add_plugins(windowed(args.size(), &window.display, args.size.is_some())).add_plugins(game);
    #[cfg(feature = "sound")]
    app.add_plugins(audio::output);
    app.insert_resource(FileNotes(notes));
    if let Some(path) = file {
        app.insert_resource(SettingsFile(path));
    }
    app.add_systems(Update, (question::close, interrupt::quit));
    if args.max_fps > 0 {
        app.insert_resource(FramePace(Duration::from_secs_f64(1.0 / f64::from(args.max_fps))));
    }
    let mailbox = remote.as_ref().map(|source| source.shared.clone());
    if let Some(remote) = remote {
        app.insert_resource(remote);
    }
    match (app.run(), mailbox.and_then(|shared| mailbox::open(&shared).end.take())) {
        (_, Some(Err(text))) => Err(GameError::Outside(text)),
        (AppExit::Success, _) => Ok(()),
        _ if interrupt::requested() => Err(GameError::Interrupted(None)),
        (AppExit::Error(_), _) => {
            Err(GameError::System("the window system or the graphics driver has stopped the game; see above".into()))
        }
    }
}

/// Bevy's plugins for an app in a window.
fn windowed((width, height): (u32, u32), display: &Display, sized: bool) -> PluginGroupBuilder {
    let window = Window {
        title: "Marathon".into(),
        resolution: WindowResolution::new(width, height),
        present_mode: apply::present_mode(display.vsync),
        // a size on the command line is that of a window
        mode: if sized { WindowMode::Windowed } else { apply::window_mode(display.window) },
        ..default()
    };
    // closing the window may ask first
    let windows = WindowPlugin { primary_window: Some(window), close_when_requested: false, ..default() };
    DefaultPlugins.set(windows).disable::<TerminalCtrlCHandlerPlugin>()
}
