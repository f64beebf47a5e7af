//! Finds the axis of a file that points up from the motion.

use super::landmarks::{Landmarks, middle};
use crate::rotation::exp;
use crate::skeleton::SkeletonPose;
use glam::{DQuat, DVec3};
use std::f64::consts::{FRAC_PI_2, PI};
use std::fmt;

/// The axis of a file that points up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Up {
    /// +x.
    X,
    /// +y.
    Y,
    /// +z.
    Z,
    /// -x.
    NegX,
    /// -y.
    NegY,
    /// -z.
    NegZ,
}

impl Up {
    /// All six.
    pub const ALL: [Up; 6] = [Up::Y, Up::Z, Up::NegZ, Up::X, Up::NegX, Up::NegY];

    /// The axis.
    pub(super) fn axis(self) -> DVec3 {
        match self {
            Up::X => DVec3::X,
            Up::Y => DVec3::Y,
            Up::Z => DVec3::Z,
            Up::NegX => DVec3::NEG_X,
            Up::NegY => DVec3::NEG_Y,
            Up::NegZ => DVec3::NEG_Z,
        }
    }

    /// The rotation that turns the axis to +z.
    pub(super) fn upright(self) -> DQuat {
        match self {
            Up::X => exp(DVec3::NEG_Y * FRAC_PI_2),
            Up::Y => exp(DVec3::X * FRAC_PI_2),
            Up::Z => DQuat::IDENTITY,
            Up::NegX => exp(DVec3::Y * FRAC_PI_2),
            Up::NegY => exp(DVec3::NEG_X * FRAC_PI_2),
            Up::NegZ => exp(DVec3::X * PI),
        }
    }

    /// The axis nearest to a direction.
    pub(super) fn nearest(direction: DVec3) -> Up {
        let along = |up: &Up| up.axis().dot(direction);
        Up::ALL.into_iter().max_by(|a, b| along(a).total_cmp(&along(b))).unwrap_or(Up::Y)
    }

    /// Score of the axis before any motion counts. Most files have y up, some z.
    fn prior(self, trust_y: f64) -> f64 {
        match self {
            Up::Y => 0.15 + trust_y,
            Up::Z => 0.1,
            Up::NegZ => -0.3,
            Up::X | Up::NegX => -0.5,
            Up::NegY => -0.8,
        }
    }
}

impl fmt::Display for Up {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Up::X => "x",
            Up::Y => "y",
            Up::Z => "z",
            Up::NegX => "-x",
            Up::NegY => "-y",
            Up::NegZ => "-z",
        })
    }
}

/// Two consecutive poses of a recording.
pub(super) struct Moment {
    pub now: SkeletonPose,
    pub next: SkeletonPose,
}

/// Speed of a joint below which it may support the character, in statures per second.
const STILL: f64 = 0.15;
/// Speed of the trunk above which the character moves relative to its supports, in statures per second.
const MOVING: f64 = 0.12;

/// The axis along which the head is above the hips and the resting limbs are below the trunk. Lengths are measured
/// relative to the stature.
pub(super) fn estimate(
    marks: &Landmarks,
    moments: &[Moment],
    stature: f64,
    dt: f64,
    rest: Option<Up>,
    trust_y: f64,
) -> Up {
    let posture: DVec3 = moments.iter().map(|moment| posture(marks, &moment.now)).sum::<DVec3>() / moments.len() as f64;
    let mut supports: Vec<(&SkeletonPose, usize)> = Vec::new();
    for Moment { now, next } in moments {
        let speed = |joint: usize| (next.pos[joint] - now.pos[joint]).length() / (dt * stature);
        let trunk = 0.5 * (speed(marks.pelvis) + speed(marks.chest));
        if trunk < MOVING {
            continue;
        }
        let ends = marks.ankles.into_iter().chain(marks.toes.into_iter().flatten());
        let ends = ends.chain(marks.wrists.into_iter().flatten()).chain(marks.knees).chain(marks.elbows);
        supports.extend(ends.filter(|end| speed(*end) < STILL.min(0.4 * trunk)).map(|end| (now, end)));
    }
    let score = |up: Up| {
        let axis = up.axis();
        let mut carried = 0.0;
        for (pose, end) in &supports {
            let center = 0.5 * (middle(pose, marks.hips) + middle(pose, marks.shoulders));
            let lowest = marks.touching().map(|(joint, _)| axis.dot(pose.pos[joint])).fold(f64::INFINITY, f64::min);
            let above = axis.dot(center - pose.pos[*end]) / stature;
            let high = (axis.dot(pose.pos[*end]) - lowest) / stature;
            carried += 1.5 * above - 2.0 * high;
        }
        let count = supports.len() as f64;
        let carried = carried / count.max(20.0);
        let same = if rest == Some(up) { 0.2 } else { 0.0 };
        up.prior(trust_y) + same + posture.dot(axis) + carried
    };
    Up::ALL.into_iter().max_by(|a, b| score(*a).total_cmp(&score(*b))).unwrap_or(Up::Y)
}

/// The mean of directions that point up while people stand, sit, walk and crawl. They lead from the hips to the
/// shoulders, from the neck to the head, from the knees to the hips, and from the elbows to the shoulders.
fn posture(marks: &Landmarks, pose: &SkeletonPose) -> DVec3 {
    let way = |from: usize, to: usize| (pose.pos[to] - pose.pos[from]).normalize_or_zero();
    let mut sum = marks.trunk(pose).normalize_or_zero();
    let mut count = 1.0;
    let mut add = |direction: DVec3, weight: f64| {
        sum += weight * direction;
        count += weight;
    };
    if let Some((neck, head)) = marks.neck.zip(marks.head).filter(|(neck, head)| neck != head) {
        add(way(neck, head), 0.5);
    }
    for side in 0..2 {
        add(way(marks.knees[side], marks.hips[side]), 0.5);
        add(way(marks.elbows[side], marks.shoulders[side]), 0.25);
    }
    sum / count
}
