//! Rays against a height field: a box below, triangles above it, and walls where the field ends.

use super::ray::{Hit, TINY, along, normalized, ray_face};
use crate::algebra::spatial::*;
use crate::lanes::Real;

/// A height field in its own frame.
pub(super) struct Grid<'a, S> {
    pub rows: usize,
    pub cols: usize,
    /// Half lengths along x and y, largest possible height, depth of the base.
    pub size: [S; 4],
    /// Heights row by row, m.
    pub heights: &'a [S],
}

/// The ray from `p` along `d`.
#[inline(always)]
pub(super) fn ray_hfield<S: Real<Scalar = S> + PartialOrd>(grid: &Grid<S>, p: &V3<S>, d: &V3<S>) -> Hit<S> {
    let (zero, half) = (S::zero(), S::lit(0.5));
    let always = S::not(S::none());
    let mut hit = Hit::none();
    let [lx, ly, top, base] = grid.size;
    let below = half * base;
    for face in 0..6 {
        let (x, ok, normal) = ray_face(&[lx, ly, below], &[p[0], p[1], p[2] + below], d, face);
        hit.offer(ok, x, &normal);
    }

    // the part of the ray within the box of all heights
    let above = half * top;
    let (box_size, q) = ([lx, ly, above], [p[0], p[1], p[2] - above]);
    let (mut near, mut far) = (None, zero);
    for face in 0..6 {
        let (x, ok, _) = ray_face(&box_size, &q, d, face);
        if S::any(ok) && x >= zero {
            near = Some(near.map_or(x, |n: S| if x < n { x } else { n }));
            far = if far < x { x } else { far };
        }
    }
    let Some(near) = near else { return hit };
    // a ray that starts inside leaves the box once
    let start = if near == far { zero } else { near };

    let step = [lx * S::lit(2.0 / (grid.cols - 1) as f64), ly * S::lit(2.0 / (grid.rows - 1) as f64)];
    let range = |k: usize, half_length: S, count: usize| {
        let a = (d[k].mul_add(start, p[k]) + half_length).div(step[k]);
        let b = (d[k].mul_add(far, p[k]) + half_length).div(step[k]);
        // one cell to spare on either side
        let low = S::widen(a.min(b).floor()) - 1.0;
        let high = S::widen(a.max(b).floor()) + 2.0;
        low.max(0.0) as usize..(high.max(0.0) as usize).min(count - 1)
    };
    let (columns, rows) = (range(0, lx, grid.cols), range(1, ly, grid.rows));
    let vertex = |r: usize, c: usize| {
        let place = |i: usize, step: S, half_length: S| S::lit(i as f64).mul_add(step, -half_length);
        [place(c, step[0], lx), place(r, step[1], ly), grid.heights[r * grid.cols + c]]
    };
    for r in rows {
        for c in columns.clone() {
            let (a, b) = (vertex(r, c), vertex(r + 1, c + 1));
            ray_triangle(&a, &vertex(r, c + 1), &b, p, d, &mut hit);
            ray_triangle(&a, &b, &vertex(r + 1, c), p, d, &mut hit);
        }
    }

    // walls: below the line between two heights of an edge
    for face in 0..4 {
        let (x, ok, normal) = ray_face(&box_size, &q, d, face);
        if !S::any(ok) {
            continue;
        }
        let at = along(p, d, x);
        let (k, last) = (face / 2, face % 2 == 1);
        let (other, half_length, count) = if k == 0 { (1, ly, grid.rows) } else { (0, lx, grid.cols) };
        let y = (at[other] + half_length).div(step[other]);
        let cell = (S::widen(y.floor()).max(0.0) as usize).min(count - 2);
        let height = |i: usize| match (k, last) {
            (0, false) => grid.heights[i * grid.cols],
            (0, true) => grid.heights[i * grid.cols + grid.cols - 1],
            (_, false) => grid.heights[i],
            (_, true) => grid.heights[(grid.rows - 1) * grid.cols + i],
        };
        let part = y - S::lit(cell as f64);
        let line = part.mul_add(height(cell + 1) - height(cell), height(cell));
        hit.offer(S::and(always, at[2].lt(line)), x, &normal);
    }
    hit
}

/// A triangle, from either side; its normal has the sense of `a`, `b`, `c`.
#[inline(always)]
fn ray_triangle<S: Real<Scalar = S> + PartialOrd>(
    a: &V3<S>,
    b: &V3<S>,
    c: &V3<S>,
    p: &V3<S>,
    d: &V3<S>,
    hit: &mut Hit<S>,
) {
    // Moeller and Trumbore
    let (e1, e2) = (sub3(b, a), sub3(c, a));
    let across = cross(d, &e2);
    let det = dot(&e1, &across);
    if det.abs() < S::lit(TINY) {
        return;
    }
    let inv = det.recip();
    let from = sub3(p, a);
    let u = dot(&from, &across) * inv;
    let turned = cross(&from, &e1);
    let v = dot(d, &turned) * inv;
    let zero = S::zero();
    if u < zero || v < zero || u + v > S::lit(1.0) {
        return;
    }
    hit.offer(S::not(S::none()), dot(&e2, &turned) * inv, &normalized(&cross(&e1, &e2)));
}
