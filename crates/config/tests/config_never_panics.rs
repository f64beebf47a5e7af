//! No bytes make the reader of configurations panic, and what it accepts is valid.

use marathon_config::{Recipe, default_for, parse, set};
use proptest::prelude::*;
use std::path::Path;

const FILES: [&str; 5] = [
    include_str!("../../../assets/configs/paper-appendix-b.yaml"),
    include_str!("../../../assets/configs/hopper-fast.yaml"),
    include_str!("../../../assets/configs/marathon_man_controller-recipe.yaml"),
    "task: hopper\nstages: {a: {seeds: [1, 2], pick: lowest falls, until: falls < 1}, b: {average: [a/policies, a]}}\n",
    "behaviors: &b\n  Hopper: {max_steps: 5, <<: *b}\ndefault_settings: {hyperparameters: {beta: !!float 3}}\n",
];

/// Pieces of which files are made.
const PIECES: [&str; 50] = [
    "task: hopper\n",
    "stages:",
    "distill:",
    "average:",
    "seeds:",
    "until:",
    "falls < 1",
    "behaviors:",
    "Hopper:",
    "DeepMindHopperBrain:",
    "default:",
    "default_settings:",
    "hyperparameters:",
    "run:",
    "ppo:",
    "rewards:",
    "amp:",
    "tasks:",
    "roles:",
    "action_std:",
    "min:",
    "batch_size:",
    "beta:",
    "agents:",
    "max_steps:",
    "lr_range:",
    "reward_signals:",
    "extrinsic:",
    "from:",
    " ",
    "\n",
    "\n  ",
    "\n    ",
    "- ",
    "{",
    "}",
    "[",
    "]",
    ",",
    "&a ",
    "*a",
    "<<:",
    "!!float ",
    "!x ",
    "\"",
    "'",
    "1e3",
    "null",
    "|\n",
    "# ",
];

fn check(bytes: &[u8]) {
    for agent in ["hopper", "no such agent"] {
        match parse(Path::new("f.yaml"), bytes, agent) {
            Ok(loaded) => loaded.config.validate().unwrap(),
            Err(error) => assert!(error.to_string().starts_with("f.yaml"), "{error}"),
        }
    }
    match Recipe::parse(Path::new("f.yaml"), bytes) {
        Ok(recipe) => {
            for stage in &recipe.stages {
                let settings = recipe.base(stage, None).and_then(|base| recipe.settings(stage, base));
                match settings {
                    Ok(loaded) => loaded.config.validate().unwrap(),
                    Err(error) => assert!(error.to_string().starts_with("f.yaml"), "{error}"),
                }
            }
        }
        Err(error) => assert!(error.to_string().starts_with("f.yaml"), "{error}"),
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn on_any_bytes(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        check(&bytes);
    }

    #[test]
    fn on_any_text(text in "\\PC{0,200}") {
        check(text.as_bytes());
    }

    #[test]
    fn on_pieces_of_yaml(pieces in prop::collection::vec(prop::sample::select(&PIECES[..]), 0..60)) {
        check(pieces.concat().as_bytes());
    }

    #[test]
    fn on_damaged_files(file in 0..FILES.len(), at in 0.0..1.0, cut in 0usize..12, put in "\\PC{0,6}|[\\n \\t:&*!{}\\[\\]-]{0,4}") {
        let text: Vec<char> = FILES[file].chars().collect();
        let at = (at * text.len() as f64) as usize;
        let after = (at + cut).min(text.len());
        let damaged: String = text[..at].iter().copied().chain(put.chars()).chain(text[after..].iter().copied()).collect();
        check(damaged.as_bytes());
    }

    #[test]
    fn on_files_cut_short(file in 0..FILES.len(), at in 0.0..1.0) {
        let bytes = FILES[file].as_bytes();
        check(&bytes[..(at * bytes.len() as f64) as usize]);
    }

    #[test]
    fn on_any_value(key in prop::sample::select(&["max_steps", "beta", "agents", "buffer_size", "hidden_units"][..]), value in "[-+0-9.eE_]{0,24}") {
        check(format!("run: {{{key}: {value}}}").as_bytes());
        check(format!("ppo: {{{key}: {value}, lr: {value}, clip: {{to: {value}}}}}\nroles: {{a: {{ppo: {{lr: {value}}}}}}}").as_bytes());
        let _ = set(default_for("hopper"), &format!("{key}={value}"));
        let _ = set(default_for("hopper"), &format!("ppo.lr={value}"));
        check(format!("Hopper: {{{key}: {value}}}").as_bytes());
        check(format!("behaviors: {{Hopper: {{{key}: {value}, hyperparameters: {{{key}: {value}}}, network_settings: {{{key}: {value}}}}}}}").as_bytes());
    }
}

/// Expanding the aliases of this long text would take 50 GB.
#[test]
fn aliases_do_not_multiply_text() {
    let file = format!("a: &a '{}'\nb: [{}]\n", "x".repeat(400_000), "*a,".repeat(90_000));
    let error = parse(Path::new("f.yaml"), file.as_bytes(), "hopper").unwrap_err().to_string();
    assert!(error.contains("found aliases that repeat more than 16777216 bytes of text"), "{error}");
    let file = format!("a: '{}'", "x".repeat(2_000_000));
    let error = parse(Path::new("f.yaml"), file.as_bytes(), "hopper").unwrap_err().to_string();
    assert!(error.contains("f.yaml:1:1: the file asks for 2.00 MB; the limit 'config_file' is 1 MB"), "{error}");
}
