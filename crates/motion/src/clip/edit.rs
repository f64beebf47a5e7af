//! Edits of a clip: trim, loop, resample, smooth, mirror, move.

use super::{Clip, Cycle, quaternions};
use crate::error::MotionError;
use crate::layout::{JointKind, Layout};
use crate::limits;
use crate::rotation::{about_z, cubic, exp, heading, hermite, log, quat, wxyz};
use glam::{DQuat, DVec3};
use marathon_physics::Model;
use marathon_physics::hint::{did_you_mean, nearest};
use marathon_physics::model::JointType;
use std::path::Path;

impl Clip {
    /// Cuts out the part from one time to another, s, to the nearest frames. It does not loop.
    ///
    /// # Errors
    /// If fewer than two frames would remain.
    pub fn trim(&self, path: &Path, from: f64, to: f64) -> Result<Self, MotionError> {
        let last = if self.cycle.is_some() { self.frames() } else { self.frames() - 1 };
        let frame = |time: f64| libm::round(time / self.dt).clamp(0.0, last as f64) as i64;
        let (from_frame, to_frame) = (frame(from), frame(to));
        if from_frame >= to_frame {
            let expected = format!("two or more frames between 0 and {:.3} s", self.duration());
            return Err(MotionError::value(path, "trim", format!("{from} to {to} s"), expected));
        }
        let rows: Vec<Vec<f64>> = (from_frame..=to_frame).map(|frame| self.frame_at(frame)).collect();
        self.rebuilt(path, self.dt, None, &rows)
    }

    /// Creates a loop from a clip whose last frame repeats the first one, farther on. The difference between both
    /// frames, other than the travel, is spread over the clip's last `blend` seconds. A turn of less than 0.4 rad is
    /// also spread, because recordings of straight walks do not end exactly in the starting direction.
    ///
    /// # Errors
    /// If there are fewer than three frames, the last of which repeats the first, or the travel exceeds the limits of a
    /// clip.
    pub fn looped(&self, path: &Path, blend: f64) -> Result<Self, MotionError> {
        if self.frames() < 3 {
            let expected = "three or more, of which the last repeats the first";
            return Err(MotionError::value(path, "frames of a loop", self.frames(), expected));
        }
        let mut cycle = Cycle::between(&self.layout, self.frame(0), self.frame(self.frames() - 1));
        if cycle.yaw.abs() < 0.4 && self.layout.joints[0].kind == JointKind::Free {
            let (a, b) = (self.frame(0), self.frame(self.frames() - 1));
            cycle = Cycle { pos: [b[0] - a[0], b[1] - a[1]], yaw: 0.0 };
        }
        self.joined(path, cycle, blend)
    }

    /// Creates a loop from a clip whose last frame repeats the first one after this cycle, up to rounding errors.
    pub(crate) fn closed(&self, path: &Path, cycle: Cycle) -> Result<Self, MotionError> {
        self.joined(path, cycle, self.duration())
    }

    fn joined(&self, path: &Path, cycle: Cycle, blend: f64) -> Result<Self, MotionError> {
        let count = self.frames() - 1;
        let mut rows = self.rows();
        let mut target = rows[0].clone();
        cycle.advance(&self.layout, &mut target, 1);
        let end = rows[count].clone();
        let window = (blend / self.dt).clamp(1.0, count as f64);
        for (i, row) in rows.iter_mut().enumerate() {
            let s = (1.0 - (count - i) as f64 / window).clamp(0.0, 1.0);
            // over a whole cycle a steady correction is least visible; over a part of it, a smooth one
            let share = if blend < self.duration() { s * s * (3.0 - 2.0 * s) } else { s };
            for k in 0..row.len() {
                row[k] += share * (target[k] - end[k]);
            }
            for (_, k) in quaternions(&self.layout) {
                let error = quat(&target[k..]) * quat(&end[k..]).conjugate();
                let q = exp(share * log(error)) * quat(&self.frame(i)[k..]);
                row[k..k + 4].copy_from_slice(&wxyz(q));
            }
        }
        rows.pop();
        self.rebuilt(path, self.dt, Some(cycle), &rows)
    }

    /// Resamples the motion with another step between frames, by cubic interpolation. A looping clip keeps its length,
    /// so its step is the nearest one that divides the length.
    ///
    /// # Errors
    /// If the step is not between 0.0001 s and half of the clip, or the result would exceed the memory limit.
    pub fn resample(&self, path: &Path, dt: f64) -> Result<Self, MotionError> {
        let duration = self.duration();
        let steps = libm::round(duration / dt);
        if !(1e-4..=10.0).contains(&dt) {
            return Err(MotionError::value(path, "dt", dt, "a step from 0.0001 to 10 s"));
        }
        if !(steps >= 2.0) {
            let found = format!("{} frames, {duration:.4} s", self.frames());
            let rate = libm::ceil(2.0 / duration);
            let expected = format!("two steps of {dt:.4} s or more; a rate of {rate} frames per second has two steps");
            return Err(MotionError::value(path, "length", found, expected));
        }
        limits::check_frames(path, steps, self.layout.nq() + self.layout.nv())?;
        let dt = duration / steps;
        let count = steps as usize + usize::from(self.cycle.is_none());
        let rows: Vec<Vec<f64>> = (0..count).map(|i| self.cubic_at(i as f64 * dt)).collect();
        self.rebuilt(path, dt, self.cycle, &rows)
    }

    /// `qpos` on the cubic spline through the frames, at a time within the clip.
    fn cubic_at(&self, time: f64) -> Vec<f64> {
        let last = self.frames() - usize::from(self.cycle.is_none());
        // rounding must not lead beyond the last frame
        let i = (libm::floor(time / self.dt + 1e-9) as usize).min(last - 1);
        let s = (time / self.dt - i as f64).clamp(0.0, 1.0);
        let (a, b) = (self.frame(i), self.frame_at(i as i64 + 1));
        let mut end = self.velocity((i + 1) % self.frames()).to_vec();
        self.turn(&mut end, i64::from(i + 1 == self.frames()));
        let start = self.velocity(i);
        let [wa, wb, wu, wv] = hermite(s);
        let mut out = vec![0.0; a.len()];
        for joint in &self.layout.joints {
            let (k, v) = (joint.qpos, joint.qvel);
            let linear = |k: usize, v: usize| wa * a[k] + wb * b[k] + self.dt * (wu * start[v] + wv * end[v]);
            let angular = |k: usize, v: usize| {
                let velocities = [DVec3::from_slice(&start[v..]), DVec3::from_slice(&end[v..])];
                wxyz(cubic(quat(&a[k..]), quat(&b[k..]), velocities, self.dt, s))
            };
            match joint.kind {
                JointKind::Free => {
                    for i in 0..3 {
                        out[k + i] = linear(k + i, v + i);
                    }
                    out[k + 3..k + 7].copy_from_slice(&angular(k + 3, v + 3));
                }
                JointKind::Ball => out[k..k + 4].copy_from_slice(&angular(k, v)),
                JointKind::Slide | JointKind::Hinge => out[k] = linear(k, v),
            }
        }
        out
    }

    /// Filters the motion with a Gaussian of this standard deviation, s. The ends of a clip that does not loop stay
    /// fixed.
    ///
    /// # Errors
    /// If a loop's neighboring cycles exceed the limits of a clip.
    pub fn smooth(&self, path: &Path, seconds: f64) -> Result<Self, MotionError> {
        let sigma = seconds / self.dt;
        if !(sigma > 1e-3) {
            return Ok(self.clone());
        }
        let reach = libm::ceil(3.0 * sigma) as i64;
        let count = self.frames() as i64;
        let rows: Vec<Vec<f64>> = (0..count)
            .map(|i| {
                // at the ends of a clip the window narrows to stay symmetric
                let reach = if self.cycle.is_some() { reach } else { reach.min(i).min(count - 1 - i) };
                let weights: Vec<f64> =
                    (-reach..=reach).map(|k| libm::exp(-0.5 * (k as f64 / sigma).powi(2))).collect();
                let total: f64 = weights.iter().sum();
                let middle = self.frame(i as usize);
                let mut row = middle.to_vec();
                for (weight, k) in weights.iter().zip(-reach..=reach) {
                    let frame = self.frame_at(i + k);
                    for (out, (there, here)) in row.iter_mut().zip(frame.iter().zip(middle)) {
                        *out += weight / total * (there - here);
                    }
                }
                for (_, at) in quaternions(&self.layout) {
                    let here = quat(&middle[at..]);
                    let mean: DVec3 = (weights.iter().zip(-reach..=reach))
                        .map(|(w, k)| w / total * log(here.conjugate() * quat(&self.frame_at(i + k)[at..])))
                        .sum();
                    row[at..at + 4].copy_from_slice(&wxyz(here * exp(mean)));
                }
                row
            })
            .collect();
        self.rebuilt(path, self.dt, self.cycle, &rows)
    }

    /// Mirrors the motion at the world's x-z plane: left and right are exchanged.
    ///
    /// # Errors
    /// If the clip is for another model, or the model is not symmetric. A joint with "left" in its name needs a partner
    /// with "right" whose axis is the mirror image. The axis of any other joint must be its own mirror image.
    pub fn mirror(&self, path: &Path, model: &Model) -> Result<Self, MotionError> {
        self.check_model(path, model)?;
        let partners = partners(path, model)?;
        let rows: Vec<Vec<f64>> = self
            .rows()
            .iter()
            .map(|row| {
                let mut out = row.clone();
                for (joint, (partner, sign)) in self.layout.joints.iter().zip(&partners) {
                    let (from, to) = (joint.qpos, self.layout.joints[*partner].qpos);
                    let mirrored = |k: usize| [row[k], -row[k + 1], row[k + 2], -row[k + 3]];
                    match joint.kind {
                        JointKind::Free => {
                            out[to..to + 3].copy_from_slice(&[row[from], -row[from + 1], row[from + 2]]);
                            out[to + 3..to + 7].copy_from_slice(&mirrored(from + 3));
                        }
                        JointKind::Ball => out[to..to + 4].copy_from_slice(&mirrored(from)),
                        JointKind::Slide | JointKind::Hinge => out[to] = sign * row[from],
                    }
                }
                out
            })
            .collect();
        let cycle = self.cycle.map(|Cycle { pos: [x, y], yaw }| Cycle { pos: [x, -y], yaw: -yaw });
        self.rebuilt(path, self.dt, cycle, &rows)
    }

    /// Moves the motion to start at the world's origin with the heading +x. Heights stay.
    ///
    /// If the first joint slides, it starts at 0.
    ///
    /// # Errors
    /// If the moved motion exceeds the limits of a clip.
    pub fn at_origin(&self, path: &Path) -> Result<Self, MotionError> {
        let first = self.frame(0);
        let (turn, start) = match self.layout.joints.first().map(|joint| joint.kind) {
            Some(JointKind::Free) => (-heading(quat(&first[3..])), DVec3::new(first[0], first[1], 0.0)),
            Some(JointKind::Slide) => (0.0, DVec3::new(first[0], 0.0, 0.0)),
            _ => return Ok(self.clone()),
        };
        let place = |row: &mut Vec<f64>| match self.layout.joints[0].kind {
            JointKind::Free => {
                let pos = about_z(turn) * (DVec3::from_slice(row) - start);
                row[..3].copy_from_slice(&pos.to_array());
                let turned = about_z(turn) * quat(&row[3..]);
                row[3..7].copy_from_slice(&wxyz(turned));
            }
            _ => row[0] -= start.x,
        };
        let mut rows = self.rows();
        rows.iter_mut().for_each(place);
        let cycle = self.cycle.map(|_| {
            let mut next = self.frame_at(self.frames() as i64);
            place(&mut next);
            Cycle::between(&self.layout, &rows[0], &next)
        });
        self.rebuilt(path, self.dt, cycle, &rows)
    }

    /// Moves the motion: the first body by `by`, as far as its joints allow.
    pub(crate) fn moved(&self, path: &Path, model: &Model, by: DVec3) -> Result<Self, MotionError> {
        let mut rows = self.rows();
        for joint in model.joints.iter().filter(|joint| joint.body == model.joints[0].body) {
            let k = joint.qpos_adr;
            for row in &mut rows {
                match joint.kind {
                    JointType::Free => (0..3).for_each(|i| row[k + i] += by[i]),
                    JointType::Slide => row[k] += DVec3::from_array(joint.axis).dot(by),
                    JointType::Ball | JointType::Hinge => {}
                }
            }
        }
        // the turns of a cycle are about the world's origin
        let cycle = self.cycle.map(|cycle| {
            let flat = by.with_z(0.0);
            let shift = flat - about_z(cycle.yaw) * flat;
            Cycle { pos: [cycle.pos[0] + shift.x, cycle.pos[1] + shift.y], yaw: cycle.yaw }
        });
        self.rebuilt(path, self.dt, cycle, &rows)
    }

    /// Rounds the clip's numbers to six decimals, as in files: a micrometer, a microradian.
    ///
    /// # Errors
    /// If rounding moves a value beyond the limits of a clip.
    pub fn rounded(&self, path: &Path) -> Result<Self, MotionError> {
        // adding zero turns -0 into 0
        let round = |value: f64| libm::round(value * 1e6) / 1e6 + 0.0;
        let rows: Vec<Vec<f64>> = self.rows().into_iter().map(|row| row.into_iter().map(round).collect()).collect();
        let cycle = self.cycle.map(|Cycle { pos, yaw }| Cycle { pos: pos.map(round), yaw: round(yaw) });
        self.rebuilt(path, self.dt, cycle, &rows)
    }
}

/// For each joint: its mirror joint, and the sign of the angle there (1 or -1).
fn partners(path: &Path, model: &Model) -> Result<Vec<(usize, f64)>, MotionError> {
    let layout = Layout::of(model);
    let names: Vec<&str> = layout.joints().map(|(name, _)| name).collect();
    let axes = rest_axes(model);
    let wrong = |problem: String| Err(MotionError::model(path, &model.name, problem));
    let mut partners = Vec::with_capacity(names.len());
    for (i, name) in names.iter().enumerate() {
        let other = swapped(name);
        let Some(partner) = names.iter().position(|name| *name == other) else {
            let hint = did_you_mean(nearest(&other, names.iter().copied()));
            return wrong(format!("joint {name:?} has no mirror image: there is no joint {other:?}{hint}"));
        };
        let kind = layout.joints[i].kind;
        if layout.joints[partner].kind != kind {
            return wrong(format!("joints {name:?} and {other:?} are of different kinds"));
        }
        let [x, y, z] = axes[i].to_array();
        // a mirror negates the image of a rotation axis
        let image = match kind {
            JointKind::Hinge => DVec3::new(-x, y, -z),
            _ => DVec3::new(x, -y, z),
        };
        let sign = match kind {
            JointKind::Free | JointKind::Ball => 1.0,
            JointKind::Hinge | JointKind::Slide => image.dot(axes[partner]),
        };
        if (sign.abs() - 1.0).abs() > 1e-3 {
            return wrong(format!("the axis of joint {other:?} is not the mirror image of that of {name:?}"));
        }
        partners.push((partner, sign.signum()));
    }
    Ok(partners)
}

/// Axes of the joints in the world's axes, in the reference pose.
fn rest_axes(model: &Model) -> Vec<DVec3> {
    let mut turns = vec![DQuat::IDENTITY; model.bodies.len()];
    for (i, body) in model.bodies.iter().enumerate().skip(1) {
        turns[i] = turns[body.parent] * quat(&body.quat);
    }
    model.joints.iter().map(|joint| turns[joint.body] * DVec3::from_array(joint.axis)).collect()
}

/// Exchanges left and right in a name.
fn swapped(name: &str) -> String {
    const SIDES: [(&str, &str); 6] =
        [("left", "right"), ("Left", "Right"), ("LEFT", "RIGHT"), ("_l_", "_r_"), ("_L_", "_R_"), (".L", ".R")];
    for (a, b) in SIDES {
        if name.contains(a) || name.contains(b) {
            return name.replace(a, "\0").replace(b, a).replace('\0', b);
        }
    }
    for (a, b) in [("_l", "_r"), ("_L", "_R")] {
        if let Some(stem) = name.strip_suffix(a) {
            return format!("{stem}{b}");
        }
        if let Some(stem) = name.strip_suffix(b) {
            return format!("{stem}{a}");
        }
    }
    name.into()
}
