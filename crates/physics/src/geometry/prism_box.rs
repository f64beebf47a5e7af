//! The closest points of a box and a prism of a height field.
//!
//! Coordinates are relative to the box's center. The box is given by its arms, the vectors from the center to the
//! middle of its faces.

use super::prism::{Face, Prism, closest_places};
use super::*;

/// Depth difference of corners on the same level, as a fraction of the box's half extent.
const LEVEL: f64 = 1e-4;
/// Fraction by which an edge's way out must be shorter than a face's.
const EDGE_BIAS: f64 = 1e-6;

/// Signed distance of a box from a prism.
pub(super) struct BoxGap<S: Real> {
    pub dist: S,
    /// Unit vector from the prism to the box.
    pub normal: V3<S>,
    /// Midway between the closest points.
    pub pos: V3<S>,
}

/// The feature of largest separation between a box and a prism.
#[derive(Clone, Copy)]
enum Feature {
    PrismFace(usize),
    BoxFace(usize),
    /// An edge of the prism and one of the box along an axis.
    Edges(usize, usize),
}

impl<S: Real> Prism<'_, S> {
    /// Distance of a box. `None` if it is above `limit`.
    #[inline(always)]
    pub(super) fn gap_to_box(&self, arms: &Rot<S>, half: &V3<S>, limit: S) -> Option<BoxGap<S>> {
        let still = [S::zero(); 3];
        let slope = self.slope(&still);
        if less(limit, slope.middle - reach(arms, &slope.normal)) {
            return None;
        }
        let faces = self.faces(slope, &still);
        let corners = [self.top[0], self.top[1], self.top[2], self.foot(0), self.foot(1), self.foot(2)];
        let mut separation = S::lit(-1e30);
        let mut normal = still;
        let mut feature = Feature::PrismFace(0);
        for i in 0..5 {
            let s = faces[i].middle - reach(arms, &faces[i].normal);
            if less(limit, s) {
                return None;
            }
            if less(separation, s) {
                (separation, normal, feature) = (s, faces[i].normal, Feature::PrismFace(i));
            }
        }
        for k in 0..3 {
            let axis = scale3(&arms[k], half[k].recip());
            let (low, high) = extent(&corners, &axis);
            // the box is above the prism along the axis, or below it
            let (above, below) = (-half[k] - high, low - half[k]);
            let (s, n) = if less(above, below) { (below, [-axis[0], -axis[1], -axis[2]]) } else { (above, axis) };
            if less(limit, s) {
                return None;
            }
            if less(separation, s) {
                (separation, normal, feature) = (s, n, Feature::BoxFace(k));
            }
        }
        let faces_alone = S::lit(EDGE_BIAS).mul_add(separation.abs(), separation);
        for e in 0..9 {
            let (corner, edge) = self.edge(e);
            for k in 0..3 {
                let n = cross(&edge, &arms[k]);
                let n2 = dot(&n, &n);
                if !less(dot(&edge, &edge) * half[k] * half[k] * S::lit(1e-10), n2) {
                    continue;
                }
                let n = scale3(&n, n2.sqrt().recip());
                let width = reach(arms, &n);
                let at = dot(&n, &corner);
                let (low, high) = extent(&corners, &n);
                let slack = (high - low) * S::lit(8.0 * S::EPSILON);
                // the edge must support the prism
                let (s, n) = if !less(at + slack, high) {
                    (-width - high, n)
                } else if !less(low, at - slack) {
                    (low - width, [-n[0], -n[1], -n[2]])
                } else {
                    continue;
                };
                if less(limit, s) {
                    return None;
                }
                if less(separation.max(faces_alone), s) {
                    (separation, normal, feature) = (s, n, Feature::Edges(e, k));
                }
            }
        }
        // for almost touching shapes, rounding dominates the direction between closest points
        if less((half[0] + half[1] + half[2]) * S::lit(64.0 * S::EPSILON), separation) {
            return self.apart(arms, half, &corners, limit);
        }
        let middle = self.place(feature, (separation, &normal), arms, half, &corners, &faces);
        Some(BoxGap { dist: separation, normal, pos: middle })
    }

    /// Contact point of a prism and a box that are `separation` apart along `normal` by this feature.
    #[inline(always)]
    fn place(
        &self,
        feature: Feature,
        (separation, normal): (S, &V3<S>),
        arms: &Rot<S>,
        half: &V3<S>,
        corners: &[V3<S>; 6],
        faces: &[Face<S>; 5],
    ) -> V3<S> {
        match feature {
            Feature::PrismFace(i) => {
                let face = box_corners(arms, half, normal);
                let touching = face.clip_to_prism(faces, i);
                axpy3(normal, separation * S::lit(-0.5), &touching)
            }
            Feature::BoxFace(k) => {
                let touching = prism_corners(corners, normal, half[k]).clip_to_box(arms, half, k);
                axpy3(normal, separation * S::lit(0.5), &touching)
            }
            Feature::Edges(e, k) => {
                let mut from = [S::zero(); 3];
                for j in 0..3 {
                    if j != k {
                        let down = less(S::zero(), dot(normal, &arms[j]));
                        from = if down { sub3(&from, &arms[j]) } else { add3(&from, &arms[j]) };
                    }
                }
                let (corner, edge) = self.edge(e);
                let (t, w) = closest_places(&arms[k], &sub3(&corner, &from), &edge);
                scale3(&add3(&axpy3(&arms[k], t, &from), &axpy3(&edge, w, &corner)), S::lit(0.5))
            }
        }
    }

    /// The closest points of a box that does not touch the prism: on one of its edges, or at a corner of the prism.
    #[inline(always)]
    fn apart(&self, arms: &Rot<S>, half: &V3<S>, corners: &[V3<S>; 6], limit: S) -> Option<BoxGap<S>> {
        let zero = S::zero();
        let mut best: Option<BoxGap<S>> = None;
        let mut nearest = limit;
        for k in 0..3 {
            let (i, j) = ((k + 1) % 3, (k + 2) % 3);
            let (sum, difference) = (add3(&arms[i], &arms[j]), sub3(&arms[i], &arms[j]));
            for (middle, sign) in [(sum, true), (sum, false), (difference, true), (difference, false)] {
                let m = if sign { middle } else { [-middle[0], -middle[1], -middle[2]] };
                let top = [sub3(&self.top[0], &m), sub3(&self.top[1], &m), sub3(&self.top[2], &m)];
                let moved = Prism { top, walls: self.walls, base: self.base - m[2] };
                if let Some(gap) = moved.gap(&arms[k], nearest)
                    && less(gap.dist, nearest)
                {
                    nearest = gap.dist;
                    let on_box = axpy3(&arms[k], gap.along, &m);
                    let pos = axpy3(&gap.normal, gap.dist * S::lit(-0.5), &on_box);
                    best = Some(BoxGap { dist: gap.dist, normal: gap.normal, pos });
                }
            }
        }
        for corner in corners {
            let mut d = [-corner[0], -corner[1], -corner[2]];
            for k in 0..3 {
                // the arms are perpendicular: this moves the end of `d` to the box along one of them
                let along = dot(corner, &arms[k]).div(half[k] * half[k]);
                d = axpy3(&arms[k], clamp(along, S::lit(1.0)), &d);
            }
            let dist = dot(&d, &d).sqrt();
            if less(zero, dist) && less(dist, nearest) {
                nearest = dist;
                let pos = axpy3(&d, S::lit(0.5), corner);
                best = Some(BoxGap { dist, normal: scale3(&d, dist.recip()), pos });
            }
        }
        best
    }
}

/// Half extent of a box along a unit vector.
#[inline(always)]
fn reach<S: Real>(arms: &Rot<S>, n: &V3<S>) -> S {
    dot(&arms[0], n).abs() + dot(&arms[1], n).abs() + dot(&arms[2], n).abs()
}

/// The least and largest component of points along a vector.
#[inline(always)]
fn extent<S: Real>(points: &[V3<S>; 6], n: &V3<S>) -> (S, S) {
    let first = dot(&points[0], n);
    let (mut low, mut high) = (first, first);
    for p in &points[1..] {
        let x = dot(p, n);
        low = low.min(x);
        high = high.max(x);
    }
    (low, high)
}

/// The corners of a box that are deepest along `-normal`: one, or all of a perpendicular edge or face.
#[inline(always)]
fn box_corners<S: Real>(arms: &Rot<S>, half: &V3<S>, normal: &V3<S>) -> Area<S> {
    let mut area = Area { points: [[S::zero(); 3]; 12], len: 1 };
    let mut open = 0;
    for k in 0..3 {
        let slope = dot(&arms[k], normal);
        let level = less(slope.abs(), half[k] * S::lit(LEVEL));
        if level && open < 2 {
            // keep the cyclic order: the second open direction is added in reverse order
            for i in 0..area.len {
                let p = area.points[area.len - 1 - i];
                area.points[area.len + i] = add3(&p, &arms[k]);
            }
            for i in 0..area.len {
                area.points[i] = sub3(&area.points[i], &arms[k]);
            }
            area.len *= 2;
            open += 1;
        } else {
            for i in 0..area.len {
                let p = area.points[i];
                area.points[i] = if less(S::zero(), slope) { sub3(&p, &arms[k]) } else { add3(&p, &arms[k]) };
            }
        }
    }
    area
}

/// The corners of a prism that are highest along `normal`, in cyclic order.
#[inline(always)]
fn prism_corners<S: Real>(corners: &[V3<S>; 6], normal: &V3<S>, size: S) -> Area<S> {
    let (_, high) = extent(corners, normal);
    let limit = high - size * S::lit(LEVEL);
    let mut area = Area { points: [[S::zero(); 3]; 12], len: 0 };
    // every face has its corners in this order: the upper ones, then the lower ones backward
    for i in [0, 1, 2, 5, 4, 3] {
        if less(limit, dot(&corners[i], normal)) {
            area.points[area.len] = corners[i];
            area.len += 1;
        }
    }
    area
}

/// A convex polygon, edge or point.
struct Area<S: Real> {
    points: [V3<S>; 12],
    len: usize,
}

impl<S: Real> Area<S> {
    /// The center of the part within the faces of a prism other than `own`.
    #[inline(always)]
    fn clip_to_prism(mut self, faces: &[Face<S>; 5], own: usize) -> V3<S> {
        for i in 0..5 {
            if i != own && self.len > 1 {
                self.clip(&faces[i].normal, -faces[i].middle);
            }
        }
        self.middle()
    }

    /// The center of the part within the faces of a box other than those across axis `own`.
    #[inline(always)]
    fn clip_to_box(mut self, arms: &Rot<S>, half: &V3<S>, own: usize) -> V3<S> {
        for k in 0..3 {
            if k != own && self.len > 1 {
                self.clip(&arms[k], half[k] * half[k]);
                self.clip(&[-arms[k][0], -arms[k][1], -arms[k][2]], half[k] * half[k]);
            }
        }
        self.middle()
    }

    /// Cuts off the points beyond `limit` along a vector, unless those are all.
    #[inline(always)]
    fn clip(&mut self, n: &V3<S>, limit: S) {
        let zero = S::zero();
        let mut out = Area { points: self.points, len: 0 };
        for i in 0..self.len {
            let next = if i + 1 == self.len { 0 } else { i + 1 };
            let (p, q) = (self.points[i], self.points[next]);
            let (d, e) = (dot(&p, n) - limit, dot(&q, n) - limit);
            if !less(zero, d) {
                out.add(p);
            }
            if (less(d, zero) && less(zero, e)) || (less(zero, d) && less(e, zero)) {
                out.add(axpy3(&sub3(&q, &p), d.div(d - e), &p));
            }
        }
        if out.len > 0 {
            *self = out;
        }
    }

    #[inline(always)]
    fn add(&mut self, p: V3<S>) {
        if self.len < self.points.len() {
            self.points[self.len] = p;
            self.len += 1;
        }
    }

    /// Mean of the points.
    #[inline(always)]
    fn middle(&self) -> V3<S> {
        let mut sum = self.points[0];
        for p in &self.points[1..self.len] {
            sum = add3(&sum, p);
        }
        scale3(&sum, S::lit(self.len as f64).recip())
    }
}
