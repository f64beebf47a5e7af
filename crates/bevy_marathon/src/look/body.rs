//! Meshes and materials of ragdolls: one shape per visible geom, colored by what it is.

use crate::axes::{place_to_game, to_game};
use crate::look::{TINTS, ground};
use crate::ragdoll::{Anatomy, OwnGround, Part, Ragdoll};
use crate::track::Track;
use bevy::asset::RenderAssetUsages;
use bevy::camera::visibility::NoFrustumCulling;
use bevy::light::NotShadowCaster;
use bevy::mesh::{Indices, PrimitiveTopology};
use bevy::prelude::*;
use bevy::render::renderer::RenderAdapterInfo;
use marathon_physics::Model;
use marathon_physics::model::{Geom, GeomType, HField, JointType};
use std::collections::BTreeMap;

/// MuJoCo's default color: the model sets none.
const UNCHOSEN: [f32; 4] = [0.5, 0.5, 0.5, 1.0];
/// Geom groups from here on are hidden by MuJoCo's viewer unless asked for.
const FIRST_HIDDEN_GROUP: i32 = 3;
/// Metal of the joints, sRGB.
const METAL: [f32; 3] = [0.20, 0.21, 0.24];
/// Rubber of the feet, sRGB.
const RUBBER: [f32; 3] = [0.11, 0.12, 0.14];
/// Height of the sides of a height field, m.
const SIDE: f32 = 0.5;
/// Bends of the ground from which on a point is the foot of a step, and at which it is darkest, m.
const FOOT: [f32; 2] = [0.012, 0.06];
/// The same for a brink, m: of ditches and boxes, not of stairs, whose treads would be dark on both sides.
const BRINK: [f32; 2] = [0.18, 0.45];
/// Brightness of such edges and of steep sides.
const DARKEST: f32 = 0.38;
/// Loss of brightness per meter that the ground around a point is higher.
const HOLLOW: f32 = 4.0;
/// Points on each side that count as around a point.
const AROUND: usize = 3;
/// Things that belong to the world, sRGB.
const WORLD: [f32; 3] = [0.62, 0.60, 0.56];

/// Makes ragdolls visible: adds a child with a mesh to each of their parts.
#[derive(Clone, Copy, Debug, Default)]
pub struct LookPlugin;

impl Plugin for LookPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<Wardrobe>();
        app.register_type::<Tint>();
        app.register_required_components::<Ragdoll, Visibility>();
        app.register_required_components::<Part, Visibility>();
        app.add_systems(Update, (dress, lay).chain());
    }
}

/// Color of a [`Ragdoll`] in place of that of its model: its shirt, so to speak. Limbs and joints keep theirs.
#[derive(Component, Clone, Copy, Debug, PartialEq, Reflect)]
#[reflect(Component, Clone, Debug, PartialEq)]
pub struct Tint(pub Color);

impl Tint {
    /// The color of number `i` of a row.
    pub fn of_row(i: usize) -> Self {
        let [r, g, b] = TINTS[i % TINTS.len()];
        Tint(Color::srgb(r, g, b))
    }
}

/// A mesh of a [`Ragdoll`] that moves with it.
#[derive(Component, Clone, Copy, Debug)]
pub(crate) struct BodyMesh(pub Entity);

/// A visible geom of a [`Ragdoll`].
#[derive(Component, Clone, Debug)]
pub(crate) struct Shape {
    pub ragdoll: Entity,
    /// Index in the model's geoms.
    pub geom: usize,
    /// Material without color-coded marks, such as errors.
    pub own: Handle<StandardMaterial>,
}

/// Meshes and materials that are in use already.
#[derive(Resource, Default)]
pub(crate) struct Wardrobe {
    meshes: BTreeMap<(u8, [u32; 3]), Handle<Mesh>>,
    materials: BTreeMap<[u8; 6], Handle<StandardMaterial>>,
    /// That of height fields: the ground's checker.
    soil: Option<Handle<StandardMaterial>>,
}

/// Material of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Stuff {
    color: [f32; 3],
    roughness: f32,
    metallic: f32,
    alpha: f32,
}

#[expect(clippy::type_complexity, reason = "a query names what it reads")]
fn dress(
    mut commands: Commands,
    mut wardrobe: ResMut<Wardrobe>,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<StandardMaterial>>,
    mut images: ResMut<Assets<Image>>,
    adapter: Option<Res<RenderAdapterInfo>>,
    new: Query<(Entity, &Anatomy, &Track, Option<&OwnGround>, Option<&Tint>), Added<Anatomy>>,
) {
    for (ragdoll, anatomy, track, own, tint) in &new {
        let model = &*anatomy.model;
        let main = main_color(model);
        for (number, geom) in visible(model) {
            let (mesh, material) = match geom.kind {
                GeomType::Plane => continue,
                GeomType::Mesh => {
                    let Some(mesh) = geom.mesh.and_then(|i| model.meshes.get(i)) else { continue };
                    (meshes.add(triangles(mesh)), wardrobe.material(&mut materials, stuff(model, geom, main, tint)))
                }
                GeomType::Hfield => {
                    let Some(surface) = surface(model, geom, track, own) else { continue };
                    (meshes.add(surface), wardrobe.soil(&mut materials, &mut images, adapter.as_deref()))
                }
                kind => {
                    let stuff = stuff(model, geom, main, tint);
                    let mesh = wardrobe.shape(&mut meshes, kind, geom.size.map(|x| x as f32));
                    (mesh, wardrobe.material(&mut materials, stuff))
                }
            };
            let place = place_to_game(geom.pos, geom.quat);
            let name = Name::new(if geom.name.is_empty() { "geom".into() } else { geom.name.clone() });
            let shape = Shape { ragdoll, geom: number, own: material.clone() };
            let looks = (Mesh3d(mesh), MeshMaterial3d(material), place, name);
            let mut shape = commands.spawn((looks, shape, ChildOf(anatomy.parts[geom.body])));
            if geom.kind == GeomType::Hfield {
                // its bounds change with each course; the floor is far below a track, and no place for its shadow
                shape.insert((NoFrustumCulling, NotShadowCaster));
            }
            if model.bodies[geom.body].weld_id != 0 {
                shape.insert(BodyMesh(ragdoll));
            }
        }
        for (body, at, radius) in joint_places(model) {
            let size = [radius as f32, 0.0, 0.0];
            let mesh = wardrobe.shape(&mut meshes, GeomType::Sphere, size);
            let metal = Stuff { color: METAL, roughness: 0.35, metallic: 0.9, alpha: 1.0 };
            let material = wardrobe.material(&mut materials, metal);
            let place = Transform::from_translation(to_game(at));
            let name = Name::new("joint");
            let looks = (Mesh3d(mesh), MeshMaterial3d(material), place, name);
            commands.spawn((looks, BodyMesh(ragdoll), ChildOf(anatomy.parts[body])));
        }
    }
}

/// Draws ground that has changed.
fn lay(
    changed: Query<(Entity, &Anatomy, &Track, &OwnGround), Changed<OwnGround>>,
    shapes: Query<(&Shape, &Mesh3d)>,
    mut meshes: ResMut<Assets<Mesh>>,
) {
    for (ragdoll, anatomy, track, own) in &changed {
        for (shape, mesh) in shapes.iter().filter(|(shape, _)| shape.ragdoll == ragdoll) {
            let geom = &anatomy.model.geoms[shape.geom];
            if let Some(surface) = surface(&anatomy.model, geom, track, Some(own))
                && let Some(mut mesh) = meshes.get_mut(&mesh.0)
            {
                *mesh = surface;
            }
        }
    }
}

/// The surface of a geom, if it is a height field, as its agent has it, or else its model.
fn surface(model: &Model, geom: &Geom, track: &Track, own: Option<&OwnGround>) -> Option<Mesh> {
    let number = geom.hfield?;
    let field = model.hfields.get(number)?;
    Some(terrain(
        field,
        own.and_then(|own| own.0.get(number)).map(Vec::as_slice),
        track.place().translation + to_game(geom.pos),
    ))
}

/// Geoms that are drawn, and their numbers: opaque ones that MuJoCo's viewer would show, or all of a body that has none of these.
pub(crate) fn visible(model: &Model) -> impl Iterator<Item = (usize, &Geom)> {
    let moving = |g: &Geom| model.bodies[g.body].weld_id != 0;
    let listed = |g: &Geom| g.group < FIRST_HIDDEN_GROUP;
    let all_hidden = !model.geoms.iter().any(|g| moving(g) && g.rgba[3] > 0.0 && listed(g));
    // level planes are the ground, which the scenery draws
    let ground = |g: &Geom| g.kind == GeomType::Plane;
    let drawn = move |g: &Geom| g.rgba[3] > 0.0 && (listed(g) || (all_hidden && moving(g))) && !ground(g);
    model.geoms.iter().enumerate().filter(move |(_, geom)| drawn(geom))
}

/// Places of a body's joints and the radius of a ball that shows there: `(body, place in its frame, m)`.
pub fn joint_places(model: &Model) -> Vec<(usize, [f64; 3], f64)> {
    let mut places: Vec<(usize, [f64; 3], f64)> = Vec::new();
    for joint in model.joints.iter().filter(|j| matches!(j.kind, JointType::Hinge | JointType::Ball)) {
        let body = &model.bodies[joint.body];
        // joints to the world are how planar agents are held, not limbs
        if body.parent == 0 || places.iter().any(|(b, at, _)| *b == joint.body && *at == joint.pos) {
            continue;
        }
        let thickness = |b: usize| {
            let of = |g: &Geom| match g.kind {
                GeomType::Capsule | GeomType::Sphere | GeomType::Cylinder => Some(g.size[0]),
                _ => None,
            };
            let body = &model.bodies[b];
            model.geoms[body.geom_start..body.geom_start + body.geom_count].iter().filter_map(of).fold(0.0, f64::max)
        };
        let (own, parent) = (thickness(joint.body), thickness(body.parent));
        let radius = if parent > 0.0 { own.min(parent) } else { own };
        if radius > 0.0 {
            places.push((joint.body, joint.pos, 1.08 * radius));
        }
    }
    places
}

/// The color that most of the model's shape has, which a [`Tint`] replaces.
fn main_color(model: &Model) -> [f32; 4] {
    let mut areas: Vec<([f32; 4], f64)> = Vec::new();
    for (_, geom) in visible(model).filter(|(_, g)| model.bodies[g.body].weld_id != 0) {
        let [a, b, c] = geom.size;
        let area = a * (a + b + c);
        match areas.iter_mut().find(|(color, _)| *color == geom.rgba) {
            Some((_, sum)) => *sum += area,
            None => areas.push((geom.rgba, area)),
        }
    }
    areas.into_iter().max_by(|a, b| a.1.total_cmp(&b.1)).map_or(UNCHOSEN, |(color, _)| color)
}

fn stuff(model: &Model, geom: &Geom, main: [f32; 4], tint: Option<&Tint>) -> Stuff {
    let [r, g, b, alpha] = geom.rgba;
    if model.bodies[geom.body].weld_id == 0 {
        let color = if geom.rgba == UNCHOSEN { WORLD } else { [r, g, b] };
        return Stuff { color, roughness: 0.9, metallic: 0.0, alpha };
    }
    let name = geom.name.to_ascii_lowercase();
    let foot = ["foot", "shoe", "toe", "ankle"].iter().any(|w| name.contains(w));
    if geom.rgba == UNCHOSEN && foot {
        return Stuff { color: RUBBER, roughness: 0.85, metallic: 0.0, alpha };
    }
    let tinted = tint.filter(|_| geom.rgba == main).map(|t| t.0.to_srgba());
    let color = match tinted {
        Some(c) => [c.red, c.green, c.blue],
        None if geom.rgba == UNCHOSEN => TINTS[0],
        None => [r, g, b],
    };
    // the far leg is darker, so that a gait's two legs can be told apart
    let left = name.contains("left") && !name.contains("right");
    let shade = if left && model.bodies[geom.body].parent != 0 { 0.72 } else { 1.0 };
    let roughness = if foot { 0.8 } else { 0.42 };
    Stuff { color: color.map(|c| c * shade), roughness, metallic: 0.0, alpha }
}

impl Wardrobe {
    fn soil(
        &mut self,
        materials: &mut Assets<StandardMaterial>,
        images: &mut Assets<Image>,
        adapter: Option<&RenderAdapterInfo>,
    ) -> Handle<StandardMaterial> {
        let mut make = || StandardMaterial {
            base_color_texture: Some(images.add(ground::checker(ground::anisotropy(adapter)))),
            perceptual_roughness: 0.92,
            reflectance: 0.25,
            ..default()
        };
        self.soil.get_or_insert_with(|| materials.add(make())).clone()
    }

    pub fn shape(&mut self, meshes: &mut Assets<Mesh>, kind: GeomType, size: [f32; 3]) -> Handle<Mesh> {
        let key = (kind as u8, size.map(f32::to_bits));
        self.meshes.entry(key).or_insert_with(|| meshes.add(shape(kind, size))).clone()
    }

    fn material(&mut self, materials: &mut Assets<StandardMaterial>, stuff: Stuff) -> Handle<StandardMaterial> {
        let byte = |x: f32| (x.clamp(0.0, 1.0) * 255.0).round() as u8;
        let [r, g, b] = stuff.color;
        let key = [r, g, b, stuff.roughness, stuff.metallic, stuff.alpha].map(byte);
        let make = || StandardMaterial {
            base_color: Color::srgba(r, g, b, stuff.alpha),
            perceptual_roughness: stuff.roughness,
            metallic: stuff.metallic,
            reflectance: 0.45,
            alpha_mode: if stuff.alpha < 1.0 { AlphaMode::Blend } else { AlphaMode::Opaque },
            ..default()
        };
        self.materials.entry(key).or_insert_with(|| materials.add(make())).clone()
    }
}

/// A geom's mesh in the game's axes: what lies along z there stands along y here.
fn shape(kind: GeomType, [x, y, z]: [f32; 3]) -> Mesh {
    match kind {
        GeomType::Capsule => Capsule3d { radius: x, half_length: y }.mesh().longitudes(24).latitudes(12).build(),
        GeomType::Cylinder => Cylinder { radius: x, half_height: y }.mesh().resolution(32).build(),
        GeomType::Box => Cuboid::new(2.0 * x, 2.0 * z, 2.0 * y).mesh().build(),
        GeomType::Ellipsoid => Sphere::new(1.0)
            .mesh()
            .uv(32, 18)
            .rotated_by(Quat::from_rotation_x(-std::f32::consts::FRAC_PI_2))
            .scaled_by(Vec3::new(x, z, y)),
        _ => Sphere::new(x).mesh().uv(28, 16).rotated_by(Quat::from_rotation_x(-std::f32::consts::FRAC_PI_2)),
    }
}

/// A mesh of the model in the game's axes, with flat faces.
fn triangles(mesh: &marathon_physics::model::Mesh) -> Mesh {
    let positions: Vec<Vec3> = mesh.vertices.iter().map(|p| to_game(p.map(f64::from))).collect();
    Mesh::new(PrimitiveTopology::TriangleList, RenderAssetUsages::default())
        .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, positions)
        .with_inserted_indices(Indices::U32(mesh.faces.as_flattened().to_vec()))
        .with_duplicated_vertices()
        .with_computed_flat_normals()
}

/// The surface of a height field at a place, with elevations of an agent's own or the model's; its checker continues that of the ground around it.
fn terrain(field: &HField, own: Option<&[f32]>, place: Vec3) -> Mesh {
    let (rows, columns) = (field.nrow, field.ncol);
    let [half_x, half_y, height, _] = field.size;
    let along = |i: usize, n: usize, half: f64| half * (2.0 * i as f64 / (n.max(2) - 1) as f64 - 1.0);
    let points = (0..rows).flat_map(|r| (0..columns).map(move |c| (r, c)));
    let positions: Vec<Vec3> = points
        .map(|(r, c)| {
            let i = r * columns + c;
            let z = match own.and_then(|own| own.get(i)) {
                Some(z) => f64::from(*z),
                None => height * f64::from(field.data.get(i).copied().unwrap_or_default()),
            };
            to_game([along(c, columns, half_x), along(r, rows, half_y), z])
        })
        .collect();
    let heights: Vec<f32> = positions.iter().map(|p| p.y).collect();
    let mut shades: Vec<[f32; 4]> =
        (0..heights.len()).map(|i| shade(&heights, [rows, columns], [i / columns, i % columns])).collect();
    let checker: Vec<Vec2> = positions.iter().map(|p| (*p + place).xz() / ground::PERIOD).collect();
    let mut triangles = Vec::new();
    for r in 1..rows as u32 {
        for c in 1..columns as u32 {
            let n = columns as u32;
            let (a, b) = ((r - 1) * n + c - 1, r * n + c - 1);
            triangles.extend([a, a + 1, b + 1, a, b + 1, b]);
        }
    }
    let (mut positions, mut checker) = (positions, checker);
    // its sides, seen from outside: without them, you cannot see where a narrow track is high
    for (row, seen_from_front) in [(0, true), (rows.saturating_sub(1), false)] {
        let first = positions.len() as u32;
        for column in 0..columns {
            let at = row * columns + column;
            for depth in [0.0, SIDE] {
                positions.push(positions[at] - Vec3::Y * depth);
                checker.push(checker[at] + Vec2::Y * (depth / ground::PERIOD));
                shades.push(gray(DARKEST));
            }
        }
        for column in 1..columns as u32 {
            let [a, b] = [first + 2 * (column - 1), first + 2 * column];
            let side = if seen_from_front { [a, a + 1, b + 1, a, b + 1, b] } else { [a, b + 1, a + 1, a, b, b + 1] };
            triangles.extend(side);
        }
    }
    // flat shading: the edge of a step must be seen
    Mesh::new(PrimitiveTopology::TriangleList, RenderAssetUsages::default())
        .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, positions)
        .with_inserted_attribute(Mesh::ATTRIBUTE_UV_0, checker)
        .with_inserted_attribute(Mesh::ATTRIBUTE_COLOR, shades)
        .with_inserted_indices(Indices::U32(triangles))
        .with_duplicated_vertices()
        .with_computed_flat_normals()
}

/// Brightness of a point of a height field: dark at the edges of steps and ditches, and where the ground around it is higher.
fn shade(heights: &[f32], [rows, columns]: [usize; 2], [row, column]: [usize; 2]) -> [f32; 4] {
    let at = |r: usize, c: usize| heights[r * columns + c];
    let here = at(row, column);
    // the bend between both neighbors, which an even slope lacks: above zero at the foot of a step
    let bend = |before: Option<f32>, after: Option<f32>| match (before, after) {
        (Some(before), Some(after)) => before - 2.0 * here + after,
        _ => 0.0,
    };
    let up = |i: usize, n: usize| (i + 1 < n).then_some(i + 1);
    let along = bend(column.checked_sub(1).map(|c| at(row, c)), up(column, columns).map(|c| at(row, c)));
    let across = bend(row.checked_sub(1).map(|r| at(r, column)), up(row, rows).map(|r| at(r, column)));
    let share = |bend: f32, [least, most]: [f32; 2]| ((bend - least) / (most - least)).clamp(0.0, 1.0);
    let edge = share(along.max(across), FOOT).max(share(-along.min(across), BRINK));
    let (mut above, mut count) = (0.0, 0.0_f32);
    for r in row.saturating_sub(AROUND)..(row + AROUND + 1).min(rows) {
        for c in column.saturating_sub(AROUND)..(column + AROUND + 1).min(columns) {
            above += (at(r, c) - here).max(0.0);
            count += 1.0;
        }
    }
    let hollow = HOLLOW * above / count.max(1.0);
    gray((1.0 - hollow.max((1.0 - DARKEST) * edge)).max(DARKEST))
}

fn gray(x: f32) -> [f32; 4] {
    [x, x, x, 1.0]
}
