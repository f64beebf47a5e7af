//! `<geom>` and `<site>`: shape, place, mass and inertia.

use super::asset::Assets;
use super::compiler::Settings;
use super::document::Element;
use super::error::MjcfError;
use super::fluid;
use super::math::*;
use super::mesh::{Content, MeshAsset};
use super::orientation::orientation;
use super::solver_params::{SOLIMP, SOLREF};
use super::value::Attrs;
use crate::model::{GeomType, Quat, SolImp, SolRef, Vec3};
use std::f64::consts::PI;

const TYPES: [(&str, Option<GeomType>); 9] = [
    ("plane", Some(GeomType::Plane)),
    ("hfield", Some(GeomType::Hfield)),
    ("sphere", Some(GeomType::Sphere)),
    ("capsule", Some(GeomType::Capsule)),
    ("ellipsoid", Some(GeomType::Ellipsoid)),
    ("cylinder", Some(GeomType::Cylinder)),
    ("box", Some(GeomType::Box)),
    ("mesh", Some(GeomType::Mesh)),
    ("sdf", None),
];

const NO_SDF: &str = "signed distance fields are not supported; type=\"mesh\" collides as the convex hull";

/// Color of shapes that give neither color nor material.
const GRAY: [f32; 4] = [0.5, 0.5, 0.5, 1.0];

/// Shape and place of a geom or site, in the frame of its body.
pub(crate) struct ShapeSpec {
    pub kind: GeomType,
    pub frame: Frame,
    pub size: Vec3,
    /// Height field that it shows.
    pub hfield: Option<usize>,
    /// Mesh that it shows, if its file was found.
    pub solid: Option<ShownMesh>,
    /// Color of its own, if it differs from the default.
    pub rgba: [f32; 4],
    pub group: i32,
}

/// The mesh of a geom.
#[derive(Clone, Copy)]
pub(crate) struct ShownMesh {
    /// Number of the asset.
    pub mesh: usize,
    /// Volume, or area of a shell.
    volume: f64,
    /// Half lengths of a box with the same inertia.
    inertia_box: Vec3,
}

/// A geom as the file describes it.
pub(crate) struct GeomSpec<'a> {
    pub element: &'a Element,
    pub shape: ShapeSpec,
    pub surface: Surface,
    pub material: Option<&'a str>,
    /// Why its mesh is missing.
    missing: Option<MjcfError>,
    pub mass: Option<f64>,
    pub density: f64,
    /// Coefficients of the medium's forces, if it takes the geom for an ellipsoid.
    pub fluid: Option<[f64; 5]>,
}

/// Contact parameters of a geom.
pub(crate) struct Surface {
    pub contype: u32,
    pub conaffinity: u32,
    pub condim: usize,
    pub priority: i32,
    pub friction: Vec3,
    pub solmix: f64,
    pub solref: SolRef,
    pub solimp: SolImp,
    pub margin: f64,
    pub gap: f64,
}

impl Surface {
    fn read(attrs: &Attrs) -> Result<Self, MjcfError> {
        let condim = attrs.integer_or("condim", 3)?;
        if !matches!(condim, 1 | 3 | 4 | 6) {
            return Err(attrs.element.invalid(format!("condim is {condim}; expected 1, 3, 4 or 6")));
        }
        Ok(Surface {
            // the masks are 32 bits wide; a negative number sets the highest
            contype: attrs.integer_or("contype", 1)? as u32,
            conaffinity: attrs.integer_or("conaffinity", 1)? as u32,
            condim: condim as usize,
            priority: attrs.integer_or("priority", 0)?,
            friction: attrs.partial_or("friction", [1.0, 0.005, 0.0001])?,
            solmix: attrs.number_or("solmix", 1.0)?,
            solref: attrs.partial_or("solref", SOLREF)?,
            solimp: attrs.partial_or("solimp", SOLIMP)?,
            margin: attrs.number_or("margin", 0.0)?,
            gap: attrs.number_or("gap", 0.0)?,
        })
    }
}

/// Checks the values of a `<geom>` or `<site>` that sets defaults.
pub(crate) fn check_default(attrs: &Attrs, settings: &Settings) -> Result<(), MjcfError> {
    ShapeValues::read(attrs, settings, [0.0; 3])?;
    if attrs.element.name == "geom" {
        Surface::read(attrs)?;
        fluid::read(attrs)?;
        attrs.array::<1>("mass")?;
        attrs.array::<1>("density")?;
    }
    Ok(())
}

impl GeomSpec<'_> {
    /// Reads a geom with its defaults; `outer` is the frame of enclosing `<frame>` elements.
    pub fn read<'a>(
        attrs: &Attrs<'a>,
        outer: &Frame,
        settings: &Settings,
        assets: &Assets<'a>,
    ) -> Result<GeomSpec<'a>, MjcfError> {
        let shape = ShapeSpec::read(attrs, outer, settings, [0.0; 3], Some(assets))?;
        let surface = Surface::read(attrs)?;
        let asset = attrs.text("mesh").and_then(|name| assets.mesh_names.get(name)).map(|i| &assets.meshes[i]);
        let missing = asset.and_then(|asset| match &asset.content {
            Content::Missing(error) => Some(error.clone()),
            Content::Unused | Content::Solid(_) => None,
        });
        match missing {
            Some(error) if surface.contype != 0 || surface.conaffinity != 0 => return Err(error),
            _ => {}
        }
        let inherited = asset.filter(|_| shape.kind == GeomType::Mesh).and_then(|asset| asset.material);
        Ok(GeomSpec {
            element: attrs.element,
            shape,
            surface,
            material: attrs.text("material").or(inherited),
            missing,
            mass: attrs.array::<1>("mass")?.map(|m| m[0]),
            density: attrs.number_or("density", 1000.0)?,
            fluid: fluid::read(attrs)?,
        })
    }

    /// Mass and principal moments in the geom's own frame.
    pub fn mass_and_inertia(&self) -> Result<(f64, Vec3), MjcfError> {
        match &self.missing {
            Some(error) if self.mass.unwrap_or(self.density) != 0.0 => return Err(error.clone()),
            _ => {}
        }
        let volume = self.shape.volume();
        let mass = match self.mass {
            Some(mass) if mass == 0.0 || volume > EPS => mass,
            Some(_) => 0.0,
            None => self.density * volume,
        };
        if mass < 0.0 || self.density < 0.0 {
            return Err(self.element.invalid("mass and density must not be negative"));
        }
        Ok((mass, self.shape.inertia_of_unit_mass().map(|x| x * mass)))
    }
}

/// The attributes of a shape, not yet put together: those of a class may be completed by the element.
struct ShapeValues {
    kind: Option<GeomType>,
    size: Vec3,
    pos: Vec3,
    quat: Option<Quat>,
    ends: Option<[f64; 6]>,
    rgba: [f32; 4],
    group: i32,
}

impl ShapeValues {
    fn read(attrs: &Attrs, settings: &Settings, size: Vec3) -> Result<Self, MjcfError> {
        Ok(ShapeValues {
            kind: attrs.keyword("type", &TYPES)?.unwrap_or(Some(GeomType::Sphere)),
            size: attrs.partial_or("size", size)?,
            pos: attrs.array_or("pos", [0.0; 3])?,
            quat: orientation(attrs, settings)?,
            ends: attrs.array("fromto")?,
            rgba: attrs.rgba()?.unwrap_or(GRAY),
            group: attrs.integer_or("group", 0)?,
        })
    }
}

impl ShapeSpec {
    /// Reads type, size, place and color. `size` is the default size; a site has no `assets` to show.
    pub fn read(
        attrs: &Attrs,
        outer: &Frame,
        settings: &Settings,
        size: Vec3,
        assets: Option<&Assets>,
    ) -> Result<Self, MjcfError> {
        let element = attrs.element;
        let values = ShapeValues::read(attrs, settings, size)?;
        let Some(kind) = values.kind else {
            return Err(element.unsupported(Some("type"), NO_SDF));
        };
        let (mut size, mut hfield, mut mesh) = (values.size, None, None);
        let on_asset = matches!(kind, GeomType::Hfield | GeomType::Mesh);
        match assets {
            Some(assets) => {
                hfield = shown_field(attrs, kind, assets)?;
                mesh = shown_mesh(attrs, kind, assets)?;
                if let Some(hfield) = hfield {
                    let [x, y, top, base] = assets.hfields[hfield].size;
                    size = [x, y, 0.25 * top + 0.5 * base];
                }
            }
            None if on_asset || kind == GeomType::Plane => {
                return Err(element.invalid("a site cannot be a plane, a height field or a mesh"));
            }
            None => {}
        }
        let local = match values.ends {
            None => Frame { pos: values.pos, quat: values.quat.unwrap_or(IDENTITY) },
            Some(_) if values.pos != [0.0; 3] => {
                return Err(element.invalid("there are both 'pos' and 'fromto'"));
            }
            Some(_) if mesh.is_some() => return Err(element.invalid("'fromto' does not go with a mesh")),
            Some(ends) => from_to(element, kind, ends, &mut size)?,
        };
        let (frame, solid) = match mesh {
            Some((index, asset)) => on_mesh(attrs, kind, index, asset, settings, &local, &mut size)?,
            None => (local, None),
        };
        if kind != GeomType::Mesh {
            check_size(element, kind, size)?;
        }
        let (rgba, group) = (values.rgba, values.group);
        Ok(ShapeSpec { kind, frame: outer.compose(&frame), size, hfield, solid, rgba, group })
    }

    /// Whether the color is the default, in which case a material's color counts.
    pub fn colorless(&self) -> bool {
        self.rgba == GRAY
    }

    /// Volume; 0 for a plane, the area for a shell.
    pub fn volume(&self) -> f64 {
        let [a, b, c] = self.size;
        match self.kind {
            GeomType::Sphere => 4.0 * PI * a * a * a / 3.0,
            GeomType::Capsule => PI * (a * a * 2.0 * b + 4.0 * a * a * a / 3.0),
            GeomType::Cylinder => PI * a * a * 2.0 * b,
            GeomType::Ellipsoid => 4.0 * PI * a * b * c / 3.0,
            // as in MuJoCo, a height field weighs as much as a box of its size
            GeomType::Box | GeomType::Hfield => 8.0 * a * b * c,
            GeomType::Mesh => self.solid.map_or(0.0, |solid| solid.volume),
            GeomType::Plane => 0.0,
        }
    }

    /// Principal moments about the center of the solid shape, for a mass of 1.
    fn inertia_of_unit_mass(&self) -> Vec3 {
        let [a, b, c] = self.solid.map_or(self.size, |solid| solid.inertia_box);
        match self.kind {
            GeomType::Sphere => [2.0 * a * a / 5.0; 3],
            GeomType::Capsule => {
                // a cylinder and two half balls, whose centers of mass are 3/8 of the radius from their flat sides
                let height = 2.0 * b;
                let ball = 4.0 * a / (4.0 * a + 3.0 * height);
                let rod = 1.0 - ball;
                let ball_axial = 2.0 * a * a / 5.0;
                let ball_offset = height * (3.0 * a + 2.0 * height) / 8.0;
                let across = rod * (3.0 * a * a + height * height) / 12.0 + ball * (ball_axial + ball_offset);
                let along = rod * a * a / 2.0 + ball * ball_axial;
                [across, across, along]
            }
            GeomType::Cylinder => {
                let across = (3.0 * a * a + 4.0 * b * b) / 12.0;
                [across, across, a * a / 2.0]
            }
            GeomType::Ellipsoid => [b * b + c * c, a * a + c * c, a * a + b * b].map(|x| x / 5.0),
            GeomType::Box | GeomType::Hfield | GeomType::Mesh => {
                [b * b + c * c, a * a + c * c, a * a + b * b].map(|x| x / 3.0)
            }
            GeomType::Plane => [0.0; 3],
        }
    }
}

/// The height field that a geom shows; checks that its type and its asset agree.
fn shown_field(attrs: &Attrs, kind: GeomType, assets: &Assets) -> Result<Option<usize>, MjcfError> {
    let element = attrs.element;
    let given = |name: &str| attrs.find(name).filter(|(_, attr)| !attr.value.is_empty());
    match (kind, given("hfield")) {
        (GeomType::Hfield, Some((owner, _))) => assets.hfield_names.required(owner, "hfield").map(Some),
        (GeomType::Hfield, None) => Err(element.invalid("a height field needs the attribute 'hfield'")),
        (_, Some(_)) => Err(element.invalid("'hfield' needs type=\"hfield\"")),
        (_, None) => Ok(None),
    }
}

/// The mesh that a geom shows or is fitted to.
fn shown_mesh<'s>(
    attrs: &Attrs,
    kind: GeomType,
    assets: &'s Assets,
) -> Result<Option<(usize, &'s MeshAsset<'s>)>, MjcfError> {
    match attrs.find("mesh").filter(|(_, attr)| !attr.value.is_empty()) {
        Some((owner, _)) => {
            let index = assets.mesh_names.required(owner, "mesh")?;
            Ok(Some((index, &assets.meshes[index])))
        }
        None if kind == GeomType::Mesh => Err(attrs.element.invalid("a mesh needs the attribute 'mesh'")),
        None => Ok(None),
    }
}

/// The frame of a geom on a mesh, whose own frame is `local`. Sets the size, and returns the mesh unless a primitive replaces it.
fn on_mesh(
    attrs: &Attrs,
    kind: GeomType,
    index: usize,
    asset: &MeshAsset,
    settings: &Settings,
    local: &Frame,
    size: &mut Vec3,
) -> Result<(Frame, Option<ShownMesh>), MjcfError> {
    let solid = match &asset.content {
        Content::Solid(solid) => solid,
        // it is only seen, or the geom is refused
        Content::Missing(_) if kind == GeomType::Mesh => {
            *size = [0.0; 3];
            return Ok((*local, None));
        }
        Content::Missing(error) => return Err(error.clone()),
        Content::Unused => return Err(attrs.element.invalid(format!("the mesh '{}' was not read", asset.name))),
    };
    if kind == GeomType::Mesh {
        *size = solid.size();
        let shown = ShownMesh { mesh: index, volume: solid.volume, inertia_box: solid.inertia_box };
        return Ok((local.compose(&solid.frame), Some(shown)));
    }
    let Some(center) = solid.fit(kind, settings.of(attrs.element).fitaabb, size) else {
        let message = "a mesh can be fitted by a sphere, capsule, cylinder, ellipsoid or box, not by this type";
        return Err(attrs.element.invalid(message));
    };
    *size = scale(*size, attrs.number_or("fitscale", 1.0)?);
    Ok((local.compose(&Frame { pos: solid.frame.point(center), quat: solid.frame.quat }), None))
}

/// The frame between two end points, its z axis towards the first; sets the length in `size`.
fn from_to(element: &Element, kind: GeomType, ends: [f64; 6], size: &mut Vec3) -> Result<Frame, MjcfError> {
    if !matches!(kind, GeomType::Capsule | GeomType::Cylinder | GeomType::Ellipsoid | GeomType::Box) {
        return Err(element.invalid("'fromto' requires a capsule, cylinder, ellipsoid or box"));
    }
    let [a, b, c, d, e, f] = ends;
    let (from, to) = ([a, b, c], [d, e, f]);
    let axis = sub(from, to);
    let half = norm(axis) / 2.0;
    let Some(z) = unit(axis).filter(|_| half >= EPS) else {
        return Err(element.invalid("the two points of 'fromto' coincide"));
    };
    if matches!(kind, GeomType::Ellipsoid | GeomType::Box) {
        *size = [size[0], size[0], half];
    } else {
        size[1] = half;
    }
    Ok(Frame { pos: scale(add(from, to), 0.5), quat: from_z_axis(z) })
}

fn check_size(element: &Element, kind: GeomType, size: Vec3) -> Result<(), MjcfError> {
    let needed = match kind {
        GeomType::Plane => {
            if size[0] < 0.0 || size[1] < 0.0 || size[2] <= 0.0 {
                let message = "a plane's size is two lengths (0 for infinite) and a grid spacing greater than zero";
                return Err(element.invalid(message));
            }
            return Ok(());
        }
        GeomType::Sphere => 1,
        GeomType::Capsule | GeomType::Cylinder => 2,
        _ => 3,
    };
    match size[..needed].iter().position(|s| !(*s > 0.0)) {
        Some(i) => {
            Err(element.invalid(format!("size {} of {needed} is {}; it must be greater than zero", i + 1, size[i])))
        }
        None => Ok(()),
    }
}
