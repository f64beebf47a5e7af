//! Contacts of pairs of geoms.
//!
//! Bounding balls cull every pair in all lanes at once. The remaining pairs go through [`crate::geometry`]. For
//! thousands of pairs, the broad phase ([`broad`]) first selects those that may be near.

use super::broad;
use super::candidate::{Candidate, add_all, gather};
use super::convex::touch_convex;
use super::obstacles::touch_obstacles;
use super::slots::{Place, Slots};
use crate::algebra::spatial::*;
use crate::geometry::height::{Terrain, field_box};
use crate::geometry::{self, Capsule, Cuboid, Cylinder, Plane, Sphere, Touch, pick, pick_axes};
use crate::geometry::{box_box, capsule_box, field_capsule, plane, round};
use crate::lanes::{MAX_LANES, Real};
use crate::sim::{Cull, GeomPairOf, Mount, ShapePair, Sim};
use crate::state::{Group, Work, clearance};

/// Finds the contacts of all pairs and writes their blocks.
#[inline(always)]
pub(crate) fn collide_pairs<T: Real>(sim: &Sim<T>, group: &Group<T>, work: &mut Work<T>) {
    work.contacts.touching_bodies.fill(T::none());
    place_geoms(sim, work);
    let mut slots = Slots::new();
    let count = match &sim.contacts.broad {
        None => sim.contacts.pairs.len(),
        Some(broad) => {
            broad::find(sim, work, broad);
            work.contacts.sweep.found.len()
        }
    };
    work.stats.pairs += count as u64;
    let few = sim.contacts.broad.is_none();
    for k in 0..count {
        let index = if few { k } else { work.contacts.sweep.found[k] as usize };
        let apart = if sim.contacts.kept { work.contacts.places.apart(sim, index) } else { T::none() };
        if T::all(apart) {
            continue;
        }
        let pair = &sim.contacts.pair(&sim.geoms, index);
        // nothing is remembered of other pairs
        let kept = sim.contacts.kept && pair.cull == Cull::Balls;
        slots.turn_to(pair.class(), work.rows.blocks.len());
        // everything relative to the reference point of one of the moving geoms' trees
        let base = pair.links[1].or(pair.links[0]).map_or(0, |l| sim.links[l].tree);
        let centers = [center(sim, work, pair.geoms[0], base), center(sim, work, pair.geoms[1], base)];
        let near = T::and(near(sim, group, work, pair, &centers), T::not(apart));
        let distance = if T::any(near) {
            let candidate = Candidate { place: Place { index, base }, centers, near };
            touch_pair(sim, group, work, &mut slots, &candidate)
        } else if kept {
            Some(between_balls(pair, &centers))
        } else {
            None
        };
        if let (Some(distance), true) = (distance, kept) {
            work.contacts.places.remember(sim, index, distance, T::splat(pair.reach));
        }
    }
}

/// Distance of the balls around two geoms, beyond the margin.
#[inline(always)]
fn between_balls<T: Real>(pair: &GeomPairOf<T::Scalar>, centers: &[V3<T>; 2]) -> T {
    let d = sub3(&centers[1], &centers[0]);
    dot(&d, &d).sqrt() - T::splat(pair.reach)
}

/// Centers and axes of the geoms in pairs, and how far they have moved.
#[inline(always)]
fn place_geoms<T: Real>(sim: &Sim<T>, work: &mut Work<T>) {
    let kept = sim.contacts.kept;
    let places = &mut work.contacts.places;
    if kept {
        for (tree, reference) in work.motion.reference.iter().enumerate() {
            places.refer(tree, reference);
        }
        for (i, carrier) in sim.contacts.turning.iter().enumerate() {
            places.turn(i, &work.motion.rot[*carrier]);
        }
    }
    for paired in &sim.contacts.paired {
        let (g, mount) = (paired.geom, &sim.geoms[paired.geom]);
        let (center, axis) = match mount.link {
            None => (work.motion.still(mount), work.motion.axes(mount)[2]),
            Some(l) => (work.motion.arm(mount, l), rotate(&work.motion.rot[l], &splat3(&mount.rot[2]))),
        };
        if kept {
            places.follow(g, &center, &axis, T::splat(paired.half));
            if let Some((i, radius)) = paired.turning {
                places.follow_turn(g, i, T::splat(radius));
            }
        } else {
            places.put(g, &center, &axis);
        }
    }
    if kept {
        places.settle(sim);
    }
}

/// Lanes in which a pair may touch.
#[inline(always)]
fn near<T: Real>(
    sim: &Sim<T>,
    group: &Group<T>,
    work: &Work<T>,
    pair: &GeomPairOf<T::Scalar>,
    centers: &[V3<T>; 2],
) -> T::Mask {
    let reach = T::splat(pair.reach);
    let mut point = centers[0];
    let normal = work.contacts.places.directions[pair.geoms[0]];
    match pair.cull {
        Cull::Balls => geometry::near(&point, &centers[1], reach),
        Cull::Plane => plane::near_plane(&Plane { point, normal }, &centers[1], reach),
        Cull::Obstacles => match (&group.obstacles, pair.links[1]) {
            (Some(obstacles), Some(link)) => {
                obstacles.any_near(&work.motion.reference[sim.links[link].tree], &centers[1], reach)
            }
            _ => T::none(),
        },
        Cull::Field => {
            let top = group.ground_top(sim, pair.field);
            for i in 0..3 {
                point[i] = normal[i].mul_add(top, point[i]);
            }
            plane::near_plane(&Plane { point, normal }, &centers[1], reach)
        }
    }
}

/// Center of a geom relative to the reference point of tree `base`.
#[inline(always)]
fn center<T: Real>(sim: &Sim<T>, work: &Work<T>, geom: usize, base: usize) -> V3<T> {
    let own = &work.contacts.places.centers[geom];
    match sim.geoms[geom].link.map(|l| sim.links[l].tree) {
        None => sub3(own, &work.motion.reference[base]),
        Some(t) if t == base => *own,
        Some(t) => add3(own, &sub3(&work.motion.reference[t], &work.motion.reference[base])),
    }
}

/// Narrow phase of one pair. Returns a lower bound of its distance beyond the margin, if known.
#[inline(always)]
fn touch_pair<T: Real>(
    sim: &Sim<T>,
    group: &Group<T>,
    work: &mut Work<T>,
    slots: &mut Slots<T>,
    candidate: &Candidate<T>,
) -> Option<T> {
    let pair = &sim.contacts.pair(&sim.geoms, candidate.place.index);
    let [a, b] = pair.geoms;
    let (mb, [ca, cb]) = (&sim.geoms[b], candidate.centers);
    let margin = T::splat(pair.margin);
    let [size_a, size_b]: [V3<T>; 2] = [splat3(&pair.sizes[0]), splat3(&pair.sizes[1])];
    let mut known = None;
    if pair.round() {
        // few near pairs touch: the distance is cheaper than the contact point
        let distance = round::gap(&capsule(work, a, ca, size_a), &capsule(work, b, cb, size_b)) - margin;
        if !T::any(clearance(distance, T::splat(pair.reach)).lt(T::zero())) {
            return Some(distance);
        }
        known = Some(distance);
    }
    let [first_axis, axis] = [work.contacts.places.directions[a], work.contacts.places.directions[b]];
    let first_sphere = Sphere { center: ca, axis: first_axis, radius: size_a[0] };
    let sphere = Sphere { center: cb, axis, radius: size_b[0] };
    let ground = Plane { point: ca, normal: first_axis };
    let found: &[Touch<T>] = match pair.shapes {
        ShapePair::PlaneSphere => &[plane::plane_sphere(&ground, &sphere, margin)],
        ShapePair::PlaneCapsule => &plane::plane_capsule(&ground, &capsule(work, b, cb, size_b), margin),
        // the second solver for friction needs MuJoCo's order of contacts
        ShapePair::PlaneBox if sim.no_slip.is_some() => {
            &plane::plane_box_in_order(&ground, &cuboid(work, mb, cb, size_b), margin)
        }
        ShapePair::PlaneBox => &plane::plane_box(&ground, &cuboid(work, mb, cb, size_b), margin),
        ShapePair::PlaneCylinder => &plane::plane_cylinder(&ground, &cylinder(work, mb, cb, size_b), margin),
        ShapePair::PlaneEllipsoid => &[plane::plane_ellipsoid(&ground, &cuboid(work, mb, cb, size_b), margin)],
        ShapePair::SphereSphere => &[round::sphere_sphere(&first_sphere, &sphere, margin)],
        ShapePair::SphereCapsule => &[round::sphere_capsule(&first_sphere, &capsule(work, b, cb, size_b), margin)],
        ShapePair::SphereBox => &[round::sphere_box(&first_sphere, &cuboid(work, mb, cb, size_b), margin)],
        ShapePair::SphereCylinder => &[round::sphere_cylinder(&first_sphere, &cylinder(work, mb, cb, size_b), margin)],
        ShapePair::CapsuleCapsule => {
            &round::capsule_capsule(&capsule(work, a, ca, size_a), &capsule(work, b, cb, size_b), margin)
        }
        ShapePair::FieldCapsule => {
            touch_field(sim, group, work, slots, candidate);
            return None;
        }
        ShapePair::PlaneHull | ShapePair::Convex | ShapePair::FieldConvex => {
            let known = work.contacts.places.known(sim, candidate.place.index);
            let distance = touch_convex(sim, group, work, slots, candidate);
            return Some(distance.max(between_balls(pair, &candidate.centers)).max(known));
        }
        ShapePair::Obstacles => {
            touch_obstacles(sim, group, work, slots, candidate);
            return None;
        }
        ShapePair::CapsuleBox | ShapePair::BoxBox | ShapePair::FieldBox => {
            one_by_one(sim, group, work, slots, candidate);
            return Some(between_balls(pair, &candidate.centers));
        }
    };
    add_all(sim, group, work, slots, candidate.place, found);
    known
}

#[inline(always)]
fn capsule<T: Real>(work: &Work<T>, geom: usize, center: V3<T>, size: V3<T>) -> Capsule<T> {
    Capsule { center, axis: work.contacts.places.directions[geom], radius: size[0], half: size[1] }
}

#[inline(always)]
fn cylinder<T: Real>(work: &Work<T>, m: &Mount<T::Scalar>, center: V3<T>, size: V3<T>) -> Cylinder<T> {
    Cylinder { center, axes: work.motion.axes(m), radius: size[0], half: size[1] }
}

#[inline(always)]
fn cuboid<T: Real>(work: &Work<T>, m: &Mount<T::Scalar>, center: V3<T>, half: V3<T>) -> Cuboid<T> {
    Cuboid { center, axes: work.motion.axes(m), half }
}

/// Narrow phase of a height field and a capsule or sphere.
#[inline(always)]
fn touch_field<T: Real>(
    sim: &Sim<T>,
    group: &Group<T>,
    work: &mut Work<T>,
    slots: &mut Slots<T>,
    candidate: &Candidate<T>,
) {
    let pair = &sim.contacts.pair(&sim.geoms, candidate.place.index);
    let fields = group.all_grounds(sim, pair.field);
    let terrain = Terrain { fields, center: candidate.centers[0], axes: work.motion.axes(&sim.geoms[pair.geoms[0]]) };
    let capsule = capsule(work, pair.geoms[1], candidate.centers[1], splat3(&pair.sizes[1]));
    let mut found = std::mem::take(&mut work.contacts.touches);
    found.clear();
    let margin = T::splat(pair.margin);
    field_capsule::field_capsule(&terrain, &capsule, margin, candidate.near, &mut work.contacts.gaps, &mut found);
    add_all(sim, group, work, slots, candidate.place, &found);
    work.contacts.touches = found;
}

/// Narrow phase of shapes that need branches: one lane at a time, for the near lanes.
#[inline(always)]
fn one_by_one<T: Real>(
    sim: &Sim<T>,
    group: &Group<T>,
    work: &mut Work<T>,
    slots: &mut Slots<T>,
    candidate: &Candidate<T>,
) {
    let pair = &sim.contacts.pair(&sim.geoms, candidate.place.index);
    let axes = pair.geoms.map(|g| work.motion.axes(&sim.geoms[g]));
    let mut found = std::mem::take(&mut work.contacts.touches);
    let mut own = std::mem::take(&mut work.contacts.lane_touches);
    found.clear();
    let bits = T::bits(candidate.near);
    for lane in (0..T::LANES).filter(|l| bits >> l & 1 == 1) {
        let [a, b] = [pick(&candidate.centers[0], lane), pick(&candidate.centers[1], lane)];
        let [turned_a, turned_b] = [pick_axes(&axes[0], lane), pick_axes(&axes[1], lane)];
        let [size_a, size_b] = pair.sizes;
        let cuboid = Cuboid { center: b, axes: turned_b, half: size_b };
        own.clear();
        match pair.shapes {
            ShapePair::CapsuleBox => {
                let capsule = Capsule { center: a, axis: turned_a[2], radius: size_a[0], half: size_a[1] };
                capsule_box::capsule_box(&capsule, &cuboid, pair.margin, &mut own);
            }
            ShapePair::BoxBox => {
                let first = Cuboid { center: a, axes: turned_a, half: size_a };
                box_box::box_box(&first, &cuboid, pair.margin, &mut own);
            }
            _ => {
                let field = group.ground(sim, lane, pair.field);
                let terrain = Terrain { fields: [field; MAX_LANES], center: a, axes: turned_a };
                field_box(&terrain, &cuboid, pair.margin, &mut own);
            }
        }
        gather(&own, lane, &mut found);
    }
    add_all(sim, group, work, slots, candidate.place, &found);
    work.contacts.touches = found;
    work.contacts.lane_touches = own;
}
