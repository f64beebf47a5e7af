//! Arguments of figures that run on uneven ground.

use super::course::Kind;
use crate::agent::Share;
use crate::agent::options::Choice;

/// Selects the reward.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reward {
    /// Speed and posture minus effort.
    Full,
    /// Speed.
    Velocity,
    /// Distance covered, at the end of the episode.
    Sparse,
}

impl Choice for Reward {
    const EXPECTED: &'static str = "full, velocity or sparse";
    const NAMED: &'static [(Self, &'static str)] =
        &[(Reward::Full, "full"), (Reward::Velocity, "velocity"), (Reward::Sparse, "sparse")];
}

/// Consequence of a fall.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Falls {
    /// The episode ends.
    End,
    /// A penalty. After it, neither posture nor effort counts.
    Hurt,
}

impl Choice for Falls {
    const EXPECTED: &'static str = "end or hurt";
    const NAMED: &'static [(Self, &'static str)] = &[(Falls::End, "end"), (Falls::Hurt, "hurt")];
}

/// How the difficulty of each course is chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Levels {
    /// The option `difficulty`.
    Fixed,
    /// Uniformly up to that.
    Random,
    /// A level that starts at 0, rises after a long run and falls after a short one.
    Curriculum,
}

impl Choice for Levels {
    const EXPECTED: &'static str = "fixed, random or curriculum";
    const NAMED: &'static [(Self, &'static str)] =
        &[(Levels::Fixed, "fixed"), (Levels::Random, "random"), (Levels::Curriculum, "curriculum")];
}

/// Reward of the adversary.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Earns {
    /// The runner's reward with the opposite sign.
    Inverse,
    /// How much more a reference runner earns on the same ground.
    Regret,
}

impl Choice for Earns {
    const EXPECTED: &'static str = "inverse or regret";
    const NAMED: &'static [(Self, &'static str)] = &[(Earns::Inverse, "inverse"), (Earns::Regret, "regret")];
}

crate::options! {
    /// Arguments of a figure that runs on uneven ground.
    pub struct TerrainArguments {
        /// Kind of ground: `flat`, `slopes`, `steps`, `stairs`, `gaps`, `rubble`, `boxes`, `mixed` (all of these), the
        /// original's `meters`, its handmade `bumps` and `blocks`, or `adversary` (built by a second role that learns).
        course: Kind = Kind::Mixed,
        /// Difficulty of the hardest courses (0 to 1).
        difficulty: Share = Share(0.5),
        /// Difficulty of each course: `fixed`, `random` up to `difficulty`, or `curriculum` (5 % harder after 16 m, 5 %
        /// easier after less than 8 m).
        levels: Levels = Levels::Fixed,
        /// Whether the figure observes the ground ahead.
        heights: bool = true,
        /// Consequence of a fall: `end` the episode, or `hurt` (a penalty).
        falls: Falls = Falls::End,
        /// Reward: `full`, `velocity` or `sparse`.
        reward: Reward = Reward::Full,
        /// Reward of the adversary: `inverse` of the runner's reward, or `regret`, how much more a reference runner
        /// earns on the same ground. The reference learns too.
        builder: Earns = Earns::Inverse,
    }
}
