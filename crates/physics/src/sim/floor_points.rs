//! Points of moving geoms that may touch a level plane.
//!
//! The candidate points are known in advance: one for a sphere, two for a capsule, the corners for a box. Each is a
//! [`FloorPoint`].

use super::contact_params::ContactParams;
use super::softness::{Softness, softness};
use super::weights::{inverse_weights, is_hard};
use super::weld::BodyMount;
use crate::algebra::rigid::{self, quat_to_rot};
use crate::lanes::Real;
use crate::model::{Cone, GeomType, Model};

/// A point of a moving geom that may touch a level plane.
#[derive(Clone, Debug)]
pub(crate) struct FloorPoint<C> {
    pub link: usize,
    /// Geom index in the model.
    pub geom: usize,
    /// Geom of the plane.
    pub plane: usize,
    /// Number of the declared pair, if it is one.
    pub declared: Option<usize>,
    /// Center of the touching sphere (radius 0 for a box corner), in the link's frame.
    pub point: [C; 3],
    pub radius: C,
    /// Capsule axis in the link's frame. The first tangent is its projection.
    pub axis: Option<[C; 3]>,
    /// For a box corner: the center of the box, and the index of the corner (0 to 7).
    pub corner: Option<([C; 3], usize)>,
    /// Height of the plane.
    pub height: C,
    /// Friction along the two tangents. Zero for a frictionless contact.
    pub mu: [C; 2],
    pub soft: Softness<C>,
}

/// Adds the points of a moving geom that may touch a level plane. Returns whether the list supports the pair: pyramidal
/// cones of condim 1 or 3, spheres, capsules and boxes. Sets `hard` if the points [are](is_hard).
pub(super) fn add<T: Real>(
    model: &Model,
    mounts: &[BodyMount],
    (fixed, geom): (usize, usize),
    link: Option<usize>,
    params: &ContactParams,
    out: &mut Vec<FloorPoint<T::Scalar>>,
    hard: &mut bool,
) -> bool {
    let (plane_geom, fixed, moving) = (fixed, &model.geoms[fixed], &model.geoms[geom]);
    let placed = |geom: usize| {
        let (mount, (pos, quat)) = (&mounts[model.geoms[geom].body], model.geom_frame(geom));
        rigid::compose(&(mount.pos, mount.rot), &(pos, quat_to_rot(&quat)))
    };
    let Some(link) = link else { return false };
    let pyramid = params.condim == 1 || (params.condim == 3 && model.opt.cone == Cone::Pyramidal);
    let shape = matches!(moving.kind, GeomType::Sphere | GeomType::Capsule | GeomType::Box);
    if fixed.kind != GeomType::Plane || mounts[fixed.body].body != 0 || !pyramid || !shape {
        return false;
    }
    let plane = placed(plane_geom);
    if plane.1[2][2] < 1.0 - 1e-12 {
        return false;
    }

    let mu = if params.condim == 1 { [0.0; 2] } else { [params.friction[0], params.friction[1]] };
    let [invweight, _] = inverse_weights(model, mounts, [moving.body, fixed.body]);
    // pyramid edges share R = 2 mu^2 (1 + mu^2) / invweight-scaled impedance (MuJoCo's mj_makeImpedance)
    let diag = if params.condim == 1 {
        // four coinciding edges of a flat pyramid carry a quarter each
        4.0 * invweight
    } else {
        2.0 * mu[0] * mu[0] / model.opt.impratio * invweight * (1.0 + mu[0] * mu[0])
    };
    *hard |= is_hard(model, mounts, [moving.body, fixed.body], diag);
    let soft = softness::<T>(model, &params.solref, &params.solimp, params.margin, diag);

    let frame = placed(geom);
    let c3 = |v: [f64; 3]| [T::scalar(v[0]), T::scalar(v[1]), T::scalar(v[2])];
    let base = FloorPoint {
        link,
        geom,
        plane: plane_geom,
        declared: params.declared,
        point: c3(frame.0),
        radius: T::scalar(moving.size[0]),
        axis: None,
        corner: None,
        height: T::scalar(plane.0[2]),
        mu: mu.map(T::scalar),
        soft,
    };
    match moving.kind {
        GeomType::Sphere => out.push(base),
        GeomType::Capsule => {
            let axis = frame.1[2];
            for side in [1.0, -1.0] {
                let h = side * moving.size[1];
                let point = [frame.0[0] + h * axis[0], frame.0[1] + h * axis[1], frame.0[2] + h * axis[2]];
                out.push(FloorPoint { point: c3(point), axis: Some(c3(axis)), ..base.clone() });
            }
        }
        GeomType::Box => {
            for i in 0..8 {
                let sign = |bit: usize, x: f64| if i & bit != 0 { x } else { -x };
                let local = [sign(1, moving.size[0]), sign(2, moving.size[1]), sign(4, moving.size[2])];
                let at = rigid::rotate(&frame.1, &local);
                let point = [frame.0[0] + at[0], frame.0[1] + at[1], frame.0[2] + at[2]];
                out.push(FloorPoint {
                    point: c3(point),
                    radius: T::scalar(0.0),
                    corner: Some((c3(frame.0), i)),
                    ..base.clone()
                });
            }
        }
        _ => unreachable!("other shapes were excluded above"),
    }
    true
}
