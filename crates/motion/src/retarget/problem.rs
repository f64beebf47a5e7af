//! Inverse kinematics as one least-squares problem over all frames, by the Levenberg-Marquardt method.

use super::band::Band;
use super::mapping::Mapping;
use super::target::Target;
use crate::ground::Touch;
use crate::kinematics::Pose;
use crate::rotation::{exp, log, quat, wxyz};
use crate::self_collision::CapsulePair;
use glam::DVec3;
use marathon_physics::Model;
use marathon_physics::model::JointType;

/// Weights of the terms that the mapping does not define. Orientations have 1/rad.
mod weight {
    /// Point between the hips, 1/m: horizontal, and vertical.
    pub const HIPS: [f64; 2] = [3.0, 6.0];
    /// Joint beyond its limit, 1/rad or 1/m.
    pub const LIMIT: f64 = 100.0;
    /// Depth below the ground, and height of held soles, 1/m.
    pub const GROUND: f64 = 150.0;
    /// Sliding of held soles per step, 1/m.
    pub const SLIDE: f64 = 120.0;
    /// Depth of overlapping parts, 1/m.
    pub const APART: f64 = 60.0;
    /// Joint's distance from its reference, 1/rad: decides only between otherwise equal poses.
    pub const REST: f64 = 0.02;
    /// Accelerations, s^2: motions faster than about 12 Hz are noise.
    pub const SMOOTH: f64 = 1.8e-4;
    /// Joint velocities, s: joints without a target do not move.
    pub const STILL: f64 = 0.004;
}
/// Distance that joints keep from their limits, rad or m, because the penalty is soft.
const LIMIT_MARGIN: f64 = 0.01;
/// Distance below which ground and parts are taken into account, m.
const NEAR: f64 = 0.1;
/// Maximum number of repetitions of a step that crosses bounds.
const CROSSINGS: usize = 4;
/// Distance between parts, m.
const APART_MARGIN: f64 = 0.005;

/// Consecutive frames, their targets, and their ground contacts.
#[derive(Clone, Copy)]
pub(super) struct Problem<'a> {
    pub model: &'a Model,
    pub mapping: &'a Mapping,
    pub touches: &'a [Touch],
    pub capsule_pairs: &'a [CapsulePair],
    pub targets: &'a [Target],
    /// Per frame and touch: whether it is held.
    pub held: &'a [Vec<bool>],
    /// Per frame: support points. Empty if the center of mass is free.
    pub support: &'a [Vec<DVec3>],
    /// Seconds between frames.
    pub dt: f64,
    /// Factor on the weights of velocities and accelerations.
    pub calm: f64,
}

/// A residual, and its derivatives with respect to the variables, `frame * nv + dof`.
pub(super) enum Row<'r> {
    /// The cost is its square.
    Even(f64, &'r [(usize, f64)]),
    /// The cost is its square while it is negative: the distance to a forbidden region.
    Bound(f64, &'r [(usize, f64)]),
}

pub(super) type Sink<'s> = dyn FnMut(Row) + 's;

/// A stored [`Row::Bound`].
struct Bound {
    residual: f64,
    by: Vec<(usize, f64)>,
    active: bool,
}

/// The sum of squares near the current frames, as a quadratic function of their change.
struct Quadratic {
    matrix: Band,
    slope: Vec<f64>,
    bounds: Vec<Bound>,
}

impl Quadratic {
    fn add(&mut self, residual: f64, by: &[(usize, f64)]) {
        for (k, (i, a)) in by.iter().enumerate() {
            self.slope[*i] -= a * residual;
            by[..=k].iter().for_each(|(j, b)| self.matrix.add(*i, *j, a * b));
        }
    }

    /// The change that minimizes it. A bound that the change would cross becomes active.
    fn step(&self, damping: f64) -> Option<Vec<f64>> {
        let mut active: Vec<bool> = self.bounds.iter().map(|bound| bound.active).collect();
        for round in 0.. {
            let mut sum = Quadratic { matrix: self.matrix.clone(), slope: self.slope.clone(), bounds: Vec::new() };
            for (bound, _) in self.bounds.iter().zip(&active).filter(|(_, active)| **active) {
                sum.add(bound.residual, &bound.by);
            }
            if !sum.matrix.solve(damping, &mut sum.slope) {
                return None;
            }
            let mut crossed = false;
            for (bound, active) in self.bounds.iter().zip(&mut active).filter(|(_, active)| !**active) {
                let there = bound.residual + bound.by.iter().map(|(i, a)| a * sum.slope[*i]).sum::<f64>();
                *active = there < 0.0;
                crossed |= *active;
            }
            if !crossed || round == CROSSINGS {
                return Some(sum.slope);
            }
        }
        None
    }
}

impl Problem<'_> {
    /// Improves the frames. Returns the remaining sum of squares.
    pub fn solve(&self, frames: &mut [Vec<f64>], iterations: usize) -> f64 {
        let nv = self.model.nv;
        let size = frames.len() * nv;
        let (mut cost, mut damping) = (self.cost(frames), 1e-3);
        for _ in 0..iterations {
            let matrix = Band::new(size, (3 * nv).min(size.max(1)));
            let mut near = Quadratic { matrix, slope: vec![0.0; size], bounds: Vec::new() };
            self.rows(frames, &mut |row| match row {
                Row::Even(residual, by) => near.add(residual, by),
                Row::Bound(residual, by) => {
                    near.bounds.push(Bound { residual, by: by.to_vec(), active: residual < 0.0 });
                }
            });
            let before = cost;
            for _ in 0..10 {
                if let Some(step) = near.step(damping) {
                    let tried: Vec<Vec<f64>> =
                        frames.iter().zip(step.chunks(nv)).map(|(frame, step)| self.moved(frame, step)).collect();
                    let there = self.cost(&tried);
                    if there < cost {
                        frames.clone_from_slice(&tried);
                        cost = there;
                        damping = (damping / 5.0).max(1e-9);
                        break;
                    }
                }
                damping *= 5.0;
            }
            if cost > before * (1.0 - 1e-4) {
                break;
            }
        }
        cost
    }

    fn cost(&self, frames: &[Vec<f64>]) -> f64 {
        let mut cost = 0.0;
        self.rows(frames, &mut |row| match row {
            Row::Even(residual, _) => cost += residual * residual,
            Row::Bound(residual, _) => cost += residual.min(0.0) * residual.min(0.0),
        });
        cost
    }

    /// Moves a pose along its degrees of freedom. Free and ball joints rotate about the world's axes.
    fn moved(&self, qpos: &[f64], step: &[f64]) -> Vec<f64> {
        let mut out = qpos.to_vec();
        let mut pose = None;
        for joint in &self.model.joints {
            let (k, v) = (joint.qpos_adr, joint.dof_adr);
            match joint.kind {
                JointType::Free => {
                    (0..3).for_each(|i| out[k + i] += step[v + i]);
                    let turned = exp(limited(DVec3::from_slice(&step[v + 3..]))) * quat(&qpos[k + 3..]);
                    out[k + 3..k + 7].copy_from_slice(&wxyz(turned.normalize()));
                }
                JointType::Ball => {
                    let pose = pose.get_or_insert_with(|| Pose::of(self.model, qpos));
                    let local = pose.quat[joint.body].conjugate() * limited(DVec3::from_slice(&step[v..]));
                    out[k..k + 4].copy_from_slice(&wxyz((quat(&qpos[k..]) * exp(local)).normalize()));
                }
                JointType::Hinge => out[k] += step[v].clamp(-1.0, 1.0),
                JointType::Slide => out[k] += step[v],
            }
        }
        out
    }

    /// All residuals.
    fn rows(&self, frames: &[Vec<f64>], sink: &mut Sink) {
        let poses: Vec<Pose> = frames.iter().map(|frame| Pose::of(self.model, frame)).collect();
        for i in 0..frames.len() {
            self.pose_rows(i, &poses[i], sink);
            self.joint_rows(i, &frames[i], sink);
            self.ground_rows(i, &poses, sink);
            self.apart_rows(i, &poses[i], sink);
        }
        self.weight_rows(&poses, sink);
        self.balance_rows(&poses, sink);
        for i in 1..frames.len() {
            self.still_rows(i, &frames[i - 1], &frames[i], sink);
        }
        for i in 1..frames.len().saturating_sub(1) {
            self.smooth_rows(i, &frames[i - 1..=i + 1], sink);
        }
    }

    /// Orientations and positions of the parts and the hips.
    fn pose_rows(&self, i: usize, pose: &Pose, sink: &mut Sink) {
        let (target, base) = (&self.targets[i], i * self.model.nv);
        for (k, part) in self.mapping.parts.iter().enumerate() {
            let point = pose.point(part.body, DVec3::from_array(part.local));
            if part.rotation > 0.0 {
                let error = log(target.quat[k] * pose.quat[part.body].conjugate());
                self.vector_rows(
                    pose,
                    part.body,
                    point,
                    base,
                    sink,
                    |turn, _| -turn,
                    part.rotation * error,
                    part.rotation,
                );
            }
            if part.position > 0.0 {
                let error = part.position * (target.pos[k] - point);
                self.vector_rows(pose, part.body, point, base, sink, |_, shift| -shift, error, part.position);
            }
        }
        let hips = self.mapping.hips.map(|hip| {
            let part = &self.mapping.parts[hip];
            (part.body, pose.point(part.body, DVec3::from_array(part.local)))
        });
        let error = target.hips - 0.5 * (hips[0].1 + hips[1].1);
        let mut by = vec![DVec3::ZERO; self.model.nv];
        for (body, point) in hips {
            pose.motions(self.model, body, point, |dof, _, shift| by[dof] -= 0.5 * shift);
        }
        let [along, up] = weight::HIPS;
        for (axis, weight) in [along, along, up].into_iter().enumerate() {
            let row: Vec<_> = by
                .iter()
                .enumerate()
                .filter(|(_, by)| by[axis] != 0.0)
                .map(|(dof, by)| (base + dof, weight * by[axis]))
                .collect();
            sink(Row::Even(weight * error[axis], &row));
        }
    }

    /// Three rows of a vector that depends on how one body moves.
    #[allow(clippy::too_many_arguments)]
    fn vector_rows(
        &self,
        pose: &Pose,
        body: usize,
        point: DVec3,
        base: usize,
        sink: &mut Sink,
        effect: impl Fn(DVec3, DVec3) -> DVec3,
        error: DVec3,
        weight: f64,
    ) {
        let mut rows: [Vec<(usize, f64)>; 3] = Default::default();
        pose.motions(self.model, body, point, |dof, turn, shift| {
            let by = weight * effect(turn, shift);
            (0..3).for_each(|axis| rows[axis].push((base + dof, by[axis])));
        });
        (0..3).for_each(|axis| sink(Row::Even(error[axis], &rows[axis])));
    }

    /// Limits, and the pull to the reference.
    fn joint_rows(&self, i: usize, qpos: &[f64], sink: &mut Sink) {
        for (k, joint) in self.model.joints.iter().enumerate() {
            if !matches!(joint.kind, JointType::Hinge | JointType::Slide) || self.is_root(k) {
                continue;
            }
            let (at, dof) = (qpos[joint.qpos_adr], i * self.model.nv + joint.dof_adr);
            sink(Row::Even(weight::REST * (at - self.model.qpos0[joint.qpos_adr]), &[(dof, weight::REST)]));
            let margin = LIMIT_MARGIN.min(0.1 * (joint.range[1] - joint.range[0]));
            if joint.limited {
                let [below, above] = [at - joint.range[0] - margin, joint.range[1] - margin - at];
                sink(Row::Bound(weight::LIMIT * below, &[(dof, weight::LIMIT)]));
                sink(Row::Bound(weight::LIMIT * above, &[(dof, -weight::LIMIT)]));
            }
        }
    }

    /// Whether a joint belongs to the first moving body, which moves the character through the world.
    fn is_root(&self, joint: usize) -> bool {
        self.model.joints[joint].body == self.model.joints[0].body
    }

    /// Keeps everything above the ground. Held soles touch it and do not slide.
    fn ground_rows(&self, i: usize, poses: &[Pose], sink: &mut Sink) {
        let (pose, nv) = (&poses[i], self.model.nv);
        let mut row = Vec::new();
        for (k, touch) in self.touches.iter().enumerate() {
            let lowest = touch.lowest(pose);
            let held = self.held[i][k];
            if held || lowest.z < NEAR {
                row.clear();
                pose.motions(self.model, touch.body, lowest, |dof, _, shift| {
                    row.push((i * nv + dof, weight::GROUND * shift.z));
                });
                let height = weight::GROUND * lowest.z;
                sink(if held { Row::Even(height, &row) } else { Row::Bound(height, &row) });
            }
            if held && i + 1 < poses.len() && self.held[i + 1][k] {
                // the body point that touches now, in the next frame
                let local = pose.quat[touch.body].conjugate() * (lowest - pose.pos[touch.body]);
                let there = poses[i + 1].point(touch.body, local);
                for axis in 0..2 {
                    row.clear();
                    pose.motions(self.model, touch.body, lowest, |dof, _, shift| {
                        row.push((i * nv + dof, -weight::SLIDE * shift[axis]));
                    });
                    poses[i + 1].motions(self.model, touch.body, there, |dof, _, shift| {
                        row.push(((i + 1) * nv + dof, weight::SLIDE * shift[axis]));
                    });
                    sink(Row::Even(weight::SLIDE * (there - lowest)[axis], &row));
                }
            }
        }
    }

    /// Keeps parts from overlapping.
    fn apart_rows(&self, i: usize, pose: &Pose, sink: &mut Sink) {
        for pair in self.capsule_pairs {
            let separation = pair.separation(pose);
            if separation.distance < NEAR {
                let mut row = vec![0.0; self.model.nv];
                for (k, sign) in [(0, 1.0), (1, -1.0)] {
                    pose.motions(self.model, separation.bodies[k], separation.points[k], |dof, _, shift| {
                        row[dof] += weight::APART * sign * separation.normal.dot(shift);
                    });
                }
                let row: Vec<_> = row
                    .iter()
                    .enumerate()
                    .filter(|(_, by)| **by != 0.0)
                    .map(|(dof, by)| (i * row.len() + dof, *by))
                    .collect();
                sink(Row::Bound(weight::APART * (separation.distance - APART_MARGIN), &row));
            }
        }
    }

    /// Velocities of the joints between two frames.
    fn still_rows(&self, i: usize, before: &[f64], now: &[f64], sink: &mut Sink) {
        let (nv, scale) = (self.model.nv, self.calm * weight::STILL / self.dt);
        for (k, joint) in self.model.joints.iter().enumerate() {
            if matches!(joint.kind, JointType::Hinge | JointType::Slide) && !self.is_root(k) {
                let by = [((i - 1) * nv + joint.dof_adr, -scale), (i * nv + joint.dof_adr, scale)];
                sink(Row::Even(scale * (now[joint.qpos_adr] - before[joint.qpos_adr]), &by));
            }
        }
    }

    /// Accelerations between three frames.
    fn smooth_rows(&self, i: usize, frames: &[Vec<f64>], sink: &mut Sink) {
        let nv = self.model.nv;
        let scale = self.calm * weight::SMOOTH / (self.dt * self.dt);
        let [a, b, c] = [&frames[0], &frames[1], &frames[2]];
        let mut row = |value: f64, dof: usize| {
            let by = [((i - 1) * nv + dof, scale), (i * nv + dof, -2.0 * scale), ((i + 1) * nv + dof, scale)];
            sink(Row::Even(scale * value, &by));
        };
        for joint in &self.model.joints {
            let (k, v) = (joint.qpos_adr, joint.dof_adr);
            let mut turns = |k: usize, v: usize| {
                let [a, b, c] = [a, b, c].map(|q| quat(&q[k..]));
                let bend = log(c * b.conjugate()) - log(b * a.conjugate());
                (0..3).for_each(|axis| row(bend[axis], v + axis));
            };
            match joint.kind {
                JointType::Free => {
                    turns(k + 3, v + 3);
                    (0..3).for_each(|i| row(a[k + i] - 2.0 * b[k + i] + c[k + i], v + i));
                }
                JointType::Ball => turns(k, v),
                JointType::Hinge | JointType::Slide => row(a[k] - 2.0 * b[k] + c[k], v),
            }
        }
    }
}

/// Limits a rotation vector to one radian.
fn limited(turn: DVec3) -> DVec3 {
    turn.clamp_length_max(1.0)
}
