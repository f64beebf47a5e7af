//! Characters among walls, a lift, a mound, boxes and each other: `cargo run --release -p bevy_marathon --features window --example obstacles`
//!
//! Eight characters walk about in a yard. They run into its walls, push boxes, are lifted by a platform and cross a mound. They
//! get out of each other's way, or fall over each other and get up.

use bevy::prelude::*;
use bevy_marathon::prelude::*;
use std::f32::consts::TAU;

/// Half of the side of the yard, m.
const YARD: f32 = 5.0;
/// Characters in it.
const CHARACTERS: usize = 8;
/// Seconds after which a character takes another direction.
const WALK: f32 = 5.0;
/// Height of the mound, m.
const MOUND: f32 = 0.15;
/// Height and period of the lift, m and s.
const LIFT: (f32, f32) = (0.25, 8.0);

fn main() {
    let assets = AssetPlugin { file_path: concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets").into(), ..default() };
    App::new().add_plugins((DefaultPlugins.set(assets), yard)).run();
}

/// The yard, those in it, and what draws it.
pub fn yard(app: &mut App) {
    app.add_plugins((MarathonPlugin, LookPlugin, SceneryPlugin(Quality::Medium)))
        .insert_resource(GlobalAmbientLight { brightness: 300.0, ..default() })
        .add_systems(Startup, (build, populate))
        .add_systems(FixedUpdate, (lift, walk).before(MarathonSystems::Admit));
}

/// The platform that goes up and down.
#[derive(Component)]
struct Lift;

fn build(mut commands: Commands, mut meshes: ResMut<Assets<Mesh>>, mut materials: ResMut<Assets<StandardMaterial>>) {
    let mut solid = |half_size: Vec3, place: Vec3, color: Color| {
        let look = (Mesh3d(meshes.add(Cuboid::from_size(2.0 * half_size))), MeshMaterial3d(materials.add(color)));
        commands.spawn((Obstacle::Cuboid { half_size }, look, Transform::from_translation(place))).id()
    };
    for side in 0..4 {
        let along = if side % 2 == 0 { Vec3::X } else { Vec3::Z };
        let half_size = Vec3::new(0.1, 0.5, 0.1) + along * YARD;
        let out = Vec3::new(along.z, 0.0, along.x) * if side < 2 { YARD } else { -YARD };
        solid(half_size, out + 0.5 * Vec3::Y, Color::srgb(0.55, 0.58, 0.62));
    }
    let platform = solid(Vec3::new(1.0, 0.1, 1.0), Vec3::new(2.5, -0.1, 2.5), Color::srgb(0.25, 0.45, 0.75));
    commands.entity(platform).insert(Lift);
    // ends below the ground
    let mound = HeightField::from_fn(Vec2::splat(3.0), [25, 25], |x, z| {
        MOUND * (1.0 - (x * x + z * z) / 1.5_f32.powi(2)).max(-0.1)
    });
    let look = (Mesh3d(meshes.add(mound.mesh())), MeshMaterial3d(materials.add(Color::srgb(0.45, 0.5, 0.35))));
    commands.spawn((Obstacle::HeightField(mound), look, Transform::from_xyz(-2.5, 0.0, -2.5)));
}

fn populate(mut commands: Commands, assets: Res<AssetServer>) {
    let policy = CharacterPolicy(assets.load("policies/MarathonManController.safetensors"));
    for i in 0..CHARACTERS {
        let place = Quat::from_rotation_y(TAU * i as f32 / CHARACTERS as f32) * Vec3::new(2.5, 0.0, 0.0);
        let character = Ragdoll::agent("MarathonManController").with_seed(1, i as u64);
        let color = Tint(Color::hsl(i as f32 * 137.5 % 360.0, 0.55, 0.5));
        let restart = Restart { on_time_up: false, ..default() };
        let way = (MoveDirection::default(), Transform::from_translation(place));
        commands.spawn((character, policy.clone(), restart, Collides::ALL, color, way));
    }
    let boxes = Ragdoll::prefab(assets.load("props/boxes.xml"));
    commands.spawn((boxes, Collides::ALL));
    let eye = Transform::from_xyz(0.0, 6.0, 12.0).looking_at(Vec3::new(0.0, 0.3, 0.0), Vec3::Y);
    commands.spawn((Camera3d::default(), eye));
}

fn lift(time: Res<Time>, mut platform: Single<&mut Transform, With<Lift>>) {
    let (height, period) = LIFT;
    // its top is level with the ground at the lowest point
    platform.translation.y = -0.1 + 0.5 * height * (1.0 - (TAU * time.elapsed_secs() / period).cos());
}

/// Sends each character in a direction, and in another one after a while.
fn walk(time: Res<Time>, mut walkers: Query<(&Ragdoll, &CharacterPose, &mut MoveDirection)>) {
    for (ragdoll, pose, mut way) in &mut walkers {
        let turn = (time.elapsed_secs() / WALK).floor() + ragdoll.number as f32 * 0.618;
        let wander = Vec3::new((turn * 2.4).sin(), 0.0, (turn * 2.4).cos());
        way.direction = 0.5 * (wander - 0.2 * pose.position.with_y(0.0)).clamp_length_max(1.0);
    }
}
