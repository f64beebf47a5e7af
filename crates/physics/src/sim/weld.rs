//! Bodies without joints, which are welded to the body that carries them: their poses on it, and their total mass.

use crate::algebra::rigid::{Frame, compose, quat_to_rot, rotate};
use crate::model::{Model, Vec3};

/// Frame of a body in the frame of the body it is welded to, or in the world if that is part of the world.
pub(crate) struct BodyMount {
    pub body: usize,
    /// Number of the mocap body that it is welded to.
    pub mocap: Option<usize>,
    pub pos: Vec3,
    pub rot: [Vec3; 3],
    /// Mean moment of inertia of all bodies that are welded together, about their center of mass, divided by their
    /// mass: a squared length. Zero without mass.
    pub spread: f64,
}

/// Pose of every body on its `weld_id`: the identity for moving bodies and mocap bodies, world frames for other static bodies.
pub(crate) fn mounts(model: &Model) -> Vec<BodyMount> {
    let identity = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let mut out: Vec<BodyMount> = Vec::with_capacity(model.bodies.len());
    let mut mocaps = 0..;
    for (i, body) in model.bodies.iter().enumerate() {
        let mount = if i == 0 || body.dof_count > 0 || body.mocap {
            let mocap = if body.mocap { mocaps.next() } else { None };
            BodyMount { body: i, mocap, pos: [0.0; 3], rot: identity, spread: 0.0 }
        } else {
            let parent = &out[body.parent];
            let (pos, rot) = compose(&(parent.pos, parent.rot), &(body.pos, quat_to_rot(&body.quat)));
            BodyMount { body: body.weld_id, mocap: parent.mocap, pos, rot, spread: 0.0 }
        };
        out.push(mount);
    }
    let spreads = spreads(model, &out);
    out.iter_mut().for_each(|m| m.spread = spreads[m.body]);
    out
}

/// See [`BodyMount::spread`]; by `weld_id`.
fn spreads(model: &Model, mounts: &[BodyMount]) -> Vec<f64> {
    // mass, first moment, and trace of the inertia about the origin
    let mut sums = vec![(0.0, [0.0; 3], 0.0); mounts.len()];
    for (i, (m, b)) in mounts.iter().zip(&model.bodies).enumerate() {
        let at = rotate(&m.rot, &model.inertial_frame(i).0);
        let (mass, moment, trace) = &mut sums[m.body];
        *mass += b.mass;
        *trace += b.inertia.iter().sum::<f64>();
        for i in 0..3 {
            let x = at[i] + m.pos[i];
            moment[i] += b.mass * x;
            *trace += 2.0 * b.mass * x * x;
        }
    }
    let spread = |(mass, moment, trace): &(f64, Vec3, f64)| {
        let square: f64 = moment.iter().map(|x| x * x).sum();
        if *mass > 0.0 { ((trace - 2.0 * square / mass) / (3.0 * mass)).max(0.0) } else { 0.0 }
    };
    sums.iter().map(spread).collect()
}

/// Mass, center and inertia (about the center, xx yy zz xy xz yz) of a body with all bodies welded to it.
pub(crate) struct Lump {
    pub mass: f64,
    pub com: Vec3,
    pub inertia: [f64; 6],
}

/// Combines the bodies welded to `link`.
pub(crate) fn lump(model: &Model, mounts: &[BodyMount], link: usize) -> Lump {
    let parts: Vec<_> = (0..model.bodies.len()).filter(|&b| mounts[b].body == link).collect();
    let mass: f64 = parts.iter().map(|&b| model.bodies[b].mass).sum();
    let centers: Vec<Frame> = parts
        .iter()
        .map(|&b| {
            let (pos, quat) = model.inertial_frame(b);
            compose(&(mounts[b].pos, mounts[b].rot), &(pos, quat_to_rot(&quat)))
        })
        .collect();
    let mut com = [0.0; 3];
    for (&b, (center, _)) in parts.iter().zip(&centers) {
        for i in 0..3 {
            com[i] += center[i] * model.bodies[b].mass / mass.max(1e-300);
        }
    }
    let mut inertia = [0.0; 6];
    for (&b, (center, axes)) in parts.iter().zip(&centers) {
        let body = &model.bodies[b];
        let d = [center[0] - com[0], center[1] - com[1], center[2] - com[2]];
        let entry = |i: usize, j: usize| {
            let principal: f64 = (0..3).map(|k| axes[k][i] * body.inertia[k] * axes[k][j]).sum();
            let square = if i == j { d[0] * d[0] + d[1] * d[1] + d[2] * d[2] } else { 0.0 };
            principal + body.mass * (square - d[i] * d[j])
        };
        for (slot, (i, j)) in [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)].into_iter().enumerate() {
            inertia[slot] += entry(i, j);
        }
    }
    Lump { mass, com, inertia }
}
