//! Messages to ragdolls, and messages about what they do. All are computed at the decisions, so they do not depend on the
//! frame rate.

use crate::ragdoll::{Episode, Target};
use bevy::prelude::*;
use serde::{Deserialize, Serialize};

/// Pushes a ragdoll.
#[derive(Message, Clone, Copy, Debug, PartialEq)]
pub struct Push {
    /// Whom.
    pub ragdoll: Entity,
    /// Which body of its model.
    pub body: usize,
    /// Force in the world's axes, N.
    pub force: Vec3,
    /// Where, in the world's axes; `None`: at the body's center of mass.
    pub at: Option<Vec3>,
    /// How long, s; it lasts at least one decision.
    pub seconds: f64,
}

/// Starts a new episode.
#[derive(Message, Clone, Copy, Debug, PartialEq, Eq)]
pub struct RestartNow {
    /// Whose.
    pub ragdoll: Entity,
}

/// A foot has touched the ground, or left it.
#[derive(Message, Clone, Copy, Debug, PartialEq)]
pub struct FootContact {
    /// Whose foot.
    pub ragdoll: Entity,
    /// Index in [`Anatomy::feet`](crate::Anatomy::feet).
    pub foot: usize,
    /// Whether it has touched.
    pub down: bool,
    /// Lowest point of the foot at the end of the decision, in the world's axes, m.
    pub point: Vec3,
    /// Speed of the foot relative to the ground, m/s: before it touched, or after it left.
    pub speed: f32,
}

/// A ragdoll has fallen: its task failed, or it begins to get up.
#[derive(Message, Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fell {
    /// Which ragdoll.
    pub ragdoll: Entity,
    /// Whether its root faces the ground. If not, it faces the sky.
    pub prone: bool,
}

/// A ragdoll stands again, see [`RagdollMode::GettingUp`](crate::RagdollMode).
#[derive(Message, Clone, Copy, Debug, PartialEq, Eq)]
pub struct GotUp {
    /// Which ragdoll.
    pub ragdoll: Entity,
}

/// A ragdoll has landed on a foot after at least 0.1 s in the air.
#[derive(Message, Clone, Copy, Debug, PartialEq)]
pub struct Landed {
    /// Which ragdoll.
    pub ragdoll: Entity,
    /// Downward speed of its center of mass before it touched the ground, m/s.
    pub speed: f32,
    /// Time in the air, s.
    pub seconds: f64,
}

/// A ragdoll has begun a skill, which is a button of its command, such as `jump`.
#[derive(Message, Clone, Debug, PartialEq, Eq)]
pub struct SkillStarted {
    /// Which ragdoll.
    pub ragdoll: Entity,
    /// Name of the button, as in [`AgentCommand::set`](crate::AgentCommand::set).
    pub skill: String,
}

/// A skill of a ragdoll has ended, by its end, a fall or a new episode.
#[derive(Message, Clone, Debug, PartialEq, Eq)]
pub struct SkillEnded {
    /// Which ragdoll.
    pub ragdoll: Entity,
    /// Name of the button.
    pub skill: String,
}

/// A ragdoll has received a blow: a [`Push`] on a body that was not pushed in the last 0.08 s.
#[derive(Message, Clone, Copy, Debug, PartialEq)]
pub struct HitReceived {
    /// Which ragdoll.
    pub ragdoll: Entity,
    /// Which body of its model.
    pub body: usize,
    /// Impulse in the world's axes, N s.
    pub impulse: Vec3,
}

/// Why an episode ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum End {
    /// The agent failed: it fell.
    Fell,
    /// The task's time was up.
    TimeUp,
    /// Its simulation stopped being finite.
    Broke,
    /// [`RestartNow`].
    Asked,
}

/// An episode has ended: a fall, or the end of the time.
#[derive(Message, Clone, Debug, PartialEq)]
pub struct EpisodeEnded {
    /// Whose.
    pub ragdoll: Entity,
    /// Why.
    pub end: End,
    /// How it went.
    pub episode: Episode,
}

/// An episode has begun: the ragdoll has been reset.
#[derive(Message, Clone, Copy, Debug, PartialEq, Eq)]
pub struct EpisodeBegan {
    /// Whose.
    pub ragdoll: Entity,
    /// Number of the episode.
    pub number: u64,
}

/// A ragdoll has reached its [`Target`].
#[derive(Message, Clone, Copy, Debug, PartialEq)]
pub struct TargetReached {
    /// Which ragdoll.
    pub ragdoll: Entity,
    /// Where it was going.
    pub target: Target,
}
