//! Every key of a native file: where it stands, what it may be, and what it means. Files are checked against this table,
//! `docs/reference/configs.md` prints it, and a test compares it with the fields of `TrainConfig`.

use super::section::Range;
use Kind::{Count, Flag, Number, Optional, Pair, Schedule, Steps, Text, Widths, Word, Words};
use marathon_learn::{Activation, Algorithm};

/// Most of anything that is counted.
const MOST: u64 = 1 << 31;
/// Most passes over a rollout. More would only repeat what the policy has learned from it.
pub const MOST_EPOCHS: u64 = 1000;
/// Most rollouts of an iteration.
const MOST_ROLLOUTS: u64 = 1_000_000;
/// Most steps of a run.
pub const MOST_STEPS: u64 = 1 << 53;

/// Type of a key's value.
#[derive(Clone, Copy, Debug)]
pub enum Kind {
    /// A whole number within bounds.
    Count(u64, u64),
    /// A number of steps from a least one, with the short forms of [`steps`](super::steps).
    Steps(u64),
    /// A number.
    Number(Range),
    /// A number, or `{from: A, to: B}`: from the start of the run to its end, linearly.
    Schedule(Range),
    /// `true` or `false`.
    Flag,
    /// One of some words.
    Word(&'static [&'static str]),
    /// Widths of layers.
    Widths,
    /// Two positive numbers in ascending order.
    Pair,
    /// A list of names.
    Words,
    /// Any text.
    Text,
    /// The same, or `null`.
    Optional(&'static Kind),
}

impl Kind {
    /// The expected value in words, for messages and the reference.
    pub fn text(self) -> String {
        match self {
            Count(0, MOST | u64::MAX) | Steps(0) => "a whole number".into(),
            Count(1, MOST) => "a whole number above 0".into(),
            Steps(_) => "a whole number above 0, also as 8e6, 500k or 8M".into(),
            Count(least, most) => format!("a whole number between {least} and {most}"),
            Number(range) => range.text().into(),
            Schedule(range) => format!("{}, or {{from: A, to: B}}", range.text()),
            Flag => "true or false".into(),
            Word(words) => format!("one of {}", words.join(", ")),
            Widths => "a list of widths such as [64, 64]".into(),
            Pair => "two positive numbers in ascending order, such as [1e-5, 3e-3]".into(),
            Words => "a list of names".into(),
            Text => "a text".into(),
            Optional(kind) => format!("{}, or null", kind.text()),
        }
    }
}

/// A key.
#[derive(Clone, Copy, Debug)]
pub struct Key {
    /// Sections that have it; the empty name is the file itself.
    pub sections: &'static [&'static str],
    /// Its name, with dots inside a section of the section.
    pub name: &'static str,
    pub kind: Kind,
    /// Its meaning, with its unit.
    pub about: &'static str,
}

const fn key(sections: &'static [&'static str], name: &'static str, kind: Kind, about: &'static str) -> Key {
    Key { sections, name, kind, about }
}

const RUN: &[&str] = &["run"];
const NETWORK: &[&str] = &["network"];
const STATISTICS: &[&str] = &["statistics"];
const FILE: &[&str] = &[""];
/// Sections of rewards that have networks.
const LEARNED: &[&str] = &["rewards.curiosity", "rewards.rnd", "rewards.gail", "rewards.amp"];
/// Sections of rewards for imitation.
const IMITATION: &[&str] = &["rewards.gail", "rewards.amp"];
/// Sections of all rewards.
pub const REWARDS: &[&str] = &["rewards.task", "rewards.curiosity", "rewards.rnd", "rewards.gail", "rewards.amp"];
/// Sections of the algorithms.
pub const ALGORITHMS: &[&str] = &Algorithm::NAMES;
const PPO: &[&str] = &["ppo"];
const A2C: &[&str] = &["a2c"];
const ACKTR: &[&str] = &["acktr"];
const SAC: &[&str] = &["sac"];
const ON_POLICY: &[&str] = &["ppo", "a2c", "acktr"];

const ACTIVATION: Kind = Word(&Activation::NAMES);
const POSITIVE: Kind = Number(Range::Positive);
const NOT_NEGATIVE: Kind = Number(Range::NotNegative);
const FRACTION: Kind = Number(Range::Fraction);

/// All keys, in the order of the reference.
pub const KEYS: &[Key] = &[
    key(
        RUN,
        "agents",
        Count(1, MOST),
        "agents that act side by side: a multiple of 16, or 1, 2, 4 or 8, which cost as much as 16",
    ),
    key(RUN, "horizon", Count(1, MOST), "decisions of each agent per rollout"),
    key(
        RUN,
        "rollouts",
        Count(1, MOST_ROLLOUTS),
        "rollouts of one iteration, each learned from by itself; an iteration is a row of `progress.csv`",
    ),
    key(RUN, "total_steps", Steps(1), "agent-steps of the whole run"),
    key(
        RUN,
        "policy_average",
        FRACTION,
        "the run hands out [the mean of the policies](../how-to/resume.md#average-policies) of its latest part: 0.1 means the last tenth; 0 means the last policy alone",
    ),
    key(RUN, "seed", Count(0, u64::MAX), "seed of everything random"),
    key(RUN, "threads", Count(0, 65_536), "threads; 0 means one per processor. The result does not depend on it"),
    key(NETWORK, "hidden", Widths, "widths of the policy's hidden layers"),
    key(
        NETWORK,
        "critic_hidden",
        Optional(&Widths),
        "widths of the value function's hidden layers; `null`: those of `hidden`",
    ),
    key(NETWORK, "activation", ACTIVATION, "activation of the hidden layers"),
    key(
        NETWORK,
        "initialization",
        Word(&["orthogonal", "ml_agents"]),
        "weights at the start: orthogonal, or as ML-Agents draws them",
    ),
    key(STATISTICS, "normalize_observations", Flag, "observations are normalized by their running mean and deviation"),
    key(
        STATISTICS,
        "follow_statistics",
        Flag,
        "when a rollout has moved the statistics of observations, the first layers move with them, so that the networks' output stays; not with `sac`",
    ),
    key(STATISTICS, "observation_clip", POSITIVE, "bound of normalized observations"),
    key(STATISTICS, "scale_rewards", Flag, "rewards are divided by the running deviation of the discounted return"),
    key(STATISTICS, "statistics_cap", POSITIVE, "most samples that the running statistics remember"),
    key(
        REWARDS,
        "strength",
        POSITIVE,
        "factor of the reward beside others; alone, the scale of the task's reward cancels",
    ),
    key(REWARDS, "gamma", FRACTION, "discount per decision"),
    key(LEARNED, "hidden", Widths, "widths of the hidden layers of the reward's network"),
    key(LEARNED, "lr", POSITIVE, "learning rate of that network"),
    key(IMITATION, "activation", ACTIVATION, "activation of its hidden layers"),
    key(
        IMITATION,
        "observations",
        Words,
        "parts of the observation that it sees (`marathon list TASK` names them); empty: all",
    ),
    key(IMITATION, "actions", Flag, "it sees the action, too; clips have no actions"),
    key(IMITATION, "gradient_penalty", NOT_NEGATIVE, "weight of the squared slope at demonstrations"),
    key(IMITATION, "logit_decay", NOT_NEGATIVE, "weight of the squared weights of the last layer"),
    key(IMITATION, "share", POSITIVE, "part of each minibatch that it learns from, at most 1"),
    key(
        IMITATION,
        "demonstrations",
        Optional(&Text),
        "`.demo` file of ML-Agents or `marathon record-demo`, from the working directory; `null`: the clips of the task",
    ),
    key(
        ALGORITHMS,
        "lr",
        POSITIVE,
        "learning rate of the policy; `ppo`: where the adaptive schedule starts; `acktr`: largest step",
    ),
    key(&["ppo", "sac"], "value_lr", POSITIVE, "learning rate of the value function"),
    key(
        PPO,
        "lr_schedule",
        Word(&["constant", "linear", "adaptive"]),
        "how the learning rate moves: not at all, linearly to 0, or after `target_kl`",
    ),
    key(
        &["a2c", "acktr", "sac"],
        "lr_schedule",
        Word(&["constant", "linear"]),
        "how the learning rate moves: not at all, or linearly to 0",
    ),
    key(
        PPO,
        "target_kl",
        Schedule(Range::Positive),
        "divergence per update that the adaptive learning rate aims at, nats",
    ),
    key(PPO, "lr_range", Pair, "bounds of the adaptive learning rate"),
    key(PPO, "epochs", Count(1, MOST_EPOCHS), "passes over each rollout"),
    key(PPO, "minibatches", Count(1, MOST), "parts that a rollout is split into in every pass"),
    key(
        PPO,
        "value_warmup",
        Count(0, MOST),
        "rollouts at the start in which the value function learns alone, for a run that [starts from a policy](../how-to/resume.md#fine-tune-a-policy)",
    ),
    key(ON_POLICY, "gae_lambda", FRACTION, "decay of generalized advantage estimation"),
    key(ON_POLICY, "entropy_coef", Schedule(Range::NotNegative), "weight of the entropy bonus"),
    key(PPO, "clip", Schedule(Range::Positive), "bound of the probability ratio's distance from 1"),
    key(
        PPO,
        "ratio",
        Word(&["joint", "per_action"]),
        "whose probability ratio `clip` bounds: that of all actions together, or of each by itself, as in ML-Agents",
    ),
    key(
        PPO,
        "value_clip",
        Optional(&POSITIVE),
        "bound of the value's change at the start; it shrinks as `clip` does; `null`: none",
    ),
    key(&["a2c", "acktr"], "value_coef", POSITIVE, "weight of the value function's squared error"),
    key(
        &["ppo", "a2c"],
        "max_grad_norm",
        POSITIVE,
        "bound of the gradient's norm; `ppo`: of each network; `a2c`: of both together",
    ),
    key(&["ppo", "sac"], "adam_epsilon", POSITIVE, "added to the root of Adam's second moment"),
    key(ON_POLICY, "action_clip", POSITIVE, "actions drawn are clipped to this and divided by it"),
    key(
        ON_POLICY,
        "action_std.init_log",
        Number(Range::Finite),
        "logarithm of the actions' standard deviation at the start, before the division",
    ),
    key(ON_POLICY, "action_std.min", Schedule(Range::Positive), "smallest standard deviation"),
    key(ON_POLICY, "action_std.max", POSITIVE, "largest standard deviation"),
    key(A2C, "rms_decay", FRACTION, "decay of RMSProp's mean square"),
    key(A2C, "rms_epsilon", POSITIVE, "added to RMSProp's mean square under the root"),
    key(ACKTR, "kl_clip", POSITIVE, "divergence that a step may cause, nats"),
    key(ACKTR, "momentum", FRACTION, "decay of the sum of steps"),
    key(ACKTR, "damping", POSITIVE, "added to the Fisher matrix"),
    key(ACKTR, "stats_decay", FRACTION, "decay of the running means of the Fisher matrix's factors"),
    key(ACKTR, "inverse_every", Count(1, MOST), "updates between inversions of the factors"),
    key(SAC, "replay", Count(1, MOST), "agent-steps that are kept"),
    key(SAC, "warmup", Steps(0), "agent-steps before the first update"),
    key(SAC, "batch", Count(16, MOST), "samples of an update, a multiple of 16"),
    key(SAC, "updates", Count(1, MOST), "updates after each rollout"),
    key(SAC, "tau", POSITIVE, "part of the way that the slow value networks go in an update"),
    key(SAC, "n_step", Count(1, 65_536), "rewards that count before the value of a state"),
    key(SAC, "init_alpha", POSITIVE, "weight of the entropy at the start"),
    key(FILE, "summary_freq", Steps(1), "agent-steps between progress lines where there is no terminal"),
    key(FILE, "checkpoint_interval", Steps(1), "agent-steps between checkpoints"),
    key(FILE, "keep_checkpoints", Count(0, MOST), "policies on the way that are kept"),
];

/// Whether a file's own keys may stand in the section of a role.
const OF_ROLES: [&str; 3] = ["network", "statistics", "rewards"];

/// Names under which a section may be in a section, `""` being the whole file; the keys first.
pub fn names_in(section: &str, of_role: bool) -> Vec<&'static str> {
    let mut names = Vec::new();
    for key in KEYS {
        for of_key in key.sections {
            let Some(name) = below(section, of_key, key.name) else { continue };
            let fits = !of_role || !section.is_empty() || OF_ROLES.contains(&name) || ALGORITHMS.contains(&name);
            if fits && !names.contains(&name) {
                names.push(name);
            }
        }
    }
    names
}

/// The first name of a key's path below a section, if it lies below.
fn below(section: &str, of_key: &'static str, name: &'static str) -> Option<&'static str> {
    let first = |path: &'static str| path.split('.').next().unwrap_or(path);
    if section.is_empty() {
        return Some(if of_key.is_empty() { name } else { first(of_key) });
    }
    let inside = |path: &'static str, section: &str| path.strip_prefix(section)?.strip_prefix('.');
    match of_key == section {
        true => Some(first(name)),
        false => match inside(of_key, section) {
            Some(rest) => Some(first(rest)),
            // a section of the section, such as `ppo.action_std`
            None => inside(name, section.strip_prefix(of_key)?.strip_prefix('.')?).map(first),
        },
    }
}

/// The key with a path.
pub fn find(path: &str) -> Option<&'static Key> {
    KEYS.iter().find(|key| paths(key).any(|known| known == path))
}

/// The paths of a key: one for each section that has it.
pub fn paths(key: &Key) -> impl Iterator<Item = String> {
    let Key { sections, name, .. } = *key;
    sections.iter().map(move |section| if section.is_empty() { name.into() } else { format!("{section}.{name}") })
}

/// The paths of all keys, sections joined by dots.
pub fn all() -> Vec<String> {
    KEYS.iter().flat_map(paths).collect()
}

/// The path of the first key with a name, for a name that stands in the wrong section.
pub fn elsewhere(name: &str) -> Option<String> {
    let known = |path: &String| path.rsplit('.').next().is_some_and(|last| last.eq_ignore_ascii_case(name));
    // a reward's network has a learning rate, too, which is hardly meant
    KEYS.iter().flat_map(paths).filter(known).min_by_key(|path| path.starts_with("rewards."))
}

/// The place of a key or section in the order of the reference.
pub fn rank(path: &str) -> usize {
    let within = |known: &str| known.strip_prefix(path).is_some_and(|rest| rest.is_empty() || rest.starts_with('.'));
    KEYS.iter().flat_map(paths).position(|known| within(&known)).unwrap_or(usize::MAX)
}
