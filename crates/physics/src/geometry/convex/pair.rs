//! The search for the contacts of one pair of convex shapes.

use super::super::V3;
use super::epa::{Depth, Polytope, depth};
use super::gjk::{Couple, Search, Vertex, is_single, nearest};
use super::manifold::{Contact, Polygons};
use super::support::{Form, Solid};
use super::vector::*;

/// Memory of the searches, kept between steps.
#[derive(Clone, Debug)]
pub(crate) struct Scratch<S> {
    polytope: Polytope<S>,
    pub(super) polygons: Polygons<S>,
}

impl<S: Number> Scratch<S> {
    pub(crate) fn new() -> Self {
        Scratch { polytope: Polytope::new(), polygons: Polygons::new() }
    }
}

/// Whether a pair of shapes can have several contacts: both have flat faces, or the first is a capsule.
pub(super) fn have_faces<S>(a: &Solid<S>, b: &Solid<S>) -> bool {
    let flat = |solid: &Solid<S>| matches!(solid.form, Form::Cylinder { .. } | Form::Cuboid { .. } | Form::Hull(_));
    flat(b) && (flat(a) || matches!(a.form, Form::Capsule { .. }))
}

/// A pair of shapes, and how its contacts are found.
pub(super) struct Pair<'a, 'b, S> {
    /// In the order of MuJoCo's shape types.
    pub solids: [&'a Solid<'b, S>; 2],
    pub margin: S,
    pub several: bool,
    pub search: &'a Search<S>,
}

/// The closest part of the difference of two shapes that were inflated by half the margin each.
struct Closest<S> {
    /// Negative for an overlap.
    dist: S,
    witness: [V3<S>; 2],
    vertices: [Vertex<S>; 3],
}

impl<'b, S: Number> Pair<'_, 'b, S> {
    /// Finds the contacts. Without contacts, returns a lower bound of the distance beyond the margin.
    pub(super) fn contacts(&self, scratch: &mut Scratch<S>, mut add: impl FnMut(Contact<S>)) -> Option<S> {
        let closest = match self.closest(&mut scratch.polytope) {
            Ok(closest) => closest,
            Err(distance) => return Some(distance),
        };
        let Closest { dist, witness, vertices } = &closest;
        if self.several && scratch.polygons.contacts(self.solids, vertices, witness, self.margin, &mut add) {
            return None;
        }
        let normal = unit(&sub(&witness[0], &witness[1]));
        add(Contact { dist: *dist + self.margin, pos: middle(&witness[0], &witness[1]), normal });
        None
    }

    /// The shapes without radii and margin are enough if they are apart. Otherwise the whole shapes overlap. If there is no contact, the
    /// error is a lower bound of the distance beyond the margin.
    fn closest(&self, polytope: &mut Polytope<S>) -> Result<Closest<S>, S> {
        let zero = S::zero();
        let half = S::lit(0.5) * self.margin;
        let radii = self.solids.map(|s| s.radius().unwrap_or(zero) + half);
        let reach = radii[0] + radii[1];
        if zero < reach {
            let found = nearest(&mut self.couple(true, zero), self.search, Some(reach)).map_err(|far| far - reach)?;
            if self.least_line() < found.distance {
                let line = unit(&sub(&found.witness[1], &found.witness[0]));
                let witness = [along(&found.witness[0], &line, radii[0]), along(&found.witness[1], &line, -radii[1])];
                let corner = |i: usize| found.simplex[if i < found.count { i } else { 0 }];
                let found =
                    Closest { dist: found.distance - reach, witness, vertices: [corner(0), corner(1), corner(2)] };
                return if found.dist < zero { Ok(found) } else { Err(zero) };
            }
        }
        let mut couple = self.couple(false, half);
        let found = nearest(&mut couple, self.search, None)?;
        if zero < found.distance || found.count < 2 {
            // a search that ends before its tolerance finds too long a distance
            return Err(zero);
        }
        let Depth { depth, witness, vertices } = depth(&mut couple, self.search, &found, polytope).ok_or(zero)?;
        if zero < depth { Ok(Closest { dist: -depth, witness, vertices }) } else { Err(zero) }
    }

    /// The shapes for a search: spheres and capsules shrunk to points and segments, or all shapes inflated.
    fn couple(&self, shrunk: bool, inflation: S) -> Couple<'b, S> {
        let mut couple = Couple { shapes: self.solids.map(Solid::shape) };
        for shape in &mut couple.shapes {
            (shape.shrunk, shape.inflation) = (shrunk, inflation);
        }
        couple
    }

    /// Distance from which two closest points have a direction.
    fn least_line(&self) -> S {
        if is_single::<S>() { S::lit(3e-5).max(self.search.tolerance) } else { self.search.tolerance }
    }
}
