//! The reference of all keys, as Markdown. `docs/reference/configs.md` has it, and a test compares the two.

use super::keys::{ALGORITHMS, KEYS, Key, REWARDS};
use super::loaded::default_of;
use super::stage_keys::STAGE_KEYS;
use super::yaml;
use marathon_learn::{Form, Imitation, Novelty, RewardConfig, RewardKind};
use serde_json::{Map, Value};
use std::fmt::Write;

/// Groups of sections: a heading, what is said of it, and the sections.
const GROUPS: [(&str, &str, &[&str]); 6] = [
    ("`run`", "Size and length of the run.", &["run"]),
    ("`network`", "Shape and start of the networks.", &["network"]),
    ("`statistics`", "How observations and rewards are normalized.", &["statistics"]),
    (
        "`rewards`",
        "One section for each reward. `task` is there always, the [others](../explanation/algorithms.md#additional-rewards) if they are \
         named; `amp: null` takes one of the preset away. A column has the default of each.",
        REWARDS,
    ),
    (
        "`ppo`, `a2c`, `acktr`, `sac`",
        "The section that a file has names the algorithm. A column has the default of each; an empty cell means that the \
         algorithm has no such key.",
        ALGORITHMS,
    ),
    ("The file itself", "", &[""]),
];

/// Text above the table of stages.
const ABOUT_STAGES: &str = "Keys of a stage of a [recipe](#recipes). A stage has one of three kinds: it trains, distills (`distill`) or averages (`average`). The \
    meaning begins with the kinds that have the key. A stage that trains also has the keys above, and every stage has `options`.";

/// Tables of all keys.
pub fn reference() -> String {
    let mut text = String::new();
    for (heading, about, sections) in GROUPS {
        let _ = writeln!(text, "### {heading}\n");
        if !about.is_empty() {
            let _ = writeln!(text, "{about}\n");
        }
        let several = sections.len() > 1;
        let names: Vec<String> = match several {
            true => sections.iter().map(|section| format!("`{}`", section.trim_start_matches("rewards."))).collect(),
            false => vec!["default".into()],
        };
        let _ = writeln!(text, "| key | {} | value | meaning |", names.join(" | "));
        let _ = writeln!(text, "|---|{}---|---|", "---|".repeat(names.len()));
        for key in KEYS.iter().filter(|key| sections.contains(&key.sections[0])) {
            let cells: Vec<String> = sections.iter().map(|section| cell(key, section)).collect();
            let Key { name, kind, about, .. } = key;
            let _ = writeln!(text, "| `{name}` | {} | {} | {about} |", cells.join(" | "), kind.text());
        }
        text.push('\n');
    }
    text + &stages()
}

/// Table of the keys of stages.
fn stages() -> String {
    let mut text =
        format!("### `stages`\n\n{ABOUT_STAGES}\n\n| key | default | value | meaning |\n|---|---|---|---|\n");
    for Key { sections, name, kind, about } in STAGE_KEYS {
        let default = match *name {
            "task" => "that of the file",
            "seed" => "1",
            "episodes" => "100",
            "or_fail" => "false",
            "steps" | "hidden" | "agents" | "lr" if sections.contains(&"distill") => "as of the command",
            _ => "none",
        };
        let value = match *name {
            "seeds" => "a list of whole numbers".into(),
            "distill" | "average" => "a list of stages or files".into(),
            _ => kind.text(),
        };
        let kinds: Vec<String> = sections.iter().map(|kind| format!("`{kind}`")).collect();
        let _ = writeln!(text, "| `{name}` | {default} | {value} | {}: {about} |", kinds.join(", "));
    }
    text.push('\n');
    text
}

/// The default of a key in a section; of a key that all algorithms share, that of PPO and of those that differ.
fn cell(key: &Key, section: &str) -> String {
    if !key.sections.contains(&section) {
        return String::new();
    }
    let path = format!("{section}.{}", key.name);
    let default = |algorithm: &str| shown(&all_of(algorithm), path.trim_start_matches('.'));
    if ALGORITHMS.contains(&section) {
        return default(section);
    }
    let own = default(ALGORITHMS[0]);
    let others = ALGORITHMS[1..].iter().map(|name| (*name, default(name))).filter(|(_, other)| *other != own);
    let others: Vec<String> = others.map(|(name, other)| format!("`{name}` {other}")).collect();
    match others.is_empty() || REWARDS.contains(&section) {
        true => own,
        false => format!("{own} ({})", others.join(", ")),
    }
}

/// Defaults of an algorithm, with all rewards.
fn all_of(algorithm: &str) -> Map<String, Value> {
    let mut loaded = default_of(algorithm);
    let imitation = |form| RewardKind::Imitation(Imitation { form, ..Default::default() });
    let kinds = [
        RewardKind::Curiosity(Novelty::default()),
        RewardKind::Rnd(Novelty::default()),
        imitation(Form::Gail),
        imitation(Form::Amp),
    ];
    loaded.config.rewards.extend(kinds.map(RewardConfig::new));
    loaded.document()
}

fn shown(document: &Map<String, Value>, path: &str) -> String {
    let mut value = None;
    for name in path.split('.') {
        value = value.map_or(document.get(name), |value: &Value| value.get(name));
    }
    value.map_or("`null`".into(), yaml::inline)
}
