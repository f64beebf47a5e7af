//! Arguments of figures that run over uneven ground.

use super::course::Kind;
use crate::agent::Share;
use crate::agent::options::Choice;

/// What a figure is rewarded for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reward {
    /// Speed and posture less effort.
    Full,
    /// Speed.
    Velocity,
    /// The way, at the end.
    Sparse,
}

impl Choice for Reward {
    const EXPECTED: &'static str = "full, velocity or sparse";
    const NAMED: &'static [(Self, &'static str)] =
        &[(Reward::Full, "full"), (Reward::Velocity, "velocity"), (Reward::Sparse, "sparse")];
}

/// What a fall does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Falls {
    /// It ends the episode.
    End,
    /// It hurts, and from then on neither posture nor effort counts.
    Hurt,
}

impl Choice for Falls {
    const EXPECTED: &'static str = "end or hurt";
    const NAMED: &'static [(Self, &'static str)] = &[(Falls::End, "end"), (Falls::Hurt, "hurt")];
}

/// How difficult each course is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Levels {
    /// As difficult as the option says.
    Fixed,
    /// Anything up to that.
    Random,
    /// At first level, then harder after a long way and easier after a short one.
    Curriculum,
}

impl Choice for Levels {
    const EXPECTED: &'static str = "fixed, random or curriculum";
    const NAMED: &'static [(Self, &'static str)] =
        &[(Levels::Fixed, "fixed"), (Levels::Random, "random"), (Levels::Curriculum, "curriculum")];
}

/// What an adversary earns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Earns {
    /// What the runner loses.
    Inverse,
    /// What a reference runner earns more on the same ground.
    Regret,
}

impl Choice for Earns {
    const EXPECTED: &'static str = "inverse or regret";
    const NAMED: &'static [(Self, &'static str)] = &[(Earns::Inverse, "inverse"), (Earns::Regret, "regret")];
}

crate::options! {
    /// Arguments of a figure that runs over uneven ground.
    pub struct TerrainArguments {
        /// What the ground is made of: `flat`, `slopes`, `steps`, `stairs`, `gaps`, `rubble`, `boxes`, `mixed` of these, the
        /// original's `meters`, made by hand: `bumps`, `blocks`, or built by an `adversary` that learns, too.
        course: Kind = Kind::Mixed,
        /// How difficult the most difficult courses are, from 0 to 1.
        difficulty: Share = Share(0.5),
        /// How difficult each course is: `fixed`, `random` up to the difficulty, or `curriculum`: 5 % harder after 16 m, 5 %
        /// easier after less than 8 m.
        levels: Levels = Levels::Fixed,
        /// Whether it sees the ground ahead.
        heights: bool = true,
        /// What a fall does: `end` the episode, or `hurt`.
        falls: Falls = Falls::End,
        /// What it is rewarded for: `full`, `velocity`, or `sparse`.
        reward: Reward = Reward::Full,
        /// What an adversary earns: the `inverse` of the runner's reward, or its `regret`: what a reference runner, who learns, too,
        /// earns more on the same ground.
        builder: Earns = Earns::Inverse,
    }
}
