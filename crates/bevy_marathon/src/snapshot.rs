//! Snapshots of ragdolls: for rollback, saved games, and peers that join later.

use crate::characters::{KindIdentity, LaneState, Slot};
use crate::error::SnapshotError;
use crate::marathon::{Marathon, RagdollState};
use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

/// Mark of the bytes of a snapshot. The last two digits are the version.
const MARK: &str = "MRTHNr01";

/// A whole ragdoll at a decision, from [`Marathon::save`].
///
/// It holds the physics with the warm start of the solver, and the phase and the memory of the task. It holds command, schedule
/// of commands, random streams, episode, and pushes that still act. It holds the poses that frames are drawn between, and
/// whether the ragdoll [sleeps](crate::Lod::Asleep).
///
/// The components of the ragdoll are not part of it. [`Controls`](crate::Controls), [`AgentCommand`](crate::AgentCommand),
/// [`MoveDirection`](crate::MoveDirection), [`CharacterPolicy`](crate::CharacterPolicy) and others are inputs, which the
/// simulation reads at every tick.
#[derive(Clone, Debug)]
pub struct RagdollSnapshot {
    kind: Arc<KindIdentity>,
    slot: Slot,
    state: LaneState,
}

/// All ragdolls and the clocks of the simulation. From [`Marathon::save_all`].
#[derive(Clone, Debug)]
pub struct MarathonSnapshot {
    now: Duration,
    decisions: u64,
    /// Time of the newest states of each kind.
    clocks: Vec<Duration>,
    ragdolls: Vec<(RagdollState, RagdollSnapshot)>,
}

impl RagdollSnapshot {
    /// Checksum of the state that the future depends on. Peers that compare it find out when their simulations differ.
    pub fn checksum(&self) -> u32 {
        self.state.checksum()
    }

    /// The snapshot as bytes, for a file or a peer. Computers of any instruction set read the same bits from it.
    pub fn to_bytes(&self) -> Vec<u8> {
        // serialization into memory has no error for lists, numbers and text
        let body = postcard::to_stdvec(&(&*self.kind, &self.slot, &self.state)).unwrap_or_default();
        [MARK.as_bytes(), &crc32fast::hash(&body).to_le_bytes(), &body].concat()
    }

    /// Reads a snapshot from bytes of [`RagdollSnapshot::to_bytes`].
    ///
    /// # Errors
    /// If the bytes are damaged, have the format of another version, or are something else.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, SnapshotError> {
        let something_else = || SnapshotError::Mark { bytes: bytes.len(), expected: MARK };
        let (mark, rest) = bytes.split_first_chunk::<8>().ok_or_else(something_else)?;
        if mark[..6] != MARK.as_bytes()[..6] {
            return Err(something_else());
        }
        if mark != MARK.as_bytes() {
            return Err(SnapshotError::Format { found: mark.escape_ascii().to_string(), expected: MARK });
        }
        let (sum, body) = rest.split_first_chunk().ok_or_else(something_else)?;
        let (found, expected) = (crc32fast::hash(body), u32::from_le_bytes(*sum));
        if found != expected {
            return Err(SnapshotError::Checksum { found, expected });
        }
        let (kind, slot, state) = postcard::from_bytes::<(KindIdentity, Slot, LaneState)>(body)?;
        Ok(RagdollSnapshot { kind: Arc::new(kind), slot, state })
    }

    /// Refuses to be restored into another kind of ragdoll.
    fn check(&self, kind: &KindIdentity) -> Result<(), SnapshotError> {
        let character = || self.kind.character.clone();
        match &*self.kind {
            own if own.character != kind.character => {
                Err(SnapshotError::Character { found: character(), expected: kind.character.clone() })
            }
            own if own.task != kind.task => Err(SnapshotError::Task { character: character() }),
            own if own.model != kind.model => Err(SnapshotError::Model { character: character() }),
            _ => Ok(()),
        }
    }
}

impl MarathonSnapshot {
    /// Checksum of the states of all ragdolls, as [`RagdollSnapshot::checksum`].
    pub fn checksum(&self) -> u32 {
        let mut sum = crc32fast::Hasher::new();
        self.ragdolls.iter().for_each(|(_, ragdoll)| sum.update(&ragdoll.checksum().to_le_bytes()));
        sum.finalize()
    }

    /// Number of ragdolls.
    pub fn len(&self) -> usize {
        self.ragdolls.len()
    }

    /// Whether it has no ragdolls.
    pub fn is_empty(&self) -> bool {
        self.ragdolls.is_empty()
    }
}

impl Marathon {
    /// Copies a whole ragdoll. `None` if it has left the simulation. Save between ticks, or in systems after
    /// [`MarathonSystems::Report`](crate::MarathonSystems::Report): messages that are not reported yet are part of the snapshot.
    pub fn save(&mut self, ragdoll: &RagdollState) -> Option<RagdollSnapshot> {
        let RagdollState { kind, batch, lane } = *ragdoll;
        let kind = self.kinds.get_mut(kind)?;
        let identity = kind.identity().clone();
        let (slot, state) = kind.batches.get_mut(batch)?.save(lane)?;
        Some(RagdollSnapshot { kind: identity, slot, state })
    }

    /// Puts a ragdoll back into a state that it, or another ragdoll of the same character and task, was in. It continues with
    /// the same bits as after the snapshot, if the inputs are the same. Other ragdolls do not change a bit.
    ///
    /// The clock of the simulation goes on: the restored state is the newest one, whatever the time of the snapshot. A
    /// [`MoveDirection`](crate::MoveDirection) also reads that clock; use [`Marathon::restore_all`] with it.
    ///
    /// # Errors
    /// If the ragdoll has left the simulation, or the snapshot belongs to another character, task, ground or model.
    pub fn restore(&mut self, ragdoll: &RagdollState, snapshot: &RagdollSnapshot) -> Result<(), SnapshotError> {
        let kind = self.kinds.get_mut(ragdoll.kind).ok_or(SnapshotError::Gone)?;
        snapshot.check(kind.identity())?;
        kind.load((ragdoll.batch, ragdoll.lane), &snapshot.slot, &snapshot.state)
    }

    /// Copies all ragdolls and the clocks of the simulation, as [`Marathon::save`].
    pub fn save_all(&mut self) -> MarathonSnapshot {
        let keys: Vec<RagdollState> = self.keys().collect();
        MarathonSnapshot {
            now: self.now,
            decisions: self.decisions,
            clocks: self.kinds.iter().map(|kind| kind.time).collect(),
            ragdolls: keys.into_iter().filter_map(|key| Some((key, self.save(&key)?))).collect(),
        }
    }

    /// Puts all ragdolls and the clocks of the simulation back, in the app that the snapshot is from. Returns how many ragdolls
    /// were restored: those that have left since are skipped, and those that have entered since stay as they are.
    ///
    /// Put [`Time<Fixed>`](bevy::time::Fixed) back to the same tick, then run
    /// [`FixedUpdate`](bevy::app::FixedUpdate) once for each tick to replay. The example `rollback` does so.
    ///
    /// # Errors
    /// If the snapshot is from another app with other kinds of ragdolls. Then nothing has changed.
    pub fn restore_all(&mut self, snapshot: &MarathonSnapshot) -> Result<usize, SnapshotError> {
        for (key, ragdoll) in &snapshot.ragdolls {
            ragdoll.check(self.kinds.get(key.kind).ok_or(SnapshotError::Gone)?.identity())?;
        }
        (self.now, self.decisions) = (snapshot.now, snapshot.decisions);
        for (kind, time) in self.kinds.iter_mut().zip(&snapshot.clocks) {
            kind.time = *time;
        }
        // a ragdoll may have moved to another lane, and its lane may have another ragdoll
        let keys = self.keys().filter_map(|key| Some(((key.kind, self.slot(key)?.entered), key)));
        let keys: BTreeMap<(usize, u64), RagdollState> = keys.collect();
        let mut restored = 0;
        for (key, ragdoll) in &snapshot.ragdolls {
            if let Some(key) = keys.get(&(key.kind, ragdoll.slot.entered)) {
                self.restore(key, ragdoll)?;
                restored += 1;
            }
        }
        Ok(restored)
    }

    /// The keys of all ragdolls in the simulation.
    fn keys(&self) -> impl Iterator<Item = RagdollState> {
        self.kinds.iter().enumerate().flat_map(|(kind, of_kind)| {
            of_kind.batches.iter().enumerate().flat_map(move |(batch, lanes)| {
                let taken = lanes.lanes.iter().enumerate().filter(|(_, slot)| slot.is_some());
                taken.map(move |(lane, _)| RagdollState { kind, batch, lane })
            })
        })
    }
}
