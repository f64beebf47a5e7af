//! Skins: a glTF character with a skeleton that a ragdoll wears in place of its shapes.
//!
//! A mapping assigns bones to bodies, as for the import of motions. A skin that was generated for the model needs none: its
//! bones are the model's bodies. The mappings that come with Marathon include the bone names of many tools. A bone turns as its body does, and keeps its length. The whole skin is scaled so that its
//! legs are as long as the ragdoll's.

use crate::axes::{to_game, to_physics};
use crate::look::body::BodyMesh;
use crate::look::camera::TooNear;
use crate::look::foot_lock::{FootLock, Legs, Stance};
use crate::look::ghost::ErrorColors;
use crate::plugin::MarathonSystems;
use crate::ragdoll::{Anatomy, Episode, Part};
use bevy::asset::{AssetLoadError, LoadState};
use bevy::camera::visibility::NoFrustumCulling;
use bevy::ecs::entity::EntityHashMap;
use bevy::mesh::skinning::SkinnedMesh;
use bevy::prelude::*;
use marathon_motion::{Bone, Mapping, MotionError, Skeleton, SkeletonPoser};
use std::borrow::Cow;
use std::collections::HashSet;
use std::f32::consts::FRAC_1_SQRT_2;
use std::path::Path;
use std::sync::Arc;
use thiserror::Error;

/// From the axes of the physics to those of the game.
const AXES: Quat = Quat::from_xyzw(-FRAC_1_SQRT_2, 0.0, 0.0, FRAC_1_SQRT_2);

/// Lets ragdolls wear [`Skin`]s.
#[derive(Clone, Copy, Debug, Default)]
pub struct SkinPlugin;

impl Plugin for SkinPlugin {
    fn build(&self, app: &mut App) {
        let shown = RunFixedMainLoopSystems::AfterFixedMainLoop;
        app.register_type::<Skin>()
            .register_type::<FootLock>()
            .add_systems(Update, (put_on, fit).chain())
            .add_systems(RunFixedMainLoop, (wear, hide).in_set(shown).after(MarathonSystems::Show));
    }
}

/// A glTF character that a ragdoll wears in place of its shapes.
#[derive(Component, Clone, Debug, PartialEq, Reflect)]
#[reflect(Component, Clone, Debug, PartialEq)]
#[require(FootLock)]
pub struct Skin {
    /// A scene with a skinned mesh, such as `GltfAssetLabel::Scene(0).from_asset("hero.glb")`. Its lights and cameras are left out.
    pub scene: Handle<WorldAsset>,
    /// Text of a mapping file: which bone follows which body. `None`: bones that are the model's own follow their bodies, others
    /// follow the mapping that comes with Marathon for the model.
    pub mapping: Option<Cow<'static, str>>,
}

impl Skin {
    /// A scene, worn by the mapping that comes with Marathon.
    pub fn new(scene: Handle<WorldAsset>) -> Self {
        Skin { scene, mapping: None }
    }
}

/// On a ragdoll: why it does not wear its [`Skin`].
#[derive(Component, Clone, Debug)]
pub struct UnfitSkin(pub SkinError);

/// An error of a [`Skin`] that does not fit its ragdoll.
#[derive(Clone, Debug, Error)]
#[non_exhaustive]
pub enum SkinError {
    /// The scene cannot be loaded.
    #[error(transparent)]
    Load(Arc<AssetLoadError>),
    /// The scene has no skeleton.
    #[error("it has no skinned mesh, expected a character with a skeleton")]
    NoSkeleton,
    /// The skin's mapping does not fit its skeleton or the model.
    #[error(transparent)]
    Mapping(MotionError),
    /// The skin brings no mapping, and the one that comes with Marathon does not know its bones.
    #[error("{0}; rename its bones, as Mixamo or Blender's Rigify calls them, or write a mapping that names them")]
    UnknownBones(MotionError),
    /// No skin can be generated for the model.
    #[error(transparent)]
    Generate(marathon_skin::SkinError),
}

/// On a ragdoll: it wears its [`Skin`].
#[derive(Component, Clone, Copy, Debug, PartialEq, Eq)]
pub struct Dressed;

/// A skin's meshes and bones, a child of the ragdoll that wears it.
#[derive(Component)]
struct Clothes {
    ragdoll: Entity,
    /// None until the scene has been read.
    fitted: Option<Fitted>,
}

/// How a scene's skeleton follows the ragdoll.
struct Fitted {
    poser: SkeletonPoser,
    /// Bones, those of the skeleton in its order.
    bones: Vec<Entity>,
    /// Transform above the first bone, in the axes of the ragdoll: position, rotation and scale.
    above: Transform,
    legs: Legs,
}

/// Makes room for new skins and removes those that are no longer worn.
#[expect(clippy::type_complexity, reason = "a query names what it reads")]
fn put_on(
    mut commands: Commands,
    changed: Query<Entity, (With<Skin>, With<Anatomy>, Or<(Changed<Skin>, Added<Anatomy>)>)>,
    skins: Query<(), With<Skin>>,
    clothes: Query<(Entity, &Clothes)>,
) {
    for (entity, worn) in &clothes {
        let gone = !skins.contains(worn.ragdoll);
        if gone || changed.contains(worn.ragdoll) {
            commands.entity(entity).despawn();
        }
        if gone && let Ok(mut ragdoll) = commands.get_entity(worn.ragdoll) {
            ragdoll.remove::<(Dressed, UnfitSkin)>();
        }
    }
    for ragdoll in &changed {
        commands.entity(ragdoll).remove::<(Dressed, UnfitSkin)>();
        let clothes = (Name::new("skin"), Clothes { ragdoll, fitted: None }, Transform::default(), Visibility::Hidden);
        commands.spawn((clothes, ChildOf(ragdoll)));
    }
}

/// Fits scenes that have been read to their ragdolls.
#[expect(clippy::type_complexity, reason = "a query names what it reads")]
fn fit(
    mut commands: Commands,
    server: Res<AssetServer>,
    scenes: Option<Res<Assets<WorldAsset>>>,
    mut clothes: Query<(Entity, &mut Clothes, &mut Transform)>,
    ragdolls: Query<(&Anatomy, &Skin), (Without<Dressed>, Without<UnfitSkin>)>,
) {
    let Some(scenes) = scenes else { return };
    for (entity, mut worn, mut transform) in &mut clothes {
        let Ok((anatomy, skin)) = ragdolls.get(worn.ragdoll) else { continue };
        let result = match (scenes.get(&skin.scene), server.load_state(&skin.scene)) {
            (Some(scene), _) => {
                let nodes = tree(&scene.world);
                fitted(&nodes, anatomy, skin).map(|fitted| (scene, nodes, fitted))
            }
            (None, LoadState::Failed(error)) => Err(SkinError::Load(error)),
            _ => continue,
        };
        match result {
            Ok((scene, nodes, (poser, above, bones))) => {
                let scale = poser.scale() as f32;
                let spawned = spawn(&mut commands, entity, &scene.world, &nodes, bones[0]);
                let bones = bones.into_iter().map(|bone| spawned[bone]).collect();
                transform.scale = Vec3::splat(scale);
                let above = Transform { translation: scale * above.translation, scale: scale * above.scale, ..above };
                let legs = Legs::of(anatomy, &poser);
                worn.fitted = Some(Fitted { poser, bones, above, legs });
                commands.entity(worn.ragdoll).insert(Dressed);
            }
            Err(problem) => {
                error!("a skin cannot be worn: {problem}");
                commands.entity(worn.ragdoll).insert(UnfitSkin(problem));
            }
        }
    }
}

/// A node of a skin's scene at rest.
struct Node {
    /// In the scene's own world.
    entity: Entity,
    /// Its place in the list, lower than the node's own.
    parent: Option<usize>,
    local: Transform,
    name: String,
    /// The mesh is bound to it.
    joint: bool,
}

/// The nodes of a scene.
fn tree(scene: &World) -> Vec<Node> {
    let all: Vec<EntityRef> =
        scene.try_query::<EntityRef>().map(|mut all| all.iter(scene).collect()).unwrap_or_default();
    let joints: HashSet<Entity> = all
        .iter()
        .filter_map(|entity| entity.get::<SkinnedMesh>())
        .flat_map(|mesh| mesh.joints.iter().copied())
        .collect();
    let mut tree = Vec::new();
    let tops = all.iter().filter(|entity| !entity.contains::<ChildOf>());
    let mut open: Vec<(Entity, Option<usize>)> = tops.map(|entity| (entity.id(), None)).collect();
    // parents come before their children
    while let Some((entity, parent)) = open.pop() {
        let Ok(node) = scene.get_entity(entity) else { continue };
        let Some(local) = node.get::<Transform>() else { continue };
        let name = node.get::<Name>().map(|name| name.to_string()).unwrap_or_default();
        open.extend(node.get::<Children>().into_iter().flatten().rev().map(|child| (*child, Some(tree.len()))));
        tree.push(Node { entity, parent, local: *local, name, joint: joints.contains(&entity) });
    }
    tree
}

/// Makes the nodes of a scene below an entity, with the meshes that are bound to bones or that hang from the first one.
fn spawn(commands: &mut Commands, below: Entity, scene: &World, tree: &[Node], first: usize) -> Vec<Entity> {
    let mut spawned: Vec<Entity> = Vec::with_capacity(tree.len());
    for node in tree {
        let parent = node.parent.map_or(below, |parent| spawned[parent]);
        let looks = (Name::new(node.name.clone()), node.local, Visibility::default(), ChildOf(parent));
        spawned.push(commands.spawn(looks).id());
    }
    let copies: EntityHashMap<Entity> = tree.iter().map(|node| node.entity).zip(spawned.iter().copied()).collect();
    let mut hangs = vec![false; tree.len()];
    for (i, node) in tree.iter().enumerate() {
        hangs[i] = i == first || node.parent.is_some_and(|parent| hangs[parent]);
        let Ok(source) = scene.get_entity(node.entity) else { continue };
        let (Some(mesh), bound) = (source.get::<Mesh3d>(), source.get::<SkinnedMesh>()) else { continue };
        if bound.is_none() && !hangs[i] {
            continue;
        }
        // the bounds of a skinned mesh are those of the rest pose
        let mut copy = commands.entity(spawned[i]);
        copy.insert((mesh.clone(), NoFrustumCulling));
        if let Some(material) = source.get::<MeshMaterial3d<StandardMaterial>>() {
            copy.insert(material.clone());
        }
        if let Some(bound) = bound {
            let joints = bound.joints.iter().filter_map(|joint| copies.get(joint).copied()).collect();
            copy.insert(SkinnedMesh { inverse_bindposes: bound.inverse_bindposes.clone(), joints });
        }
    }
    spawned
}

/// How the skeleton of a scene follows a ragdoll, what is above its first bone, and the nodes of its bones.
fn fitted(tree: &[Node], anatomy: &Anatomy, skin: &Skin) -> Result<(SkeletonPoser, Transform, Vec<usize>), SkinError> {
    let Some((above, bones, skeleton)) = skeleton(tree) else {
        return Err(SkinError::NoSkeleton);
    };
    let (path, model) = (Path::new("skin"), &*anatomy.model);
    let mapping = match &skin.mapping {
        Some(text) => Mapping::parse(path, text.as_bytes(), &skeleton, model).map_err(SkinError::Mapping),
        None => match Mapping::own(&skeleton, model) {
            Some(own) => Ok(own),
            None => Mapping::built_in(path, &skeleton, model).map_err(SkinError::UnknownBones),
        },
    };
    let poser = SkeletonPoser::new(model, &mapping?, &skeleton);
    Ok((poser, above, bones))
}

/// The skeleton with the most joints among a scene's nodes: what is above its first bone, the nodes of its bones, and the bones
/// in the axes of the physics. Nodes between joints are bones too. None without joints.
fn skeleton(tree: &[Node]) -> Option<(Transform, Vec<usize>, Skeleton)> {
    let mut joints: Vec<usize> = tree.iter().map(|node| usize::from(node.joint)).collect();
    for i in (0..tree.len()).rev() {
        if let Some(parent) = tree[i].parent {
            joints[parent] += joints[i];
        }
    }
    let up = |from: usize| std::iter::successors(tree[from].parent, move |at: &usize| tree[*at].parent);
    let tops = (0..tree.len()).filter(|i| tree[*i].joint && !up(*i).any(|above| tree[above].joint));
    let top = tops.max_by_key(|top| (joints[*top], std::cmp::Reverse(*top)))?;
    let above = up(top).fold(Transform::default(), |below, node| tree[node].local * below);
    let (mut nodes, mut scales) = (Vec::new(), Vec::new());
    let mut bones: Vec<Bone> = Vec::new();
    for (i, node) in tree.iter().enumerate().filter(|(i, _)| joints[*i] > 0) {
        let parent = node.parent.and_then(|parent| nodes.iter().position(|known| *known == parent));
        if i != top && parent.is_none() {
            continue;
        }
        let scale: f32 = parent.map_or(above.scale, |parent| scales[parent]).element_sum() / 3.0;
        let (offset, turn) = match parent {
            Some(_) => (scale * node.local.translation, node.local.rotation),
            None => (Vec3::ZERO, AXES.inverse() * above.rotation * node.local.rotation),
        };
        let rest = [turn.w, turn.x, turn.y, turn.z].map(f64::from);
        bones.push(Bone { name: node.name.clone(), parent, offset: offset.to_array().map(f64::from), rest });
        nodes.push(i);
        scales.push(scale * node.local.scale);
    }
    Some((above, nodes, Skeleton { bones }))
}

/// Lets skins follow the bodies of their ragdolls.
fn wear(
    time: Res<Time<Virtual>>,
    mut clothes: Query<&mut Clothes>,
    ragdolls: Query<(&Anatomy, Option<&Episode>, Option<&FootLock>)>,
    parts: Query<&Transform, With<Part>>,
    mut bones: Query<&mut Transform, Without<Part>>,
) {
    for mut worn in &mut clothes {
        let Clothes { ragdoll, fitted } = &mut *worn;
        let (Some(fitted), Ok((anatomy, episode, lock))) = (fitted, ragdolls.get(*ragdoll)) else { continue };
        let body = |part: &Entity| {
            let Transform { translation, rotation, .. } = *parts.get(*part).ok()?;
            let [x, y, z] = to_physics(rotation.xyz());
            Some((to_physics(translation), [f64::from(rotation.w), x, y, z]))
        };
        let Some(bodies) = anatomy.parts.iter().map(body).collect::<Option<Vec<_>>>() else { continue };
        let mut frame = fitted.poser.pose(&bodies);
        if lock.is_some_and(|lock| lock.on) {
            let stance = Stance { bodies: &bodies, episode, dt: time.delta_secs_f64() };
            fitted.legs.stand(&fitted.poser, &mut frame, &stance);
        }
        for (i, (entity, turn)) in fitted.bones.iter().zip(&frame.rotations).enumerate() {
            let Ok(mut bone) = bones.get_mut(*entity) else { continue };
            let [w, x, y, z] = turn.map(|x| x as f32);
            let turn = Quat::from_xyzw(x, y, z, w);
            if i > 0 {
                bone.rotation = turn;
                continue;
            }
            bone.rotation = fitted.above.rotation.inverse() * AXES * turn;
            let place = to_game(frame.root) - fitted.above.translation;
            bone.translation = (fitted.above.rotation.inverse() * place) / fitted.above.scale;
        }
    }
}

/// Hides the shapes of ragdolls that wear a skin, or the skin where the shapes have something to show.
fn hide(
    dressed: Query<(Has<ErrorColors>, Has<TooNear>), With<Dressed>>,
    mut clothes: Query<(&Clothes, &mut Visibility), Without<BodyMesh>>,
    mut shapes: Query<(&BodyMesh, &mut Visibility), Without<Clothes>>,
) {
    let worn = |ragdoll: Entity| dressed.get(ragdoll).is_ok_and(|(errors, _)| !errors);
    let near = |ragdoll: Entity| dressed.get(ragdoll).is_ok_and(|(_, near)| near);
    let shown = |on: bool| if on { Visibility::Inherited } else { Visibility::Hidden };
    for (clothes, mut visibility) in &mut clothes {
        visibility.set_if_neq(shown(worn(clothes.ragdoll) && !near(clothes.ragdoll)));
    }
    for (shape, mut visibility) in &mut shapes {
        visibility.set_if_neq(shown(!worn(shape.0)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f32::consts::FRAC_PI_2;

    /// A skin under a turned node in centimeters, with a node between two joints and a mesh beside them.
    #[test]
    fn skeletons_are_found_wherever_they_hang() -> Result<(), Box<dyn std::error::Error>> {
        let armature = Transform::from_xyz(0.0, 1.0, 0.0)
            .with_rotation(Quat::from_rotation_x(FRAC_PI_2))
            .with_scale(Vec3::splat(0.01));
        let node = |parent, local, name: &str, joint| Node {
            entity: Entity::PLACEHOLDER,
            parent,
            local,
            name: name.into(),
            joint,
        };
        let at = |x, y, z| Transform::from_xyz(x, y, z);
        let tree = [
            node(None, armature, "armature", false),
            node(Some(0), Transform::default(), "mesh", false),
            node(Some(0), at(0.0, 0.0, -90.0), "hips", true),
            node(Some(2), at(0.0, 0.0, -10.0), "between", false),
            node(Some(2), at(0.0, 0.0, 7.0), "decoration", false),
            node(Some(3), at(0.0, 0.0, -30.0), "chest", true),
        ];
        let (above, bones, skeleton) = skeleton(&tree).ok_or("it has joints")?;
        assert_eq!(bones, [2, 3, 5]);
        assert!(above.translation == Vec3::Y && above.scale.distance(Vec3::splat(0.01)) < 1e-6);
        let names: Vec<_> = skeleton.bones.iter().map(|bone| (bone.name.as_str(), bone.parent)).collect();
        assert_eq!(names, [("hips", None), ("between", Some(0)), ("chest", Some(1))]);
        // in the file's own axes, which the first bone turns to those of the physics
        let lengths: Vec<f64> = skeleton.bones.iter().map(|bone| bone.offset[2]).collect();
        assert!(lengths.iter().zip([0.0, -0.1, -0.3]).all(|(a, b)| (a - b).abs() < 1e-6), "{lengths:?}");
        let [w, x, y, z] = skeleton.bones[0].rest.map(|x| x as f32);
        let up = AXES * Quat::from_xyzw(x, y, z, w) * Vec3::NEG_Z;
        assert!(up.distance(Vec3::Y) < 1e-6, "what leads up the spine is up: {up}");
        Ok(())
    }
}
