//! The drawable shapes, and closed forms of their intersections with a ray.

use crate::mesh::Triangles;
use glam::{DMat3, DVec3};
use std::sync::Arc;

/// A shape in its own frame; sizes in m, named as in MuJoCo.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    /// Ball about the origin.
    Sphere {
        /// Radius.
        radius: f64,
    },
    /// Rounded rod along z.
    Capsule {
        /// Radius.
        radius: f64,
        /// Half length of the straight part.
        half: f64,
    },
    /// Box about the origin.
    Box {
        /// Half lengths.
        half: [f64; 3],
    },
    /// Ellipsoid about the origin.
    Ellipsoid {
        /// Semi-axes.
        semi: [f64; 3],
    },
    /// Cylinder along z with flat ends.
    Cylinder {
        /// Radius.
        radius: f64,
        /// Half length.
        half: f64,
    },
}

/// Intersection of a ray with the surface of a shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance along the ray, m.
    pub distance: f64,
    /// Outward unit normal.
    pub normal: [f64; 3],
}

impl Shape {
    /// First entry of the ray `origin + t * direction`, `t > 0`, into the shape, all in the shape's frame.
    ///
    /// `direction` must have unit length. A ray that starts inside hits nothing, because surfaces are visible from
    /// outside only.
    pub fn intersect(&self, origin: [f64; 3], direction: [f64; 3]) -> Option<Hit> {
        let (t, normal) = self.enter(DVec3::from_array(origin), DVec3::from_array(direction))?;
        Some(Hit { distance: t, normal: normal.to_array() })
    }

    #[inline]
    pub(crate) fn enter(&self, o: DVec3, d: DVec3) -> Option<(f64, DVec3)> {
        match *self {
            Shape::Sphere { radius } => sphere(o, d, radius),
            Shape::Capsule { radius, half } => capsule(o, d, radius, half),
            Shape::Box { half } => cuboid(o, d, DVec3::from_array(half)),
            Shape::Ellipsoid { semi } => ellipsoid(o, d, DVec3::from_array(semi)),
            Shape::Cylinder { radius, half } => cylinder(o, d, radius, half),
        }
    }

    /// Radius of the smallest ball about the origin that contains the shape.
    pub(crate) fn bounding_radius(&self) -> f64 {
        match *self {
            Shape::Sphere { radius } => radius,
            Shape::Capsule { radius, half } => radius + half,
            Shape::Box { half } => DVec3::from_array(half).length(),
            Shape::Ellipsoid { semi } => DVec3::from_array(semi).max_element(),
            Shape::Cylinder { radius, half } => (radius * radius + half * half).sqrt(),
        }
    }

    /// A rod that contains the shape: axis, half length of the straight part, radius. Exact for spheres and capsules.
    pub(crate) fn hull_rod(&self) -> (DVec3, f64, f64) {
        match *self {
            Shape::Sphere { radius } => (DVec3::Z, 0.0, radius),
            Shape::Capsule { radius, half } | Shape::Cylinder { radius, half } => (DVec3::Z, half, radius),
            Shape::Box { half } => {
                let (axis, long, others) = longest(half);
                (axis, long, (others[0] * others[0] + others[1] * others[1]).sqrt())
            }
            Shape::Ellipsoid { semi } => {
                let (axis, long, others) = longest(semi);
                (axis, long, others[0].max(others[1]))
            }
        }
    }

    /// A rod of about the shape's volume, for soft effects: axis, half length of the straight part, radius.
    pub(crate) fn soft_rod(&self) -> (DVec3, f64, f64) {
        match *self {
            Shape::Box { half: size } | Shape::Ellipsoid { semi: size } => {
                let (axis, long, others) = longest(size);
                let radius = (others[0] * others[1]).sqrt();
                (axis, (long - radius).max(0.0), radius)
            }
            Shape::Cylinder { radius, half } => (DVec3::Z, (half - radius).max(0.0), radius.min(half)),
            _ => self.hull_rod(),
        }
    }
}

/// The longest of three half lengths: its axis, its value, the other two.
fn longest(size: [f64; 3]) -> (DVec3, f64, [f64; 2]) {
    let [x, y, z] = size;
    if z >= x && z >= y {
        (DVec3::Z, z, [x, y])
    } else if x >= y {
        (DVec3::X, x, [y, z])
    } else {
        (DVec3::Y, y, [x, z])
    }
}

#[inline]
fn sphere(o: DVec3, d: DVec3, radius: f64) -> Option<(f64, DVec3)> {
    // the foot of the perpendicular stays accurate far from the ball, where b*b - c would not
    let b = o.dot(d);
    let foot = o - b * d;
    let disc = radius * radius - foot.length_squared();
    if disc < 0.0 {
        return None;
    }
    let t = -b - disc.sqrt();
    (t > 0.0).then(|| (t, (o + t * d) / radius))
}

#[inline]
fn capsule(o: DVec3, d: DVec3, radius: f64, half: f64) -> Option<(f64, DVec3)> {
    let a = d.x * d.x + d.y * d.y;
    if a < 1e-18 {
        // along the axis: only the cap that faces the ray can be hit
        return cap(o, d, radius, -half * d.z.signum());
    }
    let b = o.x * d.x + o.y * d.y;
    let cross = o.x * d.y - o.y * d.x;
    let disc = radius * radius * a - cross * cross;
    if disc < 0.0 {
        return None;
    }
    let t = (-b - disc.sqrt()) / a;
    let z = o.z + t * d.z;
    if z.abs() > half {
        // a ray that enters the infinite cylinder beyond an end must pass that end's cap first
        return cap(o, d, radius, half * z.signum());
    }
    (t > 0.0).then(|| {
        let p = o + t * d;
        (t, DVec3::new(p.x, p.y, 0.0) / radius)
    })
}

#[inline]
fn cap(o: DVec3, d: DVec3, radius: f64, z: f64) -> Option<(f64, DVec3)> {
    sphere(o - DVec3::new(0.0, 0.0, z), d, radius)
}

#[inline]
fn cuboid(o: DVec3, d: DVec3, half: DVec3) -> Option<(f64, DVec3)> {
    // slabs (Kay and Kajiya 1986); a ray parallel to a slab gives +-infinity, which the comparisons handle
    let (mut enter, mut leave) = (f64::NEG_INFINITY, f64::INFINITY);
    let mut normal = DVec3::ZERO;
    for i in 0..3 {
        if d[i] == 0.0 {
            if o[i].abs() > half[i] {
                return None;
            }
            continue;
        }
        let toward = -d[i].signum();
        let t_in = (toward * half[i] - o[i]) / d[i];
        let t_out = (-toward * half[i] - o[i]) / d[i];
        if t_in > enter {
            enter = t_in;
            normal = DVec3::ZERO;
            normal[i] = toward;
        }
        leave = leave.min(t_out);
    }
    (enter > 0.0 && enter <= leave).then_some((enter, normal))
}

#[inline]
fn ellipsoid(o: DVec3, d: DVec3, semi: DVec3) -> Option<(f64, DVec3)> {
    // a unit sphere in scaled space; distances along the ray scale by |d / semi|
    let (so, sd) = (o / semi, d / semi);
    let scale = sd.length();
    let (t, n) = sphere(so, sd / scale, 1.0)?;
    Some((t / scale, (n / semi).normalize()))
}

#[inline]
fn cylinder(o: DVec3, d: DVec3, radius: f64, half: f64) -> Option<(f64, DVec3)> {
    let (mut enter, mut leave) = (f64::NEG_INFINITY, f64::INFINITY);
    let mut flat = false;

    // the round side
    let a = d.x * d.x + d.y * d.y;
    if a < 1e-18 {
        if o.x * o.x + o.y * o.y > radius * radius {
            return None;
        }
    } else {
        let b = o.x * d.x + o.y * d.y;
        let cross = o.x * d.y - o.y * d.x;
        let disc = radius * radius * a - cross * cross;
        if disc < 0.0 {
            return None;
        }
        let root = disc.sqrt();
        (enter, leave) = ((-b - root) / a, (-b + root) / a);
    }

    // the flat ends
    if d.z == 0.0 {
        if o.z.abs() > half {
            return None;
        }
    } else {
        let toward = -d.z.signum();
        let t_in = (toward * half - o.z) / d.z;
        if t_in > enter {
            enter = t_in;
            flat = true;
        }
        leave = leave.min((-toward * half - o.z) / d.z);
    }

    (enter > 0.0 && enter <= leave).then(|| {
        let p = o + enter * d;
        let normal = if flat { DVec3::new(0.0, 0.0, -d.z.signum()) } else { DVec3::new(p.x, p.y, 0.0) / radius };
        (enter, normal)
    })
}

/// A shape placed in the world, with its color.
#[derive(Clone, Debug)]
pub(crate) struct Solid {
    /// Of a mesh, its box.
    pub shape: Shape,
    pub mesh: Option<Arc<Triangles>>,
    pub pos: DVec3,
    /// Columns are the shape's axes in the world.
    pub rot: DMat3,
    /// World to shape.
    pub inverse: DMat3,
    /// Linear light.
    pub color: DVec3,
    /// Opacity, 0..=1.
    pub alpha: f64,
    /// Whether it is part of a ghost: ghosts cast no shadow, and a ray passes through at most one of their surfaces.
    pub ghost: bool,
}

impl Solid {
    pub fn new(shape: Shape, pos: DVec3, rot: DMat3, color: DVec3, alpha: f64) -> Self {
        Self { shape, mesh: None, pos, rot, inverse: rot.transpose(), color, alpha, ghost: false }
    }

    /// First entry of a world ray and the world normal there.
    #[inline]
    pub fn enter(&self, o: DVec3, d: DVec3) -> Option<(f64, DVec3)> {
        let (o, d) = (self.inverse * (o - self.pos), self.inverse * d);
        let (t, normal) = match &self.mesh {
            None => self.shape.enter(o, d)?,
            Some(mesh) => mesh.enter(o, d)?,
        };
        Some((t, self.rot * normal))
    }

    /// Whether a world ray enters it.
    #[inline]
    pub fn stops(&self, o: DVec3, d: DVec3) -> bool {
        let (o, d) = (self.inverse * (o - self.pos), self.inverse * d);
        match &self.mesh {
            None => self.shape.enter(o, d).is_some(),
            Some(mesh) => mesh.stops(o, d),
        }
    }

    /// Ends and radius of a rod around the solid.
    pub fn hull_rod(&self) -> (DVec3, DVec3, f64) {
        self.place(self.shape.hull_rod())
    }

    /// Ends and radius of a rod of about the solid's volume.
    pub fn soft_rod(&self) -> (DVec3, DVec3, f64) {
        self.place(self.shape.soft_rod())
    }

    fn place(&self, (axis, half, radius): (DVec3, f64, f64)) -> (DVec3, DVec3, f64) {
        let arm = half * (self.rot * axis);
        (self.pos - arm, self.pos + arm, radius)
    }
}

/// An infinite or bounded plane, seen from its front only.
#[derive(Clone, Debug)]
pub(crate) struct Plane {
    pub pos: DVec3,
    /// Columns are the plane's axes in the world; the last is its normal.
    pub rot: DMat3,
    /// Half lengths along x and y; infinite where not positive.
    pub half: [f64; 2],
}

impl Plane {
    pub fn normal(&self) -> DVec3 {
        self.rot.z_axis
    }

    /// Distance along the ray to the front of the plane.
    #[inline]
    pub fn enter(&self, o: DVec3, d: DVec3) -> Option<f64> {
        let slope = self.normal().dot(d);
        let height = self.normal().dot(o - self.pos);
        if slope >= 0.0 || height <= 0.0 {
            return None;
        }
        let t = -height / slope;
        let local = o + t * d - self.pos;
        let inside = |half: f64, axis: DVec3| half <= 0.0 || local.dot(axis).abs() <= half;
        (inside(self.half[0], self.rot.x_axis) && inside(self.half[1], self.rot.y_axis)).then_some(t)
    }
}
