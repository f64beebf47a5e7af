//! The distance of two convex shapes by the algorithm of Gilbert, Johnson and Keerthi.
//!
//! The closest points are those of the difference of the shapes to the origin. A simplex of support points approaches it
//! until the lower bound of the distance, the support plane, meets the upper bound, the simplex.

use super::super::{TINY, V3};
use super::simplex::{segment, tetrahedron, triangle};
use super::support::Shape;
use super::vector::*;

/// A point of the difference of two shapes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Vertex<S> {
    pub point: V3<S>,
    /// Points of the shapes: `point` is the first less the second.
    pub on: [V3<S>; 2],
    /// The same without the inflation of the shapes.
    pub core: [V3<S>; 2],
    /// Their indices, see [`Support::index`](super::support::Support::index).
    pub index: [i32; 2],
}

/// Largest cap of a search's iterations.
pub(crate) const MOST_ITERATIONS: usize = 1000;

/// Least ratio of the bound to the distance with which a search for a distance that is too large ends.
const ENOUGH: f64 = 0.7;

/// Settings of a search.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Search<S> {
    /// Error of a distance, m (MuJoCo's `ccd_tolerance`).
    pub tolerance: S,
    /// Cap of each search's iterations (MuJoCo's `ccd_iterations`), at most [`MOST_ITERATIONS`].
    pub iterations: usize,
    /// Whether a pair can have several contacts (MuJoCo's flag `multiccd`).
    pub several: bool,
}

/// Two shapes between which a search runs.
pub(super) struct Couple<'a, S> {
    pub shapes: [Shape<'a, S>; 2],
}

impl<S: Number> Couple<'_, S> {
    /// The support point of the difference along a unit direction.
    pub(super) fn support(&mut self, direction: &V3<S>) -> Vertex<S> {
        let [a, b] = &mut self.shapes;
        let (p, q) = (a.support(direction), b.support(&neg(direction)));
        Vertex {
            point: sub(&p.point, &q.point),
            on: [p.point, q.point],
            core: [p.core, q.core],
            index: [p.index, q.index],
        }
    }

    /// Whether both shapes have finitely many support points. Then a search ends exactly.
    pub(super) fn is_discrete(&self) -> bool {
        self.shapes.iter().all(|s| s.solid.is_discrete() && !(S::zero() < s.inflation))
    }
}

/// The end of a search.
pub(super) struct Nearest<S> {
    /// 0 if the shapes overlap.
    pub distance: S,
    /// Closest points of the shapes.
    pub witness: [V3<S>; 2],
    pub simplex: [Vertex<S>; 4],
    pub count: usize,
}

/// Whether a number has less than double precision: then the bounds below are the rounding of lengths of a meter.
pub(super) fn is_single<S: Number>() -> bool {
    S::EPSILON > 1e-12
}

/// Finds the distance of two shapes. If they are farther apart than `cutoff`, or than 0 without one, the error is a lower bound of the
/// distance.
pub(super) fn nearest<S: Number>(
    couple: &mut Couple<S>,
    search: &Search<S>,
    cutoff: Option<S>,
) -> Result<Nearest<S>, S> {
    let zero = S::zero();
    let discrete = couple.is_discrete();
    let floor = S::lit(if is_single::<S>() { 8.0 * S::EPSILON } else { TINY });
    let least = if discrete { floor } else { floor.max(search.tolerance) };
    let enough = if discrete { zero } else { S::lit(0.5) * search.tolerance * search.tolerance };
    let witness = [couple.shapes[0].solid.inside(), couple.shapes[1].solid.inside()];
    let mut x = sub(&witness[0], &witness[1]);
    // replaced before it is used, unless there are no iterations
    let vertex = Vertex { point: x, on: witness, core: witness, index: [0; 2] };
    let mut simplex = [vertex; 4];
    let mut weights = [S::lit(1.0), zero, zero, zero];
    let mut count = 0;
    // of the distance, once it is known to be too large
    let mut bound = zero;
    for _ in 0..search.iterations {
        let square = dot(&x, &x);
        let start = count == 0;
        if square < least * least && !start {
            break;
        }
        let length = square.sqrt();
        // coinciding centers have no direction
        let towards = if length < least { [-S::lit(1.0), zero, zero] } else { scale(&x, -S::lit(1.0).div(length)) };
        let new = couple.support(&towards);
        if !(length < least) {
            let lower = dot(&x, &new.point);
            let rounding = S::lit(if is_single::<S>() { 2.0 * S::EPSILON } else { 0.0 });
            let enough = (rounding * length * (length + norm(&new.point))).max(enough);
            if dot(&x, &sub(&x, &new.point)) < enough {
                break;
            }
            let far = cutoff.is_none_or(|cutoff| !(lower < cutoff * length));
            if zero < lower && far {
                bound = bound.max(lower.div(length));
            }
            // a bound near the distance saves searches in later steps
            if zero < bound && !(lower < S::lit(ENOUGH) * square) {
                break;
            }
        }
        simplex[count] = new;
        weights = closest(&simplex, count + 1);
        count = keep_weighted(&mut simplex, &mut weights);
        let before = x;
        x = mix(&simplex, &weights, count, |v| &v.point);
        if count == 4 {
            break;
        }
        if !start && has_stalled(&x, &before, square) {
            break;
        }
    }
    if zero < bound {
        return Err(bound);
    }
    let distance = if count == 4 { zero } else { norm(&x) };
    let mut found = Nearest { distance, witness, simplex, count };
    if count > 0 {
        found.witness = [0, 1].map(|side| mix(&simplex, &weights, count, |v| &v.on[side]));
    }
    if cutoff.is_none() && is_separated(couple, search, &mut found, &x) { Err(zero) } else { Ok(found) }
}

/// Near the surface, and where rounding has stopped the search, the side of the support plane decides whether two shapes
/// overlap. `x` is the closest point.
fn is_separated<S: Number>(couple: &mut Couple<S>, search: &Search<S>, found: &mut Nearest<S>, x: &V3<S>) -> bool {
    let unsure = !(search.tolerance < found.distance) || is_single::<S>();
    if !unsure || !(S::zero() < found.distance) {
        return false;
    }
    let last = couple.support(&scale(x, -S::lit(1.0).div(found.distance)));
    found.distance = S::zero();
    S::zero() < dot(x, &last.point)
}

/// Moves the vertices of a simplex that have a weight to the front, and returns their number.
fn keep_weighted<S: Number>(simplex: &mut [Vertex<S>; 4], weights: &mut [S; 4]) -> usize {
    let mut count = 0;
    for i in 0..4 {
        if weights[i] != S::zero() {
            simplex[count] = simplex[i];
            weights[count] = weights[i];
            count += 1;
        }
    }
    count
}

/// Whether the closest point has stopped to move. `square` is the square of its distance before.
fn has_stalled<S: Number>(x: &V3<S>, before: &V3<S>, square: S) -> bool {
    if is_single::<S>() {
        return !(dot(x, x) < square);
    }
    sub(x, before).iter().all(|d| d.abs() < S::lit(TINY))
}

/// Weights of the closest point of a simplex.
fn closest<S: Number>(simplex: &[Vertex<S>; 4], count: usize) -> [S; 4] {
    let (zero, [a, b, c, d]) = (S::zero(), simplex);
    match count {
        1 => [S::lit(1.0), zero, zero, zero],
        2 => {
            let w = segment(&a.point, &b.point);
            [w[0], w[1], zero, zero]
        }
        3 => {
            let w = triangle(&a.point, &b.point, &c.point);
            [w[0], w[1], w[2], zero]
        }
        _ => tetrahedron([&a.point, &b.point, &c.point, &d.point]),
    }
}

/// Sum of points of a simplex with weights.
fn mix<S: Number>(
    simplex: &[Vertex<S>; 4],
    weights: &[S; 4],
    count: usize,
    point: impl Fn(&Vertex<S>) -> &V3<S>,
) -> V3<S> {
    let mut out = scale(point(&simplex[0]), weights[0]);
    for i in 1..count {
        out = along(&out, point(&simplex[i]), weights[i]);
    }
    out
}
