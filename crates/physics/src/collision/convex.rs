//! Narrow phase of convex shapes that need iteration, and of hulls: one lane at a time.

use super::candidate::{Candidate, add_all, gather};
use super::slots::Slots;
use crate::algebra::spatial::V3;
use crate::geometry::convex::{Form, Number, Polyhedron, Solid, convex, field_convex, plane_hull};
use crate::geometry::{Plane, first_tangent, pick, pick_axes};
use crate::lanes::kernel_fn;
use crate::model::GeomType;
use crate::sim::{PairSpec, ShapePair, Sim};
use crate::state::{Group, RelativePose, Work, clearance};

kernel_fn! {
    /// Finds and writes the contacts of a pair of convex shapes, or of one with a plane or height field. Returns a lower bound of the
    /// distance beyond the margin of two convex shapes in the lanes where they are apart, elsewhere less than any distance.
    pub(super) fn touch_convex<'a, T>(
        sim: &'a Sim<T>,
        group: &'a Group<T>,
        work: &'a mut Work<T>,
        slots: &'a mut Slots<T>,
        candidate: &'a Candidate<T>,
    ) -> T {
        let pair = &sim.contacts.pair(&sim.geoms, candidate.place.index);
        let [m, n] = [&sim.geoms[pair.geoms[0]], &sim.geoms[pair.geoms[1]]];
        let axes = [work.motion.axes(m), work.motion.axes(n)];
        let mut distances = T::lit(f64::NEG_INFINITY);
        let mut near = candidate.near;
        let search = sim.contacts.search[candidate.place.index].filter(|_| sim.contacts.kept);
        let seen = search.map(|i| (i as usize, RelativePose::new(&candidate.centers, &axes)));
        if let Some((i, pose)) = &seen {
            let left = work.contacts.places.left(*i, pose, T::splat(pair.radius));
            let apart = T::zero().lt(clearance(left, T::splat(pair.reach)));
            distances = T::select(apart, left, distances);
            near = T::and(near, T::not(apart));
            if !T::any(near) {
                return distances;
            }
        }
        let mut found = std::mem::take(&mut work.contacts.touches);
        let contacts = &mut work.contacts;
        let (scratch, own) = (&mut contacts.convex, &mut contacts.lane_touches);
        found.clear();
        let bits = T::bits(near);
        for lane in 0..T::LANES {
            if bits >> lane & 1 == 0 {
                continue;
            }
            let [a, b] = [pick(&candidate.centers[0], lane), pick(&candidate.centers[1], lane)];
            let [turned_a, turned_b] = [pick_axes(&axes[0], lane), pick_axes(&axes[1], lane)];
            let second = Solid { center: b, axes: turned_b, form: form_of(pair, 1, &sim.hulls) };
            own.clear();
            match pair.shapes {
                ShapePair::PlaneHull => {
                    let plane = Plane { point: a, normal: turned_a[2] };
                    plane_hull(&plane, &second, pair.margin, scratch, own);
                }
                ShapePair::FieldConvex => {
                    let field = group.ground(sim, lane, pair.field);
                    field_convex((field, &a, &turned_a), &second, pair.margin, &sim.search, scratch, own);
                }
                _ => {
                    let first = Solid { center: a, axes: turned_a, form: form_of(pair, 0, &sim.hulls) };
                    if let Some(distance) = convex(&first, &second, pair.margin, &sim.search, scratch, own) {
                        distances.set(lane, distance);
                    }
                }
            }
            gather(own, lane, &mut found);
        }
        if let Some((i, pose)) = &seen {
            contacts.places.see(*i, near, pose, distances);
        }
        for touch in &mut found {
            touch.tangent = first_tangent(&touch.normal);
        }
        add_all(sim, group, work, slots, candidate.place, &found);
        work.contacts.touches = found;
        distances
    }
}

/// The shape of one of a pair's geoms.
fn form_of<'a, S: Number>(pair: &PairSpec<S>, which: usize, hulls: &'a [Polyhedron<S>]) -> Form<'a, S> {
    form(pair.kinds[which], &pair.sizes[which], hulls.get(pair.hulls[which]))
}

/// The shape of a geom of a kind and size, for meshes with its hull.
pub(super) fn form<'a, S: Number>(kind: GeomType, size: &V3<S>, hull: Option<&'a Polyhedron<S>>) -> Form<'a, S> {
    let [x, y, z] = *size;
    match kind {
        GeomType::Capsule => Form::Capsule { radius: x, half: y },
        GeomType::Ellipsoid => Form::Ellipsoid { half: [x, y, z] },
        GeomType::Cylinder => Form::Cylinder { radius: x, half: y },
        GeomType::Box => Form::Cuboid { half: [x, y, z] },
        GeomType::Mesh if let Some(hull) = hull => Form::Hull(hull),
        // planes and height fields have no form of their own
        _ => Form::Sphere { radius: x },
    }
}
