//! Narrow phase: contacts of two shapes.
//!
//! Every function takes two shapes in the order of MuJoCo's shape types (plane, height field, sphere, capsule,
//! ellipsoid, cylinder, box, mesh). It finds MuJoCo's contacts between them: the same features, number and frames.
//! Positions are relative to a point near the shapes that the caller chooses, which keeps single precision accurate far
//! from the world's origin.
//!
//! Pairs with a fixed number of candidate contacts ([`round`], [`plane`], and spheres on boxes) use all lanes at once.
//! The others ([`capsule_box`], [`box_box`], [`height`]) choose among many features. They process one agent at a time,
//! with branches, and fill a [`Touches`]. [`field_capsule`] combines both methods. [`convex`] finds the contacts of all
//! other pairs by iteration. [`wrap`] is the way of a string around a shape.

pub(crate) mod box_box;
pub(crate) mod capsule_box;
pub(crate) mod convex;
pub(crate) mod field_capsule;
pub(crate) mod height;
pub(crate) mod plane;
mod prism;
mod prism_box;
pub(crate) mod round;
#[cfg(test)]
mod tests;
pub(crate) mod wrap;

use crate::algebra::spatial::*;
use crate::lanes::Real;
use crate::model::GeomType;

/// Length below which MuJoCo treats a vector as zero.
const TINY: f64 = 1e-15;

/// A contact, which some lanes may lack.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Touch<T: Real> {
    /// Lanes in contact: those where `dist` is below the margin. The other fields have no meaning in other lanes.
    pub on: T::Mask,
    /// Distance of the surfaces, negative for an overlap.
    pub dist: T,
    /// Midway between the surfaces.
    pub pos: V3<T>,
    /// Unit vector from the first shape to the second.
    pub normal: V3<T>,
    /// First tangent, a unit vector; the second is `normal x tangent`.
    pub tangent: V3<T>,
}

impl<T: Real> Touch<T> {
    /// No contact in any lane.
    #[inline(always)]
    pub(crate) fn none() -> Self {
        let (zero, one) = (T::zero(), T::lit(1.0));
        Touch { on: T::none(), dist: zero, pos: [zero; 3], normal: [one, zero, zero], tangent: [zero, one, zero] }
    }

    /// A contact at `pos`, in lanes where `dist < margin`, with MuJoCo's tangent.
    #[inline(always)]
    fn new(dist: T, pos: V3<T>, normal: V3<T>, margin: T) -> Self {
        let on = dist.lt(margin);
        let tangent = if T::any(on) { first_tangent(&normal) } else { normal };
        Touch { on, dist, pos, normal, tangent }
    }
}

/// MuJoCo's limit of contacts per pair. Further ones are left out.
const CAPACITY: usize = 50;

/// Contacts of one pair of shapes of one agent.
#[derive(Clone, Debug, Default)]
pub(crate) struct Touches<S: Real> {
    items: Vec<Touch<S>>,
}

impl<S: Real> Touches<S> {
    pub(crate) fn new() -> Self {
        Touches { items: Vec::with_capacity(CAPACITY) }
    }
    pub(crate) fn as_slice(&self) -> &[Touch<S>] {
        &self.items
    }
    #[inline(always)]
    pub(crate) fn clear(&mut self) {
        self.items.clear();
    }
    /// Whether the list is full.
    #[inline(always)]
    fn is_full(&self) -> bool {
        self.items.len() == CAPACITY
    }
    /// Changes every contact.
    pub(crate) fn each(&mut self, change: impl FnMut(&mut Touch<S>)) {
        self.items.iter_mut().for_each(change);
    }
    /// Adds a contact if it exists and the list is not full.
    #[inline(always)]
    pub(crate) fn push(&mut self, touch: Touch<S>) {
        if S::any(touch.on) && !self.is_full() {
            self.items.push(touch);
        }
    }
}

/// A half-space.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Plane<T: Real> {
    /// Any point of the surface.
    pub point: V3<T>,
    /// Unit vector out of the solid half.
    pub normal: V3<T>,
}

/// A ball.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sphere<T: Real> {
    pub center: V3<T>,
    /// The z axis, a unit vector, used for coinciding centers.
    pub axis: V3<T>,
    pub radius: T,
}

/// The points within `radius` of a segment.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Capsule<T: Real> {
    pub center: V3<T>,
    /// Unit vector along the segment.
    pub axis: V3<T>,
    pub radius: T,
    /// Half the length of the segment.
    pub half: T,
}

/// A solid cylinder.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cylinder<T: Real> {
    pub center: V3<T>,
    /// Columns: the third is the axis of symmetry. The others matter if the axis is parallel to a plane's normal.
    pub axes: Rot<T>,
    pub radius: T,
    /// Half the length.
    pub half: T,
}

/// A solid box or ellipsoid.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cuboid<T: Real> {
    pub center: V3<T>,
    pub axes: Rot<T>,
    /// Half the extent along each axis.
    pub half: V3<T>,
}

/// Radius of the smallest ball about a shape's center that contains the shape, from its sizes in MJCF's order. Infinite
/// for planes and height fields.
pub(crate) fn bounding_radius(kind: GeomType, size: &[f64; 3]) -> f64 {
    let [x, y, z] = *size;
    match kind {
        GeomType::Sphere => x,
        GeomType::Capsule => x + y,
        GeomType::Ellipsoid => x.max(y).max(z),
        GeomType::Cylinder => (x * x + y * y).sqrt(),
        GeomType::Box => (x * x + y * y + z * z).sqrt(),
        _ => f64::INFINITY,
    }
}

/// Lanes where balls about `a` and `b` are closer than `reach`, the sum of their radii and the margin.
#[inline(always)]
pub(crate) fn near<T: Real>(a: &V3<T>, b: &V3<T>, reach: T) -> T::Mask {
    let d = sub3(a, b);
    dot(&d, &d).lt(reach * reach)
}

/// MuJoCo's first tangent for a unit normal: the y axis made perpendicular to it, or the z axis if y is too close.
#[inline(always)]
pub(crate) fn first_tangent<T: Real>(n: &V3<T>) -> V3<T> {
    let from_y = n[1].abs().lt(T::lit(0.5));
    // the part of the seed perpendicular to n has length s and component s^2 along the seed
    let s2 = {
        let other = T::select(from_y, n[2], n[1]);
        n[0].mul_add(n[0], other * other)
    };
    let inv = s2.sqrt().recip();
    let k = -(T::select(from_y, n[1], n[2]) * inv);
    let along = s2 * inv;
    [n[0] * k, T::select(from_y, along, n[1] * k), T::select(from_y, n[2] * k, along)]
}

/// `a` where the mask is set, else `b`.
#[inline(always)]
fn select3<T: Real>(mask: T::Mask, a: &V3<T>, b: &V3<T>) -> V3<T> {
    [T::select(mask, a[0], b[0]), T::select(mask, a[1], b[1]), T::select(mask, a[2], b[2])]
}

/// `a s + c`.
#[inline(always)]
fn axpy3<T: Real>(a: &V3<T>, s: T, c: &V3<T>) -> V3<T> {
    [a[0].mul_add(s, c[0]), a[1].mul_add(s, c[1]), a[2].mul_add(s, c[2])]
}

/// `a s`.
#[inline(always)]
fn scale3<T: Real>(a: &V3<T>, s: T) -> V3<T> {
    [a[0] * s, a[1] * s, a[2] * s]
}

/// `x` limited to [-`limit`, `limit`].
#[inline(always)]
fn clamp<T: Real>(x: T, limit: T) -> T {
    x.max(-limit).min(limit)
}

/// `-x` where the mask is set, else `x`.
#[inline(always)]
fn negate_where<T: Real>(mask: T::Mask, x: T) -> T {
    T::select(mask, -x, x)
}

/// One lane's vector.
#[inline(always)]
pub(crate) fn pick<T: Real>(v: &V3<T>, lane: usize) -> V3<T::Scalar> {
    [v[0].get(lane), v[1].get(lane), v[2].get(lane)]
}

/// One lane's axes.
#[inline(always)]
pub(crate) fn pick_axes<T: Real>(axes: &Rot<T>, lane: usize) -> Rot<T::Scalar> {
    [pick(&axes[0], lane), pick(&axes[1], lane), pick(&axes[2], lane)]
}

/// Comparison of two numbers of one lane.
#[inline(always)]
fn less<S: Real>(a: S, b: S) -> bool {
    S::any(a.lt(b))
}
