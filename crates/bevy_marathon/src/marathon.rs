//! The simulation of all ragdolls, and what can be read of it.

use crate::characters::{CharacterBatch, CharacterKind, PoseSample, Slot};
use crate::error::RagdollError;
use crate::pose;
use bevy::prelude::*;
use marathon_envs::AgentState;
use std::collections::VecDeque;
use std::time::Duration;

/// The simulation of all ragdolls.
#[derive(Resource, Default)]
pub struct Marathon {
    pub(crate) kinds: Vec<CharacterKind>,
    /// Start of the present tick.
    pub(crate) now: Duration,
    pub(crate) decisions: u64,
    pub(crate) spent: Duration,
}

/// Key to a ragdoll's state in [`Marathon`]. Added to every ragdoll that has entered the simulation.
#[derive(Component, Clone, Copy, Debug)]
pub struct RagdollState {
    pub(crate) kind: usize,
    pub(crate) batch: usize,
    pub(crate) lane: usize,
}

impl Marathon {
    /// Decisions that all ragdolls together have made.
    pub fn decisions(&self) -> u64 {
        self.decisions
    }

    /// Time that deciding and stepping have taken.
    pub fn spent(&self) -> Duration {
        self.spent
    }

    /// The states of a ragdoll that frames of the present tick are drawn from, oldest first, one per decision. `None` if the ragdoll has
    /// left the simulation.
    pub fn history(&self, ragdoll: &RagdollState) -> Option<&VecDeque<PoseSample>> {
        self.slot(*ragdoll).map(|slot| &slot.history)
    }

    /// The newest state of a ragdoll, which is ahead of what a frame shows by up to a decision.
    pub fn state(&self, ragdoll: &RagdollState) -> Option<AgentState> {
        let sample = self.history(ragdoll)?.back()?;
        Some(AgentState { qpos: sample.qpos.clone(), qvel: sample.qvel.clone() })
    }

    /// Where the bodies of a ragdoll are at a time, in the order of its model, in the axes of its [`Track`](crate::Track). Known are the times
    /// that a frame of the present tick can show: from `Time<Fixed>::elapsed` on, for a timestep.
    ///
    /// Systems in [`FixedUpdate`] that follow a ragdoll ask here: the transforms of its [`crate::Part`]s are those of the last
    /// frame, in which there may have been many ticks or none.
    pub fn places(&self, ragdoll: &RagdollState, at: Duration) -> Option<Vec<Transform>> {
        let model = &self.kinds.get(ragdoll.kind)?.model;
        let (a, b, share) = self.slot(*ragdoll)?.between(at)?;
        pose::places(model, &pose::mix(model, &a.qpos, &b.qpos, share))
    }

    /// Where the clip that a ragdoll follows has the bodies at a time, as [`Marathon::places`] has them. `None` if its task
    /// follows no clip.
    pub fn clip_places(&self, ragdoll: &RagdollState, at: Duration) -> Option<Vec<Transform>> {
        let model = &self.kinds.get(ragdoll.kind)?.model;
        let (a, b, share) = self.slot(*ragdoll)?.between(at)?;
        pose::places(model, &pose::mix(model, a.reference.as_ref()?, b.reference.as_ref()?, share))
    }

    /// Puts a ragdoll into a state.
    ///
    /// # Errors
    /// If lengths or numbers do not fit its model.
    pub fn set_state(&mut self, ragdoll: &RagdollState, state: &AgentState) -> Result<(), RagdollError> {
        let RagdollState { kind, batch, lane } = *ragdoll;
        let Some(kind) = self.kinds.get_mut(kind) else { return Ok(()) };
        for (vector, given, expected) in [("qpos", &state.qpos, kind.model.nq), ("qvel", &state.qvel, kind.model.nv)] {
            if given.len() != expected {
                return Err(RagdollError::StateLength { vector, found: given.len(), expected });
            }
            if let Some(found) = given.iter().copied().find(|x| !x.is_finite()) {
                return Err(RagdollError::StateNumber { vector, found });
            }
        }
        let time = kind.time;
        if let Some(batch) = kind.batches.get_mut(batch) {
            batch.put(lane, &state.qpos, &state.qvel, time);
        }
        Ok(())
    }

    pub(crate) fn slot(&self, key: RagdollState) -> Option<&Slot> {
        self.kinds.get(key.kind)?.batches.get(key.batch)?.lanes.get(key.lane)?.as_ref()
    }

    pub(crate) fn batch(&mut self, key: RagdollState) -> Option<&mut CharacterBatch> {
        self.kinds.get_mut(key.kind)?.batches.get_mut(key.batch)
    }

    pub(crate) fn slot_mut(&mut self, key: RagdollState) -> Option<&mut Slot> {
        self.batch(key)?.lanes.get_mut(key.lane)?.as_mut()
    }
}
