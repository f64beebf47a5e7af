//! Angular momentum of the character, which only ground contacts can change.
//!
//! In the air, the angular momentum about the center of mass is constant. On the ground, all contact forces act within
//! the support area. The moment of gravity and accelerations about an edge of that area therefore cannot point beyond
//! the edge. A recording that violates this law requires impossible falls or rotations.

use super::problem::{Problem, Row, Sink};
use super::weight::{GRAVITY, center};
use crate::kinematics::Pose;
use crate::rotation::quat;
use glam::DVec3;
use marathon_physics::Model;

/// Weight of impossible ground moments, s^2/m^2. Moments are per mass.
const EDGE: f64 = 0.3;
/// Weight of a change of the angular momentum per mass in the air, s^2/m^2.
const TURN: f64 = 0.3;
/// Number of edge directions of the support area.
const EDGES: usize = 8;
/// Margin around contacts within which the ground still pushes, m. Contacts of motion capture are not more precise.
const MARGIN: f64 = 0.03;

/// A mass point of the character, and its motion with each degree of freedom.
struct Point {
    share: f64,
    at: DVec3,
    by: Vec<(usize, DVec3)>,
}

/// Points with the mass and the inertia of a character: six per body.
fn points(model: &Model, pose: &Pose) -> Vec<Point> {
    let total: f64 = model.bodies.iter().map(|body| body.mass).sum();
    let mut points = Vec::new();
    for (i, body) in model.bodies.iter().enumerate().filter(|(_, body)| body.mass > 0.0) {
        let trace: f64 = body.inertia.iter().sum();
        for axis in 0..3 {
            // along a principal axis: from the other two moments of inertia
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

/// Force and moment about the world's origin in a frame, without gravity, per mass.
struct Wrench {
    force: DVec3,
    moment: DVec3,
    /// Derivatives of both with respect to each degree of freedom of the previous, current and next frame.
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
    /// Adds the limits on the rotation of characters with a free root.
    pub(super) fn balance_rows(&self, poses: &[Pose], sink: &mut Sink) {
        let factor = self.mapping.smooth * self.mapping.balance;
        if self.support.is_empty() || factor == 0.0 {
            return;
        }
        let nv = self.model.nv;
        let all: Vec<Vec<Point>> = poses.iter().map(|pose| points(self.model, pose)).collect();
        for i in 1..poses.len().saturating_sub(1) {
            let Wrench { force, moment, by } = wrench([&all[i - 1], &all[i], &all[i + 1]], nv, self.dt);
            // the moment about a line, and its derivatives, given those at a point of the line
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
