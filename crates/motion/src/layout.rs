//! Assignment of `qpos` entries to joints.

use crate::error::MotionError;
use marathon_physics::hint::{did_you_mean, nearest};
use marathon_physics::model::{JointType, Model};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Kind of a joint.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum JointKind {
    /// Position and quaternion: 7 numbers of `qpos`, 6 of `qvel`.
    Free,
    /// Quaternion: 4 numbers of `qpos`, 3 of `qvel`.
    Ball,
    /// Distance, m.
    Slide,
    /// Angle, rad.
    Hinge,
}

impl JointKind {
    /// Number of `qpos` entries.
    pub fn nq(self) -> usize {
        match self {
            JointKind::Free => 7,
            JointKind::Ball => 4,
            JointKind::Slide | JointKind::Hinge => 1,
        }
    }

    /// Number of `qvel` entries.
    pub fn nv(self) -> usize {
        match self {
            JointKind::Free => 6,
            JointKind::Ball => 3,
            JointKind::Slide | JointKind::Hinge => 1,
        }
    }
}

impl From<JointType> for JointKind {
    fn from(kind: JointType) -> Self {
        match kind {
            JointType::Free => JointKind::Free,
            JointType::Ball => JointKind::Ball,
            JointType::Slide => JointKind::Slide,
            JointType::Hinge => JointKind::Hinge,
        }
    }
}

/// A joint: its name, its kind, and the places of its numbers.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Entry {
    pub name: String,
    pub kind: JointKind,
    pub qpos: usize,
    pub qvel: usize,
}

/// The joints of a model in their order, which is the order of `qpos`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Layout {
    pub(crate) joints: Vec<Entry>,
    nq: usize,
    nv: usize,
}

impl Layout {
    /// Creates the layout of these joints.
    pub fn new(joints: impl IntoIterator<Item = (String, JointKind)>) -> Self {
        let mut layout = Layout { joints: Vec::new(), nq: 0, nv: 0 };
        for (name, kind) in joints {
            layout.joints.push(Entry { name, kind, qpos: layout.nq, qvel: layout.nv });
            layout.nq += kind.nq();
            layout.nv += kind.nv();
        }
        layout
    }

    /// The layout of a model.
    pub fn of(model: &Model) -> Self {
        Self::new(model.joints.iter().map(|joint| (joint.name.clone(), joint.kind.into())))
    }

    /// Length of `qpos`.
    pub fn nq(&self) -> usize {
        self.nq
    }

    /// Length of `qvel`.
    pub fn nv(&self) -> usize {
        self.nv
    }

    /// Names and kinds of the joints.
    pub fn joints(&self) -> impl Iterator<Item = (&str, JointKind)> {
        self.joints.iter().map(|joint| (joint.name.as_str(), joint.kind))
    }

    /// Checks that a model has these joints in this order.
    ///
    /// # Errors
    /// If it does not. The message names the first joint that differs.
    pub fn check(&self, path: &Path, model: &Model) -> Result<(), MotionError> {
        let theirs = Layout::of(model);
        let names = || theirs.joints.iter().map(|joint| joint.name.as_str());
        let wrong = |problem: String| Err(MotionError::model(path, &model.name, problem));
        for (i, ours) in self.joints.iter().enumerate() {
            match theirs.joints.get(i) {
                Some(joint) if joint == ours => {}
                Some(joint) => {
                    let hint = if names().any(|name| name == ours.name) {
                        "; the motion was made for another order of joints".into()
                    } else {
                        did_you_mean(nearest(&ours.name, names()))
                    };
                    return wrong(format!(
                        "joint {i} is {:?} ({:?}), expected {:?} ({:?}){hint}",
                        ours.name, ours.kind, joint.name, joint.kind
                    ));
                }
                None => {
                    let (found, expected) = (self.joints.len(), theirs.joints.len());
                    return wrong(format!("found {found} joints, expected {expected}; {:?} is too many", ours.name));
                }
            }
        }
        match theirs.joints.get(self.joints.len()) {
            Some(missing) => wrong(format!("joint {:?} is missing", missing.name)),
            None => Ok(()),
        }
    }
}
