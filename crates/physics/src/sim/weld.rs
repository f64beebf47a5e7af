//! Rigid transforms and lumped inertias in double precision, for preparing a model.

use crate::model::{Model, Quat, Vec3};

/// Position and rotation (columns) of one frame in another.
pub(crate) type Frame = (Vec3, [Vec3; 3]);

/// Rotation matrix by columns of a quaternion of any length.
pub(crate) fn quat_to_rot(q: &Quat) -> [Vec3; 3] {
    let n = 2.0 / (q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    let [w, x, y, z] = *q;
    [
        [1.0 - n * (y * y + z * z), n * (x * y + w * z), n * (x * z - w * y)],
        [n * (x * y - w * z), 1.0 - n * (x * x + z * z), n * (y * z + w * x)],
        [n * (x * z + w * y), n * (y * z - w * x), 1.0 - n * (x * x + y * y)],
    ]
}

/// Rotated vector.
pub(crate) fn rotate(r: &[Vec3; 3], v: &Vec3) -> Vec3 {
    let mut out = [0.0; 3];
    for i in 0..3 {
        out[i] = r[0][i] * v[0] + r[1][i] * v[1] + r[2][i] * v[2];
    }
    out
}

/// Frame `b` given in `a`, as seen from where `a` is given.
pub(crate) fn compose(a: &Frame, b: &Frame) -> Frame {
    let p = rotate(&a.1, &b.0);
    ([a.0[0] + p[0], a.0[1] + p[1], a.0[2] + p[2]], b.1.map(|column| rotate(&a.1, &column)))
}

/// Whether a rotation is the identity to rounding.
pub(crate) fn is_identity(r: &[Vec3; 3]) -> bool {
    (0..3).all(|i| (0..3).all(|j| (r[i][j] - f64::from(i == j)).abs() < 1e-14))
}

/// Frame of a body in the frame of the body it is welded to, or in the world if that stands still.
pub(crate) struct BodyMount {
    pub body: usize,
    pub pos: Vec3,
    pub rot: [Vec3; 3],
    /// Mean moment of inertia, about their center of mass, of all bodies that are welded together, by their mass: the
    /// square of a length. Zero for what has no mass.
    pub spread: f64,
}

/// Where every body sits on its `weld_id`: the identity for bodies that move, world frames for static bodies and for
/// mocap bodies with what is welded to them.
pub(crate) fn mounts(model: &Model) -> Vec<BodyMount> {
    let identity = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let mut out: Vec<BodyMount> = Vec::with_capacity(model.bodies.len());
    for (i, body) in model.bodies.iter().enumerate() {
        let mount = if i == 0 || body.dof_count > 0 {
            BodyMount { body: i, pos: [0.0; 3], rot: identity, spread: 0.0 }
        } else {
            let parent = &out[body.parent];
            let (pos, rot) = compose(&(parent.pos, parent.rot), &(body.pos, quat_to_rot(&body.quat)));
            BodyMount { body: body.weld_id, pos, rot, spread: 0.0 }
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
    for (m, b) in mounts.iter().zip(&model.bodies) {
        let at = rotate(&m.rot, &b.ipos);
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

/// Below this fraction of a body's other inverse inertia, one is nothing.
const NOTHING: f64 = 1e-6;

/// What is taken then, as such a fraction: where the softness of the constraint and its rounding in single precision are
/// errors of a size.
const LEAST: f64 = 1e-2;

/// A constraint this much harder than what it acts on is hard for single precision.
const HARD: f64 = 1e-2;

/// Inverse inertias that two bodies have against being moved apart and against being turned: the sums of MuJoCo's inverse
/// weights.
///
/// A body that turns about its center of mass has no translational one, a body that slides no rotational one, and MuJoCo
/// takes 1e-15 for them. Such a constraint is so hard that rounding decides, in MuJoCo too. Here it is as hard as single
/// precision can hold.
pub(crate) fn inverse_weights(model: &Model, mounts: &[BodyMount], bodies: [usize; 2]) -> [f64; 2] {
    [0, 1].map(|k| {
        let own: f64 = bodies.iter().map(|b| model.bodies[*b].invweight0[k]).sum();
        let other = other_weight(model, mounts, bodies, k);
        if own < NOTHING * other { LEAST * other } else { own }
    })
}

/// What an inverse weight would be of bodies that move in the other way as if they were free.
fn other_weight(model: &Model, mounts: &[BodyMount], bodies: [usize; 2], k: usize) -> f64 {
    let share = |b: &usize| {
        let (weight, spread) = (model.bodies[*b].invweight0[1 - k], mounts[*b].spread);
        if k == 0 || spread == 0.0 { weight * spread } else { weight / spread }
    };
    bodies.iter().map(share).sum()
}

/// Whether a constraint on points of two bodies is much harder, by the inverse weight `diag` of its rows, than what a
/// point of them weighs that moves and turns.
pub(crate) fn is_hard(model: &Model, mounts: &[BodyMount], bodies: [usize; 2], diag: f64) -> bool {
    let own: f64 = bodies.iter().map(|b| model.bodies[*b].invweight0[0]).sum();
    diag < HARD * (own + other_weight(model, mounts, bodies, 0))
}

/// Mass, center and inertia (about the center, xx yy zz xy xz yz) of a body with all bodies welded to it.
pub(crate) struct Lump {
    pub mass: f64,
    pub com: Vec3,
    pub inertia: [f64; 6],
}

/// Lumps the bodies welded to `link`.
pub(crate) fn lump(model: &Model, mounts: &[BodyMount], link: usize) -> Lump {
    let parts: Vec<_> = (0..model.bodies.len()).filter(|&b| mounts[b].body == link).collect();
    let mass: f64 = parts.iter().map(|&b| model.bodies[b].mass).sum();
    let centers: Vec<Frame> = parts
        .iter()
        .map(|&b| {
            let body = &model.bodies[b];
            compose(&(mounts[b].pos, mounts[b].rot), &(body.ipos, quat_to_rot(&body.iquat)))
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

#[cfg(test)]
mod tests {
    use crate::{Model, Sim, SimOptions};

    #[test]
    fn constraints_of_shipped_models_are_not_hard() {
        for folder in ["agents", "gymnasium", "dm_control"] {
            let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets").join(folder);
            for file in std::fs::read_dir(folder).expect("the folder exists") {
                let path = file.expect("readable").path();
                let model = Model::from_xml_file(&path).unwrap_or_else(|e| panic!("{e}"));
                let sim = Sim::<f32>::new(&model, SimOptions::default()).unwrap_or_else(|e| panic!("{e}"));
                assert!(!sim.hard, "{}", path.display());
            }
        }
    }

    #[test]
    fn a_constraint_on_a_body_that_only_turns_about_its_center_is_hard() {
        let text = r#"<mujoco><worldbody><geom type="plane" size="1 1 1"/><body><joint/><geom size=".1"/></body></worldbody>
            </mujoco>"#;
        let model = Model::from_xml_str(text, "turning").expect("a model");
        assert!(model.bodies[1].invweight0[0] < 1e-12);
        let sim = Sim::<f32>::new(&model, SimOptions::default()).expect("a simulation");
        assert!(sim.contacts.floor[0].soft.diag > 1e-3);
    }
}
