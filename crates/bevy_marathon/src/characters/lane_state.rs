//! The parts of a snapshot: the kind of ragdoll, and the state of its lane.

use serde::{Deserialize, Serialize};

/// Kind of ragdoll that a snapshot is of.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct KindIdentity {
    /// The task, or the name of a prefab's model.
    pub character: String,
    /// Checksum of the task's options, its clips and its ground.
    pub task: u32,
    /// Checksum of the model.
    pub model: u32,
}

/// State of a lane in the simulation, without its [`Slot`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct LaneState {
    /// Physics, memory and command of the task, and position in the random streams.
    pub(super) engine: Vec<u8>,
    /// Observations for its next action.
    pub(super) obs: Vec<f32>,
    /// Its last action, which roles keep that do not decide.
    pub(super) action: Vec<f32>,
}

impl LaneState {
    /// Checksum of all its bits.
    pub fn checksum(&self) -> u32 {
        let mut sum = crc32fast::Hasher::new();
        sum.update(&self.engine);
        self.obs.iter().chain(&self.action).for_each(|x| sum.update(&x.to_le_bytes()));
        sum.finalize()
    }
}
