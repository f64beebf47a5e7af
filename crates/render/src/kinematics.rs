//! World poses of all geoms from `qpos` alone, in `f64`. They agree with MuJoCo's `geom_xpos` and `geom_xmat`.

use glam::{DMat3, DQuat, DVec3};
use marathon_motion::kinematics;
use marathon_physics::model::Model;

use crate::error::RenderError;

/// World pose of one geom.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GeomPose {
    /// Center, m.
    pub pos: [f64; 3],
    /// Rotation matrix, rows of three; column `i` is the geom's axis `i` in world coordinates.
    pub mat: [[f64; 3]; 3],
}

/// World pose of one body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BodyPose {
    /// Origin of the body's frame, m.
    pub pos: [f64; 3],
    /// Orientation, `[w, x, y, z]`.
    pub quat: [f64; 4],
}

/// World poses of a model at one `qpos`.
#[derive(Clone, Debug, PartialEq)]
pub struct Pose {
    /// One entry per [`Model::bodies`].
    pub bodies: Vec<BodyPose>,
    /// One entry per [`Model::geoms`].
    pub geoms: Vec<GeomPose>,
    /// Position of the first moving body, m.
    pub root: [f64; 3],
    /// Center of mass of the kinematic tree of the first joint, m. Props in their own trees do not count.
    pub com: [f64; 3],
}

/// Computes the pose of every geom. Errors name the index `agent`.
pub(crate) fn pose(model: &Model, qpos: &[f64], agent: usize) -> Result<Pose, RenderError> {
    check(model, qpos, agent)?;
    let kinematics::Pose { pos, quat, .. } = kinematics::Pose::of(model, qpos);

    let geoms = model
        .geoms
        .iter()
        .map(|geom| {
            let body = geom.body;
            let mat = DMat3::from_quat(quat[body] * dquat(geom.quat)).transpose();
            GeomPose { pos: (pos[body] + quat[body] * dvec(geom.pos)).to_array(), mat: mat.to_cols_array_2d() }
        })
        .collect();

    let first = model.joints.first().map_or(0, |joint| joint.body);
    let tree = model.bodies.get(first).map_or(0, |body| body.root_id);
    let mut mass = 0.0;
    let mut moment = DVec3::ZERO;
    for (i, body) in model.bodies.iter().enumerate().filter(|(_, body)| body.root_id == tree && tree != 0) {
        mass += body.mass;
        moment += body.mass * (pos[i] + quat[i] * dvec(body.ipos));
    }
    let root = pos.get(first).copied().unwrap_or(DVec3::ZERO);
    let com = if mass > 0.0 { moment / mass } else { root };
    let bodies =
        pos.iter().zip(&quat).map(|(p, q)| BodyPose { pos: p.to_array(), quat: [q.w, q.x, q.y, q.z] }).collect();
    Ok(Pose { bodies, geoms, root: root.to_array(), com: com.to_array() })
}

fn check(model: &Model, qpos: &[f64], agent: usize) -> Result<(), RenderError> {
    if qpos.len() != model.nq {
        let (found, expected) = (qpos.len(), model.nq);
        return Err(RenderError::QposLength { agent, model: model.name.clone(), found, expected });
    }
    match qpos.iter().position(|value| !value.is_finite()) {
        Some(index) => Err(RenderError::NotFinite { agent, index, value: qpos[index] }),
        None => Ok(()),
    }
}

fn dvec(v: [f64; 3]) -> DVec3 {
    DVec3::from_array(v)
}

/// MuJoCo stores `[w, x, y, z]`.
fn dquat(q: [f64; 4]) -> DQuat {
    DQuat::from_xyzw(q[1], q[2], q[3], q[0])
}
