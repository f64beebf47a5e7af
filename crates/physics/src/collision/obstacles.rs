//! Contacts of a geom with the obstacles of an agent: one lane at a time.

use super::candidate::{Candidate, add_all, gather};
use super::convex::form;
use super::slots::{Carrier, Slots};
use crate::algebra::spatial::*;
use crate::geometry::convex::{Form, Number, Scratch, Search, Solid, convex, field_convex};
use crate::geometry::field_capsule::field_capsule;
use crate::geometry::height::{HeightField, Terrain, field_box};
use crate::geometry::{Capsule, Cuboid, Cylinder, Sphere, Touches, first_tangent, pick, pick_axes};
use crate::geometry::{box_box, capsule_box, round};
use crate::lanes::{MAX_LANES, Real, kernel_fn};
use crate::model::GeomType;
use crate::sim::{GeomPairOf, ShapePair, Sim, rank};
use crate::state::{GeomContacts, Group, Work};

kernel_fn! {
    /// Finds and writes the contacts of a geom with its agent's obstacles, one obstacle after the other.
    pub(super) fn touch_obstacles<'a, T>(
        sim: &'a Sim<T>,
        group: &'a Group<T>,
        work: &'a mut Work<T>,
        slots: &'a mut Slots<T>,
        candidate: &'a Candidate<T>,
    ) {
        let Some(obstacles) = &group.obstacles else { return };
        let pair = &sim.contacts.pair(&sim.geoms, candidate.place.index);
        let kind = pair.kinds[1];
        let axes = work.motion.axes(&sim.geoms[pair.geoms[1]]);
        let (center, base) = (candidate.centers[1], work.motion.reference[candidate.place.base]);
        let mut found = std::mem::take(&mut work.contacts.touches);
        for (k, ball) in obstacles.balls.iter().enumerate() {
            let near = T::and(candidate.near, obstacles.near(k, &base, &center, T::splat(pair.reach)));
            let bits = T::bits(near);
            if bits == 0 {
                continue;
            }
            found.clear();
            for lane in (0..T::LANES).filter(|l| bits >> l & 1 == 1) {
                let own = &obstacles.own[lane][k];
                let at = sub3(&own.pos, &pick(&base, lane));
                let first = Solid { center: at, axes: own.axes, form: form(own.kind, &own.size, None) };
                let hull = sim.hulls.get(pair.hulls[1]);
                let second = Solid {
                    center: pick(&center, lane),
                    axes: pick_axes(&axes, lane),
                    form: form(kind, &pair.sizes[1], hull),
                };
                let contacts = &mut work.contacts;
                contacts.lane_touches.clear();
                match &own.field {
                    Some(field) => {
                        touch_field(&field.grid, (&at, &own.axes), &second, kind, pair, &sim.search, contacts);
                    }
                    None => {
                        let (scratch, touches) = (&mut contacts.convex, &mut contacts.lane_touches);
                        touch(&first, own.kind, &second, kind, pair.margin, &sim.search, scratch, touches);
                    }
                }
                gather(&contacts.lane_touches, lane, &mut found);
            }
            slots.carrier = Some(Carrier { center: sub3(&ball.center, &base), velocity: ball.velocity, spin: ball.spin });
            add_all(sim, group, work, slots, candidate.place, &found);
        }
        slots.carrier = None;
        work.contacts.touches = found;
    }
}

/// Appends the contacts of an obstacle with a geom. The normals point to the geom.
#[expect(clippy::too_many_arguments, reason = "two shapes, and what the search for their contacts needs")]
fn touch<S: Number>(
    obstacle: &Solid<S>,
    kind: GeomType,
    geom: &Solid<S>,
    geom_kind: GeomType,
    margin: S,
    search: &Search<S>,
    scratch: &mut Scratch<S>,
    out: &mut Touches<S>,
) {
    // in MuJoCo's order of shapes
    let swapped = rank(geom_kind) < rank(kind);
    let (a, b) = if swapped { (geom, obstacle) } else { (obstacle, geom) };
    let shapes = match swapped {
        true => ShapePair::of(geom_kind, kind),
        false => ShapePair::of(kind, geom_kind),
    };
    match shapes {
        Some(ShapePair::SphereSphere) => out.push(round::sphere_sphere(&sphere(a), &sphere(b), margin)),
        Some(ShapePair::SphereCapsule) => out.push(round::sphere_capsule(&sphere(a), &capsule(b), margin)),
        Some(ShapePair::SphereBox) => out.push(round::sphere_box(&sphere(a), &cuboid(b), margin)),
        Some(ShapePair::SphereCylinder) => out.push(round::sphere_cylinder(&sphere(a), &cylinder(b), margin)),
        Some(ShapePair::CapsuleCapsule) => {
            round::capsule_capsule(&capsule(a), &capsule(b), margin).into_iter().for_each(|touch| out.push(touch));
        }
        Some(ShapePair::CapsuleBox) => capsule_box::capsule_box(&capsule(a), &cuboid(b), margin, out),
        Some(ShapePair::BoxBox) => box_box::box_box(&cuboid(a), &cuboid(b), margin, out),
        _ => {
            convex(a, b, margin, search, scratch, out);
            out.each(|touch| touch.tangent = first_tangent(&touch.normal));
        }
    }
    if swapped {
        out.each(|touch| {
            touch.normal = neg3(&touch.normal);
            touch.tangent = neg3(&touch.tangent);
        });
    }
}

/// Appends the contacts of a height field with a geom to those of the lane.
#[inline(always)]
fn touch_field<T: Real>(
    field: &HeightField<T::Scalar>,
    (center, axes): (&V3<T::Scalar>, &Rot<T::Scalar>),
    geom: &Solid<T::Scalar>,
    kind: GeomType,
    pair: &GeomPairOf<T::Scalar>,
    search: &Search<T::Scalar>,
    contacts: &mut GeomContacts<T>,
) {
    let out = &mut contacts.lane_touches;
    let terrain = Terrain { fields: [field; MAX_LANES], center: *center, axes: *axes };
    match kind {
        GeomType::Sphere | GeomType::Capsule => {
            let (gaps, found) = (&mut contacts.lane_gaps, &mut contacts.lane_found);
            found.clear();
            field_capsule(&terrain, &capsule(geom), pair.margin, T::Scalar::from_bits(1), gaps, found);
            found.iter().for_each(|touch| out.push(*touch));
        }
        GeomType::Box => field_box(&terrain, &cuboid(geom), pair.margin, out),
        _ => {
            field_convex((field, center, axes), geom, pair.margin, search, &mut contacts.convex, out);
            out.each(|touch| touch.tangent = first_tangent(&touch.normal));
        }
    }
}

fn size<S: Number>(solid: &Solid<S>) -> V3<S> {
    let zero = S::zero();
    match solid.form {
        Form::Sphere { radius } => [radius, zero, zero],
        Form::Capsule { radius, half } | Form::Cylinder { radius, half } => [radius, half, zero],
        Form::Ellipsoid { half } | Form::Cuboid { half } => half,
        Form::Hull(_) | Form::Prism(_) => [zero; 3],
    }
}

fn sphere<S: Number>(solid: &Solid<S>) -> Sphere<S> {
    Sphere { center: solid.center, axis: solid.axes[2], radius: size(solid)[0] }
}

fn capsule<S: Number>(solid: &Solid<S>) -> Capsule<S> {
    let [radius, half, _] = size(solid);
    Capsule { center: solid.center, axis: solid.axes[2], radius, half }
}

fn cylinder<S: Number>(solid: &Solid<S>) -> Cylinder<S> {
    let [radius, half, _] = size(solid);
    Cylinder { center: solid.center, axes: solid.axes, radius, half }
}

fn cuboid<S: Number>(solid: &Solid<S>) -> Cuboid<S> {
    Cuboid { center: solid.center, axes: solid.axes, half: size(solid) }
}
