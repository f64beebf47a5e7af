//! `<mesh>`: a mesh in the frame of its principal axes, what it weighs, and the primitives that are fitted to it.
//!
//! The order is MuJoCo's. The hull is found in the file's frame. Then `refpos`, `refquat` and `scale` apply, and the mesh moves to its
//! center of mass and turns to its principal axes. At last its points are rounded to single precision.

use super::compiler::Settings;
use super::document::Element;
use super::error::{MjcfError, MjcfErrorKind};
use super::file::ReadFile;
use super::math::*;
use super::room::Room;
use super::settings::sections;
use super::value::Attrs;
use crate::mesh::builtin::{self, Builtin};
use crate::mesh::moments::{self, Inside};
use crate::mesh::polygons::Skin;
use crate::mesh::{self, Format, MAX_FACES, MAX_VERTICES, Triangles};
use crate::model::{GeomType, Mesh, Model, Vec3};
use std::collections::BTreeSet;

const INSIDE: [(&str, Inside); 4] =
    [("convex", Inside::Convex), ("exact", Inside::Exact), ("legacy", Inside::Legacy), ("shell", Inside::Shell)];

const BUILTIN: [(&str, Option<Builtin>); 10] = [
    ("sphere", Some(Builtin::Sphere)),
    ("hemisphere", Some(Builtin::Hemisphere)),
    ("cone", Some(Builtin::Cone)),
    ("supersphere", Some(Builtin::Supersphere)),
    ("supertorus", Some(Builtin::Supertorus)),
    ("wedge", None),
    ("plate", None),
    ("box", None),
    ("cylinder", None),
    ("ellipsoid", None),
];

/// A mesh of the model.
pub(crate) struct MeshAsset<'a> {
    element: &'a Element,
    pub name: &'a str,
    /// Material of geoms that give none.
    pub material: Option<&'a str>,
    pub content: Content,
}

/// Facts of a mesh.
pub(crate) enum Content {
    /// No geom refers to it, so it was not read.
    Unused,
    /// Its file is missing: the error for geoms that need it.
    Missing(MjcfError),
    /// The mesh.
    Solid(Box<Solid>),
}

/// A mesh in the frame of its principal axes.
pub(crate) struct Solid {
    /// This frame in that of the file.
    pub frame: Frame,
    /// Volume in m^3, or area in m^2 of a shell.
    pub volume: f64,
    /// Half lengths of a box with the same mass and inertia.
    pub inertia_box: Vec3,
    /// Lowest and highest coordinates.
    bounds: [Vec3; 2],
    vertices: Vec<Vec3>,
    faces: Vec<[u32; 3]>,
    /// The mesh in the file's frame.
    raw: Triangles,
    /// Its hull, if it is known already.
    skin: Option<Skin>,
    /// `scale` mirrors the mesh.
    mirrored: bool,
    /// Largest number of vertices of the hull.
    most: Option<usize>,
}

/// Names of the meshes that geoms or their classes refer to.
pub(crate) fn used(root: &Element) -> BTreeSet<&str> {
    let mut names = BTreeSet::new();
    for section in sections(root, "worldbody").chain(sections(root, "default")) {
        collect(section, &mut names);
    }
    names
}

fn collect<'a>(element: &'a Element, names: &mut BTreeSet<&'a str>) {
    if element.name == "geom" {
        names.extend(element.text("mesh"));
    }
    element.children.iter().for_each(|child| collect(child, names));
}

impl<'a> MeshAsset<'a> {
    /// Reads a mesh, if it is used.
    pub fn read(
        attrs: &Attrs<'a>,
        name: &'a str,
        used: bool,
        settings: &Settings,
        file: &ReadFile,
        room: &Room,
    ) -> Result<MeshAsset<'a>, MjcfError> {
        let element = attrs.element;
        let content = if used { content(attrs, settings, file, room)? } else { Content::Unused };
        Ok(MeshAsset { element, name, material: attrs.text("material"), content })
    }
}

fn content(attrs: &Attrs, settings: &Settings, file: &ReadFile, room: &Room) -> Result<Content, MjcfError> {
    let element = attrs.element;
    let given = |name: &str| attrs.text(name);
    let raw = match (given("file"), given("builtin"), given("vertex")) {
        (None, None, None) => return Err(element.invalid("'file', 'builtin' or 'vertex' is missing")),
        (Some(_), None, None) => match from_file(attrs, settings, file)? {
            Ok(mesh) => mesh,
            Err(missing) => return Ok(Content::Missing(missing)),
        },
        (None, Some(_), None) => made(attrs)?,
        (None, None, Some(_)) => inline(attrs)?,
        _ => return Err(element.invalid("only one of 'file', 'builtin' and 'vertex' may be given")),
    };
    raw.check().map_err(|reason| element.invalid(reason))?;
    // points in three precisions, faces, edges, and the hull
    room.take_for(element, raw.vertices.len(), 250)?;
    room.take_for(element, raw.faces.len(), 100)?;
    Ok(Content::Solid(Box::new(solid(attrs, raw)?)))
}

/// The mesh of a file, or the error that the file is missing.
fn from_file(attrs: &Attrs, settings: &Settings, read: &ReadFile) -> Result<Result<Triangles, MjcfError>, MjcfError> {
    let Some((_, attr)) = attrs.find("file") else { return Err(attrs.element.invalid("'file' is missing")) };
    let path = settings.of(attrs.element).asset_path(&attr.value);
    let failed = |reason: String| attr.place.error(MjcfErrorKind::Read(format!("mesh file '{path}': {reason}")));
    let format = Format::of(&path, attrs.text("content_type")).map_err(failed);
    let bytes = match read(&path) {
        Ok(bytes) => bytes,
        Err(error) if error.missing => return Ok(Err(failed(error.reason))),
        Err(error) => return Err(failed(error.reason)),
    };
    mesh::read(format?, &bytes).map(Ok).map_err(failed)
}

/// `builtin` and `params`.
fn made(attrs: &Attrs) -> Result<Triangles, MjcfError> {
    let element = attrs.element;
    let Some(shape) = attrs.keyword("builtin", &BUILTIN)?.flatten() else {
        let made: Vec<&str> = BUILTIN.iter().filter(|(_, shape)| shape.is_some()).map(|(name, _)| *name).collect();
        return Err(element.unsupported(Some("builtin"), format!("only {} are supported", made.join(", "))));
    };
    let params = match attrs.find("params") {
        Some((owner, attr)) => super::value::numbers(owner, attr, 0, 100)?,
        None => return Err(element.invalid("the attribute 'params' is missing")),
    };
    builtin::make(shape, &params).map_err(|reason| element.invalid(reason))
}

/// `vertex` and `face`.
fn inline(attrs: &Attrs) -> Result<Triangles, MjcfError> {
    let vertices = triples(attrs, "vertex", MAX_VERTICES, "finite numbers", |x: &f32| x.is_finite())?;
    let faces = triples(attrs, "face", MAX_FACES, "vertices, counted from 0", |_: &u32| true)?;
    Ok(Triangles { vertices, faces })
}

/// Numbers in groups of three.
fn triples<T: std::str::FromStr + Copy>(
    attrs: &Attrs,
    name: &str,
    most: usize,
    expected: &str,
    valid: impl Fn(&T) -> bool,
) -> Result<Vec<[T; 3]>, MjcfError> {
    let Some((element, attr)) = attrs.find(name) else { return Ok(Vec::new()) };
    let bad = |found: String| element.bad_value(attr, format!("up to {most} groups of three {expected}{found}"));
    let word = |word: &str| word.parse().ok().filter(&valid).ok_or_else(|| bad(format!(", not '{word}'")));
    let numbers: Vec<T> =
        attr.value.split_ascii_whitespace().take(3 * most + 1).map(word).collect::<Result<_, MjcfError>>()?;
    let (groups, rest) = numbers.as_chunks::<3>();
    if !rest.is_empty() || groups.len() > most {
        return Err(bad(format!(", but there are {} numbers", attr.value.split_ascii_whitespace().count())));
    }
    Ok(groups.to_vec())
}

/// Moves a mesh into the frame of its principal axes.
fn solid(attrs: &Attrs, raw: Triangles) -> Result<Solid, MjcfError> {
    let invalid = |reason: String| attrs.element.invalid(reason);
    let inside = attrs.keyword("inertia", &INSIDE)?.unwrap_or(Inside::Legacy);
    let most = match attrs.integer_or("maxhullvert", -1)? {
        -1 => None,
        n @ 4.. => Some(n as usize),
        n => return Err(invalid(format!("maxhullvert is {n}, expected -1 or at least 4"))),
    };
    let mut vertices: Vec<Vec3> = raw.vertices.iter().map(|v| v.map(f64::from)).collect();
    if let Some([a, b]) = moments::inconsistent_edge(&vertices, &raw.faces).filter(|_| inside == Inside::Exact) {
        let message = "neighbors must run through their edge in opposite directions for inertia=\"exact\"";
        return Err(invalid(format!("two faces run from vertex {a} to vertex {b}; {message}")));
    }
    let hulled = raw.faces.is_empty() || inside == Inside::Convex;
    let skin = hulled.then(|| Skin::new(&raw, most)).transpose().map_err(invalid)?;
    let scale = placed(attrs, &mut vertices)?;
    let mirrored = !(scale[0] * scale[1] * scale[2] > 0.0);
    let turned = |faces: &[[u32; 3]]| -> Vec<[u32; 3]> {
        faces.iter().map(|&[a, b, c]| if mirrored { [a, c, b] } else { [a, b, c] }).collect()
    };
    let hull = skin.as_ref().map(|skin| turned(&skin.triangles));
    let faces = if raw.faces.is_empty() { hull.clone().unwrap_or_default() } else { turned(&raw.faces) };
    let filled = if inside == Inside::Convex { hull.as_ref().unwrap_or(&faces) } else { &faces };
    let moments = moments::moments(&vertices, &faces, filled, inside).map_err(invalid)?;
    let (principal, quat) = principal_axes_of_mesh(moments.inertia);
    let [a, b, c] = principal;
    if !(c > 0.0) {
        return Err(invalid(format!("its principal moments are {principal:?}, expected positive numbers")));
    }
    if b + c < a * (1.0 - 1e-6) - 1e-9 {
        return Err(invalid(format!("its principal moments {principal:?} belong to no body")));
    }
    let half = |sum: f64| 0.5 * (6.0 * sum / moments.volume).sqrt();
    let rows = axes(quat);
    let mut bounds = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
    for vertex in &mut vertices {
        let moved = sub(*vertex, moments.center);
        *vertex = rows.map(|axis| dot(axis, moved));
        for k in 0..3 {
            bounds[0][k] = bounds[0][k].min(vertex[k]);
            bounds[1][k] = bounds[1][k].max(vertex[k]);
        }
    }
    if !bounds.iter().flatten().chain(&[moments.volume]).all(|x| x.is_finite()) {
        return Err(invalid("its scale is too large to compute with".to_owned()));
    }
    Ok(Solid {
        frame: Frame { pos: moments.center, quat },
        volume: moments.volume,
        inertia_box: [half(b + c - a), half(a + c - b), half(a + b - c)],
        bounds,
        vertices,
        faces,
        raw,
        skin,
        mirrored,
        most,
    })
}

/// Applies `refpos`, `refquat` and `scale`, and returns the scale.
fn placed(attrs: &Attrs, vertices: &mut [Vec3]) -> Result<Vec3, MjcfError> {
    let refpos: Vec3 = attrs.array_or("refpos", [0.0; 3])?;
    let refquat = attrs.array_or("refquat", IDENTITY)?;
    let factors: Vec3 = attrs.array_or("scale", [1.0; 3])?;
    let rotation = axes(normalized(refquat));
    for vertex in vertices {
        if refpos != [0.0; 3] {
            *vertex = sub(*vertex, refpos);
        }
        if refquat != IDENTITY {
            *vertex = rotation.map(|axis| dot(axis, *vertex));
        }
        for (x, factor) in vertex.iter_mut().zip(factors) {
            *x *= factor;
        }
    }
    Ok(factors)
}

impl Solid {
    /// Half lengths of the box around the origin that holds the mesh.
    pub fn size(&self) -> Vec3 {
        let [low, high] = self.bounds;
        [0, 1, 2].map(|k| low[k].abs().max(high[k].abs()))
    }

    /// Fits a primitive: sets its size and returns its center. `None`: this type cannot be fitted.
    pub fn fit(&self, kind: GeomType, to_bounds: bool, size: &mut Vec3) -> Option<Vec3> {
        let [low, high] = self.bounds;
        let center = if to_bounds { [0, 1, 2].map(|k| (low[k] + high[k]) / 2.0) } else { [0.0; 3] };
        let [x, y, z] = if to_bounds { sub(high, center) } else { self.inertia_box };
        match (kind, to_bounds) {
            (GeomType::Sphere, true) => size[0] = x.max(y).max(z),
            (GeomType::Sphere, false) => size[0] = (x + y + z) / 3.0,
            (GeomType::Capsule, true) => (size[0], size[1]) = (x.max(y), z - x.max(y)),
            (GeomType::Capsule, false) => (size[0], size[1]) = ((x + y) / 2.0, (z - (x + y) / 4.0).max(0.0)),
            (GeomType::Cylinder, true) => (size[0], size[1]) = (x.max(y), z),
            (GeomType::Cylinder, false) => (size[0], size[1]) = ((x + y) / 2.0, z),
            (GeomType::Ellipsoid | GeomType::Box, _) => *size = [x, y, z],
            _ => return None,
        }
        Some(center)
    }
}

/// Adds the meshes that geoms show to the model, and the hulls of those that collide. Until then geoms have the number of the asset.
pub(crate) fn add(model: &mut Model, assets: &[MeshAsset], room: &Room) -> Result<(), MjcfError> {
    let mut colliding = vec![false; model.geoms.len()];
    model.pairs.iter().flat_map(|pair| pair.geoms).for_each(|g| colliding[g] = true);
    for (geom, collides) in model.geoms.iter().zip(&mut colliding) {
        *collides |= geom.contype != 0 || geom.conaffinity != 0;
    }
    for (i, asset) in assets.iter().enumerate() {
        let Content::Solid(solid) = &asset.content else { continue };
        let shows: Vec<usize> = (0..model.geoms.len()).filter(|g| model.geoms[*g].mesh == Some(i)).collect();
        if shows.is_empty() {
            continue;
        }
        let mut hull = None;
        if shows.iter().any(|g| colliding[*g]) {
            let found = match &solid.skin {
                Some(skin) => skin.clone(),
                None => Skin::new(&solid.raw, solid.most).map_err(|reason| asset.element.invalid(reason))?,
            };
            room.take_for(asset.element, solid.vertices.len(), 250)?;
            hull = Some(model.hulls.len());
            model.hulls.push(found.hull(&solid.vertices, solid.mirrored));
        }
        let vertices = solid.vertices.iter().map(|v| v.map(|x| x as f32)).collect();
        model.meshes.push(Mesh { name: asset.name.to_owned(), vertices, faces: solid.faces.clone() });
        for g in shows {
            // the number of the mesh is never above that of its asset, so no later asset takes the geom for its own
            model.geoms[g].mesh = Some(model.meshes.len() - 1);
            model.geoms[g].hull = hull.filter(|_| colliding[g]);
        }
    }
    Ok(())
}
