//! A convex hull in lane precision, with what a support function needs.

use super::super::V3;
use super::vector::*;
use crate::lanes::Real;
use crate::model::{self, Hull};

/// Number of corners from which a support point is found by climbing along edges (MuJoCo's `mjMESH_HILLCLIMB_MIN`).
const CLIMB: usize = 10;
/// Components of a unit direction below this count as zero in the choice of a start.
const DEAD_ZONE: f64 = 0.4;

/// Lists of indices, one after the other.
#[derive(Clone, Debug)]
struct Lists {
    starts: Vec<u32>,
    items: Vec<u32>,
}

impl Lists {
    fn new(lists: &[Vec<u32>]) -> Self {
        let mut out = Lists { starts: vec![0], items: Vec::new() };
        for list in lists {
            out.items.extend(list);
            out.starts.push(out.items.len() as u32);
        }
        out
    }

    #[inline]
    fn get(&self, i: usize) -> &[u32] {
        &self.items[self.starts[i] as usize..self.starts[i + 1] as usize]
    }
}

/// Distance of the farthest corner of a hull from the origin.
pub(crate) fn hull_radius(hull: &Hull) -> f64 {
    hull.vertices.iter().map(|v| model::vector::norm(*v)).fold(0.0, f64::max)
}

/// A convex hull in lane precision.
#[derive(Clone, Debug)]
pub(crate) struct Polyhedron<S> {
    pub(super) vertices: Vec<V3<S>>,
    pub(super) normals: Vec<V3<S>>,
    polygons: Lists,
    around: Lists,
    neighbors: Lists,
    /// Distance of the farthest corner from the origin.
    pub(crate) radius: S,
    /// Start of the search by the signs of a direction: an extreme corner of each of 27 directions.
    seeds: [u32; 27],
}

impl<S: Real<Scalar = S>> Polyhedron<S> {
    pub(crate) fn new(hull: &Hull) -> Self {
        let cast = |v: &[f64; 3]| v.map(S::lit);
        let mut seeds = [0; 27];
        for (cell, seed) in seeds.iter_mut().enumerate() {
            let direction = [cell / 9, cell / 3 % 3, cell % 3].map(|c| c as f64 - 1.0);
            let reach = |v: &[f64; 3]| v[0] * direction[0] + v[1] * direction[1] + v[2] * direction[2];
            let mut best = f64::NEG_INFINITY;
            for (i, v) in hull.vertices.iter().enumerate() {
                if reach(v) > best {
                    best = reach(v);
                    *seed = i as u32;
                }
            }
        }
        Polyhedron {
            vertices: hull.vertices.iter().map(cast).collect(),
            normals: hull.normals.iter().map(cast).collect(),
            polygons: Lists::new(&hull.polygons),
            around: Lists::new(&hull.around),
            neighbors: Lists::new(&hull.neighbors),
            radius: S::lit(hull_radius(hull)),
            seeds,
        }
    }
}

impl<S> Polyhedron<S> {
    /// Corners of a polygon, counterclockwise from outside.
    #[inline]
    pub(super) fn polygon(&self, i: usize) -> &[u32] {
        self.polygons.get(i)
    }

    /// Polygons around a corner.
    #[inline]
    pub(super) fn around(&self, vertex: usize) -> &[u32] {
        self.around.get(vertex)
    }
}

impl<S: Number> Polyhedron<S> {
    /// The corner farthest along a local unit direction. Of equal ones, `hint` (the last answer) or the first found.
    pub(super) fn farthest(&self, direction: &V3<S>, hint: Option<usize>) -> usize {
        let reach = |i: usize| dot(direction, &self.vertices[i]);
        if self.vertices.len() < CLIMB {
            let mut best = hint.unwrap_or(0);
            let mut most = reach(best);
            for i in 0..self.vertices.len() {
                if most < reach(i) {
                    (best, most) = (i, reach(i));
                }
            }
            return best;
        }
        let sign = |x: S| usize::from(S::lit(DEAD_ZONE) < x) + 1 - usize::from(x < S::lit(-DEAD_ZONE));
        let cell = 9 * sign(direction[0]) + 3 * sign(direction[1]) + sign(direction[2]);
        let mut best = self.seeds[cell] as usize;
        let mut most = reach(best);
        if let Some(hint) = hint
            && !(reach(hint) < most)
        {
            (best, most) = (hint, reach(hint));
        }
        loop {
            let from = best;
            for &next in self.neighbors.get(from) {
                if most < reach(next as usize) {
                    (best, most) = (next as usize, reach(next as usize));
                }
            }
            if best == from {
                return best;
            }
        }
    }
}
