//! A server: thirty-two hoppers that are not drawn. No window, no graphics card, no renderer in the build:
//!
//! `cargo run --release -p bevy_marathon --example headless_server`
//!
//! A server reads messages and states. Its frames can have any length.

use bevy::app::ScheduleRunnerPlugin;
use bevy::prelude::*;
use bevy_marathon::prelude::*;
use std::time::Duration;

fn main() -> AppExit {
    let seconds = std::env::args().nth(1).and_then(|s| s.parse().ok()).unwrap_or(10.0);
    server(seconds).run()
}

/// A server that stops after some seconds.
pub fn server(seconds: f32) -> App {
    let tick = Duration::from_millis(20);
    let assets = AssetPlugin { file_path: concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets").into(), ..default() };
    let mut app = App::new();
    app.add_plugins((
        MinimalPlugins.set(ScheduleRunnerPlugin::run_loop(tick)),
        TransformPlugin,
        assets,
        MarathonPlugin,
    ))
    .insert_resource(Ends(seconds))
    .add_systems(Startup, spawn)
    .add_systems(Update, (tell_falls, end));
    app
}

/// Seconds after which the server stops.
#[derive(Resource)]
struct Ends(f32);

fn spawn(mut commands: Commands, assets: Res<AssetServer>) {
    let policy: Handle<PolicyAsset> = assets.load("policies/hopper.safetensors");
    for i in 0..32 {
        commands.spawn((Ragdoll::agent("hopper").with_seed(1, i), CharacterPolicy(policy.clone())));
    }
}

fn tell_falls(mut ended: MessageReader<EpisodeEnded>) {
    for EpisodeEnded { ragdoll, end, episode } in ended.read() {
        println!("{ragdoll}: {end:?} after {:.1} s and {:.1} m", episode.seconds, episode.distance);
    }
}

fn end(time: Res<Time>, ends: Res<Ends>, hoppers: Query<&Episode>, mut exit: MessageWriter<AppExit>) {
    if time.elapsed_secs() > ends.0 {
        let farthest = hoppers.iter().map(|e| e.distance).fold(0.0, f64::max);
        println!("the farthest is at {farthest:.1} m");
        exit.write(AppExit::Success);
    }
}
