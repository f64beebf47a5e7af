//! Level of detail: how much of a ragdoll is simulated.

use crate::axes::to_game;
use crate::marathon::{Marathon, RagdollState};
use crate::ragdoll::Anatomy;
use bevy::prelude::*;
use marathon_physics::model::JointType;

/// How much of a [`Ragdoll`](crate::Ragdoll) is simulated. Added with the ragdoll, as [`Lod::Full`].
///
/// A ragdoll at `Full` has the same bits whatever the others are set to. At `HalfRate` and `Asleep`, its bits depend on the
/// ticks at which its component changes, and on nothing else.
#[derive(Component, Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Reflect)]
#[reflect(Component, Default, Clone, Debug, PartialEq, Hash)]
pub enum Lod {
    /// A policy decides at the rate of its task.
    #[default]
    Full,
    /// The policy computes every second action of an episode; each is held for two decisions. The physics, rewards and
    /// messages are as before. Policies are trained at the full rate: how well one moves at half of it depends on the policy.
    HalfRate,
    /// It is not simulated: its body stands in the air if need be, its episode does not go on, and a [`Push`](crate::Push) has
    /// no effect. When it wakes up, it continues with the bits that it would have had.
    Asleep,
}

/// Sets the [`Lod`] of all ragdolls by their distance to this entity, such as a camera. With several of them, the nearest
/// counts. Without any, every `Lod` is yours.
///
/// What a camera is near to depends on the player and on the frame rate. Games that play the same bits on several computers set
/// [`Lod`] themselves, from positions in the simulation.
#[derive(Component, Clone, Copy, Debug, PartialEq, Reflect)]
#[reflect(Component, Default, Clone, Debug, PartialEq)]
#[require(Transform)]
pub struct LodByDistance {
    /// Distance beyond which a policy decides at half its rate, m.
    pub half_rate: f32,
    /// Distance beyond which a ragdoll sleeps, m.
    pub asleep: f32,
    /// A ragdoll that is this much nearer than a distance returns from beyond it, m.
    pub hysteresis: f32,
}

impl Default for LodByDistance {
    fn default() -> Self {
        LodByDistance { half_rate: 15.0, asleep: 60.0, hysteresis: 2.0 }
    }
}

impl LodByDistance {
    /// The level at a distance, m, of a ragdoll that has a level now.
    pub fn level(&self, now: Lod, distance: f32) -> Lod {
        let beyond = |limit: f32, level: Lod| distance > if now >= level { limit - self.hysteresis } else { limit };
        match () {
            () if beyond(self.asleep, Lod::Asleep) => Lod::Asleep,
            () if beyond(self.half_rate, Lod::HalfRate) => Lod::HalfRate,
            () => Lod::Full,
        }
    }
}

/// Sets the level of each ragdoll by its distance to the nearest [`LodByDistance`].
pub(crate) fn by_distance(
    marathon: Res<Marathon>,
    eyes: Query<(&LodByDistance, &GlobalTransform)>,
    mut ragdolls: Query<(&mut Lod, &RagdollState, &Anatomy, &GlobalTransform)>,
) {
    if eyes.is_empty() {
        return;
    }
    for (mut lod, key, anatomy, track) in &mut ragdolls {
        let Some(sample) = marathon.history(key).and_then(|history| history.back()) else { continue };
        // one without a free body stays near its track's start, or runs along it
        let root = anatomy.model.joints.iter().find(|joint| joint.kind == JointType::Free).map_or_else(
            || sample.qpos.first().map(|x| [*x, 0.0, 0.0]),
            |free| sample.qpos.get(free.qpos_adr..)?.first_chunk().copied(),
        );
        let place = track.transform_point(to_game(root.unwrap_or_default()));
        let nearest = eyes.iter().map(|(by, eye)| (eye.translation().distance(place), by));
        if let Some((distance, by)) = nearest.min_by(|(a, _), (b, _)| a.total_cmp(b)) {
            let level = by.level(*lod, distance);
            lod.set_if_neq(level);
        }
    }
}

/// Moves ragdolls to other lanes, so that those that sleep share batches, which are then not stepped.
pub(crate) fn pack(mut marathon: ResMut<Marathon>, mut ragdolls: Query<&mut RagdollState>) {
    let marathon = &mut *marathon;
    for (number, kind) in marathon.kinds.iter_mut().enumerate() {
        if !std::mem::take(&mut kind.unpacked) {
            continue;
        }
        let moves = kind.pack();
        if moves.is_empty() {
            continue;
        }
        for mut key in ragdolls.iter_mut().filter(|key| key.kind == number) {
            if let Some((_, to)) = moves.iter().find(|(from, _)| *from == (key.batch, key.lane)) {
                (key.batch, key.lane) = *to;
            }
        }
    }
}
