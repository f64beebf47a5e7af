//! Every key of a configuration file reaches the trainer, in both formats of ML-Agents.

use marathon_config::{Loaded, default_for, parse};
use marathon_learn::{Acktr, Activation, Algorithm, Init, PpoConfig, Ratio, Sac, Schedule, Signal, SignalKind};
use std::path::{Path, PathBuf};

fn read(text: &str, agent: &str) -> Loaded {
    parse(Path::new("test.yaml"), text.as_bytes(), agent).unwrap_or_else(|e| panic!("{e}"))
}

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

#[test]
fn what_is_left_out_has_the_value_of_ml_agents() {
    let loaded = current("");
    let expected = PpoConfig {
        agents: 160,
        horizon: 64,
        minibatches: 10,
        epochs: 3,
        total_steps: 500_000,
        actor_hidden: vec![128, 128],
        critic_hidden: vec![128, 128],
        activation: Activation::Swish,
        lr: 3e-4,
        value_lr: 3e-4,
        schedule: Schedule::Linear,
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
        ..PpoConfig::default()
    };
    assert_eq!(loaded.ppo, expected);
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
    let PpoConfig { agents, horizon, minibatches, epochs, total_steps, .. } = loaded.ppo;
    assert_eq!((agents, horizon, minibatches, epochs, total_steps), (64, 128, 16, 5, 2_000_000));
    let ppo = loaded.ppo;
    assert_eq!((ppo.lr, ppo.value_lr, ppo.schedule), (2e-3, 2e-3, Schedule::Constant));
    assert_eq!((ppo.entropy_coef, ppo.final_entropy_coef), (1e-2, Some(1e-5)));
    assert_eq!((ppo.clip, ppo.final_clip, ppo.value_clip), (0.3, Some(0.1), None));
    assert_eq!((ppo.gae_lambda, ppo.gamma, ppo.normalize_observations), (0.9, 0.995, true));
    assert_eq!((ppo.actor_hidden, ppo.critic_hidden), (vec![96; 3], vec![96; 3]));
    assert_eq!((ppo.seed, loaded.summary_freq), (77, 30_000));
    assert_eq!((loaded.checkpoint_interval, loaded.keep_checkpoints), (70_000, 9));
    assert!(loaded.notes.is_empty(), "{:?}", loaded.notes);
}

#[test]
fn schedules_follow_that_of_the_learning_rate_unless_they_have_their_own() {
    let ppo = current("    hyperparameters: {learning_rate_schedule: constant}\n").ppo;
    assert_eq!((ppo.schedule, ppo.final_clip, ppo.final_entropy_coef), (Schedule::Constant, None, None));
    let ppo = current("    hyperparameters: {epsilon_schedule: constant, beta_schedule: constant}\n").ppo;
    assert_eq!((ppo.schedule, ppo.final_clip, ppo.final_entropy_coef), (Schedule::Linear, None, None));
    // a decay never raises
    let ppo = current("    hyperparameters: {epsilon: 0.05, beta: 0}\n").ppo;
    assert_eq!((ppo.final_clip, ppo.final_entropy_coef), (Some(0.05), Some(0.0)));
}

#[test]
fn every_key_of_marathon_counts() {
    let loaded = current(
        "    hyperparameters: {beta: 0.01}
    marathon:
      agents: 48
      horizon: 7
      minibatches: 6
      actor_hidden: [33, 17]
      critic_hidden: [65]
      activation: elu
      value_lr: 5e-4
      schedule: adaptive
      target_kl: 0.02
      final_target_kl: 0.004
      lr_range: [1e-4, 2e-3]
      max_grad_norm: 0.5
      value_clip: 0.4
      ratio: joint
      adam_epsilon: 1e-6
      initialization: orthogonal
      action_clip: 2
      final_clip: 0.15
      final_entropy_coef: 0.001
      init_log_std: -0.7
      min_std: 0.06
      final_min_std: 0.04
      max_std: 1.5
      follow_statistics: no
      observation_clip: 8
      scale_rewards: yes
      statistics_cap: 1e6
      seed: 5
      threads: 2
",
    );
    let expected = PpoConfig {
        algorithm: Algorithm::Ppo,
        rollouts: 1,
        reward_strength: 1.0,
        signals: Vec::new(),
        agents: 48,
        horizon: 7,
        minibatches: 6,
        epochs: 3,
        total_steps: 500_000,
        actor_hidden: vec![33, 17],
        critic_hidden: vec![65],
        activation: Activation::Elu,
        lr: 3e-4,
        value_lr: 5e-4,
        schedule: Schedule::Adaptive,
        target_kl: 0.02,
        final_target_kl: Some(0.004),
        lr_range: [1e-4, 2e-3],
        max_grad_norm: 0.5,
        gamma: 0.99,
        gae_lambda: 0.95,
        clip: 0.2,
        final_clip: Some(0.15),
        value_clip: Some(0.4),
        ratio: Ratio::Joint,
        adam_epsilon: 1e-6,
        initialization: Init::Orthogonal,
        action_clip: 2.0,
        entropy_coef: 0.01,
        final_entropy_coef: Some(0.001),
        init_log_std: -0.7,
        min_std: 0.06,
        final_min_std: Some(0.04),
        max_std: 1.5,
        normalize_observations: false,
        follow_statistics: false,
        observation_clip: 8.0,
        scale_rewards: true,
        statistics_cap: 1e6,
        seed: 5,
        threads: 2,
    };
    assert_eq!(loaded.ppo, expected);
    let none = current("    marathon: {value_clip: null, final_clip: ~, final_entropy_coef: null}\n").ppo;
    assert_eq!((none.value_clip, none.final_clip, none.final_entropy_coef), (None, None, None));
    // the critic is as wide as the actor unless it has widths of its own
    assert_eq!(current("    marathon: {actor_hidden: [40]}\n").ppo.critic_hidden, [40]);
}

#[test]
fn the_buffer_is_filled_by_as_many_agents_as_needed() {
    for (agents, horizon) in [(16, 640), (256, 40), (512, 20), (1024, 10), (4096, 3), (16384, 1)] {
        let ppo = current(&format!("    marathon: {{agents: {agents}}}\n")).ppo;
        assert_eq!((ppo.agents, ppo.horizon, ppo.minibatches), (agents, horizon, 10));
    }
    let ppo = current("    time_horizon: 1000\n").ppo;
    assert_eq!((ppo.agents, ppo.horizon), (16, 640));
    let ppo = current("    hyperparameters: {batch_size: 4096, buffer_size: 2048}\n").ppo;
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
    let hopper = read(file, "Hopper-v0").ppo;
    assert_eq!((hopper.entropy_coef, hopper.clip, hopper.total_steps), (0.5, 0.3, 1000));
    assert_eq!(hopper.actor_hidden, [20, 20]);
    let ant = read(file, "ant").ppo;
    assert_eq!((ant.clip, ant.total_steps), (0.4, 3000));
    // who is not in the file at all has the defaults
    let file = "default_settings: {max_steps: 1000}\nbehaviors: {Ant: {max_steps: 2000}}";
    let walker = read(file, "walker");
    assert_eq!(walker.ppo.total_steps, 1000);
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
    let (walker, hopper) = (read(file, "walker").ppo, read(file, "hopper").ppo);
    assert_eq!((walker.entropy_coef, walker.epochs, walker.normalize_observations), (0.01, 7, true));
    assert_eq!((hopper.entropy_coef, hopper.epochs, hopper.normalize_observations), (0.01, 8, true));
    let bom = "\u{feff}behaviors: {Hopper: {max_steps: 1.e4}}\r\n";
    assert_eq!(read(bom, "hopper").ppo.total_steps, 10_000);
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
            read(&format!("behaviors: {{{name}: {{max_steps: 7}}}}"), agent).ppo.total_steps,
            7,
            "{name} {agent}"
        );
        assert_eq!(read(&format!("{name}: {{num_epoch: 9}}"), agent).ppo.epochs, 9, "{name} {agent}");
    }
    // the more particular name wins
    let file = "behaviors: {DeepMindHopperBrain: {max_steps: 1}, Hopper: {max_steps: 2}, Hopper-v1: {max_steps: 3}}";
    assert_eq!(read(file, "Hopper-v0").ppo.total_steps, 2);
    assert_eq!(read(file, "Hopper-v1").ppo.total_steps, 3);
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
    assert_eq!((hopper.ppo.entropy_coef, hopper.ppo.gamma), (0.01, 0.995));
    assert_eq!((hopper.ppo.actor_hidden, hopper.ppo.agents, hopper.ppo.horizon), (vec![90, 90], 16, 640));
    // steps of each of the 16 agents
    assert_eq!((hopper.ppo.total_steps, hopper.summary_freq), (4_800_000, 16_000));
    assert_eq!((hopper.checkpoint_interval, hopper.keep_checkpoints), (800_000, 5));
    assert!(hopper.notes[0].contains("max_steps counts the steps of each agent: 4800000"), "{:?}", hopper.notes);
    let ant = read(file, "ant");
    assert_eq!((ant.ppo.entropy_coef, ant.ppo.total_steps, ant.ppo.schedule), (0.005, 800_000, Schedule::Linear));
}

#[test]
fn the_old_format_with_reward_signals_counts_all_steps_together() {
    let file = "
default: {trainer: ppo, reward_signals: {extrinsic: {strength: 1.0, gamma: 0.98}}, vis_encode_type: simple}
Hopper-v0: {max_steps: 1e6, buffer_size: 5120, batch_size: 16, time_horizon: 100}
";
    let hopper = read(file, "hopper").ppo;
    assert_eq!((hopper.total_steps, hopper.gamma, hopper.agents, hopper.horizon), (1_000_000, 0.98, 48, 107));
    assert_eq!(hopper.minibatches, 320);
    let each = file.replace("max_steps", "marathon: {steps_per_agent: true}, max_steps");
    assert_eq!(read(&each, "hopper").ppo.total_steps, 16_000_000);
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
        let Loaded { ppo, notes, .. } = load(&file, agent);
        assert_eq!(
            (ppo.actor_hidden.clone(), ppo.lr, ppo.entropy_coef, ppo.gamma),
            (widths, lr, beta, gamma),
            "{agent}"
        );
        assert_eq!((ppo.agents * ppo.horizon, ppo.minibatches, ppo.epochs), (buffer, buffer / 2048, 3), "{agent}");
        assert_eq!((ppo.total_steps, ppo.clip, ppo.gae_lambda), (steps, 0.2, 0.95), "{agent}");
        assert_eq!((ppo.agents, ppo.normalize_observations, ppo.activation), (16, true, Activation::Swish));
        let curious = notes.iter().any(|n| n.contains("use_curiosity asks for curiosity, which is left out"));
        assert_eq!(curious, ["hopper", "walker"].contains(&agent), "{notes:?}");
    }
}

#[test]
fn appendix_c_of_the_paper_loads() {
    let loaded = load(&asset("paper-appendix-c.yaml"), "hopper");
    let ppo = loaded.ppo;
    assert_eq!((ppo.lr, ppo.epochs, ppo.actor_hidden, ppo.total_steps), (3e-3, 10, vec![64, 64], 1_000_000));
    assert_eq!((ppo.agents * ppo.horizon, ppo.minibatches, ppo.entropy_coef), (10240, 5, 5e-3));
}

#[test]
fn every_agent_has_a_valid_default() {
    let ids = marathon_envs::ids();
    assert!(ids.len() >= 8);
    for id in &ids {
        let Loaded { ppo, notes, .. } = default_for(id);
        ppo.validate().unwrap_or_else(|e| panic!("{id}: {e}"));
        assert!(notes.is_empty(), "{id}: {notes:?}");
        assert!(ppo.scale_rewards && ppo.normalize_observations && ppo.value_clip.is_none(), "{id}");
        assert_eq!(ppo.schedule, Schedule::Adaptive, "{id}");
    }
    assert_eq!(default_for("walker").ppo, default_for("Walker2d-v0").ppo);
    assert_ne!(default_for("hopper").ppo, default_for("humanoid").ppo);
    // Gymnasium's tasks have settings of their own
    assert_ne!(default_for("hopper").ppo, default_for("Hopper-v5").ppo);
    assert_eq!((default_for("Walker2d-v5").ppo.gamma, default_for("Ant-v5").ppo.total_steps), (0.99, 10_000_000));
    // and so have dm_control's
    assert_eq!(default_for("dm_control/walker-walk-v0"), default_for("walker-walk"));
    assert_ne!(default_for("walker-walk").ppo, default_for("walker").ppo);
    // an agent of somebody else's
    assert_eq!(default_for("MyRobot-v3"), Loaded::default());
}

#[test]
fn other_trainers_start_from_the_settings_of_baselines() {
    let a2c = read("behaviors: {Hopper: {trainer_type: a2c}}", "hopper").ppo;
    let defaults = PpoConfig { total_steps: 500_000, ..PpoConfig::a2c() };
    assert_eq!(a2c, defaults);
    let text = "
behaviors:
  Hopper:
    trainer_type: acktr
    hyperparameters: {learning_rate: 0.1, buffer_size: 640, lambd: 0.9}
    network_settings: {hidden_units: 32}
    max_steps: 2e6
    marathon: {kl_clip: 0.002, inverse_every: 5, rollouts: 3}
";
    let acktr = read(text, "hopper").ppo;
    let settings = Acktr { kl_clip: 0.002, inverse_every: 5, ..Acktr::default() };
    let want = PpoConfig {
        algorithm: Algorithm::Acktr(settings),
        horizon: 40,
        rollouts: 3,
        lr: 0.1,
        value_lr: 0.1,
        gae_lambda: 0.9,
        actor_hidden: vec![32, 32],
        critic_hidden: vec![32, 32],
        total_steps: 2_000_000,
        ..PpoConfig::acktr()
    };
    assert_eq!(acktr, want);
    // the format of the paper calls it by another name
    let old = read("Hopper: {trainer: a2c, max_steps: 1e5}", "hopper").ppo;
    assert_eq!((old.algorithm.name(), old.total_steps, old.horizon), ("a2c", 1_600_000, 5));
}

#[test]
fn rewards_for_novelty_have_streams_of_their_own() {
    let text = "
behaviors:
  Hopper:
    reward_signals:
      extrinsic: {gamma: 0.98, strength: 0.5}
      curiosity: {strength: 0.02, gamma: 0.95, learning_rate: 1e-3, network_settings: {hidden_units: 256, num_layers: 1}}
      rnd: {encoding_size: 64}
";
    let ppo = read(text, "hopper").ppo;
    let curiosity = Signal { kind: SignalKind::Curiosity, strength: 0.02, gamma: 0.95, hidden: vec![256], lr: 1e-3 };
    let rnd = Signal { kind: SignalKind::Rnd, strength: 1.0, gamma: 0.99, hidden: vec![64, 64], lr: 3e-4 };
    assert_eq!(ppo.signals, [curiosity, rnd]);
    assert_eq!((ppo.gamma, ppo.reward_strength), (0.98, 0.5));
    // the paper's own way
    let text = "Hopper: {use_curiosity: true, curiosity_strength: 0.01, curiosity_enc_size: 256, gamma: 0.995}";
    let old = read(text, "hopper");
    let curiosity =
        Signal { strength: 0.01, gamma: 0.995, hidden: vec![256, 256], ..Signal::new(SignalKind::Curiosity) };
    assert_eq!(old.ppo.signals, [curiosity]);
    assert!(old.notes[0].contains("a value stream of its own"), "{:?}", old.notes);
}

#[test]
fn sac_has_the_keys_of_ml_agents() {
    let text = "
behaviors:
  Hopper:
    trainer_type: sac
    hyperparameters:
      batch_size: 512
      buffer_size: 200000
      learning_rate: 1e-3
      buffer_init_steps: 1000
      init_entcoef: 0.5
      tau: 0.01
      steps_per_update: 8
    network_settings: {normalize: true, hidden_units: 256}
    max_steps: 2e5
    marathon: {agents: 64, n_step: 3}
";
    let loaded = read(text, "hopper");
    let ppo = &loaded.ppo;
    let sac = Sac { replay: 200_000, warmup: 1000, batch: 512, updates: 32, tau: 0.01, n_step: 3, init_alpha: 0.5 };
    assert_eq!(ppo.algorithm, Algorithm::Sac(sac));
    assert_eq!((ppo.agents, ppo.horizon, ppo.minibatches, ppo.total_steps), (64, 4, 1, 200_000));
    assert_eq!((ppo.lr, ppo.schedule, ppo.normalize_observations), (1e-3, Schedule::Constant, true));
    assert_eq!((&ppo.actor_hidden[..], &ppo.critic_hidden[..]), (&[256, 256][..], &[256, 256][..]));
    let defaults = read("behaviors: {Hopper: {trainer_type: sac}}", "hopper").ppo;
    let sac = Sac { replay: 50_000, warmup: 0, batch: 128, updates: 64, tau: 0.005, n_step: 1, init_alpha: 1.0 };
    assert_eq!((defaults.algorithm, defaults.agents, defaults.lr), (Algorithm::Sac(sac), 16, 3e-4));
}
