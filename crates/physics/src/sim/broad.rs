//! Groups for the broad phase of models with many pairs, and the pairs of each two groups. Every tree and every static
//! geom is a group.

use super::pairs::{GeomPair, PairSpec, Paired};
use crate::lanes::Real;

/// Number of pairs across trees from which the broad phase pays off.
const FEWEST: usize = 500;

/// The pairs of each two groups.
#[derive(Clone, Debug)]
pub(crate) struct Broad<C> {
    /// Geoms of each group.
    pub members: Vec<Vec<usize>>,
    /// By group: the groups with the same or a higher number that its geoms have pairs with, ascending, and the range
    /// of these pairs in `pairs`.
    partners: Vec<Vec<(usize, usize, usize)>>,
    /// Indices of the pairs, by groups.
    pairs: Vec<u32>,
    /// Added on every side of a box: half of the largest margin.
    pub margin: C,
}

impl<C: Real> Broad<C> {
    /// Sorts the pairs of a model into groups. `None` for few pairs. `tree_of` gives the tree of a moving geom.
    pub fn of(
        paired: &[Paired<C>],
        geom_pairs: &[GeomPair],
        specs: &[PairSpec<C>],
        trees: usize,
        tree_of: impl Fn(usize) -> Option<usize>,
    ) -> Option<Self> {
        let mut group_of = vec![usize::MAX; paired.last().map_or(0, |p| p.geom + 1)];
        let mut members = vec![Vec::new(); trees];
        for geom in paired {
            let group = tree_of(geom.geom).unwrap_or_else(|| {
                members.push(Vec::new());
                members.len() - 1
            });
            group_of[geom.geom] = group;
            members[group].push(geom.geom);
        }
        let mut keys: Vec<([usize; 2], u32)> = Vec::with_capacity(geom_pairs.len());
        for (index, pair) in geom_pairs.iter().enumerate() {
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
        let margin = specs.iter().map(|s| C::widen(s.margin.get(0))).fold(0.0, f64::max);
        let pairs = keys.into_iter().map(|(_, index)| index).collect();
        Some(Broad { members, partners, pairs, margin: C::lit(0.5 * margin) })
    }
}

impl<C> Broad<C> {
    /// Indices of the pairs of geoms of two groups.
    pub fn between(&self, a: usize, b: usize) -> &[u32] {
        let partners = &self.partners[a.min(b)];
        match partners.binary_search_by_key(&a.max(b), |p| p.0) {
            Ok(at) => &self.pairs[partners[at].1..partners[at].2],
            Err(_) => &[],
        }
    }
}
