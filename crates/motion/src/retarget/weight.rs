//! The center of mass, which only gravity and ground forces can accelerate.
//!
//! Recordings and retargeting both violate this law. A foot that is moved to its target shifts the whole character, and
//! a flight at another person's proportions is too high for its duration. A character with motors cannot follow that.
//! In the air, the center of mass should be in free fall. On the ground, which only pushes, its acceleration must lie
//! within a friction cone. [`balance`](super::balance) covers the effect of the ground on rotation.

use super::problem::{Problem, Row, Sink};
use crate::ground::Touch;
use crate::kinematics::Pose;
use glam::DVec3;
use marathon_physics::Model;

/// Weight of impossible ground forces, s^2/m.
const LAW: f64 = 0.03;
/// Weight of deviations from free fall, s^2/m. A flight must be as high as its duration requires, for a landing in
/// step.
const FALL: f64 = 0.12;
/// Weight of accelerations on the ground, s^2/m: people move smoothly.
const EFFORT: f64 = 0.001;
/// Gravity, m/s^2.
pub(super) const GRAVITY: f64 = 9.81;
/// Friction of a foot on the ground, in directions along x and y.
const FRICTION: f64 = 1.0;
/// Maximum height of a part in ground contact, m.
const NEAR: f64 = 0.02;

/// Support points per frame. Empty in a flight.
pub(super) fn support(model: &Model, touches: &[Touch], frames: &[Vec<f64>]) -> Vec<Vec<DVec3>> {
    let near = |pose: Pose| touches.iter().map(|touch| touch.lowest(&pose)).filter(|point| point.z <= NEAR).collect();
    frames.iter().map(|frame| near(Pose::of(model, frame))).collect()
}

/// Center of mass of a pose, and its derivative with respect to each degree of freedom.
pub(super) fn center(model: &Model, pose: &Pose) -> (DVec3, Vec<DVec3>) {
    let total: f64 = model.bodies.iter().map(|body| body.mass).sum();
    let (mut at, mut by) = (DVec3::ZERO, vec![DVec3::ZERO; model.nv]);
    for (i, body) in model.bodies.iter().enumerate().filter(|(_, body)| body.mass > 0.0) {
        let (share, point) = (body.mass / total, pose.point(i, DVec3::from_array(body.ipos)));
        at += share * point;
        pose.motions(model, i, point, |dof, _, shift| by[dof] += share * shift);
    }
    (at, by)
}

impl Problem<'_> {
    /// Adds the limits on the center of mass of characters with a free root.
    pub(super) fn weight_rows(&self, poses: &[Pose], sink: &mut Sink) {
        let (model, nv) = (self.model, self.model.nv);
        let factor = self.mapping.smooth;
        if self.support.is_empty() || factor == 0.0 {
            return;
        }
        let [law, fall, effort] = [LAW, FALL, EFFORT].map(|weight| factor * weight);
        let centers: Vec<_> = poses.iter().map(|pose| center(model, pose)).collect();
        let rate = 1.0 / (self.dt * self.dt);
        for i in 1..poses.len().saturating_sub(1) {
            let parts = [(i - 1, 1.0), (i, -2.0), (i + 1, 1.0)];
            let felt = parts.iter().map(|(k, sign)| sign * rate * centers[*k].0).sum::<DVec3>() + GRAVITY * DVec3::Z;
            let mut row = |weight: f64, along: DVec3, even: bool| {
                let by: Vec<(usize, f64)> = parts
                    .iter()
                    .flat_map(|(k, sign)| {
                        let by = &centers[*k].1;
                        by.iter()
                            .enumerate()
                            .map(move |(dof, by)| (k * nv + dof, weight * sign * rate * along.dot(*by)))
                    })
                    .filter(|(_, by)| *by != 0.0)
                    .collect();
                let residual = weight * along.dot(felt);
                sink(if even { Row::Even(residual, &by) } else { Row::Bound(residual, &by) });
            };
            if self.support[i].is_empty() {
                [DVec3::X, DVec3::Y, DVec3::Z].into_iter().for_each(|axis| row(fall, axis, true));
                continue;
            }
            [DVec3::X, DVec3::Y].into_iter().for_each(|axis| row(effort, axis, true));
            row(law, DVec3::Z, false);
            for side in [DVec3::X, -DVec3::X, DVec3::Y, -DVec3::Y] {
                row(law, FRICTION * DVec3::Z + side, false);
            }
        }
    }
}
