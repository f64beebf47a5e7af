//! A crowd: 64 characters, each on its own way. `cargo run --release -p bevy_marathon --features window --example crowd`
//!
//! Policies far from the camera decide at half the rate, and characters farther away sleep. Hold the space key to send all of
//! them to the middle.

use bevy::prelude::*;
use bevy_marathon::prelude::*;
use std::f32::consts::TAU;

/// Characters along a side of the square.
const SIDE: usize = 8;
/// Distance between them, m.
const SPACING: f32 = 3.0;
/// Seconds after which a character takes another direction.
const WALK: f32 = 4.0;

fn main() {
    let assets = AssetPlugin { file_path: concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets").into(), ..default() };
    App::new().add_plugins((DefaultPlugins.set(assets), crowd)).run();
}

/// The crowd, and what draws it.
pub fn crowd(app: &mut App) {
    app.add_plugins((MarathonPlugin, LookPlugin, SceneryPlugin(Quality::Medium)))
        .insert_resource(GlobalAmbientLight { brightness: 300.0, ..default() })
        .add_systems(Startup, spawn)
        .add_systems(FixedUpdate, walk.before(MarathonSystems::Admit));
}

fn spawn(mut commands: Commands, assets: Res<AssetServer>) {
    let policy = CharacterPolicy(assets.load("policies/MarathonManController.safetensors"));
    for i in 0..SIDE * SIDE {
        let [x, z] = [i % SIDE, i / SIDE].map(|k| SPACING * (k as f32 - (SIDE - 1) as f32 / 2.0));
        let character = Ragdoll::agent("MarathonManController").with_seed(1, i as u64);
        let color = Tint(Color::hsl(i as f32 * 137.5 % 360.0, 0.55, 0.5));
        commands.spawn((character, policy.clone(), MoveDirection::default(), color, Transform::from_xyz(x, 0.0, z)));
    }
    let eye = Transform::from_xyz(0.0, 6.0, 22.0).looking_at(Vec3::new(0.0, 0.5, 0.0), Vec3::Y);
    commands.spawn((Camera3d::default(), eye, LodByDistance { half_rate: 20.0, asleep: 60.0, ..default() }));
}

/// Sends each character in a direction, and in another one after a while.
fn walk(
    time: Res<Time>,
    keys: Option<Res<ButtonInput<KeyCode>>>,
    mut walkers: Query<(&Ragdoll, &Transform, &mut MoveDirection)>,
) {
    let gather = keys.is_some_and(|keys| keys.pressed(KeyCode::Space));
    for (ragdoll, place, mut way) in &mut walkers {
        let turn = (time.elapsed_secs() / WALK).floor() + ragdoll.number as f32 * 0.618;
        let wander = Vec3::new((turn * 2.4).sin(), 0.0, (turn * 2.4).cos()) * (0.3 + 0.3 * (turn * TAU).sin());
        let home = -place.translation;
        way.direction = if gather { 0.3 * home } else { wander + 0.02 * home };
    }
}
