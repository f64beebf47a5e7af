//! Strings: the paths of spatial tendons, through sites and around geoms.

use super::link::Mount;
use crate::lanes::Real;
use crate::model::{GeomType, Model, PathSpan, TendonKind};

/// The path of a spatial tendon.
#[derive(Clone, Debug)]
pub(crate) struct StringSpec<C> {
    /// Index of the tendon.
    pub tendon: usize,
    pub spans: Vec<Span<C>>,
}

/// A piece of the path from one site to the next.
#[derive(Clone, Debug)]
pub(crate) struct Span<C> {
    pub ends: [Spot<C>; 2],
    /// Weight of its length: the inverse of the pulley's divisor.
    pub share: C,
    /// The degrees of freedom that move the ends against each other.
    pub levers: Vec<Lever>,
    pub around: Option<Around<C>>,
}

/// A geom that a string wraps around.
#[derive(Clone, Debug)]
pub(crate) struct Around<C> {
    pub center: Spot<C>,
    pub radius: C,
    pub cylinder: bool,
    pub side: Option<Spot<C>>,
    /// The same for the first end and the geom, and for the geom and the second end.
    pub levers: [Vec<Lever>; 2],
}

/// A point of a body.
#[derive(Clone, Debug)]
pub(crate) struct Spot<C> {
    pub mount: Mount<C>,
    /// The tree of its link; `None` for a point that stands still.
    pub tree: Option<usize>,
}

impl<C: Clone> Spot<C> {
    /// A point at the origin of a mount.
    pub(super) fn new(mount: &Mount<C>, trees: &[usize]) -> Self {
        Spot { mount: mount.clone(), tree: mount.link.map(|l| trees[l]) }
    }
}

/// A degree of freedom that moves one end of a straight piece and not the other.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lever {
    /// Its place among the degrees of freedom of its tendon or drive.
    pub place: usize,
    pub dof: usize,
    /// The end: 0 or 1.
    pub end: usize,
}

/// The mounts of all sites and geoms, and the tree of every link.
pub(super) struct Mounts<'a, C> {
    pub sites: &'a [Mount<C>],
    pub geoms: &'a [Mount<C>],
    pub trees: &'a [usize],
}

/// The bodies at the ends of the straight pieces that a span may have: from site to site, or around a geom.
fn pieces(model: &Model, span: &PathSpan) -> Vec<[usize; 2]> {
    let [first, second] = span.sites.map(|s| model.sites[s].body);
    let mut pieces = vec![[first, second]];
    if let Some((geom, _)) = span.wrap {
        let body = model.geoms[geom].body;
        pieces.extend([[first, body], [body, second]]);
    }
    pieces
}

/// The degrees of freedom that change the length of a spatial tendon, in order; none for a fixed one.
pub(super) fn dofs(model: &Model, kind: &TendonKind) -> Vec<usize> {
    let pieces = kind.spans().into_iter().flat_map(|span| pieces(model, &span));
    let mut dofs: Vec<usize> = pieces.flat_map(|bodies| model.dofs_between(bodies)).flatten().collect();
    dofs.sort_unstable();
    dofs.dedup();
    dofs
}

/// The degrees of freedom that move one of two bodies and not the other, with their places in `dofs`.
pub(super) fn levers(model: &Model, dofs: &[usize], bodies: [usize; 2]) -> Vec<Lever> {
    let between = model.dofs_between(bodies);
    let ends = between.iter().enumerate().flat_map(|(end, list)| list.iter().map(move |dof| (*dof, end)));
    ends.filter_map(|(dof, end)| dofs.binary_search(&dof).ok().map(|place| Lever { place, dof, end })).collect()
}

/// Prepares the paths of the spatial tendons.
pub(super) fn strings<T: Real>(model: &Model, mounts: &Mounts<T::Scalar>) -> Vec<StringSpec<T::Scalar>> {
    let c = T::scalar;
    let spot = |mount: &Mount<T::Scalar>| Spot::new(mount, mounts.trees);
    let mut out = Vec::new();
    for (tendon, t) in model.tendons.iter().enumerate() {
        if !matches!(t.kind, TendonKind::Spatial(_)) {
            continue;
        }
        let dofs = dofs(model, &t.kind);
        let levers = |bodies: [usize; 2]| levers(model, &dofs, bodies);
        let span = |s: PathSpan| {
            let [first, second] = s.sites.map(|i| model.sites[i].body);
            let around = s.wrap.map(|(geom, side)| {
                let (g, body) = (&model.geoms[geom], model.geoms[geom].body);
                Around {
                    center: spot(&mounts.geoms[geom]),
                    radius: c(g.size[0]),
                    cylinder: g.kind == GeomType::Cylinder,
                    side: side.map(|i| spot(&mounts.sites[i])),
                    levers: [levers([first, body]), levers([body, second])],
                }
            });
            Span {
                ends: s.sites.map(|i| spot(&mounts.sites[i])),
                share: c(1.0 / s.divisor),
                levers: levers([first, second]),
                around,
            }
        };
        out.push(StringSpec { tendon, spans: t.kind.spans().into_iter().map(span).collect() });
    }
    out
}
