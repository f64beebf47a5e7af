//! Every key of a stage of a recipe: what it may be, and what it means.

use super::keys::{Key, Kind, MOST_STEPS};
use super::section::Range;

/// Most runs of a stage, and most files that it learns from.
pub const MOST_LISTED: usize = 1000;

const TRAIN: &str = "train";
const DISTILL: &str = "distill";
const AVERAGE: &str = "average";
/// Kinds that learn.
const LEARNS: &[&str] = &[TRAIN, DISTILL];

const fn key(sections: &'static [&'static str], name: &'static str, kind: Kind, about: &'static str) -> Key {
    Key { sections, name, kind, about }
}

/// All keys of stages, beside the keys of a configuration, in the order of the reference.
pub const STAGE_KEYS: &[Key] = &[
    key(
        &[DISTILL],
        "distill",
        Kind::Words,
        "policies to [learn from](../how-to/resume.md#distill-several-policies-into-one): stages or files. A policy named twice gets twice the agents",
    ),
    key(
        &[AVERAGE],
        "average",
        Kind::Words,
        "policies to [average](../how-to/resume.md#average-policies): stages or files. `STAGE/policies` means all policies that a stage has kept",
    ),
    key(LEARNS, "task", Kind::Text, "task of the stage; without it, the task of the file"),
    key(
        &[TRAIN],
        "config",
        Kind::Text,
        "configuration file in place of the task's preset, from the folder of this file",
    ),
    key(LEARNS, "initialize_from", Kind::Text, "policy to start from instead of random weights: a stage or a file"),
    key(LEARNS, "steps", Kind::Steps(1), "agent-steps of the stage; in one that trains, short for `run.total_steps`"),
    key(
        LEARNS,
        "seed",
        Kind::Count(0, MOST_STEPS),
        "seed of everything random; in a stage that trains, short for `run.seed`",
    ),
    key(
        LEARNS,
        "seeds",
        Kind::Words,
        "several seeds, such as [1, 2, 3], in place of `seed`: the stage has a run for each, and `pick` chooses one",
    ),
    key(LEARNS, "pick", Kind::Text, "what chooses a seed, such as `lowest falls`"),
    key(
        &[TRAIN],
        "until",
        Kind::Text,
        "measure at which the stage ends before its last step, such as `return_mean > 500`. It is checked at every checkpoint",
    ),
    key(&[TRAIN], "or_fail", Kind::Flag, "the recipe fails if the stage ends without reaching `until`"),
    key(LEARNS, "episodes", Kind::Count(1, 10_000_000), "episodes of the measurements for `pick` and `until`"),
    key(&[DISTILL], "hidden", Kind::Widths, "widths of the hidden layers of the policy"),
    key(&[DISTILL], "agents", Kind::Count(1, 1 << 31), "agents of each policy that the stage learns from"),
    key(&[DISTILL], "lr", Kind::Number(Range::Positive), "learning rate at the start; it falls to 0"),
];

/// Names of the keys of a kind of stage.
pub fn of_kind(kind: &str) -> Vec<&'static str> {
    STAGE_KEYS.iter().filter(|key| key.sections.contains(&kind)).map(|key| key.name).collect()
}

/// The key of a name.
pub fn find(name: &str) -> Option<&'static Key> {
    STAGE_KEYS.iter().find(|key| key.name == name)
}
