//! The broad phase of models with many pairs: boxes around geoms and trees, sorted along an axis.
//!
//! A crowd of bodies can have millions of pairs but only hundreds of contacts. Every tree and every static geom is a
//! group. Boxes around groups are sorted along the axis of their largest spread. Only groups with overlapping boxes are
//! examined further, and within them only geoms with overlapping boxes.
//!
//! Boxes cover all lanes together, so the result includes pairs that do not touch. Pairs are processed in the order of
//! their list. Contacts are therefore the same as if every pair were tested, and do not depend on the other lanes.

use crate::algebra::spatial::*;
use crate::lanes::{Real, kernel_fn};
use crate::model::GeomType;
use crate::sim::{Broad, GeomPair, Sim};
use crate::state::{Sweep, Work, nowhere};

kernel_fn! {
    /// Finds the pairs that may touch and writes them to [`Sweep::found`]. Requires the positions of the geoms.
    pub(super) fn find<'a, T>(sim: &'a Sim<T>, work: &'a mut Work<T>, broad: &'a Broad<T::Scalar>) {
        for paired in &sim.contacts.paired {
            work.contacts.sweep.geoms[paired.geom] = surround(sim, work, broad, paired.geom);
        }
        sweep(broad, &sim.contacts.pairs, &mut work.contacts.sweep);
    }
}

/// The box around a geom in all lanes.
#[inline(always)]
fn surround<T: Real>(sim: &Sim<T>, work: &Work<T>, broad: &Broad<T::Scalar>, geom: usize) -> [V3<T::Scalar>; 2] {
    let (model, mount) = (&sim.model.geoms[geom], &sim.geoms[geom]);
    let size = [T::lit(model.size[0]), T::lit(model.size[1]), T::lit(model.size[2])];
    let axis = &work.contacts.places.directions[geom];
    let mut half = [T::zero(); 3];
    match model.kind {
        // an agent's obstacles can be anywhere
        _ if sim.model.obstacles == Some(geom) => half = [T::lit(f64::INFINITY); 3],
        GeomType::Sphere => half = [size[0]; 3],
        GeomType::Capsule | GeomType::Cylinder => {
            for i in 0..3 {
                half[i] = axis[i].abs().mul_add(size[1], size[0]);
            }
        }
        GeomType::Box => {
            let axes = work.motion.axes(mount);
            for (column, s) in axes.iter().zip(&size) {
                for i in 0..3 {
                    half[i] = column[i].abs().mul_add(*s, half[i]);
                }
            }
        }
        GeomType::Ellipsoid => half = [size[0].max(size[1]).max(size[2]); 3],
        GeomType::Mesh => half = [model.hull.map_or(T::lit(f64::INFINITY), |h| T::splat(sim.hulls[h].radius)); 3],
        GeomType::Plane | GeomType::Hfield => half = [T::lit(f64::INFINITY); 3],
    }
    let mut center = work.contacts.places.centers[geom];
    if let Some(l) = mount.link {
        center = add3(&center, &work.motion.reference[sim.links[l].tree]);
    }
    let mut out = nowhere();
    for i in 0..3 {
        // more than the rounding of positions and sizes
        let slack = center[i].abs().mul_add(T::lit(32.0 * T::EPSILON), half[i] * T::lit(1e-3));
        let reach = half[i] + slack + T::splat(broad.margin);
        let (low, high) = (center[i] - reach, center[i] + reach);
        for lane in 0..T::LANES {
            out[0][i] = low.get(lane).min(out[0][i]);
            out[1][i] = high.get(lane).max(out[1][i]);
        }
    }
    out
}

/// The box around two boxes.
#[inline(always)]
fn join<S: Real>(a: &[V3<S>; 2], b: &[V3<S>; 2]) -> [V3<S>; 2] {
    let mut out = *a;
    for i in 0..3 {
        out[0][i] = b[0][i].min(a[0][i]);
        out[1][i] = b[1][i].max(a[1][i]);
    }
    out
}

#[inline(always)]
fn overlap<S: Real>(a: &[V3<S>; 2], b: &[V3<S>; 2]) -> bool {
    (0..3).all(|i| !less(a[1][i], b[0][i]) && !less(b[1][i], a[0][i]))
}

#[inline(always)]
fn less<S: Real>(a: S, b: S) -> bool {
    S::any(a.lt(b))
}

kernel_fn! {
    /// Finds the pairs whose boxes overlap.
    fn sweep<'a, S>(broad: &'a Broad<S>, pairs: &'a [GeomPair], sweep: &'a mut Sweep<S>) {
        let Sweep { geoms, groups, order, reaching, found } = sweep;
        groups.clear();
        for members in &broad.members {
            groups.push(members.iter().fold(nowhere(), |all, g| join(&all, &geoms[*g])));
        }
        let axis = longest(groups);
        order.clear();
        order.extend(0..groups.len());
        order.sort_unstable_by(|a, b| {
            let [x, y] = [a, b].map(|g| S::widen(groups[*g][0][axis].get(0)));
            x.total_cmp(&y).then(a.cmp(b))
        });
        found.clear();
        for (at, a) in order.iter().enumerate() {
            for i in broad.between(*a, *a) {
                let [g, h] = pairs[*i as usize].geoms.map(|g| g as usize);
                if overlap(&geoms[g], &geoms[h]) {
                    found.push(*i);
                }
            }
            for b in &order[at + 1..] {
                if less(groups[*a][1][axis], groups[*b][0][axis]) {
                    break;
                }
                if !overlap(&groups[*a], &groups[*b]) {
                    continue;
                }
                for (own, other) in [(a, b), (b, a)] {
                    for g in &broad.members[*own] {
                        reaching[*g] = overlap(&geoms[*g], &groups[*other]);
                    }
                }
                for i in broad.between(*a, *b) {
                    let [g, h] = pairs[*i as usize].geoms.map(|g| g as usize);
                    if reaching[g] && reaching[h] && overlap(&geoms[g], &geoms[h]) {
                        found.push(*i);
                    }
                }
            }
        }
        found.sort_unstable();
    }
}

/// The axis of the largest spread of the boxes.
#[inline(always)]
fn longest<S: Real>(groups: &[[V3<S>; 2]]) -> usize {
    let mut best = (0, S::zero());
    for axis in 0..3 {
        let (mut least, mut most) = (S::lit(f64::INFINITY), S::lit(f64::NEG_INFINITY));
        for g in groups.iter().filter(|g| S::any(g[0][axis].is_finite())) {
            least = g[0][axis].min(least);
            most = g[0][axis].max(most);
        }
        if less(best.1, most - least) {
            best = (axis, most - least);
        }
    }
    best.0
}
