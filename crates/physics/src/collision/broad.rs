//! The broad phase of models with many pairs: boxes around geoms and trees, swept along an axis.
//!
//! A crowd of bodies has pairs by the million and contacts by the hundred. Every tree, and every geom that stands still,
//! is a group. Boxes around groups are sorted along the axis along which they are spread most; only groups whose boxes
//! overlap are looked into, and of their geoms those whose own boxes do.
//!
//! The boxes are those of all lanes together. What is found is more than what touches, and it is taken up in the order of
//! the list of pairs: contacts are the same as if every pair were tested, and do not depend on the other lanes.

use super::Contacts;
use super::pairs::Pair;
use crate::lanes::{Real, kernel_fn};
use crate::model::GeomType;
use crate::sim::Sim;
use crate::spatial::*;
use crate::work::Work;

/// Pairs across trees from which on the broad phase is worth its while.
const FEWEST: usize = 500;

/// Which pairs belong to which groups.
#[derive(Clone, Debug)]
pub(crate) struct Broad<C> {
    /// Geoms of each group.
    members: Vec<Vec<usize>>,
    /// By group: the groups with numbers not below that its geoms have pairs with, ascending, and where those begin and
    /// end in `pairs`.
    partners: Vec<Vec<(usize, usize, usize)>>,
    /// Numbers of the pairs, by groups.
    pairs: Vec<u32>,
    /// Added on every side of a box: half of the largest margin.
    margin: C,
}

/// Boxes of a group of agents, and the pairs found; the memory is kept from step to step.
#[derive(Clone, Debug)]
pub(crate) struct Sweep<S> {
    /// By geom and by group: least and largest coordinates.
    geoms: Vec<[V3<S>; 2]>,
    groups: Vec<[V3<S>; 2]>,
    /// Groups along the axis.
    order: Vec<usize>,
    /// Geoms of two groups that reach into the box of the other.
    reaching: Vec<bool>,
    /// Numbers of the pairs whose boxes overlap, ascending.
    pub found: Vec<u32>,
}

impl<S: Real> Sweep<S> {
    pub fn new(geoms: usize) -> Self {
        Sweep {
            geoms: vec![nowhere(); geoms],
            groups: Vec::new(),
            order: Vec::new(),
            reaching: vec![false; geoms],
            found: Vec::new(),
        }
    }
}

/// A box that holds nothing.
#[inline(always)]
fn nowhere<S: Real>() -> [V3<S>; 2] {
    [[S::lit(f64::INFINITY); 3], [S::lit(f64::NEG_INFINITY); 3]]
}

impl<C: Real> Broad<C> {
    /// Sorts the pairs of a model into groups; none if they are few. `tree_of` gives the tree of a geom that moves.
    pub fn of(contacts: &Contacts<C>, trees: usize, tree_of: impl Fn(usize) -> Option<usize>) -> Option<Self> {
        let mut group_of = vec![usize::MAX; contacts.paired.last().map_or(0, |p| p.geom + 1)];
        let mut members = vec![Vec::new(); trees];
        for paired in &contacts.paired {
            let group = tree_of(paired.geom).unwrap_or_else(|| {
                members.push(Vec::new());
                members.len() - 1
            });
            group_of[paired.geom] = group;
            members[group].push(paired.geom);
        }
        let mut keys: Vec<([usize; 2], u32)> = Vec::with_capacity(contacts.pairs.len());
        for (index, pair) in contacts.pairs.iter().enumerate() {
            let [a, b] = pair.geoms.map(|g| group_of[g as usize]);
            keys.push(([a.min(b), a.max(b)], index as u32));
        }
        if keys.iter().filter(|([a, b], _)| a != b && *b < trees).count() < FEWEST {
            return None;
        }
        keys.sort_unstable();
        let mut partners: Vec<Vec<(usize, usize, usize)>> = vec![Vec::new(); members.len()];
        for (at, ([a, b], _)) in keys.iter().enumerate() {
            match partners[*a].last_mut() {
                Some((group, _, end)) if group == b => *end = at + 1,
                _ => partners[*a].push((*b, at, at + 1)),
            }
        }
        let margin = contacts.specs.iter().map(|s| C::widen(s.margin.get(0))).fold(0.0, f64::max);
        let pairs = keys.into_iter().map(|(_, index)| index).collect();
        Some(Broad { members, partners, pairs, margin: C::lit(0.5 * margin) })
    }
}

kernel_fn! {
    /// Finds the pairs that may touch, into [`Sweep::found`], after the geoms were placed.
    pub(super) fn find<'a, T>(sim: &'a Sim<T>, work: &'a mut Work<T>, broad: &'a Broad<T::Scalar>) {
        for paired in &sim.contacts.paired {
            work.sweep.geoms[paired.geom] = surround(sim, work, broad, paired.geom);
        }
        sweep(broad, &sim.contacts.pairs, &mut work.sweep);
    }
}

/// The box around a geom in all lanes.
#[inline(always)]
fn surround<T: Real>(sim: &Sim<T>, work: &Work<T>, broad: &Broad<T::Scalar>, geom: usize) -> [V3<T::Scalar>; 2] {
    let (model, mount) = (&sim.model.geoms[geom], &sim.geoms[geom]);
    let size = [T::lit(model.size[0]), T::lit(model.size[1]), T::lit(model.size[2])];
    let axis = &work.directions[geom];
    let mut half = [T::zero(); 3];
    match model.kind {
        GeomType::Sphere => half = [size[0]; 3],
        GeomType::Capsule | GeomType::Cylinder => {
            for i in 0..3 {
                half[i] = axis[i].abs().mul_add(size[1], size[0]);
            }
        }
        GeomType::Box => {
            let axes = work.axes(mount);
            for (column, s) in axes.iter().zip(&size) {
                for i in 0..3 {
                    half[i] = column[i].abs().mul_add(*s, half[i]);
                }
            }
        }
        GeomType::Ellipsoid => half = [size[0].max(size[1]).max(size[2]); 3],
        GeomType::Plane | GeomType::Hfield | GeomType::Mesh => half = [T::lit(f64::INFINITY); 3],
    }
    let mut center = work.centers[geom];
    if let Some(l) = mount.link {
        center = add3(&center, &work.reference[sim.links[l].tree]);
    }
    let mut out = nowhere();
    for i in 0..3 {
        // more than the rounding of places and sizes
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
    fn sweep<'a, S>(broad: &'a Broad<S>, pairs: &'a [Pair], sweep: &'a mut Sweep<S>) {
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

/// The axis along which the boxes are spread most.
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

impl<C> Broad<C> {
    /// Numbers of the pairs of geoms of two groups.
    fn between(&self, a: usize, b: usize) -> &[u32] {
        let partners = &self.partners[a.min(b)];
        match partners.binary_search_by_key(&a.max(b), |p| p.0) {
            Ok(at) => &self.pairs[partners[at].1..partners[at].2],
            Err(_) => &[],
        }
    }
}
