//! Spheres, capsules and the shapes that a sphere touches: contacts from closest points.

use super::*;

/// Distance below which two points count as the same. Rounding separates axes that cross exactly, as in a planar model.
#[inline(always)]
fn tiny<T: Real>() -> f64 {
    TINY.max(4.0 * T::EPSILON)
}

/// Contact of two balls. `axes` are the z axes of their shapes, which set the normal if the centers coincide.
#[inline(always)]
fn balls<T: Real>(p1: &V3<T>, r1: T, p2: &V3<T>, r2: T, margin: T, axes: [&V3<T>; 2]) -> Touch<T> {
    let d = sub3(p2, p1);
    let len = dot(&d, &d).sqrt();
    let tiny = T::lit(tiny::<T>());
    let apart = tiny.lt(len);
    let inv = len.max(tiny).recip();
    let mut normal = scale3(&d, inv);
    if !T::all(apart) {
        normal = select3::<T>(apart, &normal, &across(axes[0], axes[1]));
    }
    let dist = len - r1 - r2;
    let pos = axpy3(&normal, dist.mul_add(T::lit(0.5), r1), p1);
    Touch::new(dist, pos, normal, margin)
}

/// MuJoCo's normal for coinciding centers: perpendicular to both z axes, or the x axis if they are parallel.
#[inline(always)]
fn across<T: Real>(a: &V3<T>, b: &V3<T>) -> V3<T> {
    let n = cross(a, b);
    let sin2 = dot(&n, &n);
    let turned = T::lit(tiny::<T>() * tiny::<T>()).lt(sin2);
    let inv = T::select(turned, sin2, T::lit(1.0)).sqrt().recip();
    let x_axis = [T::lit(1.0), T::zero(), T::zero()];
    select3::<T>(turned, &scale3(&n, inv), &x_axis)
}

/// Negates a vector.
#[inline(always)]
fn against<T: Real>(a: &V3<T>) -> V3<T> {
    [-a[0], -a[1], -a[2]]
}

/// The contact of two spheres.
#[inline(always)]
pub(crate) fn sphere_sphere<T: Real>(a: &Sphere<T>, b: &Sphere<T>, margin: T) -> Touch<T> {
    balls(&a.center, a.radius, &b.center, b.radius, margin, [&a.axis, &b.axis])
}

/// One contact.
#[inline(always)]
pub(crate) fn sphere_capsule<T: Real>(a: &Sphere<T>, b: &Capsule<T>, margin: T) -> Touch<T> {
    let along = clamp(dot(&b.axis, &sub3(&a.center, &b.center)), b.half);
    balls(&a.center, a.radius, &axpy3(&b.axis, along, &b.center), b.radius, margin, [&a.axis, &b.axis])
}

/// Square of the sine up to which the axes of two capsules count as parallel.
const PARALLEL: f64 = 1e-8;

/// One contact, at the closest points of the axes. Parallel axes have no unique closest pair: both ends of the overlap
/// are contacts. The order is the first capsule's lower end, then its upper end, each moved onto the second capsule if
/// it lies beyond.
#[inline(always)]
pub(crate) fn capsule_capsule<T: Real>(a: &Capsule<T>, b: &Capsule<T>, margin: T) -> [Touch<T>; 2] {
    let axes = axes(a, b);
    let (s, t) = closest(a, b, &axes);
    let Axes { c, da, db, crossing, .. } = axes;
    if T::all(crossing) {
        return [axis_points(a, s, b, t, margin), Touch::none()];
    }
    let (s0, t0) = beside(-a.half, c, da, db, a.half, b.half);
    let (s1, t1) = beside(a.half, c, da, db, a.half, b.half);
    let (s0, t0) = (T::select(crossing, s, s0), T::select(crossing, t, t0));
    let mut second = axis_points(a, s1, b, t1, margin);
    second.on = T::and(second.on, T::not(crossing));
    [axis_points(a, s0, b, t0, margin), second]
}

/// Distance of two capsules, or balls with a half length of zero.
#[inline(always)]
pub(crate) fn gap<T: Real>(a: &Capsule<T>, b: &Capsule<T>) -> T {
    let (s, t) = closest(a, b, &axes(a, b));
    let (p, q) = (axpy3(&a.axis, s, &a.center), axpy3(&b.axis, t, &b.center));
    let d = sub3(&q, &p);
    dot(&d, &d).sqrt() - a.radius - b.radius
}

/// Relative placement of the axes of two capsules.
struct Axes<T: Real> {
    /// Cosine of the angle between them.
    c: T,
    /// Vector from the first center to the second, along either axis.
    da: T,
    db: T,
    /// Square of the sine of the angle.
    sin2: T,
    /// Lanes in which they are not parallel.
    crossing: T::Mask,
}

#[inline(always)]
fn axes<T: Real>(a: &Capsule<T>, b: &Capsule<T>) -> Axes<T> {
    let d = sub3(&b.center, &a.center);
    // the vector product does not cancel for almost parallel axes
    let n = cross(&a.axis, &b.axis);
    let sin2 = dot(&n, &n);
    let crossing = T::lit(PARALLEL).lt(sin2);
    Axes { c: dot(&a.axis, &b.axis), da: dot(&a.axis, &d), db: dot(&b.axis, &d), sin2, crossing }
}

/// The closest positions on two capsules' axes. For parallel axes, one of the possible pairs.
#[inline(always)]
fn closest<T: Real>(a: &Capsule<T>, b: &Capsule<T>, axes: &Axes<T>) -> (T, T) {
    let Axes { c, da, db, sin2, crossing, .. } = *axes;
    let s = clamp(c.neg_mul_add(db, da).div(T::select(crossing, sin2, T::lit(1.0))), a.half);
    // alternating projections; the distance is convex, so they converge to the minimum
    let t = clamp(c.mul_add(s, -db), b.half);
    (clamp(c.mul_add(t, da), a.half), t)
}

/// The position `end` of a capsule's axis and the position next to it on a parallel axis, both clamped to their axes.
#[inline(always)]
fn beside<T: Real>(end: T, c: T, da: T, db: T, half_a: T, half_b: T) -> (T, T) {
    let free = c.mul_add(end, -db);
    let t = clamp(free, half_b);
    let moved = half_b.lt(free.abs());
    (T::select(moved, clamp(c.mul_add(t, da), half_a), end), t)
}

/// Contact of the balls at given positions of two capsules' axes.
#[inline(always)]
fn axis_points<T: Real>(a: &Capsule<T>, s: T, b: &Capsule<T>, t: T, margin: T) -> Touch<T> {
    let (p, q) = (axpy3(&a.axis, s, &a.center), axpy3(&b.axis, t, &b.center));
    balls(&p, a.radius, &q, b.radius, margin, [&a.axis, &b.axis])
}

/// One contact. A center inside the box leaves through the nearest face.
#[inline(always)]
pub(crate) fn sphere_box<T: Real>(a: &Sphere<T>, b: &Cuboid<T>, margin: T) -> Touch<T> {
    let (zero, one) = (T::zero(), T::lit(1.0));
    let c = into_axes(&b.axes, &sub3(&a.center, &b.center));
    let to = [clamp(c[0], b.half[0]) - c[0], clamp(c[1], b.half[1]) - c[1], clamp(c[2], b.half[2]) - c[2]];
    let len = dot(&to, &to).sqrt();
    let outside = T::lit(TINY).lt(len);
    let mut normal = scale3(&to, len.max(T::lit(TINY)).recip());
    let mut dist = len;
    if !T::all(outside) {
        // inward normal of the nearest face, the lower one of each axis first; on the surface, rounding may give the
        // depth a sign
        let mut depth = (b.half[0] + c[0]).abs();
        let mut inward = [one, zero, zero];
        for i in 0..3 {
            for (d, sign) in [((b.half[i] + c[i]).abs(), one), ((b.half[i] - c[i]).abs(), -one)] {
                let nearer = d.lt(depth);
                depth = T::select(nearer, d, depth);
                let mut face = [zero; 3];
                face[i] = sign;
                inward = select3::<T>(nearer, &face, &inward);
            }
        }
        normal = select3::<T>(outside, &normal, &inward);
        dist = T::select(outside, len, -depth);
    }
    let normal = rotate(&b.axes, &normal);
    let dist = dist - a.radius;
    let pos = axpy3(&normal, dist.mul_add(T::lit(0.5), a.radius), &a.center);
    Touch::new(dist, pos, normal, margin)
}

/// One contact, with the side, a cap or a rim. A center inside leaves through the nearer of side and cap.
#[inline(always)]
pub(crate) fn sphere_cylinder<T: Real>(a: &Sphere<T>, b: &Cylinder<T>, margin: T) -> Touch<T> {
    let zero = T::zero();
    let axis = &b.axes[2];
    let d = sub3(&a.center, &b.center);
    let x = dot(axis, &d);
    let out = axpy3(axis, -x, &d);
    let rho = dot(&out, &out).sqrt();
    let (above, outside) = (x.abs() - b.half, rho - b.radius);
    let level = above.lt(zero);
    let within = outside.lt(zero);
    // inside, the larger of two negative distances is the nearer surface
    let cap_nearer = outside.lt(above);
    let cap = T::and(within, T::or(T::not(level), cap_nearer));
    let side = T::and(level, T::or(T::not(within), T::not(cap_nearer)));
    let tiny = T::lit(tiny::<T>());
    let beside = tiny.lt(rho);
    let mut outward = scale3(&out, rho.max(tiny).recip());
    if !T::all(beside) {
        outward = select3::<T>(beside, &outward, &against(&across(&a.axis, axis)));
    }
    let up = {
        let down = T::not(zero.lt(x));
        [negate_where::<T>(down, axis[0]), negate_where::<T>(down, axis[1]), negate_where::<T>(down, axis[2])]
    };
    // rim: the offset has components `above` along the axis and `outside` across it
    let gap = above.mul_add(above, outside * outside).sqrt();
    let apart = tiny.lt(gap);
    let inv = gap.max(tiny).recip();
    let mut rim = axpy3(&outward, outside * inv, &scale3(&up, above * inv));
    if !T::all(apart) {
        rim = select3::<T>(apart, &rim, &against(&across(&a.axis, axis)));
    }
    let away = select3::<T>(side, &outward, &select3::<T>(cap, &up, &rim));
    let dist = T::select(side, outside, T::select(cap, above, gap)) - a.radius;
    let normal = against(&away);
    let pos = axpy3(&normal, dist.mul_add(T::lit(0.5), a.radius), &a.center);
    Touch::new(dist, pos, normal, margin)
}
