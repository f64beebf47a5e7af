//! A motion of one model.

mod edit;
mod file;
mod loops;
mod sample;

use crate::error::MotionError;
use crate::layout::{JointKind, Layout};
use crate::rotation::{about_z, heading, quat, wrap_angle, wxyz};
use glam::DVec3;
use marathon_physics::Model;
use serde::Serialize;
use std::path::Path;

/// The largest number in a clip, m or rad. Larger ones are mistakes, and their differences would overflow.
const LARGEST: f64 = 1e6;

/// Origin of a clip.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct About {
    /// Name of the motion.
    pub name: String,
    /// Name of the model whose joints move.
    pub model: String,
    /// Author of the motion, and its source.
    pub source: String,
    /// License under which it may be used.
    pub license: String,
    /// The clip's distance from its source recording, if known.
    pub fit: Option<Nearness>,
}

/// Distance of a clip from its recording, as [`fit`](crate::fit) measures it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Nearness {
    /// Mean distance of the bodies, m.
    pub position: f64,
    /// Mean angle of the bodies, rad.
    pub rotation: f64,
}

/// Distance, m, and angle, rad, above which a clip no longer shows the recording's motion.
const FAR: f64 = 0.05;
const TURNED: f64 = 15.0 * std::f64::consts::PI / 180.0;

impl Nearness {
    /// A warning if the clip is too far from its recording.
    pub fn warning(&self) -> Option<String> {
        let (distance, degrees) = (1e2 * self.position, self.rotation.to_degrees());
        let far = self.position > FAR || self.rotation > TURNED;
        let text =
            || format!("its parts are {distance:.1} cm and {degrees:.0} degrees from the recording's on average");
        far.then(text)
    }
}

/// Displacement of a looping clip per cycle. Frame 0 of the next cycle is frame 0 rotated about the world's vertical
/// axis and then moved.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cycle {
    /// Displacement along the world's x and y, m.
    pub pos: [f64; 2],
    /// Rotation to the left, rad.
    pub yaw: f64,
}

/// A motion of one MJCF model: `qpos` at equal steps of time, in MuJoCo's layout.
///
/// A looping clip of `n` frames lasts `n dt`: its last frame is followed by the first one, moved by [`Cycle`]. Any
/// other clip lasts `(n - 1) dt`.
///
/// Between frames, positions are interpolated linearly, and quaternions along great arcs. Velocities are central
/// differences at the frames, interpolated linearly.
#[derive(Clone, Debug, PartialEq)]
pub struct Clip {
    about: About,
    layout: Layout,
    dt: f64,
    cycle: Option<Cycle>,
    /// `nq` numbers per frame.
    frames: Vec<f64>,
    /// `nv` numbers per frame.
    velocities: Vec<f64>,
}

impl Clip {
    /// Creates a clip from frames with `layout.nq()` numbers each, `dt` seconds apart. It loops if it has a cycle.
    /// Quaternions more than 1e-5 off unit length are normalized. Their sign is chosen to match the previous frame. The
    /// path is for messages.
    ///
    /// # Errors
    /// If there are fewer than two frames, a number is not finite, a quaternion is far from unit length, or the clip
    /// loops although its first joint cannot travel.
    pub fn new(
        path: &Path,
        about: About,
        layout: Layout,
        dt: f64,
        cycle: Option<Cycle>,
        frames: &[Vec<f64>],
    ) -> Result<Self, MotionError> {
        if !(1e-4..=10.0).contains(&dt) {
            return Err(MotionError::value(path, "dt", dt, "a number of seconds from 0.0001 to 10"));
        }
        if frames.len() < 2 {
            return Err(MotionError::value(path, "frames", frames.len(), "two or more"));
        }
        if let Some(cycle) = cycle {
            check_cycle(path, &cycle, &layout)?;
        }
        let mut all = Vec::with_capacity(frames.len() * layout.nq());
        for (i, frame) in frames.iter().enumerate() {
            if frame.len() != layout.nq() {
                let problem = format!("found {} numbers, expected {}, the joints' positions", frame.len(), layout.nq());
                return Err(MotionError::frame(path, i, problem));
            }
            if let Some(k) = frame.iter().position(|value| !(value.abs() <= LARGEST)) {
                let problem = format!("number {k} is {}, expected one from -{LARGEST} to {LARGEST}", frame[k]);
                return Err(MotionError::frame(path, i, problem));
            }
            let before = i.checked_sub(1).map(|i| all[i * layout.nq()..].to_vec());
            all.extend_from_slice(frame);
            for (joint, start) in quaternions(&layout) {
                let at = i * layout.nq() + start;
                let mut q = quat(&all[at..]);
                if !((q.length() - 1.0).abs() < 1e-2) {
                    let problem =
                        format!("the quaternion of {joint:?} is {:.3} long, expected unit length", q.length());
                    return Err(MotionError::frame(path, i, problem));
                }
                // keep quaternions that were rounded in a file
                if (q.length() - 1.0).abs() > 1e-5 {
                    q = q.normalize();
                }
                if before.as_ref().is_some_and(|before| q.dot(quat(&before[start..])) < 0.0) {
                    q = -q;
                }
                all[at..at + 4].copy_from_slice(&wxyz(q));
            }
        }
        let mut clip = Clip { about, layout, dt, cycle, frames: all, velocities: Vec::new() };
        clip.differentiate();
        Ok(clip)
    }

    /// Checks that the clip is for this model.
    ///
    /// # Errors
    /// If the model has other joints.
    pub fn check_model(&self, path: &Path, model: &Model) -> Result<(), MotionError> {
        self.layout.check(path, model)
    }

    /// Origin of the clip.
    pub fn about(&self) -> &About {
        &self.about
    }

    /// The same motion with another description.
    pub fn with_about(self, about: About) -> Self {
        Clip { about, ..self }
    }

    /// Joints whose positions the frames hold.
    pub fn layout(&self) -> &Layout {
        &self.layout
    }

    /// Seconds between frames.
    pub fn dt(&self) -> f64 {
        self.dt
    }

    /// Displacement per cycle. `None` if the clip does not loop.
    pub fn cycle(&self) -> Option<Cycle> {
        self.cycle
    }

    /// Number of frames.
    pub fn frames(&self) -> usize {
        self.frames.len() / self.layout.nq()
    }

    /// `qpos` of a frame.
    ///
    /// # Panics
    /// If there is no such frame.
    pub fn frame(&self, frame: usize) -> &[f64] {
        &self.frames[frame * self.layout.nq()..][..self.layout.nq()]
    }

    /// `qvel` of a frame.
    ///
    /// # Panics
    /// If there is no such frame.
    pub fn velocity(&self, frame: usize) -> &[f64] {
        &self.velocities[frame * self.layout.nv()..][..self.layout.nv()]
    }

    /// The frames as vectors, for edits.
    fn rows(&self) -> Vec<Vec<f64>> {
        self.frames.chunks(self.layout.nq()).map(<[f64]>::to_vec).collect()
    }

    /// Creates a clip with other frames.
    ///
    /// # Errors
    /// If there are fewer than two frames, or the frames exceed the limits of a clip.
    fn rebuilt(&self, path: &Path, dt: f64, cycle: Option<Cycle>, rows: &[Vec<f64>]) -> Result<Self, MotionError> {
        Clip::new(path, self.about.clone(), self.layout.clone(), dt, cycle, rows)
    }
}

/// Checks that the first joint can move as the cycle requires.
fn check_cycle(path: &Path, cycle: &Cycle, layout: &Layout) -> Result<(), MotionError> {
    let [x, y] = cycle.pos;
    let found = || format!("[{x}, {y}, {}]", cycle.yaw);
    if ![x, y, cycle.yaw].iter().all(|value| value.abs() <= LARGEST) {
        return Err(MotionError::value(path, "cycle", found(), format!("numbers from -{LARGEST} to {LARGEST}")));
    }
    match layout.joints.first().map(|joint| joint.kind) {
        Some(JointKind::Free) => Ok(()),
        Some(JointKind::Slide) if y == 0.0 && cycle.yaw == 0.0 => Ok(()),
        Some(JointKind::Slide) => {
            Err(MotionError::value(path, "cycle", found(), "[x, 0, 0], since the first joint slides along one axis"))
        }
        _ if *cycle == Cycle::default() => Ok(()),
        _ => Err(MotionError::value(path, "cycle", found(), "[0, 0, 0], since the first joint cannot travel")),
    }
}

/// Names of the joints with a quaternion, and the start of the quaternion in `qpos`.
fn quaternions(layout: &Layout) -> impl Iterator<Item = (&str, usize)> {
    layout.joints.iter().filter_map(|joint| match joint.kind {
        JointKind::Free => Some((joint.name.as_str(), joint.qpos + 3)),
        JointKind::Ball => Some((joint.name.as_str(), joint.qpos)),
        JointKind::Slide | JointKind::Hinge => None,
    })
}

impl Cycle {
    /// Moves a pose forward by `count` cycles, or back if negative.
    ///
    /// # Panics
    /// If `qpos` is too short for the layout.
    pub fn advance(&self, layout: &Layout, qpos: &mut [f64], count: i64) {
        match layout.joints.first().map(|joint| joint.kind) {
            Some(JointKind::Free) => {
                let turn = about_z(self.yaw * count as f64);
                let pos = turn * DVec3::new(qpos[0], qpos[1], qpos[2]) + self.travel(count);
                qpos[..3].copy_from_slice(&pos.to_array());
                let turned = turn * quat(&qpos[3..]);
                qpos[3..7].copy_from_slice(&wxyz(turned));
            }
            Some(JointKind::Slide) => qpos[0] += self.pos[0] * count as f64,
            _ => {}
        }
    }

    /// The cycle from one pose of the first joint to another, as far as a cycle can represent it.
    pub(crate) fn between(layout: &Layout, from: &[f64], to: &[f64]) -> Self {
        match layout.joints.first().map(|joint| joint.kind) {
            Some(JointKind::Free) => {
                let yaw = heading(quat(&to[3..]) * quat(&from[3..]).conjugate());
                let start = about_z(yaw) * DVec3::from_slice(from);
                Cycle { pos: [to[0] - start.x, to[1] - start.y], yaw }
            }
            Some(JointKind::Slide) => Cycle { pos: [to[0] - from[0], 0.0], yaw: 0.0 },
            _ => Cycle::default(),
        }
    }

    /// Position of the world's origin after `count` cycles: the sum of displacements, each rotated by the previous
    /// cycles.
    fn travel(&self, count: i64) -> DVec3 {
        let step = DVec3::new(self.pos[0], self.pos[1], 0.0);
        let half = 0.5 * wrap_angle(self.yaw);
        if half.abs() < 1e-9 {
            return step * count as f64;
        }
        // a geometric series of rotations
        let length = libm::sin(half * count as f64) / libm::sin(half);
        about_z(half * (count - 1) as f64) * step * length
    }
}
