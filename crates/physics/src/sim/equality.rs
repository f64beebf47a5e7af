//! Equality constraints: connected bodies, joints and tendons.

use super::link::Mount;
use super::softness::{Softness, softness};
use super::tendon::{TendonSpec, Term};
use super::weights::{inverse_weights, is_hard, tendon_weight};
use super::weld::BodyMount;
use crate::algebra::spatial::{quat_mul, rot_to_quat};
use crate::lanes::Real;
use crate::model::{EqualityKind, Model};

/// An equality constraint for the kernels.
#[derive(Clone, Debug)]
pub(crate) struct EqualitySpec<C> {
    /// Index in the model.
    pub index: usize,
    pub tie: Tie<C>,
    pub soft: Softness<C>,
    /// Approximate inverse inertia for the rows of positions and for those of orientations.
    pub diag: [C; 2],
    /// See [`is_hard`].
    pub hard: bool,
}

#[derive(Clone, Debug)]
pub(crate) enum Tie<C> {
    /// Points (and with `frames` orientations) of two bodies.
    Bodies { points: [Mount<C>; 2], frames: Option<Frames<C>> },
    /// A length, and one whose polynomial it follows.
    Lengths { follower: Length<C>, leader: Option<Length<C>>, poly: [C; 5] },
}

/// Additional data of a weld.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Frames<C> {
    /// Orientations of the frames on their links or mocap bodies; in the world for other static bodies.
    pub quats: [[C; 4]; 2],
    /// Weight of the angular error.
    pub scale: C,
}

/// A joint's position or a tendon's length, relative to the reference configuration.
#[derive(Clone, Debug)]
pub(crate) struct Length<C> {
    pub terms: Vec<Term<C>>,
    /// The tendon, if it is a string: then there are no terms.
    pub string: Option<usize>,
    pub zero: C,
}

/// Prepares the constraints that are active from the start.
pub(super) fn equalities<T: Real>(
    model: &Model,
    mounts: &[BodyMount],
    link_of: &[Option<usize>],
    tendons: &[TendonSpec<T::Scalar>],
) -> Vec<EqualitySpec<T::Scalar>> {
    let c = T::scalar;
    let joint = |j: usize| {
        let j = &model.joints[j];
        let term = Term { qpos: j.qpos_adr, dof: j.dof_adr, coef: c(1.0) };
        Length { terms: vec![term], string: None, zero: c(model.qpos0[j.qpos_adr]) }
    };
    let tendon = |t: usize| Length {
        terms: tendons[t].terms.clone(),
        string: tendons[t].spatial.then_some(t),
        zero: c(model.tendons[t].length0),
    };
    let mut out = Vec::new();
    if !(model.opt.flags.equality && model.opt.flags.constraint) {
        return out;
    }
    for (index, e) in model.equalities.iter().enumerate().filter(|(_, e)| e.active) {
        let dof_weight = |j: usize| model.dofs[model.joints[j].dof_adr].invweight0;
        let (tie, diag) = match &e.kind {
            EqualityKind::Connect { bodies, anchors, .. } => {
                (tie_bodies::<T>(mounts, link_of, bodies, anchors, None), inverse_weights(model, mounts, *bodies))
            }
            EqualityKind::Weld { bodies, anchors, quats, torquescale, .. } => {
                let tie = tie_bodies::<T>(mounts, link_of, bodies, anchors, Some((quats, *torquescale)));
                (tie, inverse_weights(model, mounts, *bodies))
            }
            EqualityKind::Joint { joint1, joint2, polycoef } => (
                Tie::Lengths { follower: joint(*joint1), leader: joint2.map(joint), poly: polycoef.map(c) },
                [dof_weight(*joint1) + joint2.map_or(0.0, dof_weight); 2],
            ),
            EqualityKind::Tendon { tendon1, tendon2, polycoef } => (
                Tie::Lengths { follower: tendon(*tendon1), leader: tendon2.map(tendon), poly: polycoef.map(c) },
                [tendon_weight::<T>(model, [Some(*tendon1), *tendon2]); 2],
            ),
        };
        let soft = softness::<T>(model, &e.solref, &e.solimp, 0.0, diag[0]);
        let hard = match &e.kind {
            EqualityKind::Connect { bodies, .. } | EqualityKind::Weld { bodies, .. } => {
                is_hard(model, mounts, *bodies, diag[0])
            }
            _ => false,
        };
        out.push(EqualitySpec { index, hard, tie, soft, diag: diag.map(|x| c(x.max(1e-15))) });
    }
    out
}

fn tie_bodies<T: Real>(
    mounts: &[BodyMount],
    link_of: &[Option<usize>],
    bodies: &[usize; 2],
    anchors: &[[f64; 3]; 2],
    frames: Option<(&[[f64; 4]; 2], f64)>,
) -> Tie<T::Scalar> {
    let c = T::scalar;
    let point = |i: usize| Mount::new::<T>(mounts, link_of, bodies[i], &anchors[i], &[1.0, 0.0, 0.0, 0.0]);
    let frames = frames.map(|(quats, scale)| {
        let on_link = |i: usize| quat_mul(&rot_to_quat(&mounts[bodies[i]].rot), &quats[i]).map(c);
        Frames { quats: [on_link(0), on_link(1)], scale: c(scale) }
    });
    Tie::Bodies { points: [point(0), point(1)], frames }
}
