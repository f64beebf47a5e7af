//! Strength of the ragdolls in their lanes: their modes, their constants and the blows that soften them.

use super::batch::{CharacterBatch, Engine};
use marathon_envs::BLOCK;
use marathon_physics::Variation;

impl CharacterBatch {
    /// Gives a ragdoll back to its policy, or takes its strength.
    pub fn set_limp(&mut self, lane: usize, limp: bool) {
        let Some(slot) = &mut self.lanes[lane] else { return };
        if slot.lying.is_some() && !limp {
            // its task has failed, so only a new episode helps
            slot.begin_now();
            return;
        }
        slot.revived |= slot.limp && !limp;
        slot.limp = limp;
        if let (true, Engine::Env(env)) = (slot.revived, self.engine.get()) {
            // the task goes on from here: what it remembers of the time before is no longer true
            let state = env.state(lane).and_then(|state| env.set_state(lane, &state));
            let mask: [bool; BLOCK] = std::array::from_fn(|i| i == lane);
            if state.is_ok() {
                let _ = env.observe(&mask, &mut self.obs);
            }
        }
    }

    /// Applies the constants and the strengths that have changed.
    pub(super) fn strengthen(&mut self) {
        let mut factors = std::mem::take(&mut self.factors);
        for lane in 0..BLOCK {
            let Some(slot) = self.lanes[lane].as_mut().filter(|slot| slot.asleep.is_none()) else { continue };
            slot.wanted_factors(&self.limbs, self.dt, &mut factors);
            slot.blows.pass(slot.reactions.as_ref(), self.dt);
            if slot.factors == factors && !slot.physique_changed {
                continue;
            }
            slot.factors.clone_from(&factors);
            slot.physique_changed = false;
            let mut variation = slot.physique.clone().unwrap_or_else(|| Variation::none(&self.model));
            variation.strength.iter_mut().zip(&factors).for_each(|(strength, factor)| *strength *= factor);
            self.vary(lane, &variation);
        }
        self.factors = factors;
    }

    /// Gives a ragdoll constants of its own.
    pub(super) fn vary(&mut self, lane: usize, variation: &Variation) {
        match self.engine.get() {
            Engine::Env(env) => drop(env.vary(lane, variation)),
            Engine::Free(batch, _) => batch.vary(lane, variation),
        }
    }
}
