//! Ground, sky and sun.

use crate::look::quality::{HORIZON, Quality};
use crate::look::{FollowCamera, blobs, effects, ground, lens, meters};
use crate::ragdoll::Anatomy;
use bevy::asset::RenderAssetUsages;
use bevy::light::{
    CascadeShadowConfig, CascadeShadowConfigBuilder, DirectionalLightShadowMap, NotShadowCaster, NotShadowReceiver,
};
use bevy::math::Affine2;
use bevy::mesh::{Indices, PrimitiveTopology};
use bevy::prelude::*;
use bevy::render::renderer::RenderAdapterInfo;
use marathon_physics::model::GeomType;
use std::f32::consts::PI;

/// Color of the sky overhead.
const ZENITH: [f32; 3] = [0.25, 0.48, 0.78];
/// Where the sun stands.
const SUN: Vec3 = Vec3::new(-0.45, 0.80, 0.55);
/// Where the light comes from that draws an edge around characters, opposite to the sun.
const RIM: Vec3 = Vec3::new(0.6, 0.35, -0.7);
/// Illuminance of the sun, and of that light, lux.
const ILLUMINANCE: [f32; 2] = [8_500.0, 2_400.0];
/// Half the side of the ground, m; it follows the camera.
const REACH: f32 = 320.0;
/// Depth of the ground below figures that run on height fields alone, m: more than a course goes down.
const DEEP: f32 = 6.0;
/// Radius of the sky, m.
const SKY: f32 = 600.0;

/// A checkered ground at height zero without end, meters on it beside the track of whom a camera follows, a sky, a sun.
#[derive(Clone, Copy, Debug, Default)]
pub struct SceneryPlugin(pub Quality);

impl Plugin for SceneryPlugin {
    fn build(&self, app: &mut App) {
        app.insert_resource(self.0);
        effects::plugin(app);
        lens::plugin(app);
        blobs::plugin(app);
        app.register_type::<Quality>()
            .insert_resource(ClearColor(Color::srgb_from_array(HORIZON)))
            .insert_resource(shadow_map(self.0))
            .insert_resource(GlobalAmbientLight { color: Color::srgb(0.75, 0.85, 1.0), brightness: 420.0, ..default() })
            .add_systems(Startup, build)
            .add_systems(Update, (meters::paint, requality.run_if(resource_changed::<Quality>)))
            .add_systems(PostUpdate, follow.before(TransformSystems::Propagate));
    }
}

/// Scenery that stays around the camera.
#[derive(Component, Default)]
struct Around {
    /// Sideways in steps of this, so that textures stand still.
    step: f32,
    /// Far below figures that have no level floor.
    floor: bool,
}

/// The light that casts shadows.
#[derive(Component)]
struct Sun;

fn build(
    mut commands: Commands,
    quality: Res<Quality>,
    adapter: Option<Res<RenderAdapterInfo>>,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<StandardMaterial>>,
    mut images: ResMut<Assets<Image>>,
) {
    let checker =
        images.add(ground::checker(if *quality == Quality::Low { 1 } else { ground::anisotropy(adapter.as_deref()) }));
    let floor = StandardMaterial {
        base_color_texture: Some(checker),
        perceptual_roughness: 0.92,
        reflectance: 0.25,
        uv_transform: Affine2::from_scale(Vec2::splat(2.0 * REACH / ground::PERIOD)),
        ..default()
    };
    commands.spawn((
        Name::new("ground"),
        Around { step: ground::PERIOD, floor: true },
        Mesh3d(meshes.add(Plane3d::default().mesh().size(2.0 * REACH, 2.0 * REACH))),
        MeshMaterial3d(materials.add(floor)),
        NotShadowCaster,
    ));
    let sky = StandardMaterial { unlit: true, fog_enabled: false, cull_mode: None, ..default() };
    commands.spawn((
        Name::new("sky"),
        Around::default(),
        Mesh3d(meshes.add(dome())),
        MeshMaterial3d(materials.add(sky)),
        NotShadowCaster,
        NotShadowReceiver,
    ));
    commands.spawn((
        Name::new("sun"),
        DirectionalLight {
            color: Color::srgb(1.0, 0.96, 0.88),
            illuminance: ILLUMINANCE[0],
            shadow_maps_enabled: *quality != Quality::Low,
            contact_shadows_enabled: *quality == Quality::High,
            ..default()
        },
        Sun,
        shadows(*quality),
        Transform::from_translation(SUN).looking_at(Vec3::ZERO, Vec3::Y),
    ));
    commands.spawn((
        Name::new("rim light"),
        DirectionalLight { color: Color::srgb(0.80, 0.88, 1.0), illuminance: ILLUMINANCE[1], ..default() },
        Transform::from_translation(RIM).looking_at(Vec3::ZERO, Vec3::Y),
    ));
}

/// Where shadows are seen, and how finely.
fn shadows(quality: Quality) -> CascadeShadowConfig {
    let (num_cascades, maximum_distance) = match quality {
        Quality::Low => (1, 20.0),
        Quality::Medium => (3, 45.0),
        Quality::High => (4, 80.0),
    };
    CascadeShadowConfigBuilder { num_cascades, first_cascade_far_bound: 7.0, maximum_distance, ..default() }.build()
}

/// Size of a shadow map, pixels.
fn shadow_map(quality: Quality) -> DirectionalLightShadowMap {
    DirectionalLightShadowMap { size: if quality == Quality::High { 4096 } else { 2048 } }
}

/// Takes in another quality.
fn requality(
    quality: Res<Quality>,
    mut map: ResMut<DirectionalLightShadowMap>,
    mut suns: Query<(&mut DirectionalLight, &mut CascadeShadowConfig), With<Sun>>,
    mut cameras: Query<&mut Msaa, With<FollowCamera>>,
) {
    *map = shadow_map(*quality);
    for (mut sun, mut config) in &mut suns {
        sun.shadow_maps_enabled = *quality != Quality::Low;
        sun.contact_shadows_enabled = *quality == Quality::High;
        *config = shadows(*quality);
    }
    cameras.iter_mut().for_each(|mut msaa| *msaa = quality.msaa());
}

/// A sphere seen from inside, colored from the horizon up, brighter about the sun.
fn dome() -> Mesh {
    const RINGS: u32 = 40;
    const SIDES: u32 = 64;
    let (mut positions, mut colors, mut triangles) = (Vec::new(), Vec::new(), Vec::new());
    let sun = SUN.normalize();
    for ring in 0..=RINGS {
        // a little below the horizon, where the ground ends
        let height = -0.06 + (PI / 2.0 + 0.06) * (ring as f32 / RINGS as f32).powf(1.6);
        for side in 0..=SIDES {
            let turn = 2.0 * PI * side as f32 / SIDES as f32;
            let at = Vec3::new(height.cos() * turn.cos(), height.sin(), height.cos() * turn.sin());
            let up = (height / (PI / 2.0)).clamp(0.0, 1.0).powf(0.55);
            let glow = at.dot(sun).max(0.0).powi(24) * 0.35 + at.dot(sun).max(0.0).powi(400) * 2.5;
            let mix = |k: usize| HORIZON[k] + (ZENITH[k] - HORIZON[k]) * up;
            let sky = Color::srgb(mix(0), mix(1), mix(2)).to_linear();
            positions.push(at * SKY);
            colors.push([sky.red + glow, sky.green + glow * 0.95, sky.blue + glow * 0.85, 1.0]);
        }
    }
    for ring in 0..RINGS {
        for side in 0..SIDES {
            let (a, b) = (ring * (SIDES + 1) + side, (ring + 1) * (SIDES + 1) + side);
            triangles.extend([a, b, a + 1, a + 1, b, b + 1]);
        }
    }
    let normals = vec![[0.0, 1.0, 0.0]; positions.len()];
    Mesh::new(PrimitiveTopology::TriangleList, RenderAssetUsages::default())
        .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, positions)
        .with_inserted_attribute(Mesh::ATTRIBUTE_NORMAL, normals)
        .with_inserted_attribute(Mesh::ATTRIBUTE_COLOR, colors)
        .with_inserted_indices(Indices::U32(triangles))
}

fn follow(
    camera: Query<&Transform, (With<Camera3d>, Without<Around>)>,
    mut around: Query<(&Around, &mut Transform), Without<Camera3d>>,
    figures: Query<&Anatomy>,
) {
    let Some(camera) = camera.iter().next() else { return };
    let at = camera.translation;
    let stands = |anatomy: &Anatomy| anatomy.model.geoms.iter().any(|geom| geom.kind == GeomType::Plane);
    let level = figures.is_empty() || figures.iter().any(stands);
    for (around, mut transform) in &mut around {
        let step = |x: f32| if around.step > 0.0 { (x / around.step).round() * around.step } else { x };
        let y = if around.floor && !level { -DEEP } else { 0.0 };
        transform.translation = Vec3::new(step(at.x), y, step(at.z));
    }
}
