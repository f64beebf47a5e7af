//! Polygons: clipping, and the largest quadrilateral.

use super::super::{TINY, V3};
use super::gjk::is_single;
use super::vector::*;

/// Clips a polygon, or an edge as a polygon of two corners, against the sides of a convex face. The face is clockwise
/// about its normal (Sutherland and Hodgman, "Reentrant polygon clipping", 1974). The result replaces `polygon`.
pub(super) fn clip<S: Number>(face: &[V3<S>], normal: &V3<S>, polygon: &mut Vec<V3<S>>, clipped: &mut Vec<V3<S>>) {
    let zero = S::zero();
    let slack = S::lit(if is_single::<S>() { 1e-7 } else { TINY });
    for (i, corner) in face.iter().enumerate() {
        let next = &face[(i + 1) % face.len()];
        let inward = unit(&cross(&sub(next, corner), normal));
        let level = dot(&inward, corner);
        let inside = |p: &V3<S>| -slack < dot(&sub(p, corner), &inward);
        clipped.clear();
        for (k, p) in polygon.iter().enumerate() {
            let q = &polygon[(k + 1) % polygon.len()];
            let (from, to) = (inside(p), inside(q));
            if from != to {
                let step = sub(q, p);
                let rate = dot(&inward, &step);
                if rate != zero {
                    let t = (level - dot(&inward, p)).div(rate);
                    if !(t < zero) && !(S::lit(1.0) < t) {
                        clipped.push(along(p, &step, t));
                    }
                }
            }
            if to {
                clipped.push(*q);
            }
        }
        std::mem::swap(polygon, clipped);
    }
}

/// Indices of the corners of a large quadrilateral in a convex polygon of more than four corners, by rotating the corners
/// about `anchors` of them in turn.
pub(super) fn quadrilateral<S: Number>(polygon: &[V3<S>], start: usize, anchors: usize) -> [usize; 4] {
    let n = polygon.len();
    let area = |[a, b, c, d]: [usize; 4]| {
        let (x, y) = (sub(&polygon[a], &polygon[c]), sub(&polygon[b], &polygon[d]));
        S::lit(0.5) * norm(&cross(&x, &y))
    };
    let mut now = [0, 1, 2, 3].map(|k| (start + k) % n);
    let (mut best, mut most) = (now, area(now));
    // moves a corner on while the area grows
    let advance = |now: &mut [usize; 4], k: usize, best: &mut [usize; 4], most: &mut S| -> bool {
        let mut next = *now;
        next[k] = (next[k] + 1) % n;
        let larger = *most < area(next);
        if larger {
            (*most, *now, *best) = (area(next), next, next);
        }
        larger
    };
    for anchor in 0..anchors {
        now[0] = (start + anchor) % n;
        while advance(&mut now, 3, &mut best, &mut most) {
            while advance(&mut now, 2, &mut best, &mut most) {}
            while advance(&mut now, 1, &mut best, &mut most) {}
        }
        // the anchor moves on to the next corner only after the others have left it
        for k in 1..4 {
            if now[k] != now[k - 1] {
                break;
            }
            now[k] = (now[k] + 1) % n;
        }
    }
    best
}
