//! A file of Marathon's contains the settings that differ from the preset of the task, by the fields of the trainer's
//! configuration. Errors name the line.

use marathon_config::{Loaded, default_for, default_of, parse, parse_object, set};
use marathon_learn::{Algorithm, Ppo, RewardKind, Schedule};
use std::path::Path;

fn read(text: &str, task: &str) -> Loaded {
    parse(Path::new("a.yaml"), text.as_bytes(), task).unwrap_or_else(|e| panic!("{text}: {e}"))
}

fn error(text: &str) -> String {
    parse(Path::new("a.yaml"), text.as_bytes(), "hopper").expect_err(text).to_string()
}

fn ppo(loaded: &Loaded) -> Ppo {
    let Algorithm::Ppo(ppo) = loaded.config.algorithm else { panic!("not PPO: {:?}", loaded.config) };
    ppo
}

#[test]
fn a_file_changes_what_it_names_and_nothing_else() {
    let preset = default_for("hopper");
    assert_eq!(read("{}", "hopper"), preset);
    let text = "
run: {agents: 64, total_steps: 2e6}
network: {hidden: [48], critic_hidden: [64, 32]}
statistics: {scale_rewards: no}
rewards: {rnd: {strength: 0.02}}
ppo:
  lr: 5.e-4
  clip: {to: 0.1}
  target_kl: 0.02
  action_std: {min: {to: 0.02}}
summary_freq: 5_000
keep_checkpoints: 0
options: {max_episode_steps: 10}
";
    let loaded = read(text, "hopper");
    let mut want = preset.clone();
    (want.config.run.agents, want.config.run.total_steps) = (64, 2_000_000);
    (want.config.network.hidden, want.config.network.critic_hidden) = (vec![48], Some(vec![64, 32]));
    want.config.statistics.scale_rewards = false;
    want.config.rewards.push(marathon_learn::RewardConfig::new(RewardKind::Rnd(Default::default())));
    want.config.rewards[1].strength = 0.02;
    let mut changed = ppo(&preset);
    (changed.lr, changed.clip, changed.target_kl) = (5e-4, Schedule { from: 0.2, to: 0.1 }, Schedule::constant(0.02));
    changed.action_std.min.to = 0.02;
    want.config.algorithm = Algorithm::Ppo(changed);
    (want.summary_freq, want.keep_checkpoints) = (5000, 0);
    want.options = vec![("max_episode_steps".into(), "10".parse().unwrap())];
    assert_eq!(loaded, want);
    // an object of a program says the same
    let object = r#"{"ppo": {"lr": 3e-4, "value_clip": null}, "network": {"hidden": [8, 8]}}"#;
    assert_eq!(
        parse_object("config", object, "hopper").unwrap(),
        read("ppo: {lr: 3e-4}\nnetwork: {hidden: [8, 8]}", "hopper")
    );
}

#[test]
fn without_a_preset_and_with_another_algorithm_defaults_hold() {
    assert_eq!(read("preset: false", "hopper"), Loaded::default());
    assert_eq!(read("{}", "MyRobot-v3"), Loaded::default());
    assert_eq!(read("sac: {}", "hopper"), default_of("sac"));
    let loaded = read("a2c: {lr: 0.1}\nrun: {agents: 32}", "MarathonManWalk");
    assert_eq!((loaded.config.algorithm.name(), loaded.config.run.agents, loaded.options.len()), ("a2c", 32, 0));
    assert_eq!(loaded.config.run.horizon, default_of("a2c").config.run.horizon);
    // the preset has a reward for imitation
    let alone = read("rewards: {amp: null}\nstatistics: {scale_rewards: true}", "MarathonManSteer");
    assert_eq!((default_for("MarathonManSteer").config.rewards.len(), alone.config.rewards.len()), (2, 1));
}

#[test]
fn tasks_of_a_file_lie_over_what_it_says_about_all() {
    let text = "
run: {total_steps: 1000}
ppo: {epochs: 2, action_std: {min: 0.3}}
tasks:
  Hopper-v1: {run: {total_steps: 3000}}
  Hopper: &hopper
    run: {total_steps: 2000}
    ppo: {action_std: {min: {to: 0.1}}}
  Walker2d: *hopper
  Ant: {acktr: {}}
";
    let steps = |task: &str| read(text, task).config.run.total_steps;
    assert_eq!(["hopper", "Hopper-v1", "walker", "humanoid"].map(steps), [2000, 3000, 2000, 1000]);
    let hopper = ppo(&read(text, "hopper"));
    assert_eq!((hopper.epochs, hopper.action_std.min), (2, Schedule { from: 0.3, to: 0.1 }));
    let ant = read(text, "ant");
    assert_eq!((ant.config.algorithm.name(), ant.config.run.total_steps), ("acktr", 1000));
    assert_eq!(
        read(text, "humanoid").notes,
        ["'tasks' has no section for Humanoid-v0: the settings outside of 'tasks' apply"]
    );
}

#[test]
fn a_role_starts_from_the_first_ones_settings() {
    let text = "
ppo: {lr: 2e-3, value_warmup: 10}
roles:
  builder: {ppo: {value_warmup: 0}, network: {hidden: [9]}}
  referee: {a2c: {lr: 0.5}}
";
    let config = read(text, "TerrainWalker2d").config;
    let [builder, referee] = ["builder", "referee"].map(|role| config.of_role(role));
    let Algorithm::Ppo(of_builder) = builder.algorithm else { panic!("{builder:?}") };
    assert_eq!((of_builder.lr, of_builder.value_warmup, &builder.network.hidden[..]), (2e-3, 0, &[9][..]));
    assert_eq!((builder.rewards, builder.run), (config.rewards.clone(), config.run.clone()));
    let Algorithm::A2c(of_referee) = referee.algorithm else { panic!("{referee:?}") };
    assert_eq!((of_referee.lr, of_referee.rms_decay, &referee.network), (0.5, 0.99, &config.network));
    let loaded = set(read(text, "TerrainWalker2d"), "roles.builder.ppo.lr=0.25").unwrap();
    assert!(loaded.config.of_role("builder").algorithm.rates().starts_with("lr is 2.5e-1"));
}

#[test]
fn everything_is_written_as_it_is_read() {
    let mut all: Vec<(String, Loaded)> =
        marathon_envs::ids().into_iter().map(|id| (id.clone(), default_for(&id))).collect();
    all.extend(Algorithm::NAMES.map(|name| (name.to_string(), default_of(name))));
    let fancy = "
run: {seed: 18446744073709551615, policy_average: 0.1, total_steps: 1234567}
rewards: {curiosity: {}, gail: {demonstrations: 'a b.demo', observations: [touch]}, amp: {actions: true, logit_decay: 0}}
ppo: {ratio: per_action, value_clip: 0.25, lr_range: [1e-7, 0.1], clip: {to: 0.012345678901234567}}
roles: {builder: {a2c: {}, network: {initialization: ml_agents}, statistics: {scale_rewards: false}}}
options: {clip: 'my clip.bvh', price: 1e-3, flag: true, range: [0.8, 2], open: '(0.7, inf)', far: inf}
";
    all.push(("fancy".into(), read(fancy, "hopper")));
    for (name, loaded) in all {
        let again = read(&format!("preset: false\n{}", loaded.to_yaml()), &name);
        assert_eq!(again, loaded, "{name}: {}", loaded.to_yaml());
    }
}

#[test]
fn what_is_wrong_is_refused_with_its_line() {
    for (text, message) in [
        ("run:\n  agnts: 3\n", "a.yaml:2: run.agnts: unknown key; did you mean 'agents'?"),
        ("rnu: {agents: 16}\n", "a.yaml:1: rnu: unknown key; did you mean 'run'?"),
        ("lr: 3\n", "a.yaml:1: lr: unknown key; did you mean 'ppo.lr'?"),
        ("network: {gae_lambda: 1}\n", "a.yaml:1: network.gae_lambda: unknown key; did you mean 'ppo.gae_lambda'?"),
        ("ppo:\n  action_std: {mni: 3}\n", "a.yaml:2: ppo.action_std.mni: unknown key; did you mean 'min'?"),
        ("ppo: {rms_decay: 0.9}\n", "a.yaml:1: ppo.rms_decay: unknown key; did you mean 'a2c.rms_decay'?"),
        ("rewards: {amp: {shape: 1}}\n", "a.yaml:1: rewards.amp.shape: unknown key; did you mean 'share'?"),
        ("tasks:\n  Hopper:\n    tasks: {}\n", "a.yaml:3: tasks.Hopper.tasks: unknown key"),
        ("roles:\n  a:\n    run: {agents: 16}\n", "a.yaml:3: roles.a.run: unknown key"),
        ("run: 3\n", "a.yaml:1: run: found '3', expected a mapping"),
        ("run: {agents: many}\n", "a.yaml:1: run.agents: found 'many', expected a whole number above 0"),
        ("run: {agents: 100}\n", "a.yaml:1: run.agents: found 100, expected a multiple of 16, such as 96"),
        ("ppo: {lr: -1}\n", "a.yaml:1: ppo.lr: found '-1', expected a positive number"),
        ("ppo: {clip: big}\n", "a.yaml:1: ppo.clip: found 'big', expected a positive number, or {from: A, to: B}"),
        ("ppo:\n  clip: {form: 1}\n", "a.yaml:2: ppo.clip.form: unknown key; did you mean 'from'?"),
        ("ppo:\n  clip:\n    to: 0\n", "a.yaml:3: ppo.clip.to: found '0', expected a positive number"),
        ("ppo: {lr_range: [3, 1]}\n", "found [3.0, 1.0], expected two positive numbers in ascending order"),
        ("ppo: {lr_schedule: cosine}\n", "found 'cosine', expected one of constant, linear, adaptive"),
        ("acktr: {lr_schedule: adaptive}\n", "found 'adaptive', expected one of constant, linear"),
        (
            "network:\n  hidden: 64\n",
            "a.yaml:2: network.hidden: found '64', expected a list of widths such as [64, 64]",
        ),
        ("network: {activation: gelu}\n", "found 'gelu', expected one of swish, tanh, elu, relu"),
        ("statistics: {scale_rewards: maybe}\n", "found 'maybe', expected true or false"),
        ("rewards: {rnd: 3}\n", "a.yaml:1: rewards.rnd: found '3', expected a mapping"),
        (
            "rewards:\n  task: null\n",
            "a.yaml:2: rewards.task: found nothing, expected a mapping such as {gamma: 0.99}: no run is without the task's own reward",
        ),
        (
            "tasks:\n  Hoper: {ppo: {lr: 1}}\n",
            "a.yaml:2: tasks.Hoper: found 'Hoper', expected the name of a task; `marathon list` shows all; did you mean 'Hopper-v0'?",
        ),
        (
            "tasks:\n  Hopper: {}\n  xyzzy: {}\n",
            "a.yaml:3: tasks.xyzzy: found 'xyzzy', expected the name of a task; `marathon list` shows all",
        ),
        ("tasks: {dog.xml: {}}\n", "tasks.dog.xml: found 'dog.xml', expected the name of a task"),
        ("sac: {replay: 1e12}\n", "a.yaml:1: sac.replay: found '1e12', expected a whole number up to 2147483648"),
        ("run: {agents: 1e30}\n", "a.yaml:1: run.agents: found '1e30', expected a whole number up to 2147483648"),
        (
            "run:\n  horizon: 100000000\n",
            "a.yaml:2: run.horizon: found 100000000, expected at most 16777216 with 128 agents",
        ),
        ("run: {rollouts: 1e7}\n", "a.yaml:1: run.rollouts: found '1e7', expected a whole number up to 1000000"),
        ("ppo: {epochs: 1001}\n", "a.yaml:1: ppo.epochs: found '1001', expected a whole number up to 1000"),
        (
            "run: {total_steps: 1.5}\n",
            "a.yaml:1: run.total_steps: found '1.5', expected a whole number above 0, also as 8e6, 500k or 8M",
        ),
        (
            "run: {total_steps: 1e30}\n",
            "a.yaml:1: run.total_steps: found '1e30', expected a whole number from 1 to 9007199254740992",
        ),
        (
            "rewards:\n  amp:\n    share: 2\n",
            "a.yaml:3: rewards.amp.share: found 2, expected a number above 0 and at most 1",
        ),
        (
            "ppo: {}\nsac: {}\n",
            "a.yaml:2: sac: found another algorithm, expected settings of one algorithm, ppo or sac",
        ),
        ("options: [a]\n", "a.yaml:1: options: found a list, expected a mapping"),
        (
            "ppo:\n  epochs: 1\n  action_std:\n    max: 0.01\n",
            "a.yaml:4: ppo.action_std.max: found 0.01, expected a number not below the smallest deviation, 0.42",
        ),
        ("run: {agents: 16, horizon: 1}\n", "a.yaml: configuration: ppo.minibatches is 8, expected at most"),
        (
            "roles:\n  a:\n    ppo: {minibatches: 4096}\n",
            "a.yaml:3: roles.a.ppo.minibatches: found 4096, expected at most 512",
        ),
    ] {
        let found = error(text);
        assert!(found.starts_with(message) || found.contains(message), "{text}: {found}");
    }
    let wrong = set(default_for("hopper"), "ppo.lr=[1]").unwrap_err().to_string();
    assert_eq!(wrong, "--set: ppo.lr: found a list, expected a positive number");
    let wrong = set(default_for("hopper"), "rewards.task=null").unwrap_err().to_string();
    assert!(wrong.starts_with("--set: rewards.task: found nothing"), "{wrong}");
    // a section of files
    let wrong = set(default_for("hopper"), "behaviors.Hopper=1").unwrap_err().to_string();
    assert!(
        wrong.starts_with("--set: behaviors: unknown key; expected one of") && !wrong.contains(", behaviors"),
        "{wrong}"
    );
}

#[test]
fn steps_have_short_forms() {
    for (text, steps) in [("8M", 8_000_000), ("500k", 500_000), ("2.5e6", 2_500_000), ("1_000", 1000)] {
        let loaded = set(default_for("hopper"), &format!("run.total_steps={text}")).unwrap();
        assert_eq!(loaded.config.run.total_steps, steps, "{text}");
    }
    assert_eq!(read("run: {total_steps: 4.35M}\nsummary_freq: 10k", "hopper").summary_freq, 10_000);
    // other numbers have none
    assert!(set(default_for("hopper"), "run.agents=1k").is_err());
}

#[test]
fn any_name_of_a_task_finds_its_section() {
    let steps = |text: &str, task: &str| read(text, task).config.run.total_steps;
    let text = "run: {total_steps: 5}\ntasks: {walker: {run: {total_steps: 7}}, ant: {run: {total_steps: 9}}}";
    assert_eq!(["Walker2d-v0", "Ant", "hopper"].map(|task| steps(text, task)), [7, 9, 5]);
    // a task that a program has made
    assert_eq!(steps("tasks: {MyRobot-v3: {run: {total_steps: 3}}}", "MyRobot-v3"), 3);
}

/// The settings of every preset, on a line each: a change of the files, the defaults or the reader shows here.
#[test]
fn presets_are_what_they_were() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/presets.txt");
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/configs");
    let mut text = String::new();
    let mut line = |name: &str, loaded: &Loaded| {
        text += &format!("{name} {}\n", serde_json::Value::Object(loaded.differences()));
    };
    for id in marathon_envs::ids() {
        line(&id, &default_for(&id));
    }
    let mut files: Vec<_> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    for file in files {
        let name = file.file_name().unwrap().to_string_lossy().into_owned();
        if name.ends_with("-fast.yaml") {
            continue;
        }
        for id in marathon_envs::ids() {
            let Ok(loaded) = parse(&file, &std::fs::read(&file).unwrap(), &id) else { continue };
            let is_other = |note: &String| note.starts_with("nothing about") || note.starts_with("'tasks' has no");
            if !loaded.notes.iter().any(is_other) {
                line(&format!("{name} {id}"), &loaded);
            }
        }
    }
    if std::env::var_os("MARATHON_BLESS").is_some() {
        std::fs::write(&path, &text).unwrap();
    }
    let pinned = std::fs::read_to_string(&path).unwrap();
    let pairs = text.lines().zip(pinned.lines());
    pairs.for_each(|(now, before)| assert_eq!(now, before, "if it is meant: MARATHON_BLESS=1"));
    assert_eq!(text.lines().count(), pinned.lines().count());
}
