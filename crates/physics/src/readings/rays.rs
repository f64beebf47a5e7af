//! Rays against shapes, and the range finder.
//!
//! Planes are only hit on their front, other shapes also from inside. Distances are in units of the ray's direction.

use super::Readings;
use super::hfield::{Grid, ray_hfield};
use super::ray::{Hit, TINY, along, normalized, ray_face};
use crate::algebra::spatial::*;
use crate::lanes::Real;
use crate::model::GeomType;

/// The ray from `p` along `d` against a shape, all in the shape's frame. Height fields and meshes are not hit here.
#[inline(always)]
pub(super) fn ray_shape<T: Real>(kind: GeomType, size: &V3<T>, p: &V3<T>, d: &V3<T>) -> Hit<T> {
    let mut hit = Hit::none();
    match kind {
        GeomType::Plane => ray_plane(size, p, d, &mut hit),
        GeomType::Sphere => ray_ellipsoid(&[size[0]; 3], p, d, &mut hit),
        GeomType::Ellipsoid => ray_ellipsoid(size, p, d, &mut hit),
        GeomType::Capsule => {
            ray_tube(size, p, d, &mut hit);
            ray_cap(size, T::lit(1.0), p, d, &mut hit);
            ray_cap(size, T::lit(-1.0), p, d, &mut hit);
        }
        GeomType::Cylinder => {
            ray_disks(size, p, d, &mut hit);
            ray_tube(size, p, d, &mut hit);
        }
        GeomType::Box => ray_box(size, p, d, &mut hit),
        GeomType::Hfield | GeomType::Mesh => {}
    }
    hit
}

/// Roots of `a x^2 + 2 b x + c`, the smaller first, and the lanes where they are real and distinct.
#[inline(always)]
fn roots<T: Real>(a: T, b: T, c: T) -> (T::Mask, [T; 2]) {
    let det = b.mul_add(b, -(a * c));
    let ok = T::and(T::not(det.lt(T::lit(TINY))), T::lit(TINY).lt(a));
    let (root, inv) = (det.max(T::zero()).sqrt(), T::select(ok, a, T::lit(1.0)).recip());
    (ok, [-(b + root) * inv, (root - b) * inv])
}

/// The rectangle of a plane. A side that is not positive is infinite.
#[inline(always)]
fn ray_plane<T: Real>(size: &V3<T>, p: &V3<T>, d: &V3<T>, hit: &mut Hit<T>) {
    let (z, one) = (T::zero(), T::lit(1.0));
    let mut ok = d[2].lt(T::lit(-TINY));
    let x = -(p[2].div(T::select(ok, d[2], one)));
    let at = along(p, d, x);
    for k in 0..2 {
        let within = T::not(size[k].lt(at[k].abs()));
        ok = T::and(ok, T::or(within, T::not(z.lt(size[k]))));
    }
    hit.offer(ok, x, &[z, z, one]);
}

#[inline(always)]
fn ray_ellipsoid<T: Real>(size: &V3<T>, p: &V3<T>, d: &V3<T>, hit: &mut Hit<T>) {
    let inv = [size[0].recip(), size[1].recip(), size[2].recip()];
    let (q, e) = ([p[0] * inv[0], p[1] * inv[1], p[2] * inv[2]], [d[0] * inv[0], d[1] * inv[1], d[2] * inv[2]]);
    let (ok, x) = roots(dot(&e, &e), dot(&q, &e), dot(&q, &q) - T::lit(1.0));
    for x in x {
        let at = along(&q, &e, x);
        hit.offer(ok, x, &normalized(&[at[0] * inv[0], at[1] * inv[1], at[2] * inv[2]]));
    }
}

/// The round side of a cylinder or capsule: only the nearer of the two hits ahead, as in MuJoCo.
#[inline(always)]
fn ray_tube<T: Real>(size: &V3<T>, p: &V3<T>, d: &V3<T>, hit: &mut Hit<T>) {
    let z = T::zero();
    let a = d[0].mul_add(d[0], d[1] * d[1]);
    let b = d[0].mul_add(p[0], d[1] * p[1]);
    let c = p[0].mul_add(p[0], p[1] * p[1]) - size[0] * size[0];
    let (ok, [near, far]) = roots(a, b, c);
    let x = T::select(near.lt(z), far, near);
    let at = along(p, d, x);
    let between = T::not(size[1].lt(at[2].abs()));
    hit.offer(T::and(ok, between), x, &normalized(&[at[0], at[1], z]));
}

/// The half sphere at one end of a capsule.
#[inline(always)]
fn ray_cap<T: Real>(size: &V3<T>, side: T, p: &V3<T>, d: &V3<T>, hit: &mut Hit<T>) {
    let q = [p[0], p[1], side.neg_mul_add(size[1], p[2])];
    let (ok, x) = roots(dot(d, d), dot(d, &q), dot(&q, &q) - size[0] * size[0]);
    for x in x {
        let at = along(&q, d, x);
        let outer = T::not((side * at[2]).lt(T::zero()));
        hit.offer(T::and(ok, outer), x, &normalized(&at));
    }
}

/// The flat ends of a cylinder.
#[inline(always)]
fn ray_disks<T: Real>(size: &V3<T>, p: &V3<T>, d: &V3<T>, hit: &mut Hit<T>) {
    let (z, one) = (T::zero(), T::lit(1.0));
    let crosses = T::lit(TINY).lt(d[2].abs());
    let inv = T::select(crosses, d[2], one).recip();
    for side in [-one, one] {
        let x = (side * size[1] - p[2]) * inv;
        let at = along(p, d, x);
        let within = T::not((size[0] * size[0]).lt(at[0].mul_add(at[0], at[1] * at[1])));
        hit.offer(T::and(crosses, within), x, &[z, z, side]);
    }
}

#[inline(always)]
fn ray_box<T: Real>(size: &V3<T>, p: &V3<T>, d: &V3<T>, hit: &mut Hit<T>) {
    for face in 0..6 {
        let (x, ok, normal) = ray_face(size, p, d, face);
        hit.offer(ok, x, &normal);
    }
}

/// Lanes in which a point in a shape's frame is inside the shape.
#[inline(always)]
pub(super) fn inside_shape<T: Real>(kind: GeomType, size: &[f64; 3], p: &V3<T>) -> T::Mask {
    let (z, one) = (T::zero(), T::lit(1.0));
    let s = [T::lit(size[0]), T::lit(size[1]), T::lit(size[2])];
    let beyond = (p[2].abs() - s[1]).max(z);
    let side = p[0].mul_add(p[0], p[1] * p[1]);
    let square = s[0] * s[0];
    match kind {
        GeomType::Plane => p[2].lt(z),
        GeomType::Sphere => p[2].mul_add(p[2], side).lt(square),
        GeomType::Capsule => beyond.mul_add(beyond, side).lt(square),
        GeomType::Cylinder => T::and(side.lt(square), p[2].abs().lt(s[1])),
        GeomType::Ellipsoid => {
            let q = [p[0].div(s[0]), p[1].div(s[1]), p[2].div(s[2])];
            dot(&q, &q).lt(one)
        }
        GeomType::Box => T::and(T::and(p[0].abs().lt(s[0]), p[1].abs().lt(s[1])), p[2].abs().lt(s[2])),
        GeomType::Hfield | GeomType::Mesh => T::none(),
    }
}

impl<T: Real> Readings<'_, T> {
    /// Values of a range finder: the fields in `mask` (distance 1, direction 2, origin 4, point 8, normal 16, depth
    /// 32). `None` if the model has a visible mesh, whose surface is not known.
    #[inline(always)]
    pub(super) fn range_finder(&self, site: usize, mask: i32) -> Option<Vec<T>> {
        let m = &self.sim.model;
        let body = m.sites[site].body;
        let mount = &self.sim.sites[site];
        let direction = self.work.motion.axes(mount)[2];
        let mut nearest = Hit::none();
        for (g, geom) in m.geoms.iter().enumerate() {
            // invisible geoms are not hit
            if geom.body == body || geom.rgba[3] == 0.0 {
                continue;
            }
            let frame = &self.sim.geoms[g];
            let axes = self.work.motion.axes(frame);
            let p = into_axes(&axes, &self.separation(frame, mount));
            let d = into_axes(&axes, &direction);
            let size = [T::lit(geom.size[0]), T::lit(geom.size[1]), T::lit(geom.size[2])];
            let hit = match geom.kind {
                GeomType::Mesh => return None,
                GeomType::Hfield => self.ray_field(geom.hfield?, &p, &d),
                kind => ray_shape(kind, &size, &p, &d),
            };
            nearest.offer(T::not(T::none()), hit.dist, &rotate(&axes, &hit.normal));
        }
        let met = T::not(nearest.dist.lt(T::zero()));
        let origin = self.mount_pos(mount);
        let point = along(&origin, &direction, nearest.dist);
        let mut out = Vec::new();
        let fields: [(&[T], bool); 6] = [
            (&[nearest.dist], false),
            (&direction, true),
            (&origin, false),
            (&point, true),
            (&nearest.normal, true),
            (&[nearest.dist], false),
        ];
        for (i, (values, only_met)) in fields.into_iter().enumerate() {
            if mask & (1 << i) != 0 {
                out.extend(values.iter().map(|x| if only_met { T::masked(met, *x) } else { *x }));
            }
        }
        Some(out)
    }

    /// A ray against a height field, lane by lane.
    #[inline(always)]
    fn ray_field(&self, index: usize, p: &V3<T>, d: &V3<T>) -> Hit<T> {
        let field = &self.sim.model.hfields[index];
        let mut out = Hit::<T>::none();
        for lane in 0..T::LANES {
            // an agent may have its own ground, with higher hills
            let own = &self.group.ground(self.sim, lane, index);
            let mut size = field.size.map(T::scalar);
            size[2] = size[2].max(own.top);
            let grid = Grid { rows: own.rows, cols: own.cols, size, heights: &own.heights };
            let pick = |v: &V3<T>| [v[0].get(lane), v[1].get(lane), v[2].get(lane)];
            let hit = ray_hfield(&grid, &pick(p), &pick(d));
            out.dist.set(lane, hit.dist);
            for k in 0..3 {
                out.normal[k].set(lane, hit.normal[k]);
            }
        }
        out
    }
}
