//! `<geom>` and `<site>`: shape, place, mass and inertia.

use super::asset::Assets;
use super::document::Element;
use super::error::MjcfError;
use super::math::*;
use super::orientation::orientation;
use super::settings::Settings;
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

/// Why a mesh is refused.
pub(crate) const NO_MESH: &str = "meshes are not supported unless they neither collide (contype and conaffinity 0) nor \
                                  weigh; use a capsule, box, sphere, cylinder or ellipsoid";

/// Color of shapes that give neither color nor material.
const GRAY: [f32; 4] = [0.5, 0.5, 0.5, 1.0];

/// Shape and place of a geom or site, in the frame of its body.
pub(crate) struct ShapeSpec {
    pub kind: GeomType,
    pub frame: Frame,
    pub size: Vec3,
    /// Height field that it shows.
    pub hfield: Option<usize>,
    /// Color of its own, if it differs from the default.
    pub rgba: [f32; 4],
    pub group: i32,
}

/// A geom as the file describes it.
pub(crate) struct GeomSpec<'a> {
    pub element: &'a Element,
    pub shape: ShapeSpec,
    pub surface: Surface,
    pub material: Option<&'a str>,
    pub mass: Option<f64>,
    pub density: f64,
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
        assets: &Assets,
    ) -> Result<GeomSpec<'a>, MjcfError> {
        let ellipsoid = attrs.keyword("fluidshape", &[("none", false), ("ellipsoid", true)])?.unwrap_or(false);
        if let Some((element, _)) = attrs.find("fluidshape").filter(|_| ellipsoid && settings.medium) {
            let reason = "the ellipsoid model of the medium's forces is not supported; only fluidshape=\"none\" is";
            return Err(element.unsupported(Some("fluidshape"), reason));
        }
        let shape = ShapeSpec::read(attrs, outer, settings, [0.0; 3], Some(assets))?;
        let surface = Surface::read(attrs)?;
        if shape.kind == GeomType::Mesh && (surface.contype != 0 || surface.conaffinity != 0) {
            return Err(attrs.element.unsupported(Some("mesh"), NO_MESH));
        }
        Ok(GeomSpec {
            element: attrs.element,
            shape,
            surface,
            material: attrs.text("material"),
            mass: attrs.array::<1>("mass")?.map(|m| m[0]),
            density: attrs.number_or("density", 1000.0)?,
        })
    }

    /// Mass and principal moments in the geom's own frame.
    pub fn mass_and_inertia(&self) -> Result<(f64, Vec3), MjcfError> {
        if self.shape.kind == GeomType::Mesh && self.mass.unwrap_or(self.density) != 0.0 {
            return Err(self.element.unsupported(Some("mesh"), NO_MESH));
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
            return Err(element.unsupported(Some("type"), NO_MESH));
        };
        let (mut size, mut hfield) = (values.size, None);
        let on_asset = matches!(kind, GeomType::Hfield | GeomType::Mesh);
        match assets {
            Some(assets) => {
                hfield = shown_asset(attrs, kind, assets)?;
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
            Some(ends) => from_to(element, kind, ends, &mut size)?,
        };
        if kind == GeomType::Mesh {
            // its extent is unknown
            size = [0.0; 3];
        } else {
            check_size(element, kind, size)?;
        }
        Ok(ShapeSpec { kind, frame: outer.compose(&local), size, hfield, rgba: values.rgba, group: values.group })
    }

    /// Whether the color is the default, in which case a material's color counts.
    pub fn colorless(&self) -> bool {
        self.rgba == GRAY
    }

    /// Volume; 0 for a plane.
    pub fn volume(&self) -> f64 {
        let [a, b, c] = self.size;
        match self.kind {
            GeomType::Sphere => 4.0 * PI * a * a * a / 3.0,
            GeomType::Capsule => PI * (a * a * 2.0 * b + 4.0 * a * a * a / 3.0),
            GeomType::Cylinder => PI * a * a * 2.0 * b,
            GeomType::Ellipsoid => 4.0 * PI * a * b * c / 3.0,
            // as in MuJoCo, a height field weighs as much as a box of its size
            GeomType::Box | GeomType::Hfield => 8.0 * a * b * c,
            GeomType::Plane | GeomType::Mesh => 0.0,
        }
    }

    /// Principal moments about the center of the solid shape, for a mass of 1.
    fn inertia_of_unit_mass(&self) -> Vec3 {
        let [a, b, c] = self.size;
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
            GeomType::Box | GeomType::Hfield => [b * b + c * c, a * a + c * c, a * a + b * b].map(|x| x / 3.0),
            GeomType::Plane | GeomType::Mesh => [0.0; 3],
        }
    }
}

/// The height field that a geom shows; checks that its type and its asset agree.
fn shown_asset(attrs: &Attrs, kind: GeomType, assets: &Assets) -> Result<Option<usize>, MjcfError> {
    let element = attrs.element;
    let given = |name: &str| attrs.find(name).filter(|(_, attr)| !attr.value.is_empty());
    match (kind, given("hfield")) {
        (GeomType::Hfield, Some((owner, _))) => return assets.hfield_names.required(owner, "hfield").map(Some),
        (GeomType::Hfield, None) => return Err(element.invalid("a height field needs the attribute 'hfield'")),
        (_, Some(_)) => return Err(element.invalid("'hfield' needs type=\"hfield\"")),
        (_, None) => {}
    }
    match (kind, given("mesh")) {
        (GeomType::Mesh, Some((owner, _))) => assets.mesh_names.required(owner, "mesh").map(|_| None),
        (GeomType::Mesh, None) => Err(element.invalid("a mesh needs the attribute 'mesh'")),
        // a primitive fitted to a mesh
        (_, Some((owner, _))) => Err(owner.unsupported(Some("mesh"), NO_MESH)),
        (_, None) => Ok(None),
    }
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
