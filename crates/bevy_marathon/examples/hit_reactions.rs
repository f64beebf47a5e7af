//! A character that takes blows and stays up, or gets up: `cargo run --release -p bevy_marathon --example hit_reactions`
//!
//! Blows come from all sides and grow harder. Each softens the limb that it hits, and the policy keeps its balance with the
//! others. After a hard one, the character falls and gets up by itself.

use bevy::prelude::*;
use bevy_marathon::prelude::*;
use std::f32::consts::TAU;

/// Seconds between two blows.
const PAUSE: f32 = 2.0;
/// Seconds that a blow lasts.
const CONTACT: f64 = 0.05;
/// Impulses of the blows by turns, N s. The character has 82 kg.
const IMPULSES: [f32; 4] = [15.0, 25.0, 40.0, 180.0];
/// Turn from one blow's direction to the next, rad.
const TURN: f32 = 0.3 * TAU;
/// Bodies that are hit by turns.
const BODIES: [&str; 4] = ["right_larm", "left_thigh", "left_upper_arm", "torso"];

fn main() {
    let assets = AssetPlugin { file_path: concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets").into(), ..default() };
    App::new().add_plugins((DefaultPlugins.set(assets), sparring)).run();
}

/// A character, its blows, and what draws it.
pub fn sparring(app: &mut App) {
    app.add_plugins((MarathonPlugin, LookPlugin, SceneryPlugin(Quality::Medium), FollowCameraPlugin, MarksPlugin))
        .add_systems(Startup, spawn)
        .add_systems(FixedUpdate, strike.before(MarathonSystems::Admit))
        .add_systems(Update, (tell_blows, tell_falls));
}

fn spawn(mut commands: Commands, assets: Res<AssetServer>) {
    let policy = CharacterPolicy(assets.load("policies/MarathonManController.safetensors"));
    // no time limit: the fight goes on
    let restart = Restart { on_time_up: false, ..default() };
    let fighter =
        commands.spawn((Ragdoll::agent("MarathonManController"), policy, restart, HitReactions::default())).id();
    commands.spawn(FollowCamera::following(fighter));
}

/// The character stands, and is hit every two seconds.
fn strike(
    time: Res<Time>,
    fighter: Single<(Entity, &Anatomy, &mut AgentCommand)>,
    mut pushes: MessageWriter<Push>,
    (mut blows, mut waited): (Local<usize>, Local<f32>),
) {
    let (ragdoll, anatomy, mut command) = fighter.into_inner();
    if command.values().is_none() {
        command.rest();
    }
    *waited += time.delta_secs();
    if *waited < PAUSE {
        return;
    }
    *waited = 0.0;
    let (name, impulse) = (BODIES[*blows % BODIES.len()], IMPULSES[*blows % IMPULSES.len()]);
    let direction = Quat::from_rotation_y(TURN * *blows as f32) * Vec3::X;
    *blows += 1;
    let Some(body) = anatomy.model.bodies.iter().position(|body| body.name == name) else { return };
    let force = direction * impulse / CONTACT as f32;
    pushes.write(Push { ragdoll, body, force, at: None, seconds: CONTACT });
}

fn tell_blows(mut hits: MessageReader<HitReceived>, fighters: Query<&Anatomy>) {
    for hit in hits.read() {
        let Ok(fighter) = fighters.get(hit.ragdoll) else { continue };
        println!("{:.0} N s on {}", hit.impulse.length(), fighter.model.bodies[hit.body].name);
    }
}

fn tell_falls(mut falls: MessageReader<Fell>, mut rises: MessageReader<GotUp>) {
    for fall in falls.read() {
        println!("fell on its {}", if fall.prone { "front" } else { "back" });
    }
    for _ in rises.read() {
        println!("stands again");
    }
}
