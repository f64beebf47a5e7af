//! Every key of a file of ML-Agents reaches the trainer, in both formats. This file has PPO's.

use crate::common::read;
use marathon_config::{Loaded, default_for, parse, set};
use marathon_learn::{Activation, Algorithm, Init, LrSchedule, Ratio, RewardKind, Schedule, TrainConfig};
use std::path::{Path, PathBuf};

fn asset(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/configs").join(name)
}

fn load(path: &Path, agent: &str) -> Loaded {
    let bytes = std::fs::read(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    parse(path, &bytes, agent).unwrap_or_else(|e| panic!("{e}"))
}

/// A behavior in the present format with some lines.
fn current(lines: &str) -> Loaded {
    read(&format!("behaviors:\n  Hopper:\n    trainer_type: ppo\n{lines}"), "hopper")
}

/// All settings of a configuration of PPO side by side.
#[derive(Debug, PartialEq)]
struct Flat {
    agents: usize,
    horizon: usize,
    rollouts: usize,
    total_steps: u64,
    policy_average: f64,
    seed: u64,
    threads: usize,
    hidden: Vec<usize>,
    critic_hidden: Vec<usize>,
    activation: Activation,
    initialization: Init,
    normalize_observations: bool,
    follow_statistics: bool,
    observation_clip: f64,
    scale_rewards: bool,
    statistics_cap: f64,
    gamma: f64,
    reward_strength: f64,
    minibatches: usize,
    epochs: usize,
    lr: f64,
    value_lr: f64,
    lr_schedule: LrSchedule,
    target_kl: f64,
    final_target_kl: Option<f64>,
    lr_range: [f64; 2],
    adam_epsilon: f64,
    max_grad_norm: f64,
    gae_lambda: f64,
    ratio: Ratio,
    clip: f64,
    final_clip: Option<f64>,
    value_clip: Option<f64>,
    entropy_coef: f64,
    final_entropy_coef: Option<f64>,
    action_clip: f64,
    init_log_std: f64,
    min_std: f64,
    final_min_std: Option<f64>,
    max_std: f64,
}

fn flat(loaded: &Loaded) -> Flat {
    let TrainConfig { run, network, statistics, rewards, algorithm, .. } = loaded.config.clone();
    let Algorithm::Ppo(ppo) = algorithm else { panic!("a configuration of {}", algorithm.name()) };
    let last = |moving: Schedule| (moving.to != moving.from).then_some(moving.to);
    assert_eq!((rewards.len(), &rewards[0].kind), (1, &RewardKind::Task));
    Flat {
        agents: run.agents,
        horizon: run.horizon,
        rollouts: run.rollouts,
        total_steps: run.total_steps,
        policy_average: run.policy_average,
        seed: run.seed,
        threads: run.threads,
        critic_hidden: network.critic().to_vec(),
        hidden: network.hidden,
        activation: network.activation,
        initialization: network.initialization,
        normalize_observations: statistics.normalize_observations,
        follow_statistics: statistics.follow_statistics,
        observation_clip: statistics.observation_clip,
        scale_rewards: statistics.scale_rewards,
        statistics_cap: statistics.statistics_cap,
        gamma: rewards[0].gamma,
        reward_strength: rewards[0].strength,
        minibatches: ppo.minibatches,
        epochs: ppo.epochs,
        lr: ppo.lr,
        value_lr: ppo.value_lr,
        lr_schedule: ppo.lr_schedule,
        target_kl: ppo.target_kl.from,
        final_target_kl: last(ppo.target_kl),
        lr_range: ppo.lr_range,
        adam_epsilon: ppo.adam_epsilon,
        max_grad_norm: ppo.max_grad_norm,
        gae_lambda: ppo.gae_lambda,
        ratio: ppo.ratio,
        clip: ppo.clip.from,
        final_clip: last(ppo.clip),
        value_clip: ppo.value_clip,
        entropy_coef: ppo.entropy_coef.from,
        final_entropy_coef: last(ppo.entropy_coef),
        action_clip: ppo.action_clip,
        init_log_std: ppo.action_std.init_log,
        min_std: ppo.action_std.min.from,
        final_min_std: last(ppo.action_std.min),
        max_std: ppo.action_std.max,
    }
}

#[test]
fn what_is_left_out_has_the_value_of_ml_agents() {
    let loaded = current("");
    let expected = Flat {
        agents: 160,
        horizon: 64,
        minibatches: 10,
        epochs: 3,
        total_steps: 500_000,
        hidden: vec![128, 128],
        critic_hidden: vec![128, 128],
        activation: Activation::Swish,
        lr: 3e-4,
        value_lr: 3e-4,
        lr_schedule: LrSchedule::Linear,
        max_grad_norm: 1e9,
        gamma: 0.99,
        gae_lambda: 0.95,
        clip: 0.2,
        final_clip: Some(0.1),
        ratio: Ratio::PerAction,
        value_clip: None,
        adam_epsilon: 1e-8,
        entropy_coef: 5e-3,
        final_entropy_coef: Some(1e-5),
        initialization: Init::MlAgents,
        action_clip: 3.0,
        init_log_std: 0.0,
        min_std: 1e-3,
        max_std: 1e3,
        normalize_observations: false,
        follow_statistics: true,
        observation_clip: 5.0,
        scale_rewards: false,
        ..flat(&Loaded::default())
    };
    assert_eq!(flat(&loaded), expected);
    assert_eq!((loaded.summary_freq, loaded.checkpoint_interval, loaded.keep_checkpoints), (50_000, 500_000, 5));
    assert_eq!(loaded.notes, Vec::<String>::new());
}

#[test]
fn every_key_of_ml_agents_counts() {
    let loaded = current(
        "    hyperparameters:
      batch_size: 512
      buffer_size: 8192
      learning_rate: 2.0e-3
      learning_rate_schedule: constant
      beta: 1e-2
      beta_schedule: linear
      epsilon: 0.3
      epsilon_schedule: linear
      lambd: .9
      num_epoch: 5
    network_settings: {normalize: true, hidden_units: 96, num_layers: 3}
    reward_signals: {extrinsic: {gamma: 0.995, strength: 1.0}}
    max_steps: 2e6
    time_horizon: 128
    summary_freq: 30000
    checkpoint_interval: 70_000
    keep_checkpoints: 9
env_settings: {seed: 77}
",
    );
    let Flat { agents, horizon, minibatches, epochs, total_steps, .. } = flat(&loaded);
    assert_eq!((agents, horizon, minibatches, epochs, total_steps), (64, 128, 16, 5, 2_000_000));
    let ppo = flat(&loaded);
    assert_eq!((ppo.lr, ppo.value_lr, ppo.lr_schedule), (2e-3, 2e-3, LrSchedule::Constant));
    assert_eq!((ppo.entropy_coef, ppo.final_entropy_coef), (1e-2, Some(1e-5)));
    assert_eq!((ppo.clip, ppo.final_clip, ppo.value_clip), (0.3, Some(0.1), None));
    assert_eq!((ppo.gae_lambda, ppo.gamma, ppo.normalize_observations), (0.9, 0.995, true));
    assert_eq!((ppo.hidden, ppo.critic_hidden), (vec![96; 3], vec![96; 3]));
    assert_eq!((ppo.seed, loaded.summary_freq), (77, 30_000));
    assert_eq!((loaded.checkpoint_interval, loaded.keep_checkpoints), (70_000, 9));
    assert!(loaded.notes.is_empty(), "{:?}", loaded.notes);
}

#[test]
fn schedules_follow_that_of_the_learning_rate_unless_they_have_their_own() {
    let ppo = flat(&current("    hyperparameters: {learning_rate_schedule: constant}\n"));
    assert_eq!((ppo.lr_schedule, ppo.final_clip, ppo.final_entropy_coef), (LrSchedule::Constant, None, None));
    let ppo = flat(&current("    hyperparameters: {epsilon_schedule: constant, beta_schedule: constant}\n"));
    assert_eq!((ppo.lr_schedule, ppo.final_clip, ppo.final_entropy_coef), (LrSchedule::Linear, None, None));
    // a decay never raises: both stay
    let ppo = flat(&current("    hyperparameters: {epsilon: 0.05, beta: 0}\n"));
    assert_eq!((ppo.clip, ppo.final_clip, ppo.entropy_coef, ppo.final_entropy_coef), (0.05, None, 0.0, None));
}

#[test]
fn the_buffer_is_filled_by_as_many_agents_as_needed() {
    for (agents, horizon) in [(16, 640), (256, 40), (512, 20), (1024, 10), (4096, 3), (16384, 1)] {
        let ppo = flat(&set(current(""), &format!("run.agents={agents}")).unwrap());
        assert_eq!((ppo.agents, ppo.horizon, ppo.minibatches), (agents, horizon, 10));
    }
    let ppo = flat(&set(current(""), "run.horizon=100").unwrap());
    assert_eq!((ppo.agents, ppo.horizon), (160, 100));
    let ppo = flat(&current("    time_horizon: 1000\n"));
    assert_eq!((ppo.agents, ppo.horizon), (16, 640));
    let ppo = flat(&current("    hyperparameters: {batch_size: 4096, buffer_size: 2048}\n"));
    assert_eq!(ppo.minibatches, 1);
}

#[test]
fn a_behavior_lies_above_the_default_settings() {
    let file = "
default_settings:
  hyperparameters: {beta: 0.5, epsilon: 0.4}
  network_settings: {hidden_units: 20, memory: {memory_size: 128}}
  max_steps: 1000
behaviors:
  Hopper:
    hyperparameters: {epsilon: 0.3}
    network_settings: {memory: null}
  Ant:
    network_settings: {memory: null}
    max_steps: 3000
";
    let hopper = flat(&read(file, "Hopper-v0"));
    assert_eq!((hopper.entropy_coef, hopper.clip, hopper.total_steps), (0.5, 0.3, 1000));
    assert_eq!(hopper.hidden, [20, 20]);
    let ant = flat(&read(file, "ant"));
    assert_eq!((ant.clip, ant.total_steps), (0.4, 3000));
    // who is not in the file at all has the defaults
    let file = "default_settings: {max_steps: 1000}\nbehaviors: {Ant: {max_steps: 2000}}";
    let walker = read(file, "walker");
    assert_eq!(flat(&walker).total_steps, 1000);
    assert!(
        walker.notes[0].contains("nothing about Walker2d-v0 itself: default_settings applies"),
        "{:?}",
        walker.notes
    );
}

#[test]
fn yaml_anchors_merges_tags_and_truth_values_are_understood() {
    let file = "
behaviors:
  Walker: &walker
    hyperparameters: &h {beta: !!float 1e-2, num_epoch: '7'}
    network_settings: {normalize: On}
  Hopper:
    <<: *walker
    hyperparameters:
      <<: *h
      num_epoch: 8
";
    let (walker, hopper) = (flat(&read(file, "walker")), flat(&read(file, "hopper")));
    assert_eq!((walker.entropy_coef, walker.epochs, walker.normalize_observations), (0.01, 7, true));
    assert_eq!((hopper.entropy_coef, hopper.epochs, hopper.normalize_observations), (0.01, 8, true));
    let bom = "\u{feff}behaviors: {Hopper: {max_steps: 1.e4}}\r\n";
    assert_eq!(flat(&read(bom, "hopper")).total_steps, 10_000);
}

#[test]
fn agents_are_found_under_the_names_of_other_systems() {
    for (name, agent) in [
        ("Hopper", "hopper"),
        ("hopper-V0", "Hopper-v0"),
        ("DeepMindHopperBrain", "hopper"),
        ("deepmindhopperbrain", "Hopper-v1"),
        ("DeepMindWalkerBrain", "walker"),
        ("Walker", "Walker2d-v1"),
        ("DeepMindHumanoidBrain", "humanoid"),
        ("OpenAIAntBrain", "ant"),
        ("MyRobot-v3", "MyRobot-v3"),
        ("MyRobot", "MyRobot-v3"),
    ] {
        assert_eq!(
            flat(&read(&format!("behaviors: {{{name}: {{max_steps: 7}}}}"), agent)).total_steps,
            7,
            "{name} {agent}"
        );
        assert_eq!(flat(&read(&format!("{name}: {{num_epoch: 9}}"), agent)).epochs, 9, "{name} {agent}");
    }
    // the more particular name wins
    let file = "behaviors: {DeepMindHopperBrain: {max_steps: 1}, Hopper: {max_steps: 2}, Hopper-v1: {max_steps: 3}}";
    assert_eq!(flat(&read(file, "Hopper-v0")).total_steps, 2);
    assert_eq!(flat(&read(file, "Hopper-v1")).total_steps, 3);
}

#[test]
fn the_old_format_has_flat_keys_above_a_default() {
    let file = "
default:
    trainer: ppo
    beta: 5.0e-3
    hidden_units: 128
    num_layers: 2
    max_steps: 5.0e4
    memory_size: 256
    sequence_length: 64
    summary_freq: 1000
    use_recurrent: false
    use_curiosity: false
DeepMindHopperBrain:
    beta: 1.0e-2
    gamma: 0.995
    hidden_units: '90'
    max_steps: 3e5
";
    let hopper = read(file, "hopper");
    assert_eq!((flat(&hopper).entropy_coef, flat(&hopper).gamma), (0.01, 0.995));
    assert_eq!((flat(&hopper).hidden, flat(&hopper).agents, flat(&hopper).horizon), (vec![90, 90], 16, 640));
    // steps of each of the 16 agents
    assert_eq!((flat(&hopper).total_steps, hopper.summary_freq), (4_800_000, 16_000));
    assert_eq!((hopper.checkpoint_interval, hopper.keep_checkpoints), (800_000, 5));
    assert!(hopper.notes[0].contains("max_steps counts the steps of each agent: 4800000"), "{:?}", hopper.notes);
    let ant = read(file, "ant");
    assert_eq!(
        (flat(&ant).entropy_coef, flat(&ant).total_steps, flat(&ant).lr_schedule),
        (0.005, 800_000, LrSchedule::Linear)
    );
}

#[test]
fn the_old_format_with_reward_signals_counts_all_steps_together() {
    let file = "
default: {trainer: ppo, reward_signals: {extrinsic: {strength: 1.0, gamma: 0.98}}, vis_encode_type: simple}
Hopper-v0: {max_steps: 1e6, buffer_size: 5120, batch_size: 16, time_horizon: 100}
";
    let hopper = flat(&read(file, "hopper"));
    assert_eq!((hopper.total_steps, hopper.gamma, hopper.agents, hopper.horizon), (1_000_000, 0.98, 48, 107));
    assert_eq!(hopper.minibatches, 320);
}

#[test]
fn appendix_b_of_the_paper_loads_for_all_its_agents() {
    let file = asset("paper-appendix-b.yaml");
    for (agent, widths, lr, beta, gamma, buffer, steps) in [
        ("hopper", vec![90; 2], 1e-3, 1e-2, 0.99, 10240, 4_800_000),
        ("walker", vec![41; 3], 1e-3, 1e-2, 0.99, 10240, 4_800_000),
        ("ant", vec![53; 3], 1e-3, 5e-3, 0.99, 10240, 4_800_000),
        ("humanoid", vec![512; 2], 3e-4, 1e-2, 0.995, 20480, 32_000_000),
    ] {
        let loaded = load(&file, agent);
        let (ppo, notes) = (flat(&loaded), loaded.notes);
        assert_eq!((ppo.hidden.clone(), ppo.lr, ppo.entropy_coef, ppo.gamma), (widths, lr, beta, gamma), "{agent}");
        assert_eq!((ppo.agents * ppo.horizon, ppo.minibatches, ppo.epochs), (buffer, buffer / 2048, 3), "{agent}");
        assert_eq!((ppo.total_steps, ppo.clip, ppo.gae_lambda), (steps, 0.2, 0.95), "{agent}");
        assert_eq!((ppo.agents, ppo.normalize_observations, ppo.activation), (16, true, Activation::Swish));
        assert!(notes.iter().all(|note| note.contains("max_steps") || note.contains("time_horizon")), "{notes:?}");
    }
}

#[test]
fn appendix_c_of_the_paper_loads() {
    let loaded = load(&asset("paper-appendix-c.yaml"), "hopper");
    let ppo = flat(&loaded);
    assert_eq!((ppo.lr, ppo.epochs, ppo.hidden, ppo.total_steps), (3e-3, 10, vec![64, 64], 1_000_000));
    assert_eq!((ppo.agents * ppo.horizon, ppo.minibatches, ppo.entropy_coef), (10240, 5, 5e-3));
}

#[test]
fn every_agent_has_a_valid_default() {
    let ids = marathon_envs::ids();
    assert!(ids.len() >= 8);
    for id in &ids {
        let loaded = default_for(id);
        loaded.config.validate().unwrap_or_else(|e| panic!("{id}: {e}"));
        let mut task = loaded.clone();
        task.config.rewards.truncate(1);
        let (ppo, notes) = (flat(&task), loaded.notes);
        assert!(notes.is_empty(), "{id}: {notes:?}");
        assert!(ppo.normalize_observations && ppo.value_clip.is_none(), "{id}");
        // what a network rewards is not scaled, nor is the task's beside it
        assert_eq!(ppo.scale_rewards, loaded.config.rewards.len() == 1, "{id}");
        assert_eq!(ppo.lr_schedule, LrSchedule::Adaptive, "{id}");
    }
    assert_eq!(default_for("walker").config, default_for("Walker2d-v0").config);
    assert_ne!(default_for("hopper").config, default_for("humanoid").config);
    // Gymnasium's tasks have settings of their own
    assert_ne!(default_for("hopper").config, default_for("Hopper-v5").config);
    assert_eq!((flat(&default_for("Walker2d-v5")).gamma, flat(&default_for("Ant-v5")).total_steps), (0.99, 10_000_000));
    // and so have dm_control's
    assert_eq!(default_for("dm_control/walker-walk-v0"), default_for("walker-walk"));
    assert_ne!(default_for("walker-walk").config, default_for("walker").config);
    // an agent from another crate
    assert_eq!(default_for("MyRobot-v3"), Loaded::default());
}
