//! `docs/reference/configs.md` lists every key that there is: each field of the trainer's configuration, and no other.

use marathon_config::{Recipe, default_of, keys, parse, reference};
use marathon_learn::{Algorithm, Form, Imitation, Novelty, RewardConfig, RewardKind};
use serde_json::Value;
use std::collections::BTreeSet;
use std::path::Path;

const START: &str = "<!-- all keys: MARATHON_BLESS=1 cargo test -p marathon-config the_reference_is_complete:: -->\n\n";
const END: &str = "<!-- end of all keys -->";

/// Paths of the values of a document; the ends of a schedule are one value.
fn leaves(value: &Value, path: &str, found: &mut BTreeSet<String>) {
    match value {
        Value::Object(map) if !map.contains_key("from") => {
            for (key, value) in map {
                leaves(value, &if path.is_empty() { key.clone() } else { format!("{path}.{key}") }, found);
            }
        }
        _ => _ = found.insert(path.into()),
    }
}

#[test]
fn every_field_of_the_configuration_is_a_key_and_every_key_a_field() {
    let mut fields = BTreeSet::new();
    for algorithm in Algorithm::NAMES {
        let mut loaded = default_of(algorithm);
        let amp = Imitation { demonstrations: Some("a.demo".into()), ..Default::default() };
        let gail = Imitation { form: Form::Gail, ..amp.clone() };
        let novelty = [RewardKind::Curiosity(Novelty::default()), RewardKind::Rnd(Novelty::default())];
        let imitation = [gail, amp].map(RewardKind::Imitation);
        loaded.config.rewards.extend(novelty.into_iter().chain(imitation).map(RewardConfig::new));
        leaves(&loaded.document().into(), "", &mut fields);
    }
    assert_eq!(fields, keys().into_iter().collect());
}

#[test]
fn the_page_has_the_reference() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/reference/configs.md");
    let page = std::fs::read_to_string(&path).unwrap();
    let (before, rest) = page.split_once(START).expect("the start of the reference");
    let (found, after) = rest.split_once(END).expect("the end of the reference");
    if std::env::var_os("MARATHON_BLESS").is_some() {
        std::fs::write(&path, format!("{before}{START}{}{END}{after}", reference())).unwrap();
        return;
    }
    assert!(found == reference(), "docs/reference/configs.md is out of date: run this test with MARATHON_BLESS=1");
}

/// Configurations in the text of the page, native or of ML-Agents, are right.
#[test]
fn the_examples_of_the_page_are_valid() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/reference/configs.md");
    let page = std::fs::read_to_string(&path).unwrap();
    let examples: Vec<&str> = page.split("```yaml\n").skip(1).filter_map(|rest| rest.split("```").next()).collect();
    assert!(examples.len() >= 4, "{examples:?}");
    for text in examples {
        if text.contains("stages:") {
            Recipe::parse("example.yaml".as_ref(), text.as_bytes()).unwrap_or_else(|e| panic!("{text}{e}"));
            continue;
        }
        let task = ["TerrainWalker2d", "MarathonManSteer"].into_iter().find(|task| text.contains(task));
        parse("example.yaml".as_ref(), text.as_bytes(), task.unwrap_or("Hopper"))
            .unwrap_or_else(|e| panic!("{text}{e}"));
    }
}
