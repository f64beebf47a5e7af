//! Geoms, sites, height fields and declared contact pairs.

use super::{Quat, SolImp, SolRef, Vec3};
use serde::{Deserialize, Serialize};

/// Shape of a geom or site.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum GeomType {
    /// Infinite plane, normal along its z axis.
    Plane,
    /// Height field, [`Geom::hfield`]; `size` is the half lengths of the box around it.
    Hfield,
    /// `size[0]` radius.
    Sphere,
    /// `size[0]` radius, `size[1]` half length of the straight part, along z.
    Capsule,
    /// `size` semi-axes.
    Ellipsoid,
    /// `size[0]` radius, `size[1]` half length, along z.
    Cylinder,
    /// `size` half lengths.
    Box,
    /// Triangle mesh, [`Geom::mesh`]. It collides as its convex hull, [`Geom::hull`]. The geom's frame is that of the mesh's
    /// principal axes, `size` the half lengths of a box around its origin that holds the mesh. A mesh that neither collides nor has
    /// mass may lack its file: then the frame is the given one and `size` is zero.
    Mesh,
}

/// A geometric shape attached to a body.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Geom {
    /// Name; empty when the file gives none.
    pub name: String,
    /// Shape.
    pub kind: GeomType,
    /// Body it is attached to.
    pub body: usize,
    /// Position in the body's frame.
    pub pos: Vec3,
    /// Orientation in the body's frame.
    pub quat: Quat,
    /// Size, see [`GeomType`].
    pub size: Vec3,
    /// Index of the height field, for [`GeomType::Hfield`].
    pub hfield: Option<usize>,
    /// Index of the convex hull, for a [`GeomType::Mesh`] that collides.
    pub hull: Option<usize>,
    /// Index of the mesh, for a [`GeomType::Mesh`] whose file was found.
    pub mesh: Option<usize>,
    /// Bit mask: the collision type of this geom.
    pub contype: u32,
    /// Bit mask: the types that this geom collides with.
    pub conaffinity: u32,
    /// Dimension of the contact space: 1, 3, 4 or 6.
    pub condim: usize,
    /// Priority in the combination of contact parameters.
    pub priority: i32,
    /// Sliding, torsional, rolling friction.
    pub friction: Vec3,
    /// Weight in the mix of solver parameters.
    pub solmix: f64,
    /// Solver reference.
    pub solref: SolRef,
    /// Solver impedance.
    pub solimp: SolImp,
    /// Distance below which contacts are generated.
    pub margin: f64,
    /// Contacts are reported up to margin + gap. Beyond the margin they exert no force.
    pub gap: f64,
    /// Color, each in 0..=1.
    pub rgba: [f32; 4],
    /// Material name, if any; for viewers.
    pub material: Option<String>,
    /// User group, for viewers.
    pub group: i32,
    /// Forces of the medium on this geom, with `fluidshape="ellipsoid"`.
    pub fluid: Option<EllipsoidFluid>,
}

/// Coefficients of the medium's forces on a geom, which is like an ellipsoid to it (MuJoCo `geom_fluid`).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct EllipsoidFluid {
    /// Half lengths of the ellipsoid's axes, m.
    pub semiaxes: Vec3,
    /// Drag across the ellipsoid, along it, and against rotations.
    pub drag: [f64; 3],
    /// Lift by the shape (Kutta) and by rotations (Magnus).
    pub lift: [f64; 2],
    /// Mass of the medium that moves along, divided by its density, m^3.
    pub virtual_mass: Vec3,
    /// The same of its inertia, m^5.
    pub virtual_inertia: Vec3,
}

/// A point of interest fixed to a body.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Site {
    /// Name; empty when the file gives none.
    pub name: String,
    /// Shape, used by touch sensors and viewers.
    pub kind: GeomType,
    /// Body it is attached to.
    pub body: usize,
    /// Position in the body's frame.
    pub pos: Vec3,
    /// Orientation in the body's frame.
    pub quat: Quat,
    /// Size, see [`GeomType`].
    pub size: Vec3,
    /// Color.
    pub rgba: [f32; 4],
    /// User group, for viewers.
    pub group: i32,
}

/// A declared geom pair and its contact parameters.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Pair {
    /// The two geoms.
    pub geoms: [usize; 2],
    /// Contact dimension.
    pub condim: usize,
    /// Two sliding, one torsional, two rolling friction coefficients.
    pub friction: [f64; 5],
    /// Solver reference.
    pub solref: SolRef,
    /// Solver impedance.
    pub solimp: SolImp,
    /// Margin.
    pub margin: f64,
    /// Gap.
    pub gap: f64,
}

/// A height field: a grid of elevations over a rectangle, fixed in the geom's frame (MuJoCo `hfield_*`).
///
/// Column `c` lies at `x = size[0] * (2 c / (ncol - 1) - 1)`, row `r` at `y = size[1] * (2 r / (nrow - 1) - 1)`, and the
/// surface there at `z = size[2] * data[r * ncol + c]`. Below `z = 0` the ground is solid down to `-size[3]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct HField {
    /// Name.
    pub name: String,
    /// Number of rows, along y.
    pub nrow: usize,
    /// Number of columns, along x.
    pub ncol: usize,
    /// Half length along x, half length along y, elevation of the highest point, thickness of the base, all in m.
    pub size: [f64; 4],
    /// Elevations by rows, from 0 to 1.
    pub data: Vec<f32>,
}

/// A triangle mesh in the frame of the geoms that show it (MuJoCo `mesh_*`).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Mesh {
    /// Name.
    pub name: String,
    /// Points in m.
    pub vertices: Vec<[f32; 3]>,
    /// Three points of each triangle, counterclockwise from outside.
    pub faces: Vec<[u32; 3]>,
}
