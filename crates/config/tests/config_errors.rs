//! A file of ML-Agents that is wrong is refused with file, line, key, what was found and what was expected; harmless settings without
//! effect are noted.

use marathon_config::{ConfigError, parse};
use std::path::Path;

fn error(text: &str) -> ConfigError {
    parse(Path::new("a/test.yaml"), text.as_bytes(), "hopper").expect_err("an error")
}

fn notes(text: &str) -> Vec<String> {
    parse(Path::new("a/test.yaml"), text.as_bytes(), "hopper").unwrap_or_else(|e| panic!("{e}")).notes
}

/// The whole message.
fn refuse(text: &str, message: &str) {
    assert_eq!(error(text).to_string(), message, "{text}");
}

/// A part of the message.
fn refuse_with(text: &str, part: &str) {
    let error = error(text).to_string();
    let start: String = text.chars().take(500).collect();
    assert!(error.starts_with("a/test.yaml:") && error.contains(part), "{start}: {error}");
}

#[test]
fn what_is_not_yaml_is_refused_with_its_place() {
    refuse_with("behaviors:\n  Hopper: [1, 2\n", "not YAML");
    let cut = error("behaviors:\n  {a: 1\n").to_string();
    assert!(!cut.contains("..") && !cut.contains('\\') && cut.contains("expected ',' or '}'"), "{cut}");
    refuse_with("behaviors:\n\t- x: 3\n", "a/test.yaml:2:");
    refuse("", "a/test.yaml:1:1: found nothing, expected a section such as 'run:' or 'behaviors:'");
    refuse("- 1\n", "a/test.yaml:1:1: found a list, expected a mapping with a section such as 'run:' or 'behaviors:'");
    refuse_with("a: 1\n---\nb: 2\n", "a second document, expected one");
    refuse_with("a: 1\nb: 2\na: 3\n", "a/test.yaml:3:1: found the key 'a' twice");
    refuse_with("a: &x [*x]\n", "contains itself");
    refuse_with("a: !python/object x\n", "tag");
    refuse_with("[a]: 3\n", "as a key, expected a name");
    refuse_with("a: {<<: 3}\n", "after '<<', expected a mapping");
    let bytes = parse(Path::new("t"), b"a: 1\nb: \xff\n", "hopper").unwrap_err().to_string();
    assert_eq!(bytes, "t:2:1: found bytes that are no text, expected UTF-8");
}

#[test]
fn bombs_are_refused() {
    refuse_with(&"[".repeat(100), "levels");
    refuse_with(&"- ".repeat(100_000), "levels");
    // the parser's own limit
    refuse_with(&"[".repeat(100_000), "not YAML");
    refuse_with(&format!("a: {}", "{b: ".repeat(1000)), "levels");
    // a billion laughs
    let mut laughs = "a0: &a0 [x, x, x, x, x, x, x, x, x, x]\n".to_string();
    for i in 1..10 {
        laughs += &format!("a{i}: &a{i} [{}]\n", vec![format!("*a{}", i - 1); 10].join(", "));
    }
    refuse_with(&laughs, "values");
    // aliases that nest deeper and deeper
    let mut deep = "a0: &a0 [x]\n".to_string();
    for i in 1..100 {
        deep += &format!("a{i}: &a{i} [*a{}]\n", i - 1);
    }
    refuse_with(&deep, "levels");
    refuse_with(&format!("a: {}", "x".repeat(2 << 20)), "the limit 'config_file' is 1 MB");
}

#[test]
fn unknown_keys_have_a_nearest_one() {
    refuse(
        "behaviors:\n  Hopper:\n    hyperparameters:\n      batch_sise: 12\n",
        "a/test.yaml:4: behaviors.Hopper.hyperparameters.batch_sise: unknown key; did you mean 'batch_size'?",
    );
    refuse_with(
        "behaviors:\n  Hopper:\n    max_step: 12\n",
        "3: behaviors.Hopper.max_step: unknown key; did you mean 'max_steps'?",
    );
    refuse_with("behaviors: {Hopper: {network_settings: {xyzzy: 1}}}", "expected one of normalize, hidden_units");
    // a section that older versions of Marathon read
    refuse_with(
        "behaviors: {Hopper: {marathon: {agents: 16}}}",
        "behaviors.Hopper.marathon: unknown key; expected one of",
    );
    refuse_with("behaviors: {Hopper: {reward_signals: {extrinsc: {}}}}", "did you mean 'extrinsic'?");
    refuse_with("behaviors: {Hopper: {reward_signals: {extrinsic: {gama: 1}}}}", "did you mean 'gamma'?");
    refuse_with("default_settings:\n  treshold: 3\nbehaviors: {}\n", "2: default_settings.treshold: unknown key");
    refuse_with(
        "behaviors: {Hopper: {}}\nenv_setings: {}\n",
        "2: env_setings: unknown key; did you mean 'env_settings'?",
    );
    refuse_with("behaviors: {Hopper: {}}\nenv_settings: {num_env: 3}\n", "did you mean 'num_envs'?");
    refuse_with("behaviors: {Hopper: {}}\nengine_settings: {widht: 3}\n", "did you mean 'width'?");
    refuse_with("behaviors: {Hopper: {}}\ncheckpoint_settings: {run_ids: 3}\n", "did you mean 'run_id'?");
    refuse_with("behaviors: {Hopper: {}}\ntorch_settings: {devise: cpu}\n", "did you mean 'device'?");
    refuse_with("Hopper:\n  num_epoc: 3\n", "2: Hopper.num_epoc: unknown key; did you mean 'num_epoch'?");
    refuse_with("behaviours: {Hopper: {}}\n", "1: behaviours: unknown key; did you mean 'behaviors'?");
}

#[test]
fn wrong_values_say_what_would_do() {
    let of = |key: &str, value: &str| format!("behaviors:\n  Hopper:\n    hyperparameters:\n      {key}: {value}\n");
    refuse(
        &of("batch_size", "many"),
        "a/test.yaml:4: behaviors.Hopper.hyperparameters.batch_size: found 'many', expected a whole number between 16 and 2147483648",
    );
    for (key, value, found, expected) in [
        ("batch_size", "8", "'8'", "a whole number between 16"),
        ("num_epoch", "2.5", "'2.5'", "a whole number"),
        ("num_epoch", "", "nothing", "a whole number"),
        ("num_epoch", "[3]", "a list", "a whole number"),
        ("buffer_size", "{}", "a mapping", "a whole number"),
        ("buffer_size", "-1", "'-1'", "a whole number"),
        ("learning_rate", "0", "'0'", "a positive number"),
        ("learning_rate", ".inf", "'.inf'", "a positive number"),
        ("learning_rate", "inf", "'inf'", "a positive number"),
        ("beta", "-0.1", "'-0.1'", "a number not below 0"),
        ("lambd", "1.1", "'1.1'", "a number between 0 and 1"),
        ("epsilon", "nan", "'nan'", "a positive number"),
        ("learning_rate_schedule", "cosine", "'cosine'", "one of constant, linear"),
        ("learning_rate_schedule", "null", "nothing", "one of constant, linear"),
    ] {
        refuse_with(
            &of(key, value),
            &format!("4: behaviors.Hopper.hyperparameters.{key}: found {found}, expected {expected}"),
        );
    }
    refuse_with("behaviors: {Hopper: {max_steps: 50e63}}", "found '50e63', expected a whole number");
    refuse_with("behaviors: {Hopper: {hyperparameters: 3}}", "found '3', expected a mapping");
    refuse_with("behaviors: {Hopper: 3}", "behaviors.Hopper: found '3', expected a mapping");
    refuse_with("behaviors: 3", "behaviors: found '3', expected a mapping");
    refuse_with("behaviors: {Hopper: {}}\nenv_settings: {seed: -2}", "found '-2', expected a whole number");
    refuse_with("Hopper: {normalize: perhaps}", "1: Hopper.normalize: found 'perhaps', expected true or false");
}

#[test]
fn values_that_do_not_go_together_are_refused() {
    refuse(
        "behaviors: {Hopper: {trainer_type: sac, hyperparameters: {batch_size: 100}}}",
        "a/test.yaml:1: behaviors.Hopper.hyperparameters.batch_size: found '100', expected a multiple of 16 up to 1048576",
    );
}

#[test]
fn agents_that_are_not_in_the_file_are_missed() {
    let message = error("behaviors: {Crawler: {}, Worm: {}}").to_string();
    assert!(
        message.starts_with("a/test.yaml: nothing about agent Hopper-v0; the file has Crawler, Worm;"),
        "{message}"
    );
    assert!(
        message.contains("Hopper-v0, Hopper, DeepMindHopperBrain") && message.contains("default_settings"),
        "{message}"
    );
    let message = error("Crawler: {num_epoch: 3}").to_string();
    assert!(message.contains("the file has Crawler") && message.contains("or default"), "{message}");
    let message = error("behaviors: {Hoper: {}}").to_string();
    assert!(message.contains("did you mean 'Hopper' for 'Hoper'?"), "{message}");
    assert!(error("behaviors: {}").to_string().contains("the file has none"));
}

#[test]
fn a_file_without_behaviors_is_not_converted() {
    let convert = |text: &str| marathon_config::convert(Path::new("a/test.yaml"), text.as_bytes());
    let wrong = convert("behaviors: {}").unwrap_err().to_string();
    let expected = "a behavior with the name of a task, such as Hopper, or default_settings";
    assert_eq!(wrong, format!("a/test.yaml:1: behaviors: found no behavior, expected {expected}"));
    // settings that serve all are enough
    let (_, notes) = convert("behaviors: {}\ndefault_settings: {max_steps: 1000}").unwrap();
    assert_eq!(notes, Vec::<String>::new());
    let (_, notes) = convert("behaviors: {Hoper: {}, HopperBrain: {}, xyzzy: {}}").unwrap();
    assert_eq!(
        notes,
        [
            "no task has the name 'Hoper': rename it before you train with the result; did you mean 'Hopper-v0'?",
            "no task has the name 'xyzzy': rename it before you train with the result",
        ]
    );
}

#[test]
fn features_that_are_not_here_are_refused() {
    let behavior = |text: &str| format!("behaviors:\n  Hopper:\n    {text}\n");
    refuse(
        &behavior("trainer_type: poca"),
        "a/test.yaml:3: behaviors.Hopper.trainer_type: this trainer is not supported; found 'poca', expected one of ppo, a2c, acktr, sac",
    );
    for (text, message) in [
        (
            "network_settings: {memory: {memory_size: 128}}",
            "network_settings.memory: recurrent memory is not supported",
        ),
        (
            "reward_signals: {extrinsic: {}, gail: {use_vail: true}}",
            "gail.use_vail: a variational bottleneck of the discriminator is not supported; found 'true', expected false",
        ),
        (
            "reward_signals: {extrinsic: {}, amp: {observations: touch}}",
            "amp.observations: found 'touch', expected a list of names of an observation's parts",
        ),
        ("reward_signals: {extrinsic: {}, amp: {use_vail: true}}", "amp.use_vail: unknown key"),
        ("reward_signals: {extrinsic: {}, gail: {demo_path: [x]}}", "expected the path of a .demo file"),
        (
            "reward_signals: {curiosity: {strength: 0}}",
            "training without the task's own reward is not supported; found nothing",
        ),
        ("reward_signals: {extrinsic: {strength: 0}}", "extrinsic.strength: found '0', expected a positive number"),
        ("behavioral_cloning: {demo_path: x}", "behavioral cloning is not supported"),
        ("self_play: {window: 10}", "self-play is not supported; found a mapping, expected null"),
        ("init_path: results/x", "starting from another run is not supported"),
        (
            "hyperparameters: {shared_critic: true}",
            "one network for policy and value is not supported; found 'true', expected false",
        ),
    ] {
        refuse_with(&behavior(text), message);
        refuse_with(&behavior(text), "a/test.yaml:3:");
    }
    for (text, message) in [
        (
            "environment_parameters: {gravity: 3}",
            "2: environment_parameters: a curriculum or randomized environment is not",
        ),
        ("checkpoint_settings: {resume: true}", "2: checkpoint_settings.resume: choosing by a file"),
        (
            "checkpoint_settings: {initialize_from: x}",
            "2: checkpoint_settings.initialize_from: starting from another run",
        ),
    ] {
        refuse_with(&format!("behaviors: {{Hopper: {{}}}}\n{text}\n"), message);
    }
    refuse_with("Hopper: {trainer: sac, tau: 0.005}", "SAC in a file of this format is not supported");
    refuse_with(
        "behaviors: {Hopper: {trainer_type: sac, hyperparameters: {beta: 1}}}",
        "hyperparameters.beta: unknown key",
    );
    refuse_with(
        "behaviors: {Hopper: {trainer_type: sac, hyperparameters: {batch_size: 100}}}",
        "batch_size: found '100', expected a multiple of 16",
    );
    refuse_with(
        "Hopper:\n  use_recurrent: true\n",
        "2: Hopper.use_recurrent: recurrent memory is not supported; found 'true'",
    );
    refuse_with(
        "behaviors: {Hopper: {reward_signals: {extrinsic: {}, rnd: {strenght: 1}}}}",
        "did you mean 'strength'?",
    );
    refuse_with(
        "behaviors: {Hopper: {trainer_type: acktr, reward_signals: {extrinsic: {}, rnd: {}}}}",
        "rewards is rnd, expected the task's alone with acktr; ppo and a2c take others",
    );
}

#[test]
fn features_that_are_switched_off_do_no_harm() {
    let off = "
behaviors:
  Hopper:
    network_settings: {memory: null, vis_encode_type: simple, goal_conditioning_type: hyper, deterministic: false}
    reward_signals: {extrinsic: {}, curiosity: {strength: 0.0}}
    self_play: null
    behavioral_cloning: ~
    init_path:
    threaded: false
    hyperparameters: {shared_critic: false}
environment_parameters: null
checkpoint_settings: {resume: false, initialize_from: null}
env_settings: {seed: -1, env_path: null}
";
    assert_eq!(notes(off), Vec::<String>::new());
    assert_eq!(notes("Hopper: {use_curiosity: false, use_recurrent: false, memory_size: 256}"), Vec::<String>::new());
}

#[test]
fn settings_of_another_trainer_are_noted() {
    let notes = notes("behaviors:\n  Hopper:\n    trainer_type: acktr\n    hyperparameters: {epsilon: 0.1}\n");
    assert_eq!(notes, ["line 4: behaviors.Hopper.hyperparameters.epsilon has no effect: acktr bounds no ratio",]);
}

#[test]
fn settings_without_effect_are_noted() {
    let text = "
behaviors:
  Hopper:
    threaded: true
    time_horizon: 1000
    hyperparameters: {learning_rate_schedule: linear, buffer_size: 4096}
    network_settings: {vis_encode_type: resnet, deterministic: true}
    reward_signals: {extrinsic: {strength: 0.5}}
env_settings: {num_envs: 4}
engine_settings: {time_scale: 20}
torch_settings: {device: cuda}
checkpoint_settings: {run_id: x}
";
    let notes = notes(text).join("\n");
    for part in [
        "line 4: behaviors.Hopper.threaded has no effect",
        "line 5: behaviors.Hopper.time_horizon has no effect: each of the 16 agents adds 256 decisions",
        "line 7: behaviors.Hopper.network_settings.vis_encode_type has no effect",
        "line 7: behaviors.Hopper.network_settings.deterministic has no effect",
        "line 8: behaviors.Hopper.reward_signals.extrinsic.strength has no effect",
        "line 9: env_settings.num_envs has no effect",
        "line 10: engine_settings has no effect",
        "line 11: torch_settings has no effect",
        "line 12: checkpoint_settings.run_id has no effect",
    ] {
        assert!(notes.contains(part), "{part}\n{notes}");
    }
}
