//! The way of a string around a sphere or a cylinder between two points.
//!
//! It is `mju_wrap` of MuJoCo 4.0. The string lies in the plane of the circle that it wraps around. Outside, it touches the
//! circle along an arc. Inside, if the side site is inside, it touches the circle in one point, where both straight
//! pieces make the same angle with it. Angles follow from sines and cosines by `atan2`, which stays accurate near 0.
//!
//! There are no fused operations here, because the compiler of models uses these functions, too.

use super::{TINY, select3};
use crate::algebra::spatial::{Rot, V3};
use crate::lanes::Real;

/// A point or direction in the plane of the circle.
type V2<T> = [T; 2];

/// A wrap, which some lanes may lack. All vectors are relative to the geom's center.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Wrap<T: Real> {
    /// Lanes in which the string touches the geom. The other fields have no meaning in other lanes.
    pub on: T::Mask,
    /// Where the string first touches the geom, and where it leaves it.
    pub points: [V3<T>; 2],
    /// Length between these points.
    pub length: T,
}

/// A wrap in the plane of the circle.
struct Arc<T: Real> {
    on: T::Mask,
    points: [V2<T>; 2],
    length: T,
}

/// Wraps a string from `ends[0]` to `ends[1]` around a sphere, or around a cylinder with the third of the `axes`.
/// `side` is the side site. All points are relative to the geom's center.
#[inline(always)]
pub(crate) fn wrap<T: Real>(
    ends: &[V3<T>; 2],
    axes: &Rot<T>,
    radius: T,
    cylinder: bool,
    side: Option<&V3<T>>,
) -> Wrap<T> {
    let (zero, one, tiny) = (T::zero(), T::lit(1.0), T::lit(TINY));
    let p = [into(axes, &ends[0]), into(axes, &ends[1])];
    let far = T::not(T::or(norm3(&p[0]).lt(tiny), norm3(&p[1]).lt(tiny)));
    let plane = if cylinder { [[one, zero, zero], [zero, one, zero]] } else { plane_of(&p) };
    let flat = |v: &V3<T>| [dot3(v, &plane[0]), dot3(v, &plane[1])];
    let d = [flat(&p[0]), flat(&p[1])];
    let arc = match side {
        None => outside(&d, None, radius),
        Some(side) => {
            let side = into(axes, side);
            let inner = norm3(&side).lt(radius);
            let near = unit2(&flat(&side));
            let not_inner = T::not(inner);
            match (T::any(inner), T::any(not_inner)) {
                (true, true) => inside(&d, radius).or(inner, &outside(&d, Some(&near), radius)),
                (true, false) => inside(&d, radius),
                _ => outside(&d, Some(&near), radius),
            }
        }
    };
    let mut points = [[zero; 3]; 2];
    for i in 0..2 {
        for k in 0..3 {
            points[i][k] = plane[0][k] * arc.points[i][0] + plane[1][k] * arc.points[i][1];
        }
    }
    let mut length = arc.length;
    if cylinder {
        // the height changes in proportion to the length in the plane
        let (first, last) = (length2(&sub2(&d[0], &arc.points[0])), length2(&sub2(&d[1], &arc.points[1])));
        let rise = (p[1][2] - p[0][2]).div((first + length + last).max(tiny));
        points[0][2] = p[0][2] + rise * first;
        points[1][2] = p[0][2] + rise * (first + length);
        let height = points[1][2] - points[0][2];
        length = (length * length + height * height).sqrt();
    }
    Wrap { on: T::and(far, arc.on), points: [out_of(axes, &points[0]), out_of(axes, &points[1])], length }
}

impl<T: Real> Arc<T> {
    /// This arc in the lanes `here`, the other one elsewhere.
    #[inline(always)]
    fn or(&self, here: T::Mask, other: &Arc<T>) -> Arc<T> {
        let pick = |i: usize, k: usize| T::select(here, self.points[i][k], other.points[i][k]);
        Arc {
            on: T::or(T::and(here, self.on), T::and(T::not(here), other.on)),
            points: [[pick(0, 0), pick(0, 1)], [pick(1, 0), pick(1, 1)]],
            length: T::select(here, self.length, other.length),
        }
    }
}

/// Two axes of the plane through a sphere's center and two points. The first points to the first point.
#[inline(always)]
fn plane_of<T: Real>(p: &[V3<T>; 2]) -> [V3<T>; 2] {
    let (zero, one) = (T::zero(), T::lit(1.0));
    let first = unit3(&p[0]);
    let normal = cross3(&p[0], &p[1]);
    // rounding leaves something of the normal of parallel vectors
    let noise = norm3(&p[0]) * norm3(&p[1]) * T::lit(2.0 * T::EPSILON);
    let parallel = norm3(&normal).lt(noise.max(T::lit(TINY)));
    let mut normal = unit3(&normal);
    if T::any(parallel) {
        // any normal: perpendicular to a vector without the largest component of the first axis
        let [x, y, z] = [first[0].abs(), first[1].abs(), first[2].abs()];
        let by_z = T::and(x.lt(z), y.lt(z));
        let by_y = T::and(T::not(by_z), T::and(x.lt(y), z.lt(y)));
        let by_x = T::not(T::or(by_y, by_z));
        let other = [T::select(by_x, zero, one), T::select(by_y, zero, one), T::select(by_z, zero, one)];
        normal = select3(parallel, &unit3(&cross3(&first, &other)), &normal);
    }
    [first, unit3(&cross3(&normal, &first))]
}

/// A string outside the circle. It takes the shorter way, and wraps if the straight way is blocked. If `side` lies
/// opposite to it, between the directions away from both ends, it takes the longer way, and always wraps.
#[inline(always)]
fn outside<T: Real>(d: &[V2<T>; 2], side: Option<&V2<T>>, radius: T) -> Arc<T> {
    let (zero, one, tiny) = (T::zero(), T::lit(1.0), T::lit(TINY));
    let [sq0, sq1, square] = [dot2(&d[0], &d[0]), dot2(&d[1], &d[1]), radius * radius];
    let off = T::or(T::or(sq0.lt(square), sq1.lt(square)), radius.lt(tiny));
    // the shorter way turns to the left if this is positive
    let turn = cross2(&d[0], &d[1]);
    let between = turn.abs().atan2(dot2(&d[0], &d[1]));
    let right = turn.lt(zero);
    let long = match side {
        None => T::none(),
        Some(side) => {
            let (from, to) = (cross2(&d[0], side), cross2(side, &d[1]));
            let (from, to) = (T::select(right, -from, from), T::select(right, -to, to));
            T::and(from.lt(zero), T::not(zero.lt(to)))
        }
    };
    let sweep = T::select(long, T::lit(std::f64::consts::TAU) - between, between);
    // what is left of it between the tangents
    let roots = [(sq0 - square).max(zero).sqrt(), (sq1 - square).max(zero).sqrt()];
    let angle = sweep - roots[0].atan2(radius) - roots[1].atan2(radius);
    let sign = T::select(T::xor(right, long), one, -one);
    let (a, b) = (sign * radius * roots[0], sign * radius * roots[1]);
    let (inv0, inv1) = (one.div(sq0.max(tiny)), one.div(sq1.max(tiny)));
    let points = [
        [(d[0][0] * square + a * d[0][1]) * inv0, (d[0][1] * square - a * d[0][0]) * inv0],
        [(d[1][0] * square - b * d[1][1]) * inv1, (d[1][1] * square + b * d[1][0]) * inv1],
    ];
    Arc { on: T::not(T::or(off, angle.lt(zero))), points, length: radius * angle }
}

/// A string that touches the circle from inside, in one point.
///
/// The point follows from the angle `x` between the string and the radius there:
/// `asin(A sin x) + asin(B sin x) - 2 x + G = 0`, where `A` and `B` are the radius by the distances of the ends, and `G`
/// is the angle between them. MuJoCo's iteration starts and ends at the same points.
#[inline(always)]
fn inside<T: Real>(d: &[V2<T>; 2], radius: T) -> Arc<T> {
    let (zero, one, tiny, two) = (T::zero(), T::lit(1.0), T::lit(TINY), T::lit(2.0));
    let (len0, len1) = (length2(&d[0]), length2(&d[1]));
    let dif = sub2(&d[1], &d[0]);
    let dd = dot2(&dif, &dif);
    let outer = T::and(radius.lt(len0), radius.lt(len1));
    let mut off = T::or(T::not(outer), T::or(radius.lt(tiny), T::or(len0.lt(tiny), len1.lt(tiny))));
    // a straight way that passes the circle does not wrap
    let at = (-dot2(&dif, &d[0])).div(dd.max(tiny));
    let within = T::and(T::and(zero.lt(at), at.lt(one)), tiny.lt(dd));
    let nearest = [at * dif[0] + d[0][0], at * dif[1] + d[0][1]];
    off = T::or(off, T::and(within, T::not(radius.lt(length2(&nearest)))));
    let middle = unit2(&[(d[0][0] + d[1][0]) * T::lit(0.5), (d[0][1] + d[1][1]) * T::lit(0.5)]);

    let (a, b) = (radius.div(len0.max(tiny)), radius.div(len1.max(tiny)));
    let turn = cross2(&d[0], &d[1]);
    let along = dot2(&d[0], &d[1]);
    let cosine = along.div((len0 * len1).max(tiny));
    off = T::or(off, cosine.lt(T::lit(TINY - 1.0)));
    let between = turn.abs().atan2(along);
    let value = |x: T, sin: T| asin(a * sin) + asin(b * sin) - two * x + between;
    let tolerance = T::lit(f64::max(1e-6, 16.0 * T::EPSILON));
    let (mut x, mut sin, mut cos) = (T::lit(std::f64::consts::FRAC_PI_2), one, zero);
    let mut f = value(x, sin);
    // lanes without a solution touch in the middle
    let mut solved = T::not(T::or(T::lit(1.0 - TINY).lt(cosine), zero.lt(f)));
    solved = T::and(solved, T::not(off));
    let mut busy = T::and(solved, tolerance.lt(f.abs()));
    for _ in 0..20 {
        if !T::any(busy) {
            break;
        }
        let rate = |share: T| (share * cos).div(cosine_of(share * sin).max(tiny));
        let slope = rate(a) + rate(b) - two;
        let next = x - f.div(slope);
        let flat = T::and(busy, (-tiny).lt(slope));
        solved = T::and(solved, T::not(flat));
        busy = T::and(busy, solved);
        x = T::select(busy, next, x);
        (sin, cos) = x.sin_cos();
        f = T::select(busy, value(x, sin), f);
        busy = T::and(busy, tolerance.lt(f.abs()));
    }
    solved = T::and(solved, T::not(busy));
    let left = zero.lt(turn);
    let from = unit2(&[T::select(left, d[0][0], d[1][0]), T::select(left, d[0][1], d[1][1])]);
    let (sin, cos) = (x - asin(T::select(left, a, b) * sin)).sin_cos();
    let touch = [cos * from[0] - sin * from[1], sin * from[0] + cos * from[1]];
    let point = [radius * T::select(solved, touch[0], middle[0]), radius * T::select(solved, touch[1], middle[1])];
    Arc { on: T::not(off), points: [point; 2], length: zero }
}

/// The cosine of an angle between 0 and a quarter turn from its sine.
#[inline(always)]
fn cosine_of<T: Real>(sine: T) -> T {
    let one = T::lit(1.0);
    ((one - sine) * (one + sine)).max(T::zero()).sqrt()
}

#[inline(always)]
fn asin<T: Real>(x: T) -> T {
    x.atan2(cosine_of(x))
}

/// Components along the axes.
#[inline(always)]
fn into<T: Real>(axes: &Rot<T>, v: &V3<T>) -> V3<T> {
    [dot3(&axes[0], v), dot3(&axes[1], v), dot3(&axes[2], v)]
}

/// The vector with these components.
#[inline(always)]
fn out_of<T: Real>(axes: &Rot<T>, v: &V3<T>) -> V3<T> {
    let mut out = [T::zero(); 3];
    for i in 0..3 {
        out[i] = axes[0][i] * v[0] + axes[1][i] * v[1] + axes[2][i] * v[2];
    }
    out
}

#[inline(always)]
fn dot2<T: Real>(a: &V2<T>, b: &V2<T>) -> T {
    a[0] * b[0] + a[1] * b[1]
}

#[inline(always)]
fn cross2<T: Real>(a: &V2<T>, b: &V2<T>) -> T {
    a[0] * b[1] - a[1] * b[0]
}

#[inline(always)]
fn sub2<T: Real>(a: &V2<T>, b: &V2<T>) -> V2<T> {
    [a[0] - b[0], a[1] - b[1]]
}

#[inline(always)]
fn length2<T: Real>(a: &V2<T>) -> T {
    dot2(a, a).sqrt()
}

/// Unit vector; the first axis for a vector without length.
#[inline(always)]
fn unit2<T: Real>(a: &V2<T>) -> V2<T> {
    let (n, tiny) = (length2(a), T::lit(TINY));
    let (none, inverse) = (n.lt(tiny), T::lit(1.0).div(n.max(tiny)));
    [T::select(none, T::lit(1.0), a[0] * inverse), T::masked(T::not(none), a[1] * inverse)]
}

#[inline(always)]
fn dot3<T: Real>(a: &V3<T>, b: &V3<T>) -> T {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline(always)]
fn cross3<T: Real>(a: &V3<T>, b: &V3<T>) -> V3<T> {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[inline(always)]
fn norm3<T: Real>(a: &V3<T>) -> T {
    dot3(a, a).sqrt()
}

/// Unit vector; the first axis for a vector without length.
#[inline(always)]
pub(crate) fn unit3<T: Real>(a: &V3<T>) -> V3<T> {
    let (n, tiny) = (norm3(a), T::lit(TINY));
    let (none, inverse) = (n.lt(tiny), T::lit(1.0).div(n.max(tiny)));
    let some = T::not(none);
    [T::select(none, T::lit(1.0), a[0] * inverse), T::masked(some, a[1] * inverse), T::masked(some, a[2] * inverse)]
}
