//! Ragdolls that sleep: their lanes are stepped with the others of their batch, and what they compute is thrown away. A batch
//! that sleeps as a whole is not stepped.

use super::{CharacterBatch, CharacterKind};
use crate::lod::Lod;
use marathon_envs::BLOCK;
use std::time::Duration;

/// A batch and a lane.
type Place = (usize, usize);

impl CharacterKind {
    /// Sets the level of detail of a ragdoll. Returns whether it has woken up.
    pub fn set_lod(&mut self, (batch, lane): Place, lod: Lod) -> bool {
        let time = self.time;
        let Some(batch) = self.batches.get_mut(batch) else { return false };
        let Some(slot) = &mut batch.lanes[lane] else { return false };
        slot.lod = lod;
        let (sleeps, shall) = (slot.asleep.is_some(), lod == Lod::Asleep);
        if sleeps == shall {
            return false;
        }
        self.unpacked = true;
        if shall {
            batch.fall_asleep(lane);
        } else {
            batch.wake_up(lane, time);
        }
        !shall
    }

    /// Gathers those that are awake in as few batches as hold them. Returns which ragdolls have moved, and where.
    pub fn pack(&mut self) -> Vec<(Place, Place)> {
        let awake = |batch: &CharacterBatch| (0..BLOCK).filter(|lane| batch.is_awake(*lane)).count();
        // the fullest first; of two alike, the older
        let mut order: Vec<(usize, usize)> = self.batches.iter().enumerate().map(|(i, b)| (awake(b), i)).collect();
        order.sort_by_key(|(count, batch)| (std::cmp::Reverse(*count), *batch));
        let needed = order.iter().map(|(count, _)| count).sum::<usize>().div_ceil(BLOCK);
        let places = |batches: &[(usize, usize)], wanted: bool, kind: &Self| -> Vec<Place> {
            let lanes = batches.iter().flat_map(|(_, batch)| (0..BLOCK).map(move |lane| (*batch, lane)));
            lanes.filter(|(batch, lane)| kind.batches[*batch].is_awake(*lane) == wanted).collect()
        };
        let (kept, emptied) = order.split_at(needed);
        let (movers, room) = (places(emptied, true, self), places(kept, false, self));
        let mut moves = Vec::new();
        for (from, to) in movers.into_iter().zip(room) {
            if self.swap(from, to) {
                moves.extend([(from, to), (to, from)]);
            }
        }
        moves
    }

    /// Exchanges two lanes, of which the first is awake and the second is not. Returns whether they could.
    fn swap(&mut self, from: Place, to: Place) -> bool {
        let state = self.batches[from.0].lane_state(from.1);
        if self.batches[to.0].load_lane(to.1, &state).is_err() {
            return false;
        }
        let mover = self.batches[from.0].lanes[from.1].take();
        let sleeper = std::mem::replace(&mut self.batches[to.0].lanes[to.1], mover);
        match sleeper {
            Some(_) => self.batches[from.0].lanes[from.1] = sleeper,
            None => self.batches[from.0].dismiss(from.1),
        }
        true
    }
}

impl CharacterBatch {
    /// Whether a lane has a ragdoll that does not sleep.
    pub(super) fn is_awake(&self, lane: usize) -> bool {
        self.lanes[lane].as_ref().is_some_and(|slot| slot.asleep.is_none())
    }

    /// Whether a step moves anything.
    pub fn has_awake(&self) -> bool {
        (0..BLOCK).any(|lane| self.is_awake(lane))
    }

    /// Keeps the state of a lane.
    fn fall_asleep(&mut self, lane: usize) {
        let state = self.lane_state(lane);
        if let Some(slot) = &mut self.lanes[lane] {
            slot.asleep = Some(state);
        }
    }

    /// Restores the state of a lane. Its pose is then that of `time`.
    fn wake_up(&mut self, lane: usize, time: Duration) {
        let Some(state) = self.lanes[lane].as_mut().and_then(|slot| slot.asleep.take()) else { return };
        // the state is from a lane of this kind
        let loaded = self.load_lane(lane, &state);
        debug_assert!(loaded.is_ok(), "{loaded:?}");
        if let Some(slot) = &mut self.lanes[lane] {
            // nothing lies between the last pose of then and the first of now
            slot.history.drain(..slot.history.len().saturating_sub(1));
            slot.retime(time);
        }
    }
}
