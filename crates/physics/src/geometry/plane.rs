//! Contacts of a plane of any pose with the extreme points of other shapes.

use super::*;

/// The contact of a point of a shape at signed distance `dist` from the plane.
#[inline(always)]
fn at<T: Real>(plane: &Plane<T>, point: &V3<T>, dist: T, margin: T, tangent: &V3<T>) -> Touch<T> {
    let pos = axpy3(&plane.normal, dist * T::lit(-0.5), point);
    Touch { on: dist.lt(margin), dist, pos, normal: plane.normal, tangent: *tangent }
}

/// Signed distance of a point from the plane.
#[inline(always)]
fn height<T: Real>(plane: &Plane<T>, point: &V3<T>) -> T {
    dot(&plane.normal, &sub3(point, &plane.point))
}

/// Lanes where a ball about `center` is closer to the plane than the margin.
#[inline(always)]
pub(crate) fn near_plane<T: Real>(plane: &Plane<T>, center: &V3<T>, reach: T) -> T::Mask {
    height(plane, center).lt(reach)
}

/// One contact.
#[inline(always)]
pub(crate) fn plane_sphere<T: Real>(plane: &Plane<T>, b: &Sphere<T>, margin: T) -> Touch<T> {
    let dist = height(plane, &b.center) - b.radius;
    let pos = axpy3(&plane.normal, dist.mul_add(T::lit(-0.5), -b.radius), &b.center);
    Touch::new(dist, pos, plane.normal, margin)
}

/// Up to two contacts, upper end first. The first tangent is the capsule's axis.
#[inline(always)]
pub(crate) fn plane_capsule<T: Real>(plane: &Plane<T>, b: &Capsule<T>, margin: T) -> [Touch<T>; 2] {
    let n = &plane.normal;
    let slope = dot(n, &b.axis);
    let middle = height(plane, &b.center) - b.radius;
    let tangent = axis_tangent(n, &b.axis, slope);
    let low = axpy3(n, -b.radius, &b.center);
    [
        at(plane, &axpy3(&b.axis, b.half, &low), slope.mul_add(b.half, middle), margin, &tangent),
        at(plane, &axpy3(&b.axis, -b.half, &low), slope.neg_mul_add(b.half, middle), margin, &tangent),
    ]
}

/// The direction of a capsule's axis in a plane. For an upright capsule the x axis, else the y axis.
#[inline(always)]
fn axis_tangent<T: Real>(n: &V3<T>, axis: &V3<T>, slope: T) -> V3<T> {
    let (zero, one) = (T::zero(), T::lit(1.0));
    let t = axpy3(n, -slope, axis);
    let len2 = dot(&t, &t);
    let upright = len2.lt(T::lit(1e-12));
    let along_x = T::lit(0.9).lt(n[0].abs());
    let seed = [T::select(along_x, zero, one), T::select(along_x, one, zero), zero];
    let k = dot(n, &seed);
    let t = select3::<T>(upright, &axpy3(n, -k, &seed), &t);
    let len2 = T::select(upright, k.neg_mul_add(k, one), len2);
    scale3(&t, len2.sqrt().recip())
}

/// Up to four contacts, the corners below the center. Of two opposite corners only the lower one qualifies, so contact
/// `i` is that of corners `i` and `7 - i`. Bit `k` of a corner's number is its side along axis `k`.
#[inline(always)]
pub(crate) fn plane_box<T: Real>(plane: &Plane<T>, b: &Cuboid<T>, margin: T) -> [Touch<T>; 4] {
    box_corners(plane, b, margin).map(|(touch, _)| touch)
}

/// The same contacts in the order of the corners, as in MuJoCo: entry `k` is that of corner `k`.
#[inline(always)]
pub(crate) fn plane_box_in_order<T: Real>(plane: &Plane<T>, b: &Cuboid<T>, margin: T) -> [Touch<T>; 8] {
    let corners = box_corners(plane, b, margin);
    let mut out = [Touch::none(); 8];
    for (i, (touch, opposite)) in corners.into_iter().enumerate() {
        out[i] = Touch { on: T::and(touch.on, T::not(opposite)), ..touch };
        out[7 - i] = Touch { on: T::and(touch.on, opposite), ..touch };
    }
    out
}

/// The lower of the opposite corners `i` and `7 - i`, and the lanes where it is the latter.
#[inline(always)]
fn box_corners<T: Real>(plane: &Plane<T>, b: &Cuboid<T>, margin: T) -> [(Touch<T>, T::Mask); 4] {
    let n = &plane.normal;
    let middle = height(plane, &b.center);
    let tangent = first_tangent(n);
    let arm = [scale3(&b.axes[0], b.half[0]), scale3(&b.axes[1], b.half[1]), scale3(&b.axes[2], b.half[2])];
    let rise = [dot(n, &arm[0]), dot(n, &arm[1]), dot(n, &arm[2])];
    // offsets of corners 0 to 3 along the first two axes; along the third they are all negative
    let (sum, difference) = (add3(&arm[0], &arm[1]), sub3(&arm[0], &arm[1]));
    let (rise_sum, rise_difference) = (rise[0] + rise[1], rise[0] - rise[1]);
    let offsets = [
        ([-sum[0], -sum[1], -sum[2]], -rise_sum),
        (difference, rise_difference),
        ([-difference[0], -difference[1], -difference[2]], -rise_difference),
        (sum, rise_sum),
    ];
    let mut out = [(Touch::none(), T::none()); 4];
    for i in 0..4 {
        let (arm01, rise01) = offsets[i];
        let lift = rise01 - rise[2];
        let opposite = T::zero().lt(lift);
        let mut corner = b.center;
        for k in 0..3 {
            corner[k] += negate_where::<T>(opposite, arm01[k] - arm[2][k]);
        }
        out[i] = (at(plane, &corner, middle - lift.abs(), margin, &tangent), opposite);
    }
    out
}

/// Up to four contacts: the lowest point of the rim, the adjacent point of the other rim, and two more of the lower rim
/// that complete an equilateral triangle.
#[inline(always)]
pub(crate) fn plane_cylinder<T: Real>(plane: &Plane<T>, b: &Cylinder<T>, margin: T) -> [Touch<T>; 4] {
    let (zero, half) = (T::zero(), T::lit(0.5));
    let n = &plane.normal;
    let slope = dot(n, &b.axes[2]);
    let up = zero.lt(slope);
    let axis = {
        let a = &b.axes[2];
        [negate_where::<T>(up, a[0]), negate_where::<T>(up, a[1]), negate_where::<T>(up, a[2])]
    };
    let slope = negate_where::<T>(up, slope);
    // steepest descent perpendicular to the axis; arbitrary for an upright cylinder
    let down = sub3(&scale3(&axis, slope), n);
    let len2 = dot(&down, &down);
    let tiny = (4.0 * T::EPSILON).max(TINY);
    let upright = len2.lt(T::lit(tiny * tiny));
    let scale = b.radius.div(T::select(upright, T::lit(1.0), len2).sqrt());
    let rim = select3::<T>(upright, &scale3(&b.axes[0], b.radius), &scale3(&down, scale));
    let drop = dot(n, &rim);
    let middle = height(plane, &b.center);
    let lower = slope.mul_add(b.half, middle);
    let tangent = first_tangent(n);
    let foot = axpy3(&axis, b.half, &b.center);
    let head = axpy3(&axis, -b.half, &b.center);
    let side = scale3(&cross(&rim, &axis), T::lit(3f64.sqrt() / 2.0));
    let back = axpy3(&rim, -half, &foot);
    let dist = [lower + drop, slope.neg_mul_add(b.half, middle) + drop, drop.neg_mul_add(half, lower)];
    [
        at(plane, &add3(&foot, &rim), dist[0], margin, &tangent),
        at(plane, &add3(&head, &rim), dist[1], margin, &tangent),
        at(plane, &add3(&back, &side), dist[2], margin, &tangent),
        at(plane, &sub3(&back, &side), dist[2], margin, &tangent),
    ]
}

/// One contact, at the lowest point.
#[inline(always)]
pub(crate) fn plane_ellipsoid<T: Real>(plane: &Plane<T>, b: &Cuboid<T>, margin: T) -> Touch<T> {
    let n = into_axes(&b.axes, &plane.normal);
    let s = [n[0] * b.half[0], n[1] * b.half[1], n[2] * b.half[2]];
    let reach = dot(&s, &s).sqrt();
    let k = -reach.recip();
    let lowest = rotate_add(&b.axes, &[s[0] * b.half[0] * k, s[1] * b.half[1] * k, s[2] * b.half[2] * k], &b.center);
    let dist = height(plane, &b.center) - reach;
    at(plane, &lowest, dist, margin, &first_tangent(&plane.normal))
}
