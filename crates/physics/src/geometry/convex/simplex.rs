//! The point of a segment, triangle or tetrahedron that is closest to the origin, as weights of the corners.
//!
//! The weights are ratios of signed lengths, areas and volumes. All of them are computed from edges at the last corner, so
//! that corners far from the origin do not cancel. Source: Montanari, Petrinic and Barbieri, "Improving the GJK algorithm
//! for faster and more reliable distance queries between convex objects", 2017.

use super::super::V3;
use super::vector::*;

/// Closest point of the segment from `a` to `b`.
pub(super) fn segment<S: Number>(a: &V3<S>, b: &V3<S>) -> [S; 2] {
    let (zero, one) = (S::zero(), S::lit(1.0));
    let edge = sub(a, b);
    let (part, whole) = (-dot(b, &edge), dot(&edge, &edge));
    if !(zero < part) {
        return [zero, one];
    }
    if !(part < whole) {
        return [one, zero];
    }
    let t = part.div(whole);
    [t, one - t]
}

/// Closest point of a triangle.
pub(super) fn triangle<S: Number>(a: &V3<S>, b: &V3<S>, c: &V3<S>) -> [S; 3] {
    let zero = S::zero();
    let (u, v) = (sub(a, c), sub(b, c));
    let normal = cross(&u, &v);
    let whole = dot(&normal, &normal);
    // areas opposite of the corners
    let at_a = -dot(&cross(c, &v), &normal);
    let at_b = -dot(&cross(&u, c), &normal);
    let at_c = whole - at_a - at_b;
    if zero < at_a && zero < at_b && zero < at_c && zero < whole {
        return [at_a.div(whole), at_b.div(whole), at_c.div(whole)];
    }
    let mut best = [zero; 3];
    let mut least = None;
    // only an edge with the triangle on its far side can be closest
    for (area, i, j) in [(at_a, 1, 2), (at_b, 0, 2), (at_c, 0, 1)] {
        if zero < area && zero < whole {
            continue;
        }
        let corners = [a, b, c];
        let (p, q) = (corners[i], corners[j]);
        let weights = segment(p, q);
        let x = combine([p, q], &weights);
        let square = dot(&x, &x);
        if least.is_none_or(|least| square < least) {
            least = Some(square);
            best = [zero; 3];
            (best[i], best[j]) = (weights[0], weights[1]);
        }
    }
    best
}

/// Closest point of a tetrahedron. All weights are positive if the origin is inside.
pub(super) fn tetrahedron<S: Number>(corners: [&V3<S>; 4]) -> [S; 4] {
    let zero = S::zero();
    let [a, b, c, d] = corners;
    let (u, v, w) = (sub(a, d), sub(b, d), sub(c, d));
    let (vw, wu, uv) = (cross(&v, &w), cross(&w, &u), cross(&u, &v));
    let whole = dot(&u, &vw);
    let (at_a, at_b, at_c) = (-dot(d, &vw), -dot(d, &wu), -dot(d, &uv));
    let volumes = [at_a, at_b, at_c, whole - at_a - at_b - at_c];
    let inside = |volume: S| (zero < volume && zero < whole) || (volume < zero && whole < zero);
    if volumes.iter().all(|x| inside(*x)) {
        return volumes.map(|x| x.div(whole));
    }
    let mut best = [zero; 4];
    let mut least = None;
    for (k, [i, j, l]) in [[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]].into_iter().enumerate() {
        if inside(volumes[k]) {
            continue;
        }
        let face = [corners[i], corners[j], corners[l]];
        let weights = triangle(face[0], face[1], face[2]);
        let x = combine(face, &weights);
        let square = dot(&x, &x);
        if least.is_none_or(|least| square < least) {
            least = Some(square);
            best = [zero; 4];
            (best[i], best[j], best[l]) = (weights[0], weights[1], weights[2]);
        }
    }
    best
}
