//! A trained humanoid in a Bevy app: `cargo run --release -p bevy_marathon --features window --example ragdoll`
//!
//! Every plugin after [`MarathonPlugin`] is optional: your game has its own ground, light and camera.

use bevy::prelude::*;
use bevy_marathon::prelude::*;

fn main() {
    let assets = AssetPlugin { file_path: concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets").into(), ..default() };
    App::new().add_plugins((DefaultPlugins.set(assets), humanoid)).run();
}

/// A humanoid, and what draws it.
pub fn humanoid(app: &mut App) {
    app.add_plugins((MarathonPlugin, LookPlugin, SceneryPlugin(Quality::Medium), FollowCameraPlugin))
        .add_systems(Startup, spawn)
        .add_systems(Update, tell);
}

fn spawn(mut commands: Commands, assets: Res<AssetServer>) {
    let policy = CharacterPolicy(assets.load("policies/humanoid.safetensors"));
    let runner = commands.spawn((Ragdoll::agent("humanoid"), policy)).id();
    commands.spawn(FollowCamera::following(runner));
}

fn tell(mut steps: MessageReader<FootContact>, mut ended: MessageReader<EpisodeEnded>, runners: Query<&Anatomy>) {
    for step in steps.read().filter(|s| s.down) {
        let Ok(runner) = runners.get(step.ragdoll) else { continue };
        println!("step: {}", runner.feet[step.foot]);
    }
    for run in ended.read() {
        println!("{:?} after {:.1} m", run.end, run.episode.distance);
    }
}
