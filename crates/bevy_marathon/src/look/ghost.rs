//! The motion clip that a ragdoll follows: a ghost that moves as the clip does, and how far each part is from it, in color.

use crate::axes::{place_to_game, to_game};
use crate::look::body::{Shape, Wardrobe, visible};
use crate::marathon::{Marathon, RagdollState};
use crate::plugin::MarathonSystems;
use crate::ragdoll::Anatomy;
use crate::track::Track;
use bevy::light::NotShadowCaster;
use bevy::prelude::*;
use marathon_physics::Model;
use marathon_physics::model::GeomType;
use std::collections::HashMap;
use std::time::Duration;

/// Color of a ghost, sRGB, and how much of what is behind it it hides.
const GHOST: [f32; 4] = [0.36, 0.72, 1.0, 0.42];
/// Size of a ghost's parts: within those of a ragdoll that moves exactly as its clip, none is seen.
const GHOST_SIZE: f32 = 0.98;
/// Distance from the clip at which a part is red, m.
const FAR: f32 = 0.3;
/// Colors between near and far.
const SHADES: usize = 24;

/// Draws [`Ghost`]s and [`ErrorColors`].
#[derive(Clone, Copy, Debug, Default)]
pub struct GhostPlugin;

impl Plugin for GhostPlugin {
    fn build(&self, app: &mut App) {
        let shown = RunFixedMainLoopSystems::AfterFixedMainLoop;
        app.register_type::<Ghost>().register_type::<ErrorColors>().register_type::<ErrorPalette>();
        app.init_resource::<ErrorPalette>();
        app.add_systems(RunFixedMainLoop, (haunt, color).in_set(shown).after(MarathonSystems::Show));
    }
}

/// On a ragdoll whose task follows a motion clip: draws the clip as a see-through body, this far from where the clip is in the
/// axes of the ragdoll's track, m.
#[derive(Component, Clone, Copy, Debug, Default, PartialEq, Reflect)]
#[reflect(Component, Default, Clone, Debug, PartialEq)]
pub struct Ghost(pub Vec3);

/// On a ragdoll whose task follows a motion clip: its parts are green where the clip has them, and red from 0.3 m on.
#[derive(Component, Clone, Copy, Debug, Default, PartialEq, Eq, Reflect)]
#[reflect(Component, Default, Clone, Debug, PartialEq)]
pub struct ErrorColors;

/// The colors of [`ErrorColors`], from a part that is where the clip has it to one that is far away.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq, Eq, Reflect)]
#[reflect(Resource, Default, Clone, Debug, PartialEq)]
pub enum ErrorPalette {
    /// From green over yellow to red.
    #[default]
    GreenToRed,
    /// From blue over gray to orange, which people with color blindness tell apart.
    BlueToOrange,
}

impl ErrorPalette {
    /// The color of a distance, 0 to 1.
    fn color(self, far: f32) -> Color {
        match self {
            ErrorPalette::GreenToRed => {
                Color::srgb((2.0 * far).min(1.0) * 0.86, (2.0 - 2.0 * far).min(1.0) * 0.68, 0.10)
            }
            ErrorPalette::BlueToOrange => {
                let [near, far_out, middle] =
                    [Vec3::new(0.0, 0.32, 0.75), Vec3::new(0.90, 0.45, 0.0), Vec3::splat(0.72)];
                let [r, g, b] = match far < 0.5 {
                    true => near.lerp(middle, 2.0 * far),
                    false => middle.lerp(far_out, 2.0 * far - 1.0),
                }
                .to_array();
                Color::srgb(r, g, b)
            }
        }
    }
}

/// The body of a ghost.
#[derive(Component)]
struct GhostBody {
    ragdoll: Entity,
    /// By body of the model.
    parts: Vec<Entity>,
}

/// How far the center of each geom of a model is from where a clip has it, m, by the places of the bodies.
pub fn part_errors(model: &Model, places: &[Transform], clip: &[Transform]) -> Vec<f32> {
    let error = |body: usize, center: Vec3| {
        let at = |places: &[Transform]| places.get(body).map(|place| place.transform_point(center));
        at(places).zip(at(clip)).map_or(0.0, |(a, b)| a.distance(b))
    };
    model.geoms.iter().map(|geom| error(geom.body, to_game(geom.pos))).collect()
}

/// The time that a frame shows.
fn now(time: &Time<Fixed>) -> Duration {
    time.elapsed() + time.overstep()
}

/// Makes, moves and removes ghosts.
#[expect(clippy::too_many_arguments, reason = "a system names what it uses")]
fn haunt(
    mut commands: Commands,
    marathon: Res<Marathon>,
    time: Res<Time<Fixed>>,
    mut wardrobe: Option<ResMut<Wardrobe>>,
    mut meshes: Option<ResMut<Assets<Mesh>>>,
    mut materials: Option<ResMut<Assets<StandardMaterial>>>,
    ragdolls: Query<(Entity, &RagdollState, &Anatomy, (&Ghost, &Track))>,
    bodies: Query<(Entity, &GhostBody)>,
    mut transforms: Query<&mut Transform>,
) {
    for (entity, body) in &bodies {
        if !ragdolls.contains(body.ragdoll) {
            commands.entity(entity).despawn();
        }
    }
    for (ragdoll, state, anatomy, (ghost, track)) in &ragdolls {
        let at = track.inverse() * Transform::from_translation(ghost.0);
        let Some(places) = marathon.clip_places(state, now(&time)) else { continue };
        if let Some((root, body)) = bodies.iter().find(|(_, body)| body.ragdoll == ragdoll) {
            if let Ok(mut transform) = transforms.get_mut(root) {
                *transform = at;
            }
            for (part, place) in body.parts.iter().zip(places) {
                if let Ok(mut transform) = transforms.get_mut(*part) {
                    *transform = place;
                }
            }
            continue;
        }
        let (Some(wardrobe), Some(meshes), Some(materials)) = (&mut wardrobe, &mut meshes, &mut materials) else {
            return;
        };
        let name = (Name::new("ghost"), at, Visibility::default());
        let root = commands.spawn((name, ChildOf(ragdoll))).id();
        let part = |place: Transform| commands.spawn((place, Visibility::default(), ChildOf(root))).id();
        let parts: Vec<Entity> = places.into_iter().map(part).collect();
        let [r, g, b, alpha] = GHOST;
        let material = materials.add(StandardMaterial {
            base_color: Color::srgba(r, g, b, alpha),
            perceptual_roughness: 0.9,
            reflectance: 0.1,
            alpha_mode: AlphaMode::Blend,
            ..default()
        });
        let model = &*anatomy.model;
        for (_, geom) in visible(model).filter(|(_, geom)| model.bodies[geom.body].weld_id != 0) {
            if matches!(geom.kind, GeomType::Plane | GeomType::Mesh | GeomType::Hfield) {
                continue;
            }
            let mesh = wardrobe.shape(meshes, geom.kind, geom.size.map(|x| x as f32));
            let place = place_to_game(geom.pos, geom.quat).with_scale(Vec3::splat(GHOST_SIZE));
            let looks = (Mesh3d(mesh), MeshMaterial3d(material.clone()), NotShadowCaster);
            commands.spawn((looks, place, ChildOf(parts[geom.body])));
        }
        commands.entity(root).insert(GhostBody { ragdoll, parts });
    }
}

/// Colors parts by their errors, or as they were.
fn color(
    marathon: Res<Marathon>,
    (time, palette): (Res<Time<Fixed>>, Res<ErrorPalette>),
    mut materials: Option<ResMut<Assets<StandardMaterial>>>,
    mut ramp: Local<Vec<Handle<StandardMaterial>>>,
    ragdolls: Query<(Entity, &RagdollState, &Anatomy), With<ErrorColors>>,
    mut shapes: Query<(&Shape, &mut MeshMaterial3d<StandardMaterial>)>,
) {
    let Some(materials) = &mut materials else { return };
    if ramp.is_empty() || palette.is_changed() {
        *ramp = (0..SHADES).map(|i| materials.add(shade(*palette, i as f32 / (SHADES - 1) as f32))).collect();
    }
    let mut errors: HashMap<Entity, Vec<f32>> = HashMap::new();
    for (ragdoll, state, anatomy) in &ragdolls {
        let (places, clip) = (marathon.places(state, now(&time)), marathon.clip_places(state, now(&time)));
        if let (Some(places), Some(clip)) = (places, clip) {
            errors.insert(ragdoll, part_errors(&anatomy.model, &places, &clip));
        }
    }
    for (shape, mut material) in &mut shapes {
        let error = errors.get(&shape.ragdoll).and_then(|errors| errors.get(shape.geom));
        let wanted = error.map_or(&shape.own, |error| &ramp[((error / FAR).min(1.0) * (SHADES - 1) as f32) as usize]);
        if material.0 != *wanted {
            material.0 = wanted.clone();
        }
    }
}

/// The material of a distance, 0 to 1.
fn shade(palette: ErrorPalette, far: f32) -> StandardMaterial {
    StandardMaterial { base_color: palette.color(far), perceptual_roughness: 0.5, reflectance: 0.4, ..default() }
}
