//! Dust at footsteps: a few puffs that rise, grow and fade.
//!
//! A puff is a soft disc that faces the camera. Puffs are pooled: the same entities are used again, so that a crowd makes no more
//! than [`MOST`] of them.

use crate::look::blobs::soft_disc;
use crate::look::quality::Quality;
use crate::messages::FootContact;
use crate::ragdoll::Episode;
use bevy::light::{NotShadowCaster, NotShadowReceiver};
use bevy::prelude::*;

/// Most puffs at a time.
const MOST: usize = 48;
/// Puffs of a step, and the seconds that a puff lasts.
const PER_STEP: usize = 3;
const LIFE: f32 = 0.55;
/// Radius of a puff at its start and at its end, m.
const RADIUS: [f32; 2] = [0.03, 0.16];
/// Opacity at the start.
const OPACITY: f32 = 0.30;
/// Steps of opacity. Puffs of one step share a material.
const LEVELS: usize = 6;
/// Speed of a character below which its steps raise no dust, m/s.
const SLOWEST: f32 = 1.2;
/// Color of dust, sRGB.
const DUST: [f32; 3] = [0.80, 0.74, 0.64];

/// Raises dust where feet touch the ground, unless the quality is low.
#[derive(Clone, Copy, Debug, Default)]
pub struct DustPlugin;

impl Plugin for DustPlugin {
    fn build(&self, app: &mut App) {
        app.add_systems(Startup, make)
            .add_systems(Update, (raise, drift).chain().run_if(resource_exists::<Puffs>))
            .add_systems(Update, settle.run_if(resource_exists_and_changed::<Quality>).after(drift));
    }
}

/// Mesh and materials of the puffs, and the next puff to be used again.
#[derive(Resource)]
struct Puffs {
    mesh: Handle<Mesh>,
    /// From faint to dense.
    materials: [Handle<StandardMaterial>; LEVELS],
    next: usize,
}

/// A puff.
#[derive(Component, Clone, Copy, Debug)]
struct Puff {
    number: usize,
    velocity: Vec3,
    /// Seconds since it was raised.
    age: f32,
}

fn make(
    mut commands: Commands,
    meshes: Option<ResMut<Assets<Mesh>>>,
    materials: Option<ResMut<Assets<StandardMaterial>>>,
    images: Option<ResMut<Assets<Image>>>,
) {
    let (Some(mut meshes), Some(mut materials), Some(mut images)) = (meshes, materials, images) else { return };
    let texture = images.add(soft_disc());
    let [r, g, b] = DUST;
    let materials = std::array::from_fn(|level| {
        let share = (level + 1) as f32 / LEVELS as f32;
        materials.add(StandardMaterial {
            base_color: Color::srgba(r, g, b, OPACITY * share),
            base_color_texture: Some(texture.clone()),
            alpha_mode: AlphaMode::Blend,
            unlit: true,
            ..default()
        })
    });
    commands.insert_resource(Puffs { mesh: meshes.add(Rectangle::new(2.0, 2.0)), materials, next: 0 });
}

/// Raises puffs at the feet that touch the ground.
fn raise(
    mut commands: Commands,
    mut puffs: ResMut<Puffs>,
    quality: Option<Res<Quality>>,
    mut contacts: MessageReader<FootContact>,
    ragdolls: Query<&Episode>,
    mut old: Query<(&mut Puff, &mut Transform)>,
) {
    if quality.is_none_or(|quality| *quality == Quality::Low) {
        contacts.clear();
        return;
    }
    for contact in contacts.read().filter(|contact| contact.down) {
        let Ok(episode) = ragdolls.get(contact.ragdoll) else { continue };
        if episode.speed.abs() < SLOWEST || episode.down {
            continue;
        }
        for i in 0..PER_STEP {
            let number = puffs.next;
            puffs.next = (number + 1) % MOST;
            // around the foot in even steps, which the order of the puffs turns
            let (sin, cos) = (number as f32 * 2.4 + i as f32).sin_cos();
            let puff = Puff { number, velocity: Vec3::new(0.35 * cos, 0.30, 0.35 * sin), age: 0.0 };
            let place = Transform::from_translation(contact.point + 0.04 * Vec3::Y).with_scale(Vec3::splat(RADIUS[0]));
            if let Some((mut old, mut transform)) = old.iter_mut().find(|(old, _)| old.number == number) {
                (*old, *transform) = (puff, place);
                continue;
            }
            let looks = (Mesh3d(puffs.mesh.clone()), MeshMaterial3d(puffs.materials[LEVELS - 1].clone()));
            commands.spawn((Name::new("dust"), puff, place, looks, NotShadowCaster, NotShadowReceiver));
        }
    }
}

/// Puffs rise, grow, fade, and face the camera.
fn drift(
    time: Res<Time>,
    puffs: Res<Puffs>,
    cameras: Query<&Transform, (With<Camera3d>, Without<Puff>)>,
    mut old: Query<(&mut Puff, &mut Transform, &mut Visibility, &mut MeshMaterial3d<StandardMaterial>)>,
) {
    let turn = cameras.iter().next().map_or(Quat::IDENTITY, |camera| camera.rotation);
    let dt = time.delta_secs();
    for (mut puff, mut transform, mut visibility, mut material) in &mut old {
        puff.age += dt;
        let share = (puff.age / LIFE).min(1.0);
        visibility.set_if_neq(if share < 1.0 { Visibility::Inherited } else { Visibility::Hidden });
        if share >= 1.0 {
            continue;
        }
        // air stops it
        puff.velocity *= (-4.0 * dt).exp();
        transform.translation += puff.velocity * dt;
        transform.scale = Vec3::splat(RADIUS[0] + (RADIUS[1] - RADIUS[0]) * share.sqrt());
        transform.rotation = turn;
        let level = ((1.0 - share) * LEVELS as f32).ceil() as usize;
        material.set_if_neq(MeshMaterial3d(puffs.materials[level.clamp(1, LEVELS) - 1].clone()));
    }
}

/// Low quality has no dust.
fn settle(mut commands: Commands, quality: Res<Quality>, puffs: Query<Entity, With<Puff>>) {
    if *quality == Quality::Low {
        puffs.iter().for_each(|puff| commands.entity(puff).despawn());
    }
}
