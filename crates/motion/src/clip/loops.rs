//! Search for the part of a motion that repeats best.

use std::path::Path;

use super::Clip;
use crate::error::MotionError;
use crate::layout::JointKind;
use crate::rotation::{about_z, heading, quat, wxyz};

/// Frame rate of the search, Hz.
const RATE: f64 = 60.0;
/// Most frames that are compared. Longer motions are searched at a lower rate.
const MOST_FRAMES: usize = 36_000;
/// Shortest and longest loop, s. A cycle of a fast run takes 0.6 s.
const LENGTHS: [f64; 2] = [0.3, 4.0];
/// Frames before and after two poses that are compared too, so that the velocities are alike.
const MARGIN: usize = 3;
/// Weight of the squared difference of heights, 1/m^2. 5 cm weigh as much as 0.2 rad in all joints.
const HEIGHT: f64 = 4.0;

impl Clip {
    /// The part whose ends are most alike in pose and velocity, whatever their places and headings: its start and its end, s.
    /// It takes 0.3 to 4 s.
    ///
    /// # Errors
    /// If the clip is shorter than the shortest loop.
    pub fn best_loop(&self, path: &Path) -> Result<[f64; 2], MotionError> {
        let stride = libm::round(1.0 / (RATE * self.dt)).max(self.frames() as f64 / MOST_FRAMES as f64);
        let stride = (libm::ceil(stride) as usize).max(1);
        let poses: Vec<Vec<f64>> = (0..self.frames()).step_by(stride).map(|frame| self.comparable(frame)).collect();
        let [shortest, longest] = LENGTHS.map(|seconds| libm::ceil(seconds / (stride as f64 * self.dt)) as usize);
        let last = poses.len() - 1;
        let (mut best, mut found) = (f64::INFINITY, None);
        for length in shortest..=longest.min(last) {
            let gaps: Vec<f64> =
                (0..=last - length).map(|from| self.gap(&poses[from], &poses[from + length])).collect();
            for from in 0..gaps.len() {
                let around = &gaps[from.saturating_sub(MARGIN)..(from + MARGIN + 1).min(gaps.len())];
                let gap = around.iter().sum::<f64>() / around.len() as f64;
                // of equally good loops, the shortest and first one
                if gap < best - 1e-9 {
                    (best, found) = (gap, Some([from, from + length]));
                }
            }
        }
        let short = || {
            let expected = format!("at least {} s, to find a loop", LENGTHS[0]);
            MotionError::value(path, "duration", format!("{:.2} s", self.duration()), expected)
        };
        Ok(found.ok_or_else(short)?.map(|frame| (frame * stride) as f64 * self.dt))
    }

    /// A frame without its place and heading.
    fn comparable(&self, frame: usize) -> Vec<f64> {
        let mut pose = self.frame(frame).to_vec();
        if self.layout.joints[0].kind == JointKind::Free {
            pose[..2].fill(0.0);
            let q = quat(&pose[3..]);
            pose[3..7].copy_from_slice(&wxyz(about_z(-heading(q)) * q));
        }
        pose
    }

    /// Mean squared difference of two such frames: of rotations, the squared sine of half their angle.
    fn gap(&self, a: &[f64], b: &[f64]) -> f64 {
        let turned = |i: usize| {
            let dot: f64 = (i..i + 4).map(|k| a[k] * b[k]).sum();
            1.0 - dot * dot
        };
        let of_joint = |kind: JointKind, i: usize| match kind {
            JointKind::Free => turned(i + 3) + HEIGHT * (a[i + 2] - b[i + 2]).powi(2),
            JointKind::Ball => turned(i),
            JointKind::Slide => (a[i] - b[i]).powi(2),
            JointKind::Hinge => libm::sin(0.5 * (a[i] - b[i])).powi(2),
        };
        let joints = &self.layout.joints;
        joints.iter().map(|joint| of_joint(joint.kind, joint.qpos)).sum::<f64>() / joints.len() as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{About, Layout};

    /// A figure that travels and turns, with one joint that follows `angle`.
    fn clip(seconds: f64, dt: f64, angle: impl Fn(f64) -> f64) -> Clip {
        let layout = Layout::new([("root".into(), JointKind::Free), ("hip".into(), JointKind::Hinge)]);
        let row = |i: usize| {
            let t = i as f64 * dt;
            let [w, x, y, z] = wxyz(about_z(0.3 * t));
            vec![1.2 * t, 0.1 * t, 1.0, w, x, y, z, angle(t)]
        };
        let rows: Vec<Vec<f64>> = (0..=(seconds / dt) as usize).map(row).collect();
        Clip::new(Path::new("test"), About::default(), layout, dt, None, &rows).unwrap()
    }

    #[test]
    fn the_cycle_of_a_gait_is_found_among_other_movements() {
        // 1.1 s per cycle from 2 to 5 s, and a movement that does not repeat before
        let angle =
            |t: f64| if t < 2.0 { 0.4 * t * t } else { 1.6 + 0.6 * libm::sin(std::f64::consts::TAU * (t - 2.0) / 1.1) };
        for dt in [1.0 / 120.0, 1.0 / 60.0, 1.0 / 30.0] {
            let [from, to] = clip(5.0, dt, angle).best_loop(Path::new("test")).unwrap();
            assert!(from >= 1.9 && (to - from - 1.1).abs() < 0.6 * dt.max(1.0 / 60.0), "{from} to {to} s");
        }
    }

    /// Poses are alike at the turning points of a swing, and half a cycle apart in its middle, but velocities are not.
    #[test]
    fn the_velocities_at_the_ends_are_alike() {
        let [from, to] =
            clip(1.9, 1.0 / 60.0, |t| libm::sin(std::f64::consts::TAU * t)).best_loop(Path::new("test")).unwrap();
        assert!((to - from - 1.0).abs() < 1e-9, "{from} to {to} s");
    }

    #[test]
    fn a_short_motion_has_no_loop() {
        let error = clip(0.2, 1.0 / 60.0, |t| t).best_loop(Path::new("kick.bvh")).unwrap_err().to_string();
        assert!(error.contains("kick.bvh") && error.contains("at least 0.3 s"), "{error}");
    }
}
