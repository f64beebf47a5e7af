//! Arguments of figures that run on uneven ground.

use super::bank::Rule;
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

/// How each course is chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Levels {
    /// The option `difficulty`.
    Fixed,
    /// Uniformly up to that.
    Random,
    /// A level that starts at 0, rises after a long run and falls after a short one.
    Distance,
    /// Prioritized level replay of pieces.
    Plr,
    /// Replay of pieces and of their edits.
    Accel,
    /// Pieces sampled for learnability.
    Sfl,
    /// Built by an adversary: short for the course `adversary` of fixed difficulty.
    Adversary,
    /// The same, and it earns regret.
    Regret,
}

impl Levels {
    /// The rule of the bank, for levels with one.
    pub(super) fn rule(self) -> Option<Rule> {
        match self {
            Levels::Plr => Some(Rule::Plr),
            Levels::Accel => Some(Rule::Accel),
            Levels::Sfl => Some(Rule::Sfl),
            _ => None,
        }
    }
}

impl Choice for Levels {
    const EXPECTED: &'static str = "fixed, random, distance, plr, accel, sfl, adversary or regret";
    const NAMED: &'static [(Self, &'static str)] = &[
        (Levels::Fixed, "fixed"),
        (Levels::Random, "random"),
        (Levels::Distance, "distance"),
        (Levels::Plr, "plr"),
        (Levels::Accel, "accel"),
        (Levels::Sfl, "sfl"),
        (Levels::Adversary, "adversary"),
        (Levels::Regret, "regret"),
    ];
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
        /// How each course is chosen: `fixed`, `random` up to `difficulty`, `distance` (5 % harder after 16 m, 5 % easier
        /// after less than 8 m), by pieces that teach (`plr`, `accel`, `sfl`), or built by an `adversary`, also for `regret`.
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

impl TerrainArguments {
    /// Kind of ground, also if `levels` name the adversary.
    pub(super) fn course(&self) -> Kind {
        match self.levels {
            Levels::Adversary | Levels::Regret => Kind::Adversary,
            _ => self.course,
        }
    }

    /// Reward of the adversary, also if `levels` name it.
    pub(super) fn builder(&self) -> Earns {
        match self.levels {
            Levels::Regret => Earns::Regret,
            _ => self.builder,
        }
    }
}
