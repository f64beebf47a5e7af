//! The turning of the figure, which only the ground can change, and only where it is touched.
//!
//! In the air, nothing changes the angular momentum about the center of mass. On the ground, all that pushes the figure lies
//! within what it stands on: the moment of gravity and of the accelerations about an edge of that cannot point beyond the edge.
//! A recording that breaks this law asks a figure to fall over faster than anybody falls, or to turn on nothing.

use super::problem::{Problem, Row, Sink};
use super::weight::{GRAVITY, center};
use crate::kinematics::Pose;
use crate::rotation::quat;
use glam::DVec3;
use marathon_physics::Model;

/// Of what the ground cannot do, s^2/m^2: moments are per mass.
const EDGE: f64 = 0.3;
/// Of a change of the angular momentum per mass in the air, s^2/m^2.
const TURN: f64 = 0.3;
/// Edges of what the figure stands on, by their directions.
const EDGES: usize = 8;
/// How far beyond a contact the ground still pushes, m: contacts of motion capture are not more precise.
const MARGIN: f64 = 0.03;

/// A point of the figure, which has a share of its mass, and how it moves with each degree of freedom.
struct Point {
    share: f64,
    at: DVec3,
    by: Vec<(usize, DVec3)>,
}

/// Points with the mass and the inertia of a figure: six of each body.
fn points(model: &Model, pose: &Pose) -> Vec<Point> {
    let total: f64 = model.bodies.iter().map(|body| body.mass).sum();
    let mut points = Vec::new();
    for (i, body) in model.bodies.iter().enumerate().filter(|(_, body)| body.mass > 0.0) {
        let trace: f64 = body.inertia.iter().sum();
        for axis in 0..3 {
            // along a principal axis: what the other two have more of
            let second = (0.5 * trace - body.inertia[axis]).max(0.0);
            let reach = quat(&body.iquat) * DVec3::AXES[axis] * (3.0 * second / body.mass).sqrt();
            for offset in [reach, -reach] {
                let at = pose.point(i, DVec3::from_array(body.ipos) + offset);
                let mut by = Vec::new();
                pose.motions(model, i, at, |dof, _, shift| by.push((dof, shift)));
                points.push(Point { share: body.mass / (6.0 * total), at, by });
            }
        }
    }
    points
}

/// What moves the figure in a frame, gravity taken off: a force and its moment about the world's origin, per mass.
struct Wrench {
    force: DVec3,
    moment: DVec3,
    /// How both change with each degree of freedom of the frame before, of the frame, and of the one after.
    by: Vec<[DVec3; 2]>,
}

/// The wrench on points in three frames that are `dt` apart.
fn wrench(near: [&Vec<Point>; 3], nv: usize, dt: f64) -> Wrench {
    let rate = 1.0 / (dt * dt);
    let [before, now, after] = near;
    let (mut force, mut moment, mut by) = (DVec3::ZERO, DVec3::ZERO, vec![[DVec3::ZERO; 2]; 3 * nv]);
    for ((before, now), after) in before.iter().zip(now).zip(after) {
        let push = now.share * (rate * (before.at - 2.0 * now.at + after.at) + GRAVITY * DVec3::Z);
        force += push;
        moment += now.at.cross(push);
        for (k, (point, sign)) in [(before, 1.0), (now, -2.0), (after, 1.0)].into_iter().enumerate() {
            for (dof, shift) in &point.by {
                let change = now.share * rate * sign * shift;
                let [of_force, of_moment] = &mut by[k * nv + dof];
                *of_force += change;
                *of_moment += now.at.cross(change);
            }
        }
        now.by.iter().for_each(|(dof, shift)| by[nv + dof][1] += shift.cross(push));
    }
    Wrench { force, moment, by }
}

impl Problem<'_> {
    /// What the turning of figures with a free root may do.
    pub(super) fn balance_rows(&self, poses: &[Pose], sink: &mut Sink) {
        let factor = self.mapping.smooth * self.mapping.balance;
        if self.support.is_empty() || factor == 0.0 {
            return;
        }
        let nv = self.model.nv;
        let all: Vec<Vec<Point>> = poses.iter().map(|pose| points(self.model, pose)).collect();
        for i in 1..poses.len().saturating_sub(1) {
            let Wrench { force, moment, by } = wrench([&all[i - 1], &all[i], &all[i + 1]], nv, self.dt);
            // the moment about a line, and its changes, given those of a point of the line
            let along = |about: DVec3, axis: DVec3, weight: f64, moved: &[DVec3]| {
                let mut row: Vec<f64> = by.iter().map(|[f, m]| weight * axis.dot(m - about.cross(*f))).collect();
                for (row, moved) in row[nv..].iter_mut().zip(moved) {
                    *row -= weight * axis.dot(moved.cross(force));
                }
                let row = row.into_iter().enumerate().filter(|(_, by)| *by != 0.0);
                let row: Vec<(usize, f64)> = row.map(|(dof, by)| ((i - 1) * nv + dof, by)).collect();
                (weight * axis.dot(moment - about.cross(force)), row)
            };
            let support = &self.support[i];
            if support.is_empty() {
                let (about, moved) = center(self.model, &poses[i]);
                for axis in DVec3::AXES {
                    let (residual, row) = along(about, axis, factor * TURN, &moved);
                    sink(Row::Even(residual, &row));
                }
                continue;
            }
            for k in 0..EDGES {
                let (sin, cos) = libm::sincos(std::f64::consts::TAU * k as f64 / EDGES as f64);
                let out = DVec3::new(cos, sin, 0.0);
                let furthest = support.iter().map(|point| point.dot(out)).fold(f64::NEG_INFINITY, f64::max);
                let (residual, row) = along((furthest + MARGIN) * out, DVec3::Z.cross(out), factor * EDGE, &[]);
                sink(Row::Bound(residual, &row));
            }
        }
    }
}
