//! Soft dark discs on the ground below the bodies: shadows for pictures without shadow maps.
//!
//! A disc has the outline of its body seen from above. The higher the body, the larger and fainter its disc.

use crate::axes::{place_to_game, to_game, to_physics, turn_to_game};
use crate::look::obstacle::elevation;
use crate::look::quality::Quality;
use crate::ragdoll::{Anatomy, OwnGround, Part};
use bevy::asset::RenderAssetUsages;
use bevy::light::{NotShadowCaster, NotShadowReceiver};
use bevy::prelude::*;
use bevy::render::render_resource::{Extent3d, TextureDimension, TextureFormat};
use marathon_physics::Model;
use marathon_physics::model::{Geom, GeomType};

/// Darkness below a body that touches the ground.
const DARKEST: f32 = 0.75;
/// Height at which a disc is half as dark, m.
const HALF_HEIGHT: f32 = 0.35;
/// Growth of a disc's radius with the height of its body.
const SPREAD: f32 = 0.35;
/// Steps of darkness. Discs of one step share a material.
const LEVELS: usize = 8;
/// Distance between a disc and the ground, m: less flickers, more floats.
const LIFT: f32 = 0.012;
/// Radius of a disc relative to its body: its edge is soft.
const SOFT: f32 = 1.7;
/// Most bodies of a model that have a disc each; larger models have one below their first body.
const MOST_BODIES: usize = 40;
/// Pixels along a side of the disc's texture.
const SIDE: usize = 64;

pub(super) fn plugin(app: &mut App) {
    app.add_systems(Startup, make)
        .add_systems(Update, (spawn, remove).run_if(resource_exists::<Discs>))
        .add_systems(PostUpdate, place.run_if(resource_exists::<Discs>).before(TransformSystems::Propagate));
}

/// Mesh and materials of the discs.
#[derive(Resource)]
struct Discs {
    mesh: Handle<Mesh>,
    /// From faint to dark.
    materials: [Handle<StandardMaterial>; LEVELS],
}

/// A disc, a child of the ragdoll.
#[derive(Component, Clone, Copy, Debug)]
struct Blob {
    ragdoll: Entity,
    body: usize,
    /// Center of the body's largest geom, and half of its axis, in the frame of the body.
    center: Vec3,
    axis: Vec3,
    radius: f32,
}

/// On a ragdoll: it has its discs.
#[derive(Component)]
struct HasBlobs;

fn make(
    mut commands: Commands,
    meshes: Option<ResMut<Assets<Mesh>>>,
    materials: Option<ResMut<Assets<StandardMaterial>>>,
    images: Option<ResMut<Assets<Image>>>,
) {
    let (Some(mut meshes), Some(mut materials), Some(mut images)) = (meshes, materials, images) else { return };
    let texture = images.add(soft_disc());
    let materials = std::array::from_fn(|level| {
        let share = (level + 1) as f32 / LEVELS as f32;
        materials.add(StandardMaterial {
            base_color: Color::srgba(0.05, 0.05, 0.07, DARKEST * share),
            base_color_texture: Some(texture.clone()),
            alpha_mode: AlphaMode::Blend,
            unlit: true,
            ..default()
        })
    });
    let mesh = meshes.add(Plane3d::default().mesh().size(2.0, 2.0));
    commands.insert_resource(Discs { mesh, materials });
}

/// White, opaque in the middle and clear at the edge.
pub(super) fn soft_disc() -> Image {
    let half = 0.5 * SIDE as f32;
    let mut data = Vec::with_capacity(4 * SIDE * SIDE);
    for i in 0..SIDE * SIDE {
        let at = Vec2::new((i % SIDE) as f32 + 0.5, (i / SIDE) as f32 + 0.5) / half - Vec2::ONE;
        let inside = 1.0 - at.length().min(1.0);
        let alpha = inside * inside * (3.0 - 2.0 * inside);
        data.extend([255, 255, 255, (255.0 * alpha) as u8]);
    }
    let size = Extent3d { width: SIDE as u32, height: SIDE as u32, depth_or_array_layers: 1 };
    Image::new(size, TextureDimension::D2, data, TextureFormat::Rgba8UnormSrgb, RenderAssetUsages::RENDER_WORLD)
}

/// Makes the discs of new ragdolls, at low quality alone.
fn spawn(
    mut commands: Commands,
    quality: Res<Quality>,
    discs: Res<Discs>,
    new: Query<(Entity, &Anatomy), Without<HasBlobs>>,
) {
    if *quality != Quality::Low {
        return;
    }
    for (ragdoll, anatomy) in &new {
        commands.entity(ragdoll).insert(HasBlobs);
        for (body, center, axis, radius) in outlines(&anatomy.model) {
            let looks = (Mesh3d(discs.mesh.clone()), MeshMaterial3d(discs.materials[0].clone()));
            let blob = (Name::new("blob shadow"), Blob { ragdoll, body, center, axis, radius }, Transform::default());
            commands.spawn((blob, looks, NotShadowCaster, NotShadowReceiver, ChildOf(ragdoll)));
        }
    }
}

/// The outlines that cast discs: of each moving body, its largest geom.
fn outlines(model: &Model) -> Vec<(usize, Vec3, Vec3, f32)> {
    let of = |body: usize| {
        let own = &model.bodies[body];
        let geoms = &model.geoms[own.geom_start..own.geom_start + own.geom_count];
        let rods = geoms.iter().filter_map(|geom| Some((geom, rod(geom)?)));
        let (geom, (half, radius)) = rods.max_by(|a, b| (a.1.0 + a.1.1).total_cmp(&(b.1.0 + b.1.1)))?;
        Some((body, to_game(geom.pos), turn_to_game(geom.quat) * Vec3::Y * half, radius))
    };
    let moving = (1..model.bodies.len()).filter(|body| model.bodies[*body].weld_id != 0);
    let most = if model.bodies.len() > MOST_BODIES { 1 } else { MOST_BODIES };
    moving.filter_map(of).take(most).collect()
}

/// Half the length of a geom's axis, and its radius.
fn rod(geom: &Geom) -> Option<(f32, f32)> {
    let [x, y, z] = geom.size.map(|s| s as f32);
    match geom.kind {
        GeomType::Sphere => Some((0.0, x)),
        GeomType::Capsule | GeomType::Cylinder => Some((y, x)),
        GeomType::Ellipsoid | GeomType::Box => {
            let radius = x.max(y);
            Some(((z - radius).max(0.0), radius))
        }
        GeomType::Plane | GeomType::Hfield | GeomType::Mesh => None,
    }
}

/// Removes the discs when shadow maps take their place.
fn remove(
    mut commands: Commands,
    quality: Res<Quality>,
    blobs: Query<Entity, With<Blob>>,
    with: Query<Entity, With<HasBlobs>>,
) {
    if *quality == Quality::Low {
        return;
    }
    blobs.iter().for_each(|blob| commands.entity(blob).despawn());
    for ragdoll in &with {
        commands.entity(ragdoll).remove::<HasBlobs>();
    }
}

/// Puts the discs below their bodies.
fn place(
    discs: Res<Discs>,
    ragdolls: Query<(&Anatomy, &Transform, Option<&OwnGround>), Without<Blob>>,
    parts: Query<&Transform, (With<Part>, Without<Blob>)>,
    mut blobs: Query<(&Blob, &mut Transform, &mut Visibility, &mut MeshMaterial3d<StandardMaterial>)>,
) {
    for (blob, mut transform, mut visibility, mut material) in &mut blobs {
        let Ok((anatomy, track, own)) = ragdolls.get(blob.ragdoll) else { continue };
        let part = |body: usize| anatomy.parts.get(body).and_then(|part| parts.get(*part).ok());
        let (Some(body), Some(world)) = (part(blob.body), part(0)) else { continue };
        let body = *track * *body;
        let (center, axis) = (body.transform_point(blob.center), body.rotation * blob.axis);
        let ground = height(&anatomy.model, *track * *world, own, center);
        let gap = (center.y - axis.y.abs() - blob.radius - ground).max(0.0);
        let level = (LEVELS as f32 / (1.0 + (gap / HALF_HEIGHT).powi(2))).round() as usize;
        let below = center.y > ground - blob.radius;
        visibility.set_if_neq(if below && level > 0 { Visibility::Inherited } else { Visibility::Hidden });
        let Some(level) = level.checked_sub(1) else { continue };
        material.set_if_neq(MeshMaterial3d(discs.materials[level].clone()));
        let radius = SOFT * blob.radius * (1.0 + SPREAD * gap / blob.radius.max(0.05)).min(4.0);
        let along = axis.xz();
        let shape = Transform::from_xyz(center.x, ground + LIFT, center.z)
            .with_rotation(Quat::from_rotation_y(-along.y.atan2(along.x)))
            .with_scale(Vec3::new(radius + along.length(), 1.0, radius));
        let inverse = track.compute_affine().inverse();
        *transform = Transform::from_matrix(Mat4::from(inverse) * shape.to_matrix());
    }
}

/// Height of the ground below a point, m: that of the height fields there, or else of the level ground.
fn height(model: &Model, world: Transform, own: Option<&OwnGround>, point: Vec3) -> f32 {
    let fields = model.geoms.iter().filter_map(|geom| {
        let number = geom.hfield?;
        let field = model.hfields.get(number)?;
        let place = world * place_to_game(geom.pos, geom.quat);
        let [x, y, _] = to_physics(place.compute_affine().inverse().transform_point3(point));
        let [half_x, half_y, ..] = field.size;
        let (across, along) = (field.ncol.max(2) - 1, field.nrow.max(2) - 1);
        let [u, v] = [(x / half_x + 1.0) * 0.5 * across as f64, (y / half_y + 1.0) * 0.5 * along as f64];
        if !(0.0..=across as f64).contains(&u) || !(0.0..=along as f64).contains(&v) {
            return None;
        }
        let own = own.and_then(|own| own.0.get(number)).map(Vec::as_slice);
        let at = |row: usize, column: usize| elevation(field, own, row.min(field.nrow - 1), column.min(field.ncol - 1));
        let (row, column) = (v as usize, u as usize);
        let (p, q) = ((v.fract()) as f32, (u.fract()) as f32);
        let low = at(row, column) * (1.0 - q) + at(row, column + 1) * q;
        let high = at(row + 1, column) * (1.0 - q) + at(row + 1, column + 1) * q;
        Some(place.translation.y + low * (1.0 - p) + high * p)
    });
    let level = model.geoms.iter().any(|geom| geom.kind == GeomType::Plane);
    fields.reduce(f32::max).unwrap_or(if level { 0.0 } else { f32::MIN }).max(if level { 0.0 } else { f32::MIN })
}
