//! The closest points of a segment and a prism: three vertical columns of different heights over a triangle.
//!
//! Coordinates are relative to the middle of the segment. A ball or a capsule is a segment (of length zero for a ball)
//! with a radius, so this covers both on a height field.

use super::*;
use crate::lanes::kernel_fn;

/// The solid between a slanted triangle and a level base below it.
pub(super) struct Prism<'a, S: Real> {
    /// Upper corners, counterclockwise seen from above.
    pub top: [V3<S>; 3],
    /// Outward unit normals of the walls: from the first corner to the second, and so on.
    pub walls: &'a [[S::Scalar; 2]; 3],
    /// Height of the base.
    pub base: S,
}

/// Signed distance of a segment from a prism. Inside, it is the negative length of the shortest way out.
#[derive(Clone, Copy, Debug)]
pub(super) struct Gap<S: Real> {
    pub dist: S,
    /// Unit vector from the prism to the segment.
    pub normal: V3<S>,
    /// Position of the closest point on the segment, from -1 to 1.
    pub along: S,
}

impl<T: Real> Gap<T> {
    /// One lane's gap.
    #[inline(always)]
    pub(super) fn lane(&self, lane: usize) -> Gap<T::Scalar> {
        Gap { dist: self.dist.get(lane), normal: pick(&self.normal, lane), along: self.along.get(lane) }
    }
}

/// A face's plane: outward unit normal, and the signed distance of the point `t arm` as `middle + slope t`.
#[derive(Clone, Copy)]
pub(super) struct Face<S: Real> {
    pub normal: V3<S>,
    pub middle: S,
    slope: S,
}

impl<S: Real> Face<S> {
    #[inline(always)]
    fn new(normal: V3<S>, through: &V3<S>, arm: &V3<S>) -> Self {
        Face { normal, middle: -dot(&normal, through), slope: dot(&normal, arm) }
    }
    #[inline(always)]
    fn at(&self, along: S) -> S {
        self.slope.mul_add(along, self.middle)
    }
    /// The smallest distance of the segment's points.
    #[inline(always)]
    fn nearest(&self) -> S {
        self.middle - self.slope.abs()
    }
}

/// Results that follow from the faces alone.
pub(super) struct Glance<T: Real> {
    /// Lanes where an end of the segment is closest, to a point within the prism's top.
    pub over: T::Mask,
    /// The distance in those lanes.
    pub gap: Gap<T>,
    /// Lanes that may be closer than the limit in another way.
    pub unclear: T::Mask,
}

impl<'a, T: Real> Prism<'a, T> {
    /// Checks the segment from `-arm` to `arm` from above.
    #[inline(always)]
    pub(super) fn glance(&self, arm: &V3<T>, limit: T) -> Glance<T> {
        let (zero, one) = (T::zero(), T::lit(1.0));
        let slope = self.slope(arm);
        let along = T::select(zero.lt(slope.slope), -one, one);
        let dist = slope.at(along);
        let gap = Gap { dist, normal: slope.normal, along };
        let mut unclear = T::not(limit.lt(dist));
        if !T::any(unclear) {
            return Glance { over: unclear, gap, unclear };
        }
        let mut over = T::and(unclear, zero.lt(dist));
        // the part of the segment that is not too far beyond a wall
        let (mut from, mut to) = (-one, one);
        let n = &slope.normal;
        for (wall, corner) in self.walls.iter().zip(&self.top) {
            let [x, y] = [T::splat(wall[0]), T::splat(wall[1])];
            let cos = n[0].mul_add(x, n[1] * y);
            let middle = -corner[0].mul_add(x, corner[1] * y);
            let rate = arm[0].mul_add(x, arm[1] * y);
            // the point of the top below the end
            let other = cos.neg_mul_add(dist, rate.mul_add(along, middle));
            over = T::and(over, T::not(zero.lt(other)));
            let crossing = (limit - middle).div(rate);
            to = T::select(zero.lt(rate), to.min(crossing), to);
            from = T::select(rate.lt(zero), from.max(crossing), from);
            // beyond both faces: the edge between them is closer than everything behind it
            let beside = middle - rate.abs();
            let (up, out) = (cos.neg_mul_add(beside, dist), cos.neg_mul_add(dist, beside));
            let edge2 = up.mul_add(dist, out * beside);
            let far2 = (limit * limit) * cos.neg_mul_add(cos, one);
            let past_edge = T::and(T::and(zero.lt(up), zero.lt(out)), far2.lt(edge2));
            unclear = T::and(unclear, T::not(T::or(limit.lt(beside), past_edge)));
        }
        let too_high = T::or(to.lt(from), limit.lt(slope.at(from).min(slope.at(to))));
        Glance { over, gap, unclear: T::and(unclear, T::not(T::or(over, too_high))) }
    }

    /// Height of the highest corner.
    #[inline(always)]
    pub(super) fn highest(&self) -> T {
        self.top[0][2].max(self.top[1][2]).max(self.top[2][2])
    }

    /// One lane's prism.
    #[inline(always)]
    pub(super) fn lane(&self, lane: usize) -> Prism<'a, T::Scalar> {
        let top = [pick(&self.top[0], lane), pick(&self.top[1], lane), pick(&self.top[2], lane)];
        Prism { top, walls: self.walls, base: self.base.get(lane) }
    }
}

kernel_fn! {
    /// Distance of the segment from `-arm` to `arm`. `None` if it is above `limit`.
    pub(super) fn gap<'a, S>(prism: &'a Prism<'a, S>, arm: &'a V3<S>, limit: S) -> Option<Gap<S>> {
        prism.gap(arm, limit)
    }
}

impl<S: Real> Prism<'_, S> {
    /// Lower corner below upper corner `i`.
    #[inline(always)]
    pub(super) fn foot(&self, i: usize) -> V3<S> {
        [self.top[i][0], self.top[i][1], self.base]
    }

    /// The slanted top.
    #[inline(always)]
    pub(super) fn slope(&self, arm: &V3<S>) -> Face<S> {
        let t = &self.top;
        let up = cross(&sub3(&t[1], &t[0]), &sub3(&t[2], &t[0]));
        Face::new(scale3(&up, dot(&up, &up).sqrt().recip()), &t[0], arm)
    }

    /// The five faces: top, three walls, base.
    #[inline(always)]
    pub(super) fn faces(&self, slope: Face<S>, arm: &V3<S>) -> [Face<S>; 5] {
        let (zero, one) = (S::zero(), S::lit(1.0));
        let t = &self.top;
        let mut faces = [slope; 5];
        for i in 0..3 {
            let [x, y] = self.walls[i];
            faces[1 + i] = Face::new([S::splat(x), S::splat(y), zero], &t[i], arm);
        }
        faces[4] = Face::new([zero, zero, -one], &self.foot(0), arm);
        faces
    }

    /// Edge `i` as a corner and a vector: three of the top, three of the base, three vertical.
    #[inline(always)]
    pub(super) fn edge(&self, i: usize) -> (V3<S>, V3<S>) {
        let (k, next) = (i % 3, (i + 1) % 3);
        match i / 3 {
            0 => (self.top[k], sub3(&self.top[next], &self.top[k])),
            1 => (self.foot(k), sub3(&self.foot(next), &self.foot(k))),
            _ => (self.foot(k), sub3(&self.top[k], &self.foot(k))),
        }
    }

    /// See [`gap`].
    #[inline(always)]
    pub(super) fn gap(&self, arm: &V3<S>, limit: S) -> Option<Gap<S>> {
        let one = S::lit(1.0);
        let slope = self.slope(arm);
        if less(limit, slope.nearest()) {
            return None;
        }
        let faces = self.faces(slope, arm);
        // the part of the segment inside; ends early if it is completely beyond the limit of one face
        let (mut from, mut to) = (-one, one);
        let mut inside = true;
        for face in &faces {
            if less(limit, face.nearest()) {
                return None;
            }
            if less(S::zero(), face.slope.abs()) {
                let root = (-face.middle).div(face.slope);
                if less(S::zero(), face.slope) {
                    to = to.min(root);
                } else {
                    from = from.max(root);
                }
            } else {
                inside &= !less(S::zero(), face.middle);
            }
        }
        if inside && !less(to, from) {
            return Some(self.exit(arm, &faces, (from + to) * S::lit(0.5)));
        }
        // a closure here would be compiled for the baseline processor
        match self.over_face(&faces) {
            None => self.beside_edge(arm, limit),
            found => found,
        }
    }

    /// An end of the segment whose closest point is within a face. No other point of the segment is closer if the
    /// segment does not descend toward that face.
    #[inline(always)]
    fn over_face(&self, faces: &[Face<S>; 5]) -> Option<Gap<S>> {
        let (zero, one) = (S::zero(), S::lit(1.0));
        for f in 0..5 {
            let along = if less(zero, faces[f].slope) { -one } else { one };
            let dist = faces[f].at(along);
            if !less(zero, dist) {
                continue;
            }
            let mut within = true;
            for g in 0..5 {
                // distance of the projected point from the other face
                let other = dot(&faces[f].normal, &faces[g].normal).neg_mul_add(dist, faces[g].at(along));
                within &= g == f || !less(zero, other);
            }
            if within {
                return Some(Gap { dist, normal: faces[f].normal, along });
            }
        }
        None
    }

    /// The closest pair of the segment and an edge.
    #[inline(always)]
    fn beside_edge(&self, arm: &V3<S>, limit: S) -> Option<Gap<S>> {
        let mut best2 = if less(S::zero(), limit) { limit * limit } else { return None };
        let mut best = None;
        let base_is_far = less(limit, -arm[2].abs() - self.base);
        for i in 0..9 {
            if base_is_far && i / 3 == 1 {
                continue;
            }
            let (corner, edge) = self.edge(i);
            let (t, w) = closest_places(arm, &corner, &edge);
            let d = sub3(&scale3(arm, t), &axpy3(&edge, w, &corner));
            let d2 = dot(&d, &d);
            if less(d2, best2) {
                best2 = d2;
                best = Some((d, t));
            }
        }
        let (d, along) = best?;
        let dist = best2.sqrt();
        if !less(S::lit(TINY), dist) {
            return None;
        }
        Some(Gap { dist, normal: scale3(&d, dist.recip()), along })
    }

    /// The shortest way out for a segment that is partly inside, near `inner`.
    #[inline(always)]
    fn exit(&self, arm: &V3<S>, faces: &[Face<S>; 5], inner: S) -> Gap<S> {
        let (zero, one) = (S::zero(), S::lit(1.0));
        let mut best = Gap { dist: S::lit(-1e30), normal: [zero, zero, one], along: zero };
        for face in faces {
            // the deepest point is an end, or all of a segment along the face
            let level = less(face.slope.abs(), S::lit(4.0 * S::EPSILON) * face.middle.abs());
            let along = if level {
                inner
            } else if less(zero, face.slope) {
                -one
            } else {
                one
            };
            let dist = face.nearest();
            if less(best.dist, dist) {
                best = Gap { dist, normal: face.normal, along };
            }
        }
        let length2 = dot(arm, arm);
        for i in 0..9 {
            let (corner, edge) = self.edge(i);
            let n = cross(arm, &edge);
            let n2 = dot(&n, &n);
            if !less(length2 * dot(&edge, &edge) * S::lit(1e-12), n2) {
                continue;
            }
            let mut n = scale3(&n, n2.sqrt().recip());
            // the edge must support the prism along n or -n to be a way out
            let reach = dot(&n, &corner);
            if !less(best.dist, -reach.abs()) {
                continue;
            }
            let (mut above, mut below) = (false, false);
            let size =
                corner[0].abs() + corner[1].abs() + corner[2].abs() + edge[0].abs() + edge[1].abs() + edge[2].abs();
            let slack = size * S::lit(8.0 * S::EPSILON);
            for k in 0..3 {
                for p in [self.top[k], self.foot(k)] {
                    let d = dot(&n, &p) - reach;
                    above |= less(slack, d);
                    below |= less(d, -slack);
                }
            }
            if above && below {
                continue;
            }
            let mut dist = -reach;
            if above {
                n = [-n[0], -n[1], -n[2]];
                dist = reach;
            }
            if less(best.dist, dist) {
                let (t, _) = closest_places(arm, &corner, &edge);
                best = Gap { dist, normal: n, along: t };
            }
        }
        best
    }
}

/// Positions of the closest points of the segments `[-1, 1] arm` and `corner + [0, 1] edge`.
#[inline(always)]
pub(super) fn closest_places<S: Real>(arm: &V3<S>, corner: &V3<S>, edge: &V3<S>) -> (S, S) {
    let (zero, one) = (S::zero(), S::lit(1.0));
    let (aa, ae, ee) = (dot(arm, arm), dot(arm, edge), dot(edge, edge));
    let (ac, ec) = (dot(arm, corner), dot(edge, corner));
    let n = cross(arm, edge);
    let det = dot(&n, &n);
    let mut t = zero;
    if less(aa * ee * S::lit(1e-14), det) {
        t = clamp((ee * ac - ae * ec).div(det), one);
    }
    let w = (ae * t - ec).div(ee).max(zero).min(one);
    if less(zero, aa) {
        t = clamp((ae * w + ac).div(aa), one);
    }
    (t, w)
}
