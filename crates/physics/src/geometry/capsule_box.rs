//! A capsule on a box: up to two contacts.
//!
//! The first contact is where the capsule's segment is closest to the box. One point alone would let a capsule on a
//! face or an edge tip over, so MuJoCo adds a second. From the first point, it follows the segment over the face or
//! along the edge as far as both reach. Both points are then treated as spheres on a box.

use super::round::sphere_box;
use super::*;
use crate::lanes::kernel_fn;

/// The box feature of the segment's closest point.
#[derive(Clone, Copy)]
enum Feature<S> {
    /// Inside the box; there is no second contact.
    Inside,
    /// An end of the segment over the face across this axis.
    Face(usize),
    /// The corner with these sides, bit `k` for axis `k`.
    Corner(usize),
    /// The edge along `axis` through the corner, at `place` in (-1, 1) along it.
    Edge { axis: usize, corner: usize, place: S },
}

/// A closest point of the segment.
struct Closest<S> {
    feature: Feature<S>,
    /// Position on the segment, from -1 to 1.
    along: S,
    distance2: S,
}

kernel_fn! {
    /// Finds the contacts and appends them.
    pub(crate) fn capsule_box<'a, S>(a: &'a Capsule<S>, b: &'a Cuboid<S>, margin: S, out: &'a mut Touches<S>) {
        let center = into_axes(&b.axes, &sub3(&a.center, &b.center));
        let axis = into_axes(&b.axes, &a.axis);
        let arm = scale3(&axis, a.half);
        let first = closest(&center, &arm, a.half, &b.half);
        out.push(ball_at(a, b, first.along, margin));
        if let Some(step) = second(&first, &center, &axis, &arm, &b.half) {
            out.push(ball_at(a, b, first.along + step, margin));
        }
    }
}

/// The contact of the capsule's ball at a position of its segment.
#[inline(always)]
fn ball_at<S: Real>(a: &Capsule<S>, b: &Cuboid<S>, along: S, margin: S) -> Touch<S> {
    let center = axpy3(&a.axis, along * a.half, &a.center);
    sphere_box(&Sphere { center, axis: a.axis, radius: a.radius }, b, margin)
}

/// The point of the segment `center + [-1, 1] arm` that is closest to the box, in the box's frame.
#[inline(always)]
fn closest<S: Real>(center: &V3<S>, arm: &V3<S>, half_length: S, half: &V3<S>) -> Closest<S> {
    let one = S::lit(1.0);
    let mut best = Closest { feature: Feature::Inside, along: -one, distance2: S::lit(1e30) };
    // ends over a face or inside
    for along in [-one, one] {
        let p = axpy3(arm, along, center);
        let mut feature = Some(Feature::Inside);
        let mut distance2 = S::zero();
        for k in 0..3 {
            let beyond = p[k].abs() - half[k];
            if less(S::zero(), beyond) {
                feature = if let Some(Feature::Inside) = feature { Some(Feature::Face(k)) } else { None };
                distance2 = beyond * beyond;
            }
        }
        if let Some(feature) = feature
            && less(distance2, best.distance2)
        {
            best = Closest { feature, along, distance2 };
        }
    }
    // an edge must be closer than an end by more than rounding: a capsule flat on a face is equally close at both
    let size = half_length + half[0] + half[1] + half[2];
    let slack = size.mul_add(size * S::lit(S::EPSILON), S::lit(TINY));
    for axis in 0..3 {
        for corner in 0..8 {
            if corner & (1 << axis) == 0
                && let Some(edge) = closest_on_edge(center, arm, half_length, half, axis, corner)
                && less(edge.distance2, best.distance2 - slack)
            {
                best = edge;
            }
        }
    }
    best
}

/// The point of the segment closest to one edge, unless they are parallel.
#[inline(always)]
fn closest_on_edge<S: Real>(
    center: &V3<S>,
    arm: &V3<S>,
    half_length: S,
    half: &V3<S>,
    axis: usize,
    corner: usize,
) -> Option<Closest<S>> {
    let one = S::lit(1.0);
    let (k, l) = ((axis + 1) % 3, (axis + 2) % 3);
    let mut from = [-center[0], -center[1], -center[2]];
    from[k] += if corner & (1 << k) != 0 { half[k] } else { -half[k] };
    from[l] += if corner & (1 << l) != 0 { half[l] } else { -half[l] };
    let across2 = arm[k].mul_add(arm[k], arm[l] * arm[l]);
    let edge2 = half[axis] * half[axis];
    let arm2 = half_length * half_length;
    if less(edge2 * across2, S::lit(TINY)) {
        return None;
    }
    // positions x on the edge and y on the segment minimize |from + x edge - y arm|
    let mix = half[axis] * arm[axis];
    let u = -(half[axis] * from[axis]);
    let v = dot(arm, &from);
    let free = (arm2 * u + mix * v).div(edge2 * across2);
    let mut place = clamp(free, one);
    let mut y = (v + mix * place).div(arm2);
    // the last position beyond the edge decides the end, even if later steps return to the edge
    let mut beyond = free;
    if less(one, y.abs()) {
        y = clamp(y, one);
        let again = (u + mix * y).div(edge2);
        place = clamp(again, one);
        if less(one, again.abs()) {
            beyond = again;
        }
    }
    let mut gap = axpy3(arm, -y, &from);
    gap[axis] = half[axis].mul_add(place, gap[axis]);
    let feature = if less(one, beyond) {
        Feature::Corner(corner | (1 << axis))
    } else if less(beyond, -one) {
        Feature::Corner(corner)
    } else {
        Feature::Edge { axis, corner, place }
    };
    Some(Closest { feature, along: y, distance2: dot(&gap, &gap) })
}

/// Distance along the segment from the first to the second contact, if there is one.
#[inline(always)]
fn second<S: Real>(first: &Closest<S>, center: &V3<S>, axis: &V3<S>, arm: &V3<S>, half: &V3<S>) -> Option<S> {
    let (zero, one, two) = (S::zero(), S::lit(1.0), S::lit(2.0));
    let mut heading = 0;
    for k in 0..3 {
        if less(zero, arm[k]) {
            heading |= 1 << k;
        }
    }
    match first.feature {
        Feature::Inside => None,
        Feature::Corner(corner) => {
            // orient the segment so that it runs inward along one axis, `lead`, and outward along the others
            let inward = heading ^ corner;
            let (lead, forward) = match inward {
                1 | 2 | 4 => (inward.trailing_zeros() as usize, true),
                3 | 5 | 6 => ((7 - inward).trailing_zeros() as usize, false),
                // it points at the corner
                _ => return None,
            };
            let onward = if forward { one - first.along } else { one + first.along };
            if less(S::lit(0.5), axis[lead] * axis[lead]) {
                // along the edge, to the segment's end or the edge's
                let step = onward.min(span(half[lead], arm[lead]));
                Some(if forward { step } else { -step })
            } else {
                // in the other direction, over the face across `lead`
                let (k, l) = ((lead + 1) % 3, (lead + 2) % 3);
                let step = (two - onward).min(span(half[k], arm[k])).min(span(half[l], arm[l]));
                Some(if forward { -step } else { step })
            }
        }
        Feature::Edge { axis: edge, corner, place } => {
            // only a segment that runs inward over one of the edge's faces and outward over the other
            let inward = (heading ^ corner) & !(1 << edge);
            if inward.count_ones() != 1 {
                return None;
            }
            // the face to which it is less steep
            let (k, l) = ((edge + 1) % 3, (edge + 2) % 3);
            let over = if less(axis[l].abs(), axis[k].abs()) { k } else { l };
            let forward = inward & (1 << over) != 0;
            let onward = if forward { one - first.along } else { one + first.along };
            let rest = if (heading & (1 << edge) != 0) == forward { one - place } else { one + place };
            let step = onward.min(span(half[over], arm[over])).min((half[edge] * rest).div(arm[edge].abs()));
            Some(if forward { step } else { -step })
        }
        Feature::Face(face) => {
            // toward the other end, until the segment leaves the face
            let forward = less(first.along, zero);
            let ahead = if forward { *arm } else { [-arm[0], -arm[1], -arm[2]] };
            let start = sub3(center, &ahead);
            let mut step = two;
            for k in 0..3 {
                for side in [half[k], -half[k]] {
                    let to = (side - start[k]).div(ahead[k]);
                    if k != face && less(zero, to) {
                        step = step.min(to);
                    }
                }
            }
            Some(if forward { step } else { -step })
        }
    }
}

/// Steps of `arm` that cross a box of this half extent.
#[inline(always)]
fn span<S: Real>(half: S, arm: S) -> S {
    (half + half).div(arm.abs())
}
