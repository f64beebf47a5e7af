//! Lengths, velocities and moment arms of strings: spatial tendons.

use crate::algebra::spatial::*;
use crate::geometry::wrap::{unit3, wrap};
use crate::lanes::{Real, kernel_fn};
use crate::sim::{Around, Lever, Sim, Span, Spot};
use crate::state::{DofWork, Group, Motion, Work};

kernel_fn! {
    /// Measures all strings at the positions and velocities of the bodies.
    pub(crate) fn measure_strings<'a, T>(sim: &'a Sim<T>, group: &'a Group<T>, work: &'a mut Work<T>) {
        let Work { motion, dofs, strings, .. } = work;
        strings.moments.fill(T::zero());
        for string in &sim.strings {
            let tendon = &sim.tendons[string.tendon];
            let moments = &mut strings.moments[tendon.moments.clone()];
            let mut length = T::zero();
            for span in &string.spans {
                length = span_length(motion, dofs, span, moments).mul_add(T::splat(span.share), length);
            }
            let mut velocity = T::zero();
            for (dof, arm) in tendon.dofs.iter().zip(moments.iter()) {
                velocity = arm.mul_add(group.qvel[*dof], velocity);
            }
            (strings.length[string.tendon], strings.velocity[string.tendon]) = (length, velocity);
            if tendon.is_heavy() {
                let gravity = group.gravity(sim);
                let mut drift = T::zero();
                for span in string.spans.iter().filter(|span| !span.levers.is_empty()) {
                    drift = span_drift(motion, span, &gravity).mul_add(T::splat(span.share), drift);
                }
                strings.drift[string.tendon] = drift;
            }
        }
    }
}

/// Velocity of a point of a body, and its acceleration without those of the joints.
#[inline(always)]
fn bias_motion<T: Real>(motion: &Motion<T>, spot: &Spot<T::Scalar>, r: &V3<T>, gravity: &V3<T>) -> [V3<T>; 2] {
    let Some(l) = spot.mount.link else { return [[T::zero(); 3]; 2] };
    let (vel, acc) = (&motion.vel[l], &motion.bias_acc[l]);
    let v = cross_add(&ang(vel), r, &lin(vel));
    let a = cross_add(&ang(vel), &v, &cross_add(&ang(acc), r, &lin(acc)));
    // the bias acceleration includes gravity
    [v, add3(&a, gravity)]
}

/// Acceleration of the length of a span from site to site without accelerations of the joints.
#[inline(always)]
fn span_drift<T: Real>(motion: &Motion<T>, span: &Span<T::Scalar>, gravity: &V3<T>) -> T {
    let [first, second] = &span.ends;
    let arms = [arm(motion, first), arm(motion, second)];
    let apart = between(motion, [first, second], &arms);
    let along = unit3(&apart);
    let [v0, a0] = bias_motion(motion, first, &arms[0], gravity);
    let [v1, a1] = bias_motion(motion, second, &arms[1], gravity);
    let (v, a) = (sub3(&v1, &v0), sub3(&a1, &a0));
    // what is across the string turns it
    let rate = dot(&v, &along);
    let across = rate.neg_mul_add(rate, dot(&v, &v));
    let (length, least) = (dot(&apart, &apart).sqrt(), T::lit(1e-15));
    dot(&a, &along) + T::masked(least.lt(length), across.div(length.max(least)))
}

/// A point of a link, relative to its tree's reference point; in the world for a static point.
#[inline(always)]
pub(super) fn arm<T: Real>(motion: &Motion<T>, spot: &Spot<T::Scalar>) -> V3<T> {
    match spot.mount.link {
        Some(link) => motion.arm(&spot.mount, link),
        None => motion.still(&spot.mount),
    }
}

/// Vector from one point to another, with their arms.
#[inline(always)]
pub(super) fn between<T: Real>(motion: &Motion<T>, spots: [&Spot<T::Scalar>; 2], arms: &[V3<T>; 2]) -> V3<T> {
    let mut places = *arms;
    // within a tree, adding the common reference would only lose digits
    if spots[0].tree != spots[1].tree {
        for i in 0..2 {
            if let Some(tree) = spots[i].tree {
                places[i] = add3(&places[i], &motion.reference[tree]);
            }
        }
    }
    sub3(&places[1], &places[0])
}

/// Length of a span without its share. Adds its share of the moment arms.
#[inline(always)]
fn span_length<T: Real>(motion: &Motion<T>, dofs: &[DofWork<T>], span: &Span<T::Scalar>, moments: &mut [T]) -> T {
    let share = T::splat(span.share);
    let arms = [arm(motion, &span.ends[0]), arm(motion, &span.ends[1])];
    let straight = between(motion, [&span.ends[0], &span.ends[1]], &arms);
    let length = dot(&straight, &straight).sqrt();
    let Some(around) = &span.around else {
        pull(dofs, &span.levers, &arms, &straight, share, moments);
        return length;
    };
    let found = wrapped(motion, around, &span.ends, &arms);
    if T::any(T::not(found.on)) {
        pull(dofs, &span.levers, &arms, &straight, T::masked(T::not(found.on), share), moments);
    }
    if !T::any(found.on) {
        return length;
    }
    let here = T::masked(found.on, share);
    let before = [arms[0], found.arms[0]];
    pull(dofs, &around.levers[0], &before, &found.pieces[0], here, moments);
    let after = [found.arms[1], arms[1]];
    pull(dofs, &around.levers[1], &after, &found.pieces[1], here, moments);
    T::select(found.on, found.length, length)
}

/// A straight piece of a span, which some lanes may lack.
pub(crate) struct Straight<T: Real> {
    pub on: T::Mask,
    /// Its ends, relative to the references of their trees, or in the world for points that stand still.
    pub arms: [V3<T>; 2],
    /// Unit vector from the first end to the second.
    pub along: V3<T>,
}

/// The straight pieces of a span: from site to site, and those before and after the geom.
pub(crate) fn straights<T: Real>(motion: &Motion<T>, span: &Span<T::Scalar>) -> [Option<Straight<T>>; 3] {
    let arms = [arm(motion, &span.ends[0]), arm(motion, &span.ends[1])];
    let along = unit3(&between(motion, [&span.ends[0], &span.ends[1]], &arms));
    let Some(around) = &span.around else {
        return [Some(Straight { on: T::not(T::none()), arms, along }), None, None];
    };
    let found = wrapped(motion, around, &span.ends, &arms);
    let piece = |on: T::Mask, arms: [V3<T>; 2], along: V3<T>| T::any(on).then_some(Straight { on, arms, along });
    [
        piece(T::not(found.on), arms, along),
        piece(found.on, [arms[0], found.arms[0]], unit3(&found.pieces[0])),
        piece(found.on, [found.arms[1], arms[1]], unit3(&found.pieces[1])),
    ]
}

/// A span that wraps around its geom, in some lanes.
struct Wrapped<T: Real> {
    on: T::Mask,
    length: T,
    /// The straight pieces before and after the geom.
    pieces: [V3<T>; 2],
    /// The points where they touch it, relative to the reference of the geom's tree.
    arms: [V3<T>; 2],
}

#[inline(always)]
fn wrapped<T: Real>(
    motion: &Motion<T>,
    around: &Around<T::Scalar>,
    ends: &[Spot<T::Scalar>; 2],
    arms: &[V3<T>; 2],
) -> Wrapped<T> {
    let center = arm(motion, &around.center);
    let first = between(motion, [&around.center, &ends[0]], &[center, arms[0]]);
    let last = between(motion, [&around.center, &ends[1]], &[center, arms[1]]);
    let axes = motion.axes(&around.center.mount);
    let radius = T::splat(around.radius);
    let found = match &around.side {
        None => wrap(&[first, last], &axes, radius, around.cylinder, None),
        Some(side) => {
            let at = between(motion, [&around.center, side], &[center, arm(motion, side)]);
            wrap(&[first, last], &axes, radius, around.cylinder, Some(&at))
        }
    };
    // lanes without a wrap hold anything, even what is not finite
    let on = found.on;
    let clean = |v: V3<T>| [T::masked(on, v[0]), T::masked(on, v[1]), T::masked(on, v[2])];
    let points = [clean(found.points[0]), clean(found.points[1])];
    let pieces = [sub3(&points[0], &first), sub3(&last, &points[1])];
    let straight = dot(&pieces[0], &pieces[0]).sqrt() + dot(&pieces[1], &pieces[1]).sqrt();
    Wrapped {
        on,
        length: straight + T::masked(on, found.length),
        pieces,
        arms: [add3(&center, &points[0]), add3(&center, &points[1])],
    }
}

/// Adds the moment arms of a straight piece, times `share`: what each degree of freedom adds to its length.
#[inline(always)]
fn pull<T: Real>(
    dofs: &[DofWork<T>],
    levers: &[Lever],
    arms: &[V3<T>; 2],
    straight: &V3<T>,
    share: T,
    moments: &mut [T],
) {
    if levers.is_empty() {
        return;
    }
    let along = unit3(straight);
    let force = [along[0] * share, along[1] * share, along[2] * share];
    let back = neg3(&force);
    let (t0, t1) = (cross(&arms[0], &back), cross(&arms[1], &force));
    let wrenches =
        [[t0[0], t0[1], t0[2], back[0], back[1], back[2]], [t1[0], t1[1], t1[2], force[0], force[1], force[2]]];
    for lever in levers {
        moments[lever.place] += dot6(&dofs[lever.dof].axis, &wrenches[lever.end]);
    }
}
