//! Coupled degrees of freedom: tendons and equality constraints.

use super::{Model, Quat, SolImp, SolRef, Vec3};
use serde::{Deserialize, Serialize};

/// Path of a tendon.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum TendonKind {
    /// `length = sum(coef * qpos)` over hinge and slide joints, as `(joint, coef)`. A joint occurs once.
    Fixed(Vec<(usize, f64)>),
    /// A string through sites and around geoms. Its length is that of all [spans](TendonKind::spans), m.
    Spatial(Vec<PathPart>),
}

/// A part of the path of a spatial tendon.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum PathPart {
    /// A site that the string passes through.
    Site(usize),
    /// A sphere or cylinder that the string wraps around between the sites before and after it.
    Geom {
        /// The geom.
        geom: usize,
        /// The site that the string stays next to, if any. The string passes inside the geom if the site is inside.
        side: Option<usize>,
    },
    /// The end of one branch of the path and the start of the next.
    Pulley {
        /// Divisor of the lengths of the branch behind it.
        divisor: f64,
    },
}

/// A piece of a spatial tendon from one site to the next, and the wrapped geom between them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathSpan {
    /// The two sites.
    pub sites: [usize; 2],
    /// The geom to wrap around and its side site, if any.
    pub wrap: Option<(usize, Option<usize>)>,
    /// Divisor of its length.
    pub divisor: f64,
}

impl TendonKind {
    /// The pieces of a spatial tendon; none for a fixed one.
    pub fn spans(&self) -> Vec<PathSpan> {
        let TendonKind::Spatial(path) = self else { return Vec::new() };
        let (mut from, mut wrap, mut divisor) = (None, None, 1.0);
        let mut spans = Vec::new();
        for part in path {
            match *part {
                PathPart::Site(site) => {
                    if let Some(from) = from.replace(site) {
                        spans.push(PathSpan { sites: [from, site], wrap: wrap.take(), divisor });
                    }
                }
                PathPart::Geom { geom, side } => wrap = Some((geom, side)),
                PathPart::Pulley { divisor: by } => (from, wrap, divisor) = (None, None, by),
            }
        }
        spans
    }
}

impl Model {
    /// Degrees of freedom that move a body, from the body to the root.
    pub(crate) fn dofs_of_body(&self, body: usize) -> Vec<usize> {
        let weld = &self.bodies[self.bodies[body].weld_id];
        let mut next = (weld.dof_count > 0).then(|| weld.dof_start + weld.dof_count - 1);
        let mut dofs = Vec::new();
        while let Some(dof) = next {
            dofs.push(dof);
            next = self.dofs[dof].parent;
        }
        dofs
    }

    /// Degrees of freedom that move the first of two bodies only, and the second only.
    pub(crate) fn dofs_between(&self, bodies: [usize; 2]) -> [Vec<usize>; 2] {
        let [mut first, mut second] = bodies.map(|b| self.dofs_of_body(b));
        // those that move both are nearest to the root
        while first.last().is_some_and(|dof| second.last() == Some(dof)) {
            first.pop();
            second.pop();
        }
        [first, second]
    }
}

/// A tendon (MuJoCo `tendon_*`). The length of a fixed one is in the units of the joints (m, rad or a mix) times the
/// coefficients.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Tendon {
    /// Name; empty when the file gives none.
    pub name: String,
    /// Path.
    pub kind: TendonKind,
    /// Whether `range` is enforced.
    pub limited: bool,
    /// Limits of the length.
    pub range: [f64; 2],
    /// Distance from the limit at which the constraint becomes active.
    pub margin: f64,
    /// Spring stiffness per unit of length.
    pub stiffness: f64,
    /// Higher orders of the stiffness, see [`Joint::stiffness_poly`](super::Joint::stiffness_poly).
    pub stiffness_poly: [f64; 2],
    /// The spring is slack between these lengths and pulls towards them from outside (MuJoCo `tendon_lengthspring`).
    pub spring_length: [f64; 2],
    /// Viscous damping per unit of velocity, including that of actuators.
    pub damping: f64,
    /// Higher orders of the damping, see [`Dof::damping_poly`](super::Dof::damping_poly).
    pub damping_poly: [f64; 2],
    /// Dry friction.
    pub frictionloss: f64,
    /// Inertia of the tendon's velocity, including that of actuators. It adds `armature * J' J` to the mass matrix, but
    /// only for dofs that are equal or an ancestor of each other. MuJoCo's matrix has no other entries.
    pub armature: f64,
    /// `solreflimit`.
    pub solref_limit: SolRef,
    /// `solimplimit`.
    pub solimp_limit: SolImp,
    /// `solreffriction`.
    pub solref_friction: SolRef,
    /// `solimpfriction`.
    pub solimp_friction: SolImp,
    /// Limits of the total actuator force on this tendon (`actuatorfrcrange`), if any.
    pub actuator_force_range: Option<[f64; 2]>,
    /// Length in the reference configuration.
    pub length0: f64,
    /// Inverse inertia seen by the tendon in the reference configuration, `J inv(M) J'`.
    pub invweight0: f64,
    /// User group, for viewers.
    pub group: i32,
}

/// Kind of an equality constraint (MuJoCo `eq_type`, `eq_data`).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum EqualityKind {
    /// A point of one body stays on a point of another: 3 rows, world axes.
    Connect {
        /// The two bodies; 0 is the world.
        bodies: [usize; 2],
        /// The two sites, if the constraint was given with sites. `anchors` has their positions.
        sites: Option<[usize; 2]>,
        /// The point in the first body's frame and in the second's.
        anchors: [Vec3; 2],
    },
    /// A frame of one body stays on a frame of another. There are 3 rows for the position as in `Connect`, and 3 for
    /// the orientation: `torquescale` times the vector part of `conj(q[1]) * q[0]`, where `q[i]` is the orientation of
    /// `bodies[i]` times `quats[i]`.
    Weld {
        /// The two bodies; 0 is the world.
        bodies: [usize; 2],
        /// The two sites, if the constraint was given with sites. `anchors` and `quats` have their poses.
        sites: Option<[usize; 2]>,
        /// The point in the first body's frame and in the second's.
        anchors: [Vec3; 2],
        /// The orientation in the first body's frame and in the second's. For constraints given with bodies, the first
        /// is the relative orientation `relpose` and the second the identity.
        quats: [Quat; 2],
        /// Ratio of angular to linear error, m.
        torquescale: f64,
    },
    /// `q1 - q1_0 = p(q2 - q2_0)`, where `_0` marks the reference configuration and `p` is the polynomial. Without a
    /// second joint, `q1 - q1_0 = polycoef[0]`. Hinge and slide joints only.
    Joint {
        /// The joint that follows.
        joint1: usize,
        /// The joint that leads, if any.
        joint2: Option<usize>,
        /// Coefficients of the quartic, constant first.
        polycoef: [f64; 5],
    },
    /// The same for the lengths of tendons, measured from `length0`.
    Tendon {
        /// The tendon that follows.
        tendon1: usize,
        /// The tendon that leads, if any.
        tendon2: Option<usize>,
        /// Coefficients of the quartic, constant first.
        polycoef: [f64; 5],
    },
}

/// An equality constraint.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Equality {
    /// Name; empty when the file gives none.
    pub name: String,
    /// Kind.
    pub kind: EqualityKind,
    /// Whether it is active from the start (MuJoCo `eq_active0`).
    pub active: bool,
    /// Solver reference.
    pub solref: SolRef,
    /// Solver impedance.
    pub solimp: SolImp,
}
