//! Two boxes: one contact where edges cross, up to eight where a face meets the other box.
//!
//! There are 15 candidate directions: the face normals of both boxes and the products of their edges. The contact
//! normal is the one of largest separation. If it belongs to a face, that face is the reference. The most opposed face
//! of the other box is clipped to the reference's outline, and the remaining corners below the margin are the contacts.
//! If it belongs to two edges, their closest points are the contact.

use super::*;
use crate::lanes::kernel_fn;

/// An edge direction wins only if its separation exceeds that of the best face by this fraction.
const EDGE_BIAS: f64 = 1e-6;
/// An edge direction this close to the best face's normal (cosine) counts as that normal...
const SAME_DIRECTION: f64 = 0.99;
/// ...unless its separation is larger by this fraction.
const SAME_SHARE: f64 = 0.05;
/// Maximum corners of a square after four cuts, plus room for corners caused by rounding.
const CORNERS: usize = 12;

/// Rounding allowances, for double and for single precision.
struct Slack<S> {
    /// For a separation, relative to the sum of the boxes' sizes.
    separation: S,
    /// Square of the sine below which two edges are parallel.
    parallel: S,
    /// Component of the normal below which both edges of a face are supporting.
    either: S,
    /// Squared distance of coinciding corners, relative to the squared size.
    same: S,
}

impl<S: Real> Slack<S> {
    #[inline(always)]
    fn new() -> Self {
        let [separation, parallel, either, same] =
            if S::EPSILON < 1e-10 { [1e-13, 1e-16, 1e-9, 1e-14] } else { [1e-6, 1e-7, 1e-5, 1e-10] };
        Slack { separation: S::lit(separation), parallel: S::lit(parallel), either: S::lit(either), same: S::lit(same) }
    }
}

/// The direction of largest separation.
#[derive(Clone, Copy)]
enum Direction {
    /// The normal of a face across this axis, of the first or second box.
    Face { first: bool, axis: usize },
    /// The product of an edge along axis `i` of the first box and one along axis `j` of the second.
    Edges { i: usize, j: usize },
}

/// Both boxes in the frames of both.
struct Relative<S: Real> {
    /// `cos[i][j]`: cosine between axis `i` of the first and axis `j` of the second box.
    cos: [[S; 3]; 3],
    /// Center of the second box in the frame of the first.
    second: V3<S>,
    /// Center of the first box in the frame of the second.
    first: V3<S>,
}

kernel_fn! {
    /// Finds the contacts and appends them.
    pub(crate) fn box_box<'a, S>(a: &'a Cuboid<S>, b: &'a Cuboid<S>, margin: S, out: &'a mut Touches<S>) {
        let slack = Slack::new();
        let d = sub3(&b.center, &a.center);
        let back = [-d[0], -d[1], -d[2]];
        let mut cos = [[S::zero(); 3]; 3];
        for i in 0..3 {
            cos[i] = into_axes(&b.axes, &a.axes[i]);
        }
        let relative = Relative { cos, second: into_axes(&a.axes, &d), first: into_axes(&b.axes, &back) };
        match separate(a, b, &relative, margin, &slack) {
            None => {}
            Some(Direction::Face { first: true, axis }) => {
                let axes = [cos[0], cos[1], cos[2]];
                face_contacts(a, b, &axes, &relative.second, axis, false, margin, &slack, out);
            }
            Some(Direction::Face { first: false, axis }) => {
                let c = &cos;
                let axes = [[c[0][0], c[1][0], c[2][0]], [c[0][1], c[1][1], c[2][1]], [c[0][2], c[1][2], c[2][2]]];
                face_contacts(b, a, &axes, &relative.first, axis, true, margin, &slack, out);
            }
            Some(Direction::Edges { i, j }) => out.push(edge_contact(a, b, &relative, i, j, margin, &slack)),
        }
    }
}

/// The direction of the largest separation, or `None` if that is above the margin.
#[inline(always)]
fn separate<S: Real>(a: &Cuboid<S>, b: &Cuboid<S>, r: &Relative<S>, margin: S, slack: &Slack<S>) -> Option<Direction> {
    let (s, t) = (&a.half, &b.half);
    let limit = (s[0] + s[1] + s[2] + t[0] + t[1] + t[2]).mul_add(slack.separation, margin);
    let mut face = S::lit(-1e10);
    let mut direction = Direction::Face { first: true, axis: 0 };
    for axis in 0..3 {
        let c = &r.cos[axis];
        let reach = c[0].abs() * t[0] + c[1].abs() * t[1] + c[2].abs() * t[2];
        let separation = r.second[axis].abs() - s[axis] - reach;
        if less(limit, separation) {
            return None;
        }
        if less(face, separation) {
            face = separation;
            direction = Direction::Face { first: true, axis };
        }
    }
    for axis in 0..3 {
        let c = &r.cos;
        let reach = c[0][axis].abs() * s[0] + c[1][axis].abs() * s[1] + c[2][axis].abs() * s[2];
        let separation = r.first[axis].abs() - t[axis] - reach;
        if less(limit, separation) {
            return None;
        }
        if less(face, separation) {
            face = separation;
            direction = Direction::Face { first: false, axis };
        }
    }
    let mut best = face;
    let mut edges = None;
    for i in 0..3 {
        for j in 0..3 {
            let Some(n) = edge_normal(r, i, j, slack) else { continue };
            let m = in_second(r, &n);
            let (i1, i2, j1, j2) = ((i + 1) % 3, (i + 2) % 3, (j + 1) % 3, (j + 2) % 3);
            let reach_a = s[i1] * n[i1].abs() + s[i2] * n[i2].abs();
            let reach_b = t[j1] * m[j1].abs() + t[j2] * m[j2].abs();
            let separation = dot(&n, &r.second).abs() - reach_a - reach_b;
            if less(limit, separation) {
                return None;
            }
            let biased = S::lit(EDGE_BIAS).neg_mul_add(separation.abs(), separation);
            if less(best, biased) && less(face, separation) {
                best = separation;
                edges = Some((i, j, n));
            }
        }
    }
    if let Some((i, j, n)) = edges {
        let along = match direction {
            Direction::Face { first: true, axis } => n[axis],
            Direction::Face { first: false, axis } => in_second(r, &n)[axis],
            Direction::Edges { .. } => S::zero(),
        };
        let excess = S::lit(SAME_SHARE).mul_add(face.abs(), face) + S::lit(TINY);
        let same = less(S::lit(SAME_DIRECTION), along.abs()) && less(best, excess);
        if !same {
            direction = Direction::Edges { i, j };
        }
    }
    Some(direction)
}

/// Unit vector perpendicular to an edge of each box, in the frame of the first. `None` for parallel edges.
#[inline(always)]
fn edge_normal<S: Real>(r: &Relative<S>, i: usize, j: usize, slack: &Slack<S>) -> Option<V3<S>> {
    let (i1, i2) = ((i + 1) % 3, (i + 2) % 3);
    let (x, y) = (-r.cos[i2][j], r.cos[i1][j]);
    let len2 = x.mul_add(x, y * y);
    if less(len2, slack.parallel) {
        return None;
    }
    let inv = len2.sqrt().recip();
    let mut n = [S::zero(); 3];
    n[i1] = x * inv;
    n[i2] = y * inv;
    Some(n)
}

/// Converts a vector from the first box's frame to the second's.
#[inline(always)]
fn in_second<S: Real>(r: &Relative<S>, x: &V3<S>) -> V3<S> {
    let c = &r.cos;
    [
        c[0][0].mul_add(x[0], c[1][0].mul_add(x[1], c[2][0] * x[2])),
        c[0][1].mul_add(x[0], c[1][1].mul_add(x[1], c[2][1] * x[2])),
        c[0][2].mul_add(x[0], c[1][2].mul_add(x[1], c[2][2] * x[2])),
    ]
}

/// The contact of two edges.
#[inline(always)]
fn edge_contact<S: Real>(
    a: &Cuboid<S>,
    b: &Cuboid<S>,
    r: &Relative<S>,
    i: usize,
    j: usize,
    margin: S,
    slack: &Slack<S>,
) -> Touch<S> {
    let zero = S::zero();
    let Some(mut n) = edge_normal(r, i, j, slack) else { return Touch::none() };
    if less(dot(&n, &r.second), zero) {
        n = [-n[0], -n[1], -n[2]];
    }
    let m = in_second(r, &n);
    let edge_b = [r.cos[0][j], r.cos[1][j], r.cos[2][j]];
    let cosine = edge_b[i];
    let sin2 = cosine.neg_mul_add(cosine, S::lit(1.0));
    // the supporting edge of each box; if the normal lies in a face, two edges support it, and the closest pair of
    // edges counts
    let (ends_a, ends_b) = (supports(&n, i, slack), supports(&m, j, slack));
    let mut best2 = S::lit(1e30);
    let mut points = ([zero; 3], [zero; 3]);
    for side_a in ends_a.into_iter().flatten() {
        for side_b in ends_b.into_iter().flatten() {
            let mut p = [a.half[0] * side_a[0], a.half[1] * side_a[1], a.half[2] * side_a[2]];
            let corner = [-(b.half[0] * side_b[0]), -(b.half[1] * side_b[1]), -(b.half[2] * side_b[2])];
            let c = &r.cos;
            let mut q = [
                dot(&c[0], &corner) + r.second[0],
                dot(&c[1], &corner) + r.second[1],
                dot(&c[2], &corner) + r.second[2],
            ];
            let e = sub3(&q, &p);
            let (along_a, along_b) = (e[i], dot(&edge_b, &e));
            let s = clamp(cosine.neg_mul_add(along_b, along_a).div(sin2), a.half[i]);
            let t = clamp(cosine.mul_add(s, -along_b), b.half[j]);
            let s = clamp(cosine.mul_add(t, along_a), a.half[i]);
            p[i] += s;
            q = axpy3(&edge_b, t, &q);
            let gap = sub3(&q, &p);
            let gap2 = dot(&gap, &gap);
            if less(gap2, best2) {
                best2 = gap2;
                points = (p, q);
            }
        }
    }
    let (p, q) = points;
    let dist = dot(&sub3(&q, &p), &n);
    let middle = scale3(&add3(&p, &q), S::lit(0.5));
    Touch::new(dist, rotate_add(&a.axes, &middle, &a.center), rotate(&a.axes, &n), margin)
}

/// Sides (-1 or 1; 0 along `axis`) of the edge along `axis` that lies farthest along `n`. Also those of the other edge
/// if the normal does not distinguish them.
#[inline(always)]
fn supports<S: Real>(n: &V3<S>, axis: usize, slack: &Slack<S>) -> [Option<V3<S>>; 2] {
    let one = S::lit(1.0);
    let mut side = [S::zero(); 3];
    for step in 1..3 {
        let k = (axis + step) % 3;
        side[k] = if less(n[k], S::zero()) { -one } else { one };
    }
    for step in 1..3 {
        let k = (axis + step) % 3;
        if less(n[k].abs(), slack.either) {
            let mut other = side;
            other[k] = -other[k];
            return [Some(side), Some(other)];
        }
    }
    [Some(side), None]
}

/// The contacts of a face of the box `reference` with the box `other`.
///
/// `cos[k]` is axis `k` of the reference in the other's frame, `center` the other's center in the reference's frame.
/// `flip` means that the reference is the second box of the pair.
#[inline(always)]
#[allow(clippy::too_many_arguments)]
fn face_contacts<S: Real>(
    reference: &Cuboid<S>,
    other: &Cuboid<S>,
    cos: &[V3<S>; 3],
    center: &V3<S>,
    axis: usize,
    flip: bool,
    margin: S,
    slack: &Slack<S>,
    out: &mut Touches<S>,
) {
    let zero = S::zero();
    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
    let half = &reference.half;
    let below = less(center[axis], zero);
    // the face of the other box that is most opposed to the reference
    let facing = &cos[axis];
    let mut face = 0;
    for k in 1..3 {
        if less(facing[face].abs(), facing[k].abs()) {
            face = k;
        }
    }
    let toward = less(zero, if below { -facing[face] } else { facing[face] });
    let depth = if toward { -other.half[face] } else { other.half[face] };
    let (k, l) = ((face + 1) % 3, (face + 2) % 3);
    // its corners: two coordinates in the reference face, and the height above it
    let mut middle = [zero; 3];
    let mut arms = [[zero; 3]; 2];
    for (row, c) in [u, v, axis].into_iter().enumerate() {
        middle[row] = center[c] + depth * cos[c][face];
        arms[0][row] = other.half[k] * cos[c][k];
        arms[1][row] = other.half[l] * cos[c][l];
    }
    if below {
        middle[2] = -middle[2];
        arms[0][2] = -arms[0][2];
        arms[1][2] = -arms[1][2];
    }
    middle[2] -= half[axis];
    let (sum, difference) = (add3(&arms[0], &arms[1]), sub3(&arms[0], &arms[1]));
    let mut polygon = Polygon { corners: [[zero; 3]; CORNERS], len: 4 };
    polygon.corners[0] = add3(&middle, &sum);
    polygon.corners[1] = sub3(&middle, &difference);
    polygon.corners[2] = sub3(&middle, &sum);
    polygon.corners[3] = add3(&middle, &difference);
    for (coordinate, limit) in [(0, half[u]), (1, half[v])] {
        polygon.clip(coordinate, false, limit);
        polygon.clip(coordinate, true, limit);
    }

    let up = reference.axes[axis];
    let normal = if below != flip { [-up[0], -up[1], -up[2]] } else { up };
    let tangent = first_tangent(&normal);
    let same = slack.same * half[u].mul_add(half[u], half[v] * half[v]);
    let mut kept = 0;
    for index in 0..polygon.len {
        let p = polygon.corners[index];
        if less(margin, p[2]) || polygon.has_near(kept, &p, same) {
            continue;
        }
        polygon.corners[kept] = p;
        kept += 1;
        let mut at = [zero; 3];
        at[u] = p[0];
        at[v] = p[1];
        at[axis] = p[2].mul_add(S::lit(0.5), half[axis]);
        if below {
            at[axis] = -at[axis];
        }
        let pos = rotate_add(&reference.axes, &at, &reference.center);
        out.push(Touch { on: p[2].lt(margin), dist: p[2], pos, normal, tangent });
    }
}

/// A convex polygon over the plane of a face: two coordinates and a height.
struct Polygon<S: Real> {
    corners: [V3<S>; CORNERS],
    len: usize,
}

impl<S: Real> Polygon<S> {
    #[inline(always)]
    fn add(&mut self, corner: V3<S>) {
        if self.len < CORNERS {
            self.corners[self.len] = corner;
            self.len += 1;
        }
    }

    /// Cuts off the part beyond `limit` along a coordinate, or along its negative.
    #[inline(always)]
    fn clip(&mut self, coordinate: usize, negative: bool, limit: S) {
        let zero = S::zero();
        let mut beyond = [zero; CORNERS];
        let mut cut = false;
        for i in 0..self.len {
            let x = self.corners[i][coordinate];
            beyond[i] = if negative { -x } else { x } - limit;
            cut |= less(zero, beyond[i]);
        }
        if !cut {
            return;
        }
        let old = self.corners;
        let len = self.len;
        self.len = 0;
        for i in 0..len {
            let next = if i + 1 == len { 0 } else { i + 1 };
            let (d, e) = (beyond[i], beyond[next]);
            if !less(zero, d) {
                self.add(old[i]);
            }
            if (less(d, zero) && less(zero, e)) || (less(zero, d) && less(e, zero)) {
                let t = d.div(d - e);
                self.add(axpy3(&sub3(&old[next], &old[i]), t, &old[i]));
            }
        }
    }

    /// Whether one of the first `len` corners has a squared distance below `limit2` from `p` in the plane.
    #[inline(always)]
    fn has_near(&self, len: usize, p: &V3<S>, limit2: S) -> bool {
        for q in &self.corners[..len] {
            let (x, y) = (q[0] - p[0], q[1] - p[1]);
            if less(x.mul_add(x, y * y), limit2) {
                return true;
            }
        }
        false
    }
}
