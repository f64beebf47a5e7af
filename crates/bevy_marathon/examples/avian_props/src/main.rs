//! Another physics engine beside this one: a hopper runs into a wall of avian's boxes, and both sides feel it.
//!
//! `cargo run --release` in this folder opens a window.
//!
//! For avian, each geom of the ragdoll is a kinematic body that is moved to where the geom is; what avian's contacts do to
//! such a body goes back to the ragdoll as a [`Push`]. [`PropsPlugin`] is all that takes.

use avian3d::prelude::*;
use bevy::prelude::*;
use bevy_marathon::axes::place_to_game;
use bevy_marathon::prelude::*;
use marathon_physics::model::{Geom, GeomType};
use std::collections::HashMap;

/// Where the wall stands, m.
const WALL: f32 = 3.0;
/// Edge of a box, m, and its density, kg/m^3.
const EDGE: f32 = 0.3;
const DENSITY: f32 = 30.0;
/// Speed above which a body counts as moved to a new place at once, m/s.
const JUMP: f32 = 30.0;

/// Lets avian's bodies and ragdolls touch each other.
struct PropsPlugin;

impl Plugin for PropsPlugin {
    fn build(&self, app: &mut App) {
        app.add_plugins(PhysicsPlugins::default())
            .add_systems(Update, cast_shadows)
            .add_systems(FixedUpdate, follow.after(MarathonSystems::Report))
            .add_systems(FixedPostUpdate, push_back.in_set(PhysicsSystems::Last));
    }
}

/// Avian's copy of a geom: a kinematic body that follows a part.
#[derive(Component)]
struct Shadow {
    ragdoll: Entity,
    body: usize,
    /// Of the geom on the part.
    place: Transform,
}

/// Makes the shadows of a ragdoll that has entered the simulation.
fn cast_shadows(mut commands: Commands, new: Query<(Entity, &Anatomy), Added<Anatomy>>) {
    for (ragdoll, anatomy) in &new {
        for geom in &anatomy.model.geoms {
            let Some(collider) = collider(geom) else { continue };
            let place = place_to_game(geom.pos, geom.quat);
            let shadow = Shadow { ragdoll, body: geom.body, place };
            // out of everybody's way until it follows
            commands.spawn((shadow, RigidBody::Kinematic, collider, Transform::from_xyz(0.0, -100.0, 0.0)));
        }
    }
}

/// The shape of a geom. Shapes that have an axis have it along y in the game.
fn collider(geom: &Geom) -> Option<Collider> {
    let [a, b, c] = geom.size.map(|x| x as f32);
    match geom.kind {
        GeomType::Sphere => Some(Collider::sphere(a)),
        GeomType::Capsule => Some(Collider::capsule(a, 2.0 * b)),
        GeomType::Cylinder => Some(Collider::cylinder(a, 2.0 * b)),
        GeomType::Box => Some(Collider::cuboid(2.0 * a, 2.0 * c, 2.0 * b)),
        GeomType::Ellipsoid | GeomType::Plane | GeomType::Hfield | GeomType::Mesh => None,
    }
}

/// Takes the shadows to where their parts are at the end of the tick: at the velocity that leads there, which is what boxes
/// are hit with. They go with their ragdoll.
fn follow(
    mut commands: Commands,
    time: Res<Time>,
    marathon: Res<Marathon>,
    ragdolls: Query<(&RagdollState, &Track)>,
    mut shadows: Query<(Entity, &Shadow, &mut Position, &mut Rotation, &mut LinearVelocity, &mut AngularVelocity)>,
) {
    let rate = 1.0 / time.delta_secs();
    let mut known: HashMap<Entity, Vec<Transform>> = HashMap::new();
    for (entity, shadow, mut position, mut rotation, mut velocity, mut spin) in &mut shadows {
        let Ok((state, track)) = ragdolls.get(shadow.ragdoll) else {
            commands.entity(entity).despawn();
            continue;
        };
        let places = || marathon.places(state, time.elapsed()).unwrap_or_default();
        let Some(part) = known.entry(shadow.ragdoll).or_insert_with(places).get(shadow.body) else { continue };
        let goal = track.place() * *part * shadow.place;
        velocity.0 = (goal.translation - position.0) * rate;
        spin.0 = (goal.rotation * rotation.0.inverse()).to_scaled_axis() * rate;
        // a new episode starts in another place; that jump must not hit anything
        if velocity.0.length() > JUMP {
            (position.0, rotation.0) = (goal.translation, goal.rotation);
            (velocity.0, spin.0) = (Vec3::ZERO, Vec3::ZERO);
        }
    }
}

/// Gives the ragdolls what avian's contacts did to their shadows.
fn push_back(
    collisions: Collisions,
    shadows: Query<&Shadow>,
    ragdolls: Query<&Anatomy>,
    masses: Query<&ComputedMass>,
    mut pushes: MessageWriter<Push>,
) {
    for pair in collisions.iter() {
        let Some(contact) = pair.find_deepest_contact() else { continue };
        // normals point from the first to the second
        for (ours, other, sign) in [(pair.collider1, pair.body2, -1.0), (pair.collider2, pair.body1, 1.0)] {
            let Ok(&Shadow { ragdoll, body, .. }) = shadows.get(ours) else { continue };
            let Ok(anatomy) = ragdolls.get(ragdoll) else { continue };
            // for avian the shadow has no end of mass; the part has one, and takes no more than what two such masses exchange
            let lightness = other.and_then(|other| masses.get(other).ok()).map_or(0.0, |mass| mass.inverse());
            let lightness = lightness + anatomy.model.bodies[body].invweight0[0] as f32;
            let most = (-contact.normal_speed).max(0.0) / lightness;
            let impulse = sign * pair.total_normal_impulse().clamp_length_max(most);
            if impulse != Vec3::ZERO {
                let (force, at) = (impulse / anatomy.dt as f32, Some(contact.point));
                pushes.write(Push { ragdoll, body, force, at, seconds: anatomy.dt });
            }
        }
    }
}

/// A box of the wall.
#[derive(Component)]
struct Brick;

/// A wall of twelve boxes on avian's own ground.
fn build_wall(mut commands: Commands) {
    commands.spawn((RigidBody::Static, Collider::half_space(Vec3::Y)));
    for i in 0..12 {
        // three abreast, four high
        let (across, up) = ((i % 3) as f32 - 1.0, (i / 3) as f32 + 0.5);
        let at = Vec3::new(WALL, EDGE * up, EDGE * across);
        let body = (RigidBody::Dynamic, Collider::cuboid(EDGE, EDGE, EDGE), ColliderDensity(DENSITY));
        commands.spawn((Brick, body, Transform::from_translation(at)));
    }
}

/// A hopper that comes running.
#[cfg(feature = "window")]
fn spawn_hopper(mut commands: Commands, server: Res<AssetServer>) {
    let policy = CharacterPolicy(server.load("policies/hopper.safetensors"));
    commands.spawn((Ragdoll::agent("hopper"), policy));
}

fn assets() -> AssetPlugin {
    AssetPlugin { file_path: concat!(env!("CARGO_MANIFEST_DIR"), "/../../../../assets").into(), ..default() }
}

#[cfg(feature = "window")]
fn main() -> AppExit {
    App::new()
        .add_plugins((DefaultPlugins.set(assets()), MarathonPlugin, PropsPlugin))
        .add_plugins((LookPlugin, SceneryPlugin(Quality::Medium), FollowCameraPlugin))
        .add_systems(Startup, (build_wall, spawn_hopper))
        .add_systems(Update, (paint, video))
        .run()
}

#[cfg(not(feature = "window"))]
fn main() {
    eprintln!("nothing to see without the feature `window`");
    std::process::exit(2);
}

/// Makes the boxes visible.
#[cfg(feature = "window")]
fn paint(
    mut commands: Commands,
    new: Query<Entity, Added<Brick>>,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<StandardMaterial>>,
) {
    for brick in &new {
        let mesh = Mesh3d(meshes.add(Cuboid::from_length(EDGE)));
        commands.entity(brick).insert((mesh, MeshMaterial3d(materials.add(Color::srgb(0.75, 0.35, 0.2)))));
    }
}

/// Points a camera at the runner.
#[cfg(feature = "window")]
fn video(mut commands: Commands, new: Query<Entity, Added<Ragdoll>>) {
    for runner in &new {
        commands.spawn(FollowCamera::following(runner));
    }
}

#[cfg(test)]
mod tests;
