//! A character between animation and physics: `cargo run --release -p bevy_marathon --features window --example animation`
//!
//! A motion clip moves it, until a ball's worth of momentum hits it. Then it is a ragdoll whose policy keeps its balance or gets
//! it up, and it goes back to its clip.

use bevy::prelude::*;
use bevy_marathon::prelude::*;
use std::f32::consts::TAU;

/// Seconds between two blows.
const PAUSE: f32 = 6.0;
/// Impulses of the blows by turns, N s. The character has 82 kg.
const IMPULSES: [f32; 3] = [40.0, 80.0, 180.0];
/// Seconds that the physics has the character if it does not fall.
const RECOVERY: f32 = 1.5;

fn main() {
    let assets = AssetPlugin { file_path: concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets").into(), ..default() };
    App::new().add_plugins((DefaultPlugins.set(assets), stroll)).run();
}

/// A character on a stroll, its blows, and what draws it.
pub fn stroll(app: &mut App) {
    app.add_plugins((MarathonPlugin, LookPlugin, SceneryPlugin(Quality::Medium), FollowCameraPlugin))
        .add_systems(Startup, spawn)
        .add_systems(FixedUpdate, strike.before(MarathonSystems::Admit))
        .add_systems(FixedUpdate, (leave, recover).chain().after(MarathonSystems::Report));
}

/// The clip of the stroll.
#[derive(Resource)]
struct Walk(PlayClip);

/// The physics has the character since this time, s.
#[derive(Component)]
struct Hit(f32);

fn spawn(mut commands: Commands, assets: Res<AssetServer>) {
    let walk = PlayClip::new(assets.load("motions/marathon_man/walk.motion"));
    let policy = CharacterPolicy(assets.load("policies/MarathonManController.safetensors"));
    let restart = Restart { on_time_up: false, ..default() };
    let ragdoll = Ragdoll::agent("MarathonManController");
    let walker = commands.spawn((ragdoll, policy, restart, MoveDirection::default(), walk.clone())).id();
    commands.spawn(FollowCamera::following(walker));
    commands.insert_resource(Walk(walk));
}

fn strike(
    time: Res<Time>,
    walker: Single<(Entity, &Anatomy)>,
    mut pushes: MessageWriter<Push>,
    (mut blows, mut waited): (Local<usize>, Local<f32>),
) {
    *waited += time.delta_secs();
    if *waited < PAUSE {
        return;
    }
    *waited = 0.0;
    let (ragdoll, anatomy) = *walker;
    let impulse = IMPULSES[*blows % IMPULSES.len()];
    let direction = Quat::from_rotation_y(0.3 * TAU * *blows as f32) * Vec3::X;
    let body = anatomy.model.bodies.iter().position(|body| body.name == "torso").unwrap_or(1);
    // the push lasts: the first step of it ends the clip
    let seconds = 0.1;
    pushes.write(Push { ragdoll, body, force: direction * impulse / seconds as f32, at: None, seconds });
    *blows += 1;
}

/// A blow ends the clip.
fn leave(mut commands: Commands, time: Res<Time>, mut hits: MessageReader<HitReceived>) {
    for hit in hits.read() {
        commands.entity(hit.ragdoll).remove::<PlayClip>().insert(Hit(time.elapsed_secs()));
    }
}

/// A character that stands again goes on walking.
fn recover(mut commands: Commands, time: Res<Time>, walk: Res<Walk>, hit: Query<(Entity, &Hit, &RagdollMode)>) {
    for (entity, since, mode) in &hit {
        if *mode == RagdollMode::Powered && time.elapsed_secs() - since.0 > RECOVERY {
            commands.entity(entity).remove::<Hit>().insert(walk.0.clone());
        }
    }
}
