//! The turning of the figure, which only the ground can change, and only where it is touched.
//!
//! In the air, nothing changes the angular momentum about the center of mass. On the ground, all that pushes the figure lies
//! within what it stands on: the moment of gravity and of the accelerations about an edge of that cannot point beyond the edge.
//! A recording that breaks this law asks a figure to fall over faster than anybody falls, or to turn on nothing.

use super::problem::{Problem, Row, Sink};
use super::weight::GRAVITY;
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

/// What is asked of the moment about a line.
struct Law {
    /// A point of the line, and its direction.
    about: DVec3,
    axis: DVec3,
    weight: f64,
    /// About an edge of the support, where gravity counts and the moment may be positive; else it is to be nothing.
    of_edge: bool,
}

impl Problem<'_> {
    /// What the turning of figures with a free root may do.
    pub(super) fn balance_rows(&self, poses: &[Pose], sink: &mut Sink) {
        let factor = self.mapping.smooth * self.mapping.balance;
        if self.support.is_empty() || factor == 0.0 {
            return;
        }
        let all: Vec<Vec<Point>> = poses.iter().map(|pose| points(self.model, pose)).collect();
        for i in 1..poses.len().saturating_sub(1) {
            let near = [&all[i - 1], &all[i], &all[i + 1]];
            let support = &self.support[i];
            if support.is_empty() {
                let about = near[1].iter().map(|point| point.share * point.at).sum::<DVec3>();
                for axis in DVec3::AXES {
                    self.moment_row(i, near, &Law { about, axis, weight: factor * TURN, of_edge: false }, sink);
                }
                continue;
            }
            for k in 0..EDGES {
                let (sin, cos) = libm::sincos(std::f64::consts::TAU * k as f64 / EDGES as f64);
                let out = DVec3::new(cos, sin, 0.0);
                let furthest = support.iter().map(|point| point.dot(out)).fold(f64::NEG_INFINITY, f64::max);
                let (about, axis) = ((furthest + MARGIN) * out, DVec3::Z.cross(out));
                self.moment_row(i, near, &Law { about, axis, weight: factor * EDGE, of_edge: true }, sink);
            }
        }
    }

    /// The moment in frame `i` of what moves the points, which are those of the frame before it, of it, and of the one after.
    fn moment_row(&self, i: usize, near: [&Vec<Point>; 3], law: &Law, sink: &mut Sink) {
        let &Law { about, axis, weight, of_edge } = law;
        let nv = self.model.nv;
        let rate = 1.0 / (self.dt * self.dt);
        let gravity = if of_edge { GRAVITY * DVec3::Z } else { DVec3::ZERO };
        let mut by = vec![0.0; 3 * nv];
        let (mut moment, mut force) = (0.0, DVec3::ZERO);
        let [before, now, after] = near;
        for ((before, now), after) in before.iter().zip(now).zip(after) {
            let felt = rate * (before.at - 2.0 * now.at + after.at) + gravity;
            let arm = now.at - about;
            moment += now.share * arm.cross(felt).dot(axis);
            force += now.share * felt;
            // of the force, then of its arm
            let lever = now.share * rate * axis.cross(arm);
            for (k, (point, sign)) in [(before, 1.0), (now, -2.0), (after, 1.0)].into_iter().enumerate() {
                point.by.iter().for_each(|(dof, shift)| by[k * nv + dof] += sign * lever.dot(*shift));
            }
            let pull = now.share * felt.cross(axis);
            now.by.iter().for_each(|(dof, shift)| by[nv + dof] += pull.dot(*shift));
        }
        if !of_edge {
            // the center of mass moves, too
            let pull = force.cross(axis);
            for point in now {
                point.by.iter().for_each(|(dof, shift)| by[nv + dof] -= point.share * pull.dot(*shift));
            }
        }
        let first = (i - 1) * nv;
        let by: Vec<(usize, f64)> = (by.into_iter().enumerate())
            .filter(|(_, by)| *by != 0.0)
            .map(|(dof, by)| (first + dof, weight * by))
            .collect();
        let residual = weight * moment;
        sink(if of_edge { Row::Bound(residual, &by) } else { Row::Even(residual, &by) });
    }
}
