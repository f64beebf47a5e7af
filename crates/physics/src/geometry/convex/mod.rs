//! Contacts of convex shapes: spheres, capsules, ellipsoids, cylinders, boxes, hulls of meshes.
//!
//! MuJoCo's rules decide which contacts there are. [`gjk`] finds the distance of two shapes that are apart, [`epa`] the
//! depth of two that overlap. Spheres and capsules are first shrunk to points and segments, and all shapes lose their
//! margin; if they are apart then, the distance is exact. If several contacts are allowed, [`manifold`] clips the faces
//! or edges at the closest points against each other.
//!
//! One agent is processed at a time. The results depend on the two shapes only, not on earlier steps.

mod clip;
mod epa;
mod feature;
mod field;
mod gjk;
mod manifold;
mod plane_hull;
mod polyhedron;
mod simplex;
mod support;
#[cfg(test)]
mod tests;
mod vector;

pub(crate) use gjk::{MOST_ITERATIONS, Search};
pub(crate) use polyhedron::{Polyhedron, hull_radius};
pub(crate) use support::{Form, Solid};
pub(crate) use vector::Number;

use super::height::HeightField;
use super::{Plane, Rot, Touch, Touches, V3};
use epa::{Polytope, depth};
use gjk::{Couple, Vertex, nearest};
use manifold::{Contact, Polygons};
use vector::*;

/// Memory of the searches, kept between steps.
#[derive(Clone, Debug)]
pub(crate) struct Scratch<S> {
    polytope: Polytope<S>,
    polygons: Polygons<S>,
}

impl<S: Number> Scratch<S> {
    pub(crate) fn new() -> Self {
        Scratch { polytope: Polytope::new(), polygons: Polygons::new() }
    }
}

/// Finds the contacts of two shapes, in the order of MuJoCo's shape types, and appends them. The tangents are left out.
// one copy per precision, for all lane types
#[inline(never)]
pub(crate) fn convex<S: Number>(
    a: &Solid<S>,
    b: &Solid<S>,
    margin: S,
    search: &Search<S>,
    scratch: &mut Scratch<S>,
    out: &mut Touches<S>,
) {
    let several = search.several && have_faces(a, b);
    collide([a, b], margin, several, search, scratch, |contact| push(out, &contact, margin));
}

/// Finds the contacts of a plane and a hull and appends them. The tangents are left out.
#[inline(never)]
pub(crate) fn plane_hull<S: Number>(
    plane: &Plane<S>,
    b: &Solid<S>,
    margin: S,
    scratch: &mut Scratch<S>,
    out: &mut Touches<S>,
) {
    if let Form::Hull(hull) = b.form {
        let corners = &mut scratch.polygons.polygon;
        plane_hull::plane_hull(plane, b, hull, margin, corners, |contact| push(out, &contact, margin));
    }
}

/// Finds the contacts of a height field at a place and a shape and appends them. The tangents are left out.
#[inline(never)]
pub(crate) fn field_convex<S: Number>(
    a: (&HeightField<S>, &V3<S>, &Rot<S>),
    b: &Solid<S>,
    margin: S,
    search: &Search<S>,
    scratch: &mut Scratch<S>,
    out: &mut Touches<S>,
) {
    let (field, center, axes) = a;
    field::field_convex(field, (center, axes), b, margin, search, scratch, |contact| push(out, &contact, margin));
}

fn push<S: Number>(out: &mut Touches<S>, contact: &Contact<S>, margin: S) {
    let Contact { dist, pos, normal } = *contact;
    out.push(Touch { on: dist.lt(margin), dist, pos, normal, tangent: [S::zero(); 3] });
}

/// Whether a pair of shapes can have several contacts: both have flat faces, or the first is a capsule.
fn have_faces<S>(a: &Solid<S>, b: &Solid<S>) -> bool {
    let flat = |solid: &Solid<S>| matches!(solid.form, Form::Cylinder { .. } | Form::Cuboid { .. } | Form::Hull(_));
    flat(b) && (flat(a) || matches!(a.form, Form::Capsule { .. }))
}

/// Finds the contacts of two shapes.
fn collide<S: Number>(
    solids: [&Solid<S>; 2],
    margin: S,
    several: bool,
    search: &Search<S>,
    scratch: &mut Scratch<S>,
    mut add: impl FnMut(Contact<S>),
) {
    let zero = S::zero();
    let mut couple = Couple { shapes: solids.map(Solid::shape) };
    let half = S::lit(0.5) * margin;
    let radii = solids.map(|s| s.radius().unwrap_or(zero) + half);
    if zero < radii[0] + radii[1] {
        for shape in &mut couple.shapes {
            shape.shrunk = true;
        }
        let Some(found) = nearest(&mut couple, search, Some(radii[0] + radii[1])) else { return };
        if search.tolerance < found.distance {
            let along_line = unit(&sub(&found.witness[1], &found.witness[0]));
            let witness =
                [along(&found.witness[0], &along_line, radii[0]), along(&found.witness[1], &along_line, -radii[1])];
            let dist = found.distance - (radii[0] + radii[1]);
            if !(dist < zero) {
                return;
            }
            let corner = |i: usize| found.simplex[if i < found.count { i } else { 0 }];
            let vertices = [corner(0), corner(1), corner(2)];
            finish(solids, &vertices, &witness, dist, margin, several, scratch, &mut add);
            return;
        }
        couple = Couple { shapes: solids.map(Solid::shape) };
        for shape in &mut couple.shapes {
            shape.inflation = half;
        }
    }
    let Some(found) = nearest(&mut couple, search, None) else { return };
    if search.tolerance < found.distance || found.count < 2 {
        return;
    }
    let Some(found) = depth(&mut couple, search, &found, &mut scratch.polytope) else { return };
    if zero < found.depth {
        finish(solids, &found.vertices, &found.witness, -found.depth, margin, several, scratch, &mut add);
    }
}

/// Adds the contacts at two points of the shapes that were inflated by the margin.
#[allow(clippy::too_many_arguments)]
fn finish<S: Number>(
    solids: [&Solid<S>; 2],
    vertices: &[Vertex<S>; 3],
    witness: &[V3<S>; 2],
    dist: S,
    margin: S,
    several: bool,
    scratch: &mut Scratch<S>,
    add: &mut impl FnMut(Contact<S>),
) {
    if several && scratch.polygons.contacts(solids, vertices, witness, margin, &mut *add) {
        return;
    }
    let normal = unit(&sub(&witness[0], &witness[1]));
    add(Contact { dist: dist + margin, pos: middle(&witness[0], &witness[1]), normal });
}
