//! Pairs of geoms that may touch: moving bodies with each other, and with terrain.

use super::contact_params::ContactParams;
use super::softness::{Cost, Softness, softness};
use super::weights::{inverse_weights, is_hard};
use super::weld::BodyMount;
use crate::geometry::bounding_radius;
use crate::geometry::convex::hull_radius;
use crate::lanes::Real;
use crate::model::{Cone, Geom, GeomType, Model};

/// Function that finds the contacts of a pair.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ShapePair {
    PlaneSphere,
    PlaneCapsule,
    PlaneBox,
    PlaneCylinder,
    PlaneEllipsoid,
    SphereSphere,
    SphereCapsule,
    SphereBox,
    SphereCylinder,
    CapsuleCapsule,
    CapsuleBox,
    BoxBox,
    FieldCapsule,
    FieldBox,
    /// The pairs below need iteration, or a hull.
    PlaneHull,
    Convex,
    FieldConvex,
    /// An agent's obstacles, and a geom.
    Obstacles,
}

impl ShapePair {
    pub(crate) fn of(a: GeomType, b: GeomType) -> Option<ShapePair> {
        use GeomType as G;
        Some(match (a, b) {
            (G::Plane, G::Sphere) => ShapePair::PlaneSphere,
            (G::Plane, G::Capsule) => ShapePair::PlaneCapsule,
            (G::Plane, G::Box) => ShapePair::PlaneBox,
            (G::Plane, G::Cylinder) => ShapePair::PlaneCylinder,
            (G::Plane, G::Ellipsoid) => ShapePair::PlaneEllipsoid,
            (G::Sphere, G::Sphere) => ShapePair::SphereSphere,
            (G::Sphere, G::Capsule) => ShapePair::SphereCapsule,
            (G::Sphere, G::Box) => ShapePair::SphereBox,
            (G::Sphere, G::Cylinder) => ShapePair::SphereCylinder,
            (G::Capsule, G::Capsule) => ShapePair::CapsuleCapsule,
            (G::Capsule, G::Box) => ShapePair::CapsuleBox,
            (G::Box, G::Box) => ShapePair::BoxBox,
            (G::Hfield, G::Sphere | G::Capsule) => ShapePair::FieldCapsule,
            (G::Hfield, G::Box) => ShapePair::FieldBox,
            (G::Hfield, G::Ellipsoid | G::Cylinder | G::Mesh) => ShapePair::FieldConvex,
            (G::Plane, G::Mesh) => ShapePair::PlaneHull,
            (G::Plane | G::Hfield, G::Plane | G::Hfield) | (_, G::Plane | G::Hfield) => return None,
            _ => ShapePair::Convex,
        })
    }
}

impl ShapePair {
    /// Whether the contacts depend on MuJoCo's flag `nativeccd`.
    pub(super) fn iterates(self) -> bool {
        use ShapePair as P;
        matches!(self, P::Convex | P::FieldCapsule | P::FieldBox | P::FieldConvex)
    }
}

/// Test that decides whether a pair can touch at all.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Cull {
    /// Balls around both.
    Balls,
    /// The first is a plane.
    Plane,
    /// The first is a height field: nothing touches it above its highest point.
    Field,
    /// Balls around the second and each of the agent's obstacles.
    Obstacles,
}

/// Two geoms that may touch. There can be millions of these.
#[derive(Clone, Copy, Debug)]
pub(crate) struct GeomPair {
    /// In MuJoCo's order: the normal points from the first to the second.
    pub geoms: [u32; 2],
    /// Index of its [`PairSpec`].
    pub spec: u32,
    /// Whether they belong to different trees, or one is static.
    pub across: bool,
}

/// Radius of the ball around a geom's center that holds the geom.
pub(super) fn radius(model: &Model, geom: &Geom) -> f64 {
    match geom.hull {
        Some(hull) => hull_radius(&model.hulls[hull]),
        None => bounding_radius(geom.kind, &geom.size),
    }
}

/// A geom that is part of pairs.
#[derive(Clone, Debug)]
pub(crate) struct Paired<C> {
    pub geom: usize,
    /// Half length of a capsule along the third axis. Other geoms have 0, and a ball bounds them.
    pub half: C,
    /// Set if the whole shape counts in a pair and is not round: the number of its carrier among those whose turns matter, and its
    /// radius.
    pub turning: Option<(usize, C)>,
}

/// A pair with its data.
#[derive(Clone, Copy, Debug)]
pub(crate) struct GeomPairOf<'a, C> {
    pub geoms: [usize; 2],
    pub links: [Option<usize>; 2],
    pub(super) spec: &'a PairSpec<C>,
}

/// Common data of pairs of equal geoms.
#[derive(Clone, Debug)]
pub(crate) struct PairSpec<C> {
    /// Whether both geoms move.
    pub coupled: bool,
    /// Number of the declared pair, if it is one.
    pub declared: Option<usize>,
    /// In MJCF's order. Unused sizes are zero: a sphere is a capsule without length.
    pub sizes: [[C; 3]; 2],
    pub shapes: ShapePair,
    pub kinds: [GeomType; 2],
    /// Hulls of the geoms, for meshes.
    pub hulls: [usize; 2],
    /// Height field of the first geom.
    pub field: usize,
    pub cull: Cull,
    /// Distance beyond which they cannot touch: of the centers, or of the second's center from the plane.
    pub reach: C,
    /// Radius of the second geom around its center.
    pub radius: C,
    pub margin: C,
    pub dim: usize,
    pub cost: Cost,
    pub friction: [C; 5],
    /// Regularized slope of an elliptic cone.
    pub slope: C,
    pub soft: Softness<C>,
    /// Stiffness of the rows relative to the first row's.
    pub ratios: [C; 6],
}

impl<C> GeomPairOf<'_, C> {
    /// The moving geom of a pair with the static world.
    pub fn moving(&self) -> usize {
        self.geoms[if self.links[1].is_some() { 1 } else { 0 }]
    }
}

impl<C> std::ops::Deref for GeomPairOf<'_, C> {
    type Target = PairSpec<C>;
    #[inline(always)]
    fn deref(&self) -> &PairSpec<C> {
        self.spec
    }
}

impl<C> PairSpec<C> {
    /// The class of a pair. Contacts of a class share slots.
    pub fn class(&self) -> (bool, usize) {
        (self.coupled, self.dim)
    }

    /// Whether both are spheres or capsules.
    pub fn round(&self) -> bool {
        matches!(self.shapes, ShapePair::SphereSphere | ShapePair::SphereCapsule | ShapePair::CapsuleCapsule)
    }
}

/// Adds the common data of pairs like this pair of geoms. Returns false if their contacts are not supported. Sets
/// `hard` if the pair [is](is_hard).
pub(super) fn add<T: Real>(
    model: &Model,
    mounts: &[BodyMount],
    geoms: [usize; 2],
    links: [Option<usize>; 2],
    params: &ContactParams,
    specs: &mut Vec<PairSpec<T::Scalar>>,
    hard: &mut bool,
) -> bool {
    let c = T::scalar;
    let [a, b] = geoms.map(|g| &model.geoms[g]);
    let Some(mut shapes) = ShapePair::of(a.kind, b.kind) else { return false };
    let obstacles = model.obstacles == Some(geoms[0]);
    if obstacles {
        shapes = ShapePair::Obstacles;
    }
    // a mesh without a hull does not collide
    if [a, b].iter().any(|g| g.kind == GeomType::Mesh && g.hull.is_none()) {
        return false;
    }
    // moving planes and fields are not supported
    if matches!(a.kind, GeomType::Plane | GeomType::Hfield) && links[0].is_some() {
        return false;
    }
    let [invweight, _] = inverse_weights(model, mounts, [a.body, b.body]);
    let (impratio, friction) = (model.opt.impratio, params.friction);
    let mu = friction[0] / impratio.sqrt();
    let mut ratios = [1.0; 6];
    let (cost, diag) = match (params.condim, model.opt.cone) {
        (1, _) => (Cost::Push, invweight),
        // the edges of a pyramid share R = 2 mu^2 (1 + mu0^2) / impedance (MuJoCo's mj_makeImpedance)
        (_, Cone::Pyramidal) => (Cost::Pyramid, 2.0 * mu * mu * invweight * (1.0 + friction[0] * friction[0])),
        (_, Cone::Elliptic) => {
            for k in 1..6 {
                ratios[k] = impratio * (friction[k - 1] / friction[0]).powi(2);
            }
            (Cost::Elliptic, invweight)
        }
    };
    let cull = match a.kind {
        GeomType::Plane => Cull::Plane,
        GeomType::Hfield => Cull::Field,
        _ if obstacles => Cull::Obstacles,
        _ => Cull::Balls,
    };
    let sizes = |g: &Geom| if g.kind == GeomType::Sphere { [g.size[0], 0.0, 0.0] } else { g.size };
    *hard |= is_hard(model, mounts, [a.body, b.body], diag);
    specs.push(PairSpec {
        coupled: links[0].is_some() && links[1].is_some(),
        declared: params.declared,
        sizes: [sizes(a).map(c), sizes(b).map(c)],
        shapes,
        kinds: [a.kind, b.kind],
        hulls: [a, b].map(|g| g.hull.unwrap_or(0)),
        field: a.hfield.unwrap_or(0),
        cull,
        radius: c(radius(model, b)),
        reach: c(if cull == Cull::Balls { radius(model, a) } else { 0.0 } + radius(model, b) + params.margin),
        margin: c(params.margin),
        dim: params.condim,
        cost,
        friction: friction.map(c),
        slope: c(mu),
        soft: softness::<T>(model, &params.solref, &params.solimp, params.margin, diag),
        ratios: ratios.map(c),
    });
    true
}
