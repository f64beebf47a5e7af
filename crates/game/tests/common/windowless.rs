//! The game as its command line makes it, without a window and without pictures.

use bevy::prelude::*;
use bevy::render::RenderPlugin;
use bevy::render::settings::WgpuSettings;
use bevy::time::TimeUpdateStrategy;
use bevy::window::ExitCondition;
use bevy::winit::WinitPlugin;
use clap::Parser;
use marathon_game::app::{Args, Bindings, GamePlugin, LoadScenario, Scenario};
use std::time::Duration;

/// The game with these words on its command line, after its first frames, each of which is this long. `add` adds what a test
/// needs before the first frame. All keys have their defaults, whatever the user has bound.
pub fn game(words: &[&str], frame: Duration, add: impl FnOnce(&mut App)) -> App {
    game_in(None, words, frame, add)
}

/// The same in a window that nothing shows.
#[allow(dead_code, reason = "not every test needs it")]
pub fn game_in(window: Option<Window>, words: &[&str], frame: Duration, add: impl FnOnce(&mut App)) -> App {
    let args = Args::parse_from([&["marathon-game"], words].concat());
    let mut app = App::new();
    let window = WindowPlugin { primary_window: window, exit_condition: ExitCondition::DontExit, ..default() };
    let render = RenderPlugin { render_creation: WgpuSettings { backends: None, ..default() }.into(), ..default() };
    let plugins = DefaultPlugins.set(window).set(render).disable::<WinitPlugin>().disable::<bevy::log::LogPlugin>();
    app.add_plugins(plugins).add_plugins(GamePlugin::new(&args).expect("the command line makes sense"));
    app.insert_resource(TimeUpdateStrategy::ManualDuration(frame));
    add(&mut app);
    app.finish();
    app.cleanup();
    app.update();
    app.insert_resource(Bindings::default());
    frames(&mut app, 3);
    app
}

/// Changes the scenario and loads it.
#[allow(dead_code, reason = "not every test needs it")]
pub fn load(app: &mut App, change: impl FnOnce(&mut Scenario)) {
    change(&mut app.world_mut().resource_mut::<Scenario>());
    app.world_mut().write_message(LoadScenario);
}

/// So many frames.
pub fn frames(app: &mut App, n: usize) {
    (0..n).for_each(|_| app.update());
}
