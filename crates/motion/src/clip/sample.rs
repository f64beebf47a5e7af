//! Positions and velocities at any time.

use super::Clip;
use crate::layout::JointKind;
use crate::rotation::{log, quat, slerp, wxyz};
use glam::DVec3;

/// A time between two frames.
struct Moment {
    /// The frame before, within the clip.
    frame: usize,
    /// Fraction of the way to the next frame, 0 to 1.
    share: f64,
    /// Number of completed cycles.
    cycle: i64,
}

impl Clip {
    /// Length of the clip, or of one cycle, s.
    pub fn duration(&self) -> f64 {
        (self.frames() - usize::from(self.cycle.is_none())) as f64 * self.dt
    }

    /// Phase of the clip or of its cycle at a time: 0 to 1.
    pub fn phase(&self, time: f64) -> f64 {
        let share = time / self.duration();
        if self.cycle.is_some() { share - libm::floor(share) } else { share.clamp(0.0, 1.0) }
    }

    /// Whether a clip that does not loop has ended.
    pub fn is_over(&self, time: f64) -> bool {
        self.cycle.is_none() && time > self.duration()
    }

    /// `qpos` at a time, s. A looping clip continues in both directions. Any other clip stays at its first and last
    /// frame.
    ///
    /// # Panics
    /// If the length of `out` is not `nq`.
    pub fn qpos(&self, time: f64, out: &mut [f64]) {
        assert_eq!(out.len(), self.layout.nq(), "qpos has the length nq");
        let moment = self.moment(time);
        let after = self.frame_at(moment.frame as i64 + 1);
        self.blend(self.frame(moment.frame), &after, moment.share, out);
        if let Some(cycle) = &self.cycle {
            cycle.advance(&self.layout, out, moment.cycle);
        }
    }

    /// `qvel` at a time. A free joint has its linear velocity in the world's axes, m/s, and its angular velocity in the
    /// body's axes, rad/s. All velocities are zero before and after a clip that does not loop.
    ///
    /// # Panics
    /// If the length of `out` is not `nv`.
    pub fn qvel(&self, time: f64, out: &mut [f64]) {
        assert_eq!(out.len(), self.layout.nv(), "qvel has the length nv");
        if self.cycle.is_none() && !(0.0..=self.duration()).contains(&time) {
            out.fill(0.0);
            return;
        }
        let moment = self.moment(time);
        let mut before = self.velocity(moment.frame).to_vec();
        let mut after = self.velocity((moment.frame + 1) % self.frames()).to_vec();
        self.turn(&mut before, moment.cycle);
        self.turn(&mut after, moment.cycle + i64::from(moment.frame + 1 == self.frames()));
        for ((out, a), b) in out.iter_mut().zip(before).zip(after) {
            *out = a + moment.share * (b - a);
        }
    }

    /// `qacc` of a frame: the central difference of the neighboring velocities, in the layout of `qvel`. It is
    /// one-sided at the ends of a clip that does not loop.
    ///
    /// # Panics
    /// If there is no such frame.
    pub fn acceleration(&self, frame: usize) -> Vec<f64> {
        let (count, last) = (self.frames(), self.frames() - 1);
        let beside = |by: i64| {
            let at = frame as i64 + by;
            let at = if self.cycle.is_some() { at } else { at.clamp(0, last as i64) };
            let mut velocity = self.velocity(at.rem_euclid(count as i64) as usize).to_vec();
            self.turn(&mut velocity, at.div_euclid(count as i64));
            (at, velocity)
        };
        let ((from, before), (to, after)) = (beside(-1), beside(1));
        let seconds = (to - from) as f64 * self.dt;
        before.iter().zip(&after).map(|(before, after)| (after - before) / seconds).collect()
    }

    /// Rotates the linear velocity of a free root with the cycles. Its angular velocity is in body axes.
    pub(super) fn turn(&self, qvel: &mut [f64], cycles: i64) {
        if let (Some(cycle), Some(JointKind::Free)) = (self.cycle, self.layout.joints.first().map(|joint| joint.kind)) {
            let turned = crate::rotation::about_z(cycle.yaw * cycles as f64) * DVec3::from_slice(qvel);
            qvel[..3].copy_from_slice(&turned.to_array());
        }
    }

    fn moment(&self, time: f64) -> Moment {
        let count = self.frames() as i64;
        let at = if time.is_finite() { time / self.dt } else { 0.0 };
        match self.cycle {
            Some(_) => {
                let frame = libm::floor(at);
                let (whole, share) = (frame as i64, at - frame);
                Moment { frame: whole.rem_euclid(count) as usize, share, cycle: whole.div_euclid(count) }
            }
            None => {
                let frame = (libm::floor(at) as i64).clamp(0, count - 2);
                Moment { frame: frame as usize, share: (at - frame as f64).clamp(0.0, 1.0), cycle: 0 }
            }
        }
    }

    /// A frame of the endless motion. Frames of looping clips are moved by their cycles; others stay at the ends.
    pub(crate) fn frame_at(&self, frame: i64) -> Vec<f64> {
        let count = self.frames() as i64;
        match &self.cycle {
            Some(cycle) => {
                let mut qpos = self.frame(frame.rem_euclid(count) as usize).to_vec();
                cycle.advance(&self.layout, &mut qpos, frame.div_euclid(count));
                qpos
            }
            None => self.frame(frame.clamp(0, count - 1) as usize).to_vec(),
        }
    }

    /// Interpolates between two poses.
    fn blend(&self, a: &[f64], b: &[f64], share: f64, out: &mut [f64]) {
        for (k, out) in out.iter_mut().enumerate() {
            *out = a[k] + share * (b[k] - a[k]);
        }
        for (_, k) in super::quaternions(&self.layout) {
            out[k..k + 4].copy_from_slice(&wxyz(slerp(quat(&a[k..]), quat(&b[k..]), share)));
        }
    }

    /// Computes velocities at the frames: central differences, one-sided at the ends of a clip that does not loop.
    pub(super) fn differentiate(&mut self) {
        let mut velocities = Vec::with_capacity(self.frames() * self.layout.nv());
        for i in 0..self.frames() as i64 {
            let (mut before, mut after) = (i - 1, i + 1);
            if self.cycle.is_none() {
                (before, after) = (before.max(0), after.min(self.frames() as i64 - 1));
            }
            let seconds = (after - before) as f64 * self.dt;
            let (a, here, b) = (self.frame_at(before), self.frame_at(i), self.frame_at(after));
            velocities.extend(self.difference(&a, &here, &b, seconds));
        }
        self.velocities = velocities;
    }

    /// The velocity from `a` to `b`, with angular velocities in the body axes of `here`.
    fn difference(&self, a: &[f64], here: &[f64], b: &[f64], seconds: f64) -> Vec<f64> {
        let angular = |k: usize| {
            let [from, middle, to] = [a, here, b].map(|qpos| quat(&qpos[k..]).normalize());
            let world = from * log(from.conjugate() * to) / seconds;
            (middle.conjugate() * world).to_array()
        };
        let mut qvel = Vec::with_capacity(self.layout.nv());
        for joint in &self.layout.joints {
            let k = joint.qpos;
            match joint.kind {
                JointKind::Free => {
                    qvel.extend((k..k + 3).map(|k| (b[k] - a[k]) / seconds));
                    qvel.extend(angular(k + 3));
                }
                JointKind::Ball => qvel.extend(angular(k)),
                JointKind::Slide | JointKind::Hinge => qvel.push((b[k] - a[k]) / seconds),
            }
        }
        qvel
    }
}
