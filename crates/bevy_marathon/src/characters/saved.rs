//! Saves and restores the state of a lane.

use super::batch::Engine;
use super::lane_state::{KindIdentity, LaneState};
use super::{CharacterBatch, CharacterKind, Slot};
use crate::error::SnapshotError;
use bevy::prelude::*;
use marathon_envs::BLOCK;
use marathon_physics::AgentState;
use serde::Serialize;
use std::io::Write;
use std::sync::Arc;
use std::time::Duration;

/// Checksum of what is written.
struct Sum(crc32fast::Hasher);

impl Write for Sum {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0.update(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

/// Checksum of a value as JSON.
fn checksum(value: &impl Serialize) -> u32 {
    let mut sum = Sum(crc32fast::Hasher::new());
    // it is written to memory, and its maps have text as keys
    let written = serde_json::to_writer(&mut sum, value);
    debug_assert!(written.is_ok(), "{written:?}");
    sum.0.finalize()
}

impl CharacterKind {
    /// The mark of its snapshots.
    pub fn identity(&self) -> &Arc<KindIdentity> {
        self.identity.get_or_init(|| {
            Arc::new(KindIdentity {
                character: self.spec.as_ref().map_or_else(|| self.model.name.clone(), |spec| spec.id.clone()),
                task: checksum(&(&self.task_config, self.ground.name())),
                model: checksum(&*self.model),
            })
        })
    }

    /// Restores a lane, at the time of the kind.
    pub fn load(&mut self, (batch, lane): (usize, usize), slot: &Slot, state: &LaneState) -> Result<(), SnapshotError> {
        let time = self.time;
        let batch = self.batches.get_mut(batch).ok_or(SnapshotError::Gone)?;
        self.unpacked |= batch.is_awake(lane) == slot.asleep.is_some();
        batch.load(lane, slot, state, time)
    }
}

impl CharacterBatch {
    /// The state of a lane that is not free.
    pub fn save(&mut self, lane: usize) -> Option<(Slot, LaneState)> {
        let slot = self.lanes[lane].clone()?;
        let state = slot.asleep.clone().unwrap_or_else(|| self.lane_state(lane));
        Some((slot, state))
    }

    /// The state of a lane in the simulation.
    pub(super) fn lane_state(&mut self, lane: usize) -> LaneState {
        let engine = match self.engine.get() {
            // the lane exists, and so does its agent
            Engine::Env(env) => env.save_agent(lane).unwrap_or_default(),
            Engine::Free(batch, _) => {
                let mut bytes = Vec::new();
                batch.agent_state(lane).write_to(&mut bytes);
                bytes
            }
        };
        let row = |numbers: &[f32]| {
            let n = numbers.len() / BLOCK;
            numbers[lane * n..(lane + 1) * n].to_vec()
        };
        LaneState { engine, obs: row(&self.obs), action: row(&self.action) }
    }

    /// Restores a lane that is not free. Its newest state is then that of `time`.
    fn load(&mut self, lane: usize, slot: &Slot, state: &LaneState, time: Duration) -> Result<(), SnapshotError> {
        let present = self.lanes[lane].clone().ok_or(SnapshotError::Gone)?;
        self.check(slot)?;
        self.load_lane(lane, state)?;
        let mut slot = slot.clone().with_inputs_of(present);
        slot.retime(time);
        if slot.grounds.is_empty() {
            slot.grounds = Arc::new(self.grounds(lane));
            slot.history.iter_mut().for_each(|sample| sample.grounds = slot.grounds.clone());
        }
        self.lanes[lane] = Some(slot);
        Ok(())
    }

    /// Restores the state of a lane in the simulation.
    pub(super) fn load_lane(&mut self, lane: usize, state: &LaneState) -> Result<(), SnapshotError> {
        let LaneState { engine, obs, action } = state;
        if (obs.len() * BLOCK, action.len() * BLOCK) != (self.obs.len(), self.action.len()) {
            return Err(SnapshotError::Damaged("its observations or actions have another length"));
        }
        match self.engine.get() {
            Engine::Env(env) => env.load_agent(lane, engine)?,
            Engine::Free(batch, _) => match AgentState::read_from(&self.model, engine) {
                Some((state, [])) => batch.set_agent_state(lane, &state),
                _ => return Err(SnapshotError::Damaged("its physics belongs to another model")),
            },
        }
        for (rows, row) in [(&mut self.obs, obs), (&mut self.action, action)] {
            rows[lane * row.len()..(lane + 1) * row.len()].copy_from_slice(row);
        }
        Ok(())
    }

    /// Elevations of the height fields below a lane.
    pub(super) fn grounds(&mut self, lane: usize) -> Vec<Vec<f32>> {
        match self.engine.get() {
            // lanes and fields exist
            Engine::Env(env) => {
                (0..self.model.hfields.len()).filter_map(|field| env.ground(lane, field).ok()).collect()
            }
            Engine::Free(..) => Vec::new(),
        }
    }

    /// Refuses lists of a length that nothing else expects. Only bytes from elsewhere have any.
    fn check(&self, slot: &Slot) -> Result<(), SnapshotError> {
        let model = &*self.model;
        let pose = |sample: &super::PoseSample| {
            (sample.qpos.len(), sample.qvel.len(), sample.action.len()) == (model.nq, model.nv, self.n_act)
                && sample.reference.as_ref().is_none_or(|qpos| qpos.len() == model.nq)
        };
        if slot.history.is_empty() || !slot.history.iter().all(pose) {
            return Err(SnapshotError::Damaged("its poses belong to another model"));
        }
        if slot.playing.as_ref().is_some_and(|playing| !playing.fits(model)) {
            return Err(SnapshotError::Damaged("its clip belongs to another model"));
        }
        if slot.pushes.iter().any(|push| push.body >= model.bodies.len()) {
            return Err(SnapshotError::Damaged("it pushes a body that the model does not have"));
        }
        Ok(())
    }
}
