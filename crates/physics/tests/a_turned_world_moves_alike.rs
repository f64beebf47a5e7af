//! Promise: the physics does not depend on the heading or the origin.
//!
//! Every shipped model is rotated a quarter turn about the vertical, gravity included, and floating models are also
//! moved on the floor. After a hundred steps with contacts its state is the rotated state of the original model. The
//! planar models (hopper, walker, cheetah, pendulums) are solved in three components of spatial vectors, and in all six
//! once they are rotated. The test therefore also compares the two.

use crate::common;
use crate::common::numbers::distance;
use marathon_physics::lanes::Real;
use marathon_physics::model::Cone;
use marathon_physics::model::JointType;
use marathon_physics::{Group, Model, Sim, SimOptions, Work};

const STEPS: usize = 100;
/// Models whose bodies touch each other within these steps. MuJoCo aligns the axes of such a friction pyramid with the
/// world, so only a cone without axes rotates with it.
const TOUCH_THEMSELVES: [&str; 1] = ["marathon_man"];
/// Position of a floating model, m.
const AWAY: [f64; 2] = [3.0, -2.0];

/// A quarter turn about the vertical. (The friction pyramid is the same after one, not after any other.)
fn turned(v: &[f64]) -> [f64; 3] {
    [-v[1], v[0], v[2]]
}

fn turned_quat(q: &[f64]) -> [f64; 4] {
    let h = std::f64::consts::FRAC_1_SQRT_2;
    [h * (q[0] - q[3]), h * (q[1] - q[2]), h * (q[2] + q[1]), h * (q[3] + q[0])]
}

/// The model with its moving bodies rotated. Free ones are rotated by their state.
fn turned_model(model: &Model) -> Model {
    let mut out = model.clone();
    // one model has a tiny amount along x
    out.opt.gravity = turned(&out.opt.gravity);
    for body in out.bodies.iter_mut().skip(1).filter(|b| b.parent == 0) {
        body.pos = turned(&body.pos);
        body.quat = turned_quat(&body.quat);
    }
    out
}

fn turned_state(model: &Model, qpos: &[f64], qvel: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let (mut q, mut v) = (qpos.to_vec(), qvel.to_vec());
    for joint in model.joints.iter().filter(|j| j.kind == JointType::Free) {
        let (a, d) = (joint.qpos_adr, joint.dof_adr);
        let p = turned(&qpos[a..a + 3]);
        q[a..a + 3].copy_from_slice(&[p[0] + AWAY[0], p[1] + AWAY[1], p[2]]);
        q[a + 3..a + 7].copy_from_slice(&turned_quat(&qpos[a + 3..a + 7]));
        v[d..d + 3].copy_from_slice(&turned(&qvel[d..d + 3]));
    }
    (q, v)
}

/// Positions and velocities after some steps under constant controls.
fn play<T: Real>(model: &Model, (qpos, qvel): (&[f64], &[f64]), steps: usize) -> (Vec<f64>, Vec<f64>, u64) {
    let mut model = model.clone();
    if T::EPSILON < 1e-10 {
        model.opt.tolerance = 1e-14;
    }
    let sim = Sim::<T>::new(&model, SimOptions::default()).expect("a shipped model can be simulated");
    let (mut work, mut group) = (Work::new(&sim), Group::new(&sim));
    group.reset_lane(&sim, 0, qpos, qvel);
    for (i, u) in group.ctrl.iter_mut().enumerate() {
        u.set(0, T::scalar(0.3 * (1.7 * i as f64 + 0.4).sin()));
    }
    sim.step(&mut work, &mut group, steps);
    let plain = |v: &[T]| v.iter().map(|x| T::widen(x.get(0))).collect();
    (plain(&group.qpos), plain(&group.qvel), work.stats().contacts)
}

/// Difference between a model and its rotated twin, and the number of contacts.
fn difference<T: Real>(model: &Model, steps: usize) -> (f64, u64) {
    let qvel: Vec<f64> = (0..model.nv).map(|d| 0.5 * (2.3 * d as f64 + 1.0).sin()).collect();
    let (q, v, contacts) = play::<T>(model, (&model.qpos0, &qvel), steps);
    let (start, speed) = turned_state(model, &model.qpos0, &qvel);
    let (q2, v2, _) = play::<T>(&turned_model(model), (&start, &speed), steps);
    let (mut q, v) = turned_state(model, &q, &v);
    // q and -q are the same rotation
    for joint in &model.joints {
        let a = match joint.kind {
            JointType::Free => joint.qpos_adr + 3,
            JointType::Ball => joint.qpos_adr,
            _ => continue,
        };
        if (a..a + 4).map(|i| q[i] * q2[i]).sum::<f64>() < 0.0 {
            q[a..a + 4].iter_mut().for_each(|x| *x = -*x);
        }
    }
    (distance(&q2, &q, 1.0).max(distance(&v2, &v, 1.0)), contacts)
}

#[test]
fn a_turned_world_moves_alike() {
    let mut failures = Vec::new();
    let (mut touched, mut models) = (0, 0);
    for path in common::shipped() {
        let mut model = Model::from_xml_file(&path).unwrap_or_else(|e| panic!("{e}"));
        if path.file_stem().is_some_and(|name| TOUCH_THEMSELVES.iter().any(|known| name == *known)) {
            model.opt.cone = Cone::Elliptic;
        }
        let (double, contacts) = difference::<f64>(&model, STEPS);
        // rounding errors grow with every contact; a few steps in single precision show whether anything is missing
        let (single, _) = difference::<f32>(&model, 5);
        println!("{:60} {double:.0e} {single:.0e} {contacts} contacts", path.display());
        if double > 1e-7 || single > 1e-3 {
            failures.push(format!("{}: {double:.1e} in double precision, {single:.1e} in single", path.display()));
        }
        models += 1;
        touched += usize::from(contacts > 0);
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
    assert!(models == 21 && touched >= 11, "{touched} of {models} models touched the floor");
}
