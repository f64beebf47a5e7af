//! Modes, strengths and reactions that the app has set enter the simulation.

use crate::marathon::{Marathon, RagdollState};
use crate::mode::RagdollMode;
use crate::reactions::HitReactions;
use crate::strength::LimbStrength;
use bevy::prelude::*;

/// Takes in what has changed.
pub(crate) fn take_in(
    mut marathon: ResMut<Marathon>,
    ragdolls: Query<(&RagdollState, &RagdollMode, &LimbStrength, Option<&HitReactions>)>,
) {
    for (key, mode, strength, reactions) in &ragdolls {
        let Some(batch) = marathon.batch(*key) else { continue };
        let Some(slot) = &mut batch.lanes[key.lane] else { continue };
        // what changes meanwhile is taken in when it wakes up
        if slot.asleep.is_some() {
            continue;
        }
        slot.reactions = reactions.copied();
        if slot.strength != *strength {
            slot.strength.clone_from(strength);
        }
        if *mode != slot.shown_mode {
            slot.shown_mode = *mode;
            batch.set_limp(key.lane, *mode == RagdollMode::Limp);
        }
    }
}
