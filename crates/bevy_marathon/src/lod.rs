//! Level of detail: how much of a ragdoll is simulated.

use bevy::prelude::*;

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
    /// no effect. When it wakes up, it continues with the bits that it would have had. Only a
    /// [`MoveDirection`](crate::MoveDirection) notices the pause, because it goes by the clock.
    Asleep,
}

/// Sets the [`Lod`] of all ragdolls by their distance to this entity, such as a camera. With several of them, the nearest
/// counts. Without any, every `Lod` is yours.
///
/// The place of a camera depends on the player and on the frame rate. Games that play the same bits on several computers set
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
