//! Skins that are generated for a ragdoll's own model while the game runs.
//!
//! A task in the background generates the skin; the ragdoll shows its shapes until the skin is there. Ragdolls of the same
//! model share one skin.

use crate::look::skin::{Skin, SkinError, UnfitSkin};
use crate::ragdoll::Anatomy;
use bevy::asset::RenderAssetUsages;
use bevy::ecs::lifecycle::Remove;
use bevy::mesh::skinning::{SkinnedMesh, SkinnedMeshInverseBindposes};
use bevy::mesh::{Indices, PrimitiveTopology, VertexAttributeValues};
use bevy::prelude::*;
use bevy::tasks::futures::check_ready;
use bevy::tasks::{AsyncComputeTaskPool, Task, block_on};
use marathon_physics::Model;
use std::sync::Arc;

/// Lets a ragdoll wear a skin that is generated for its model: one smooth surface around its shapes, with a joint for each
/// body. The plugin adds the [`Skin`]; removing this component removes it. A model that no skin can be made for keeps its
/// shapes and gets an [`UnfitSkin`].
#[derive(Component, Clone, Copy, Debug, Default, PartialEq, Eq, Reflect)]
#[reflect(Component, Default, Clone, Debug, PartialEq)]
pub struct GeneratedSkin;

/// When [`GeneratedSkin`]s are made.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq, Eq, Reflect)]
#[reflect(Resource, Default, Clone, Debug, PartialEq)]
pub enum SkinGeneration {
    /// Beside the game, without a pause.
    #[default]
    Background,
    /// In the frame that asks for them, which waits: a video must not depend on the speed of the machine.
    Blocking,
}

/// The skins of the models in use.
#[derive(Resource, Default)]
struct GeneratedSkins(Vec<(Arc<Model>, Progress)>);

/// The progress of a skin.
enum Progress {
    Running(Task<Result<marathon_skin::Skin, marathon_skin::SkinError>>),
    Made(Handle<WorldAsset>),
    Failed(marathon_skin::SkinError),
}

/// Generates [`GeneratedSkin`]s. It needs the [`SkinPlugin`](crate::look::SkinPlugin), which lets ragdolls wear them.
#[derive(Clone, Copy, Debug, Default)]
pub struct GeneratedSkinPlugin;

impl Plugin for GeneratedSkinPlugin {
    fn build(&self, app: &mut App) {
        app.register_type::<GeneratedSkin>()
            .register_type::<SkinGeneration>()
            .init_resource::<GeneratedSkins>()
            .init_resource::<SkinGeneration>()
            .add_systems(Update, generate.run_if(has_assets))
            .add_observer(take_off);
    }
}

/// Without a renderer there may be nothing that a skin could be made of.
fn has_assets(
    scenes: Option<Res<Assets<WorldAsset>>>,
    poses: Option<Res<Assets<SkinnedMeshInverseBindposes>>>,
) -> bool {
    scenes.is_some() && poses.is_some()
}

/// The assets that a skin consists of.
type SkinAssets<'w> = (
    ResMut<'w, Assets<WorldAsset>>,
    ResMut<'w, Assets<Mesh>>,
    ResMut<'w, Assets<StandardMaterial>>,
    ResMut<'w, Assets<SkinnedMeshInverseBindposes>>,
);

/// Starts to generate skins, and gives those that are done to their ragdolls.
#[expect(clippy::type_complexity, reason = "a query names what it reads")]
fn generate(
    mut commands: Commands,
    mut skins: ResMut<GeneratedSkins>,
    generation: Res<SkinGeneration>,
    (mut scenes, mut meshes, mut materials, mut poses): SkinAssets<'_>,
    bare: Query<(Entity, &Anatomy), (With<GeneratedSkin>, Without<Skin>, Without<UnfitSkin>)>,
) {
    if bare.is_empty() {
        return;
    }
    // models that only this list still holds are no longer worn
    skins.0.retain(|(model, _)| Arc::strong_count(model) > 1);
    for (ragdoll, anatomy) in &bare {
        let same = |(model, _): &(Arc<Model>, Progress)| Arc::ptr_eq(model, &anatomy.model) || *model == anatomy.model;
        let number = skins.0.iter().position(same).unwrap_or_else(|| {
            let model = anatomy.model.clone();
            let make = async move { marathon_skin::skin(&model, &marathon_skin::Options::default()) };
            let task = AsyncComputeTaskPool::get().spawn(make);
            skins.0.push((anatomy.model.clone(), Progress::Running(task)));
            skins.0.len() - 1
        });
        let progress = &mut skins.0[number].1;
        if let Progress::Running(task) = progress {
            let done = match *generation {
                SkinGeneration::Background => check_ready(task),
                SkinGeneration::Blocking => Some(block_on(task)),
            };
            match done {
                Some(Ok(skin)) => {
                    let scene = scene(&skin, &mut meshes, &mut materials, &mut poses);
                    *progress = Progress::Made(scenes.add(scene));
                }
                Some(Err(problem)) => {
                    warn!("no skin can be generated: {problem}");
                    *progress = Progress::Failed(problem);
                }
                None => continue,
            }
        }
        match progress {
            Progress::Made(scene) => {
                commands.entity(ragdoll).insert(Skin::new(scene.clone()));
            }
            Progress::Failed(problem) => {
                commands.entity(ragdoll).insert(UnfitSkin(SkinError::Generate(problem.clone())));
            }
            Progress::Running(_) => {}
        }
    }
}

/// Removes the skin of a ragdoll that shall no longer have a generated one.
fn take_off(
    removed: On<Remove, GeneratedSkin>,
    mut commands: Commands,
    skins: Res<GeneratedSkins>,
    worn: Query<&Skin>,
) {
    let generated =
        |skin: &Skin| skins.0.iter().any(|(_, p)| matches!(p, Progress::Made(scene) if *scene == skin.scene));
    if worn.get(removed.entity).is_ok_and(generated)
        && let Ok(mut ragdoll) = commands.get_entity(removed.entity)
    {
        ragdoll.try_remove::<Skin>();
    }
}

/// The scene that a skin's file would be loaded as.
fn scene(
    skin: &marathon_skin::Skin,
    meshes: &mut Assets<Mesh>,
    materials: &mut Assets<StandardMaterial>,
    poses: &mut Assets<SkinnedMeshInverseBindposes>,
) -> WorldAsset {
    let mut world = World::new();
    let top = world.spawn((Name::new(skin.name.clone()), Transform::default())).id();
    let mut joints: Vec<Entity> = Vec::with_capacity(skin.skeleton.len());
    for joint in &skin.skeleton {
        let (parent, from) = joint
            .parent
            .map_or((top, Vec3::ZERO), |parent| (joints[parent], Vec3::from_array(skin.skeleton[parent].position)));
        let place = Transform::from_translation(Vec3::from_array(joint.position) - from);
        joints.push(world.spawn((Name::new(joint.name.clone()), place, ChildOf(parent))).id());
    }
    // joints are not turned at rest
    let rest = skin.skeleton.iter().map(|joint| Mat4::from_translation(-Vec3::from_array(joint.position)));
    let bound = SkinnedMesh { inverse_bindposes: poses.add(rest.collect::<Vec<_>>()), joints };
    let material = StandardMaterial { perceptual_roughness: 0.75, ..default() };
    let looks = (Mesh3d(meshes.add(mesh(skin))), MeshMaterial3d(materials.add(material)), bound);
    world.spawn((Name::new("skin"), Transform::default(), looks, ChildOf(top)));
    WorldAsset::new(world)
}

fn mesh(skin: &marathon_skin::Skin) -> Mesh {
    let share = |four: &[u8; 4]| four.map(|byte| f32::from(byte) / 255.0);
    let joints = skin.joints.iter().map(|four| four.map(u16::from)).collect();
    Mesh::new(PrimitiveTopology::TriangleList, RenderAssetUsages::default())
        .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, skin.positions.clone())
        .with_inserted_attribute(Mesh::ATTRIBUTE_NORMAL, skin.normals.clone())
        .with_inserted_attribute(Mesh::ATTRIBUTE_COLOR, skin.colors.iter().map(share).collect::<Vec<_>>())
        .with_inserted_attribute(Mesh::ATTRIBUTE_JOINT_INDEX, VertexAttributeValues::Uint16x4(joints))
        .with_inserted_attribute(Mesh::ATTRIBUTE_JOINT_WEIGHT, skin.weights.iter().map(share).collect::<Vec<_>>())
        .with_inserted_indices(Indices::U16(skin.triangles.iter().flatten().copied().collect()))
}
