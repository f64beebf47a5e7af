//! Ragdolls that motion clips move in place of the physics.

use super::CharacterBatch;
use super::batch::Engine;
use super::playing::Playing;
use marathon_envs::BLOCK;
use marathon_physics::Model;

impl CharacterBatch {
    /// The model of its ragdolls.
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// Starts a clip on a ragdoll.
    pub fn play(&mut self, lane: usize, mut playing: Playing) {
        let Some(slot) = &mut self.lanes[lane] else { return };
        if let Some(now) = slot.history.back() {
            playing.start(&self.model, &now.qpos, &now.qvel);
            slot.playing = Some(playing);
        }
    }

    /// Gives a ragdoll back to the physics.
    pub fn stop(&mut self, lane: usize) {
        let Some(slot) = &mut self.lanes[lane] else { return };
        (slot.playing, slot.revived) = (None, true);
        if let Engine::Env(env) = self.engine.get() {
            let mask: [bool; BLOCK] = std::array::from_fn(|i| i == lane);
            let _ = env.observe(&mask, &mut self.obs);
        }
    }

    /// Puts a ragdoll where its clip has it after a decision. Returns whether a clip moves it.
    pub(super) fn animate(&mut self, lane: usize) -> bool {
        let dt = self.dt;
        let Some(slot) = self.lanes[lane].as_mut().filter(|slot| !slot.is_limp()) else { return false };
        let Some(state) = slot.playing.as_mut().and_then(|playing| playing.advance(&self.model, dt)) else {
            return false;
        };
        slot.begin_now = false;
        match self.engine.get() {
            // the lengths are those of the model
            Engine::Env(env) => drop(env.set_state(lane, &state)),
            Engine::Free(batch, _) => batch.reset(lane, &state.qpos, &state.qvel),
        }
        true
    }
}
