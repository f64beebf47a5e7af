//! Contacts of convex shapes: spheres, capsules, ellipsoids, cylinders, boxes, hulls of meshes.
//!
//! MuJoCo's rules decide which contacts there are; [`pair`] has their order. [`gjk`] finds the distance of two shapes
//! that are apart, [`epa`] the depth of two that overlap. Spheres and capsules are first shrunk to points and segments,
//! and all shapes lose their margin; if they are apart then, the distance is exact. If several contacts are allowed,
//! [`manifold`] clips the faces or edges at the closest points against each other.
//!
//! One agent is processed at a time. The results depend on the two shapes only, not on earlier steps.

mod clip;
mod epa;
mod feature;
mod field;
mod gjk;
mod manifold;
mod pair;
mod plane_hull;
mod polyhedron;
mod simplex;
mod support;
#[cfg(test)]
mod tests;
mod vector;

pub(crate) use gjk::{MOST_ITERATIONS, Search};
pub(crate) use pair::Scratch;
pub(crate) use polyhedron::{Polyhedron, hull_radius};
pub(crate) use support::{Form, Solid};
pub(crate) use vector::Number;

use super::height::HeightField;
use super::{Plane, Rot, Touch, Touches, V3};
use manifold::Contact;
use pair::{Pair, have_faces};

/// Finds the contacts of two shapes, in the order of MuJoCo's shape types, and appends them. The tangents are left out. Returns a lower
/// bound of the distance beyond the margin if the shapes are apart.
// one copy per precision, for all lane types
#[inline(never)]
pub(crate) fn convex<S: Number>(
    a: &Solid<S>,
    b: &Solid<S>,
    margin: S,
    search: &Search<S>,
    scratch: &mut Scratch<S>,
    out: &mut Touches<S>,
) -> Option<S> {
    let pair = Pair { solids: [a, b], margin, several: search.several && have_faces(a, b), search };
    pair.contacts(scratch, |contact| push(out, &contact, margin))
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
