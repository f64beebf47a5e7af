//! Every key of a file of ML-Agents reaches the trainer: those of trainers other than PPO, and of rewards beside the task's.

use crate::common::read;
use marathon_config::Loaded;
use marathon_learn::{
    Acktr, Activation, Algorithm, Form, Imitation, LrSchedule, Novelty, RewardConfig, RewardKind, Sac, TrainConfig,
};

#[test]
fn other_trainers_start_from_the_settings_of_baselines() {
    let a2c = read("behaviors: {Hopper: {trainer_type: a2c}}", "hopper").config;
    assert_eq!(a2c, TrainConfig::a2c().with(|config| config.run.total_steps = 500_000));
    let text = "
behaviors:
  Hopper:
    trainer_type: acktr
    hyperparameters: {learning_rate: 0.1, buffer_size: 640, lambd: 0.9}
    network_settings: {hidden_units: 32}
    max_steps: 2e6
";
    let acktr = read(text, "hopper").config;
    let settings = Acktr { lr: 0.1, gae_lambda: 0.9, ..Default::default() };
    let want = TrainConfig::acktr().with(|config| {
        (config.run.horizon, config.run.total_steps) = (40, 2_000_000);
        config.network.hidden = vec![32, 32];
        config.algorithm = Algorithm::Acktr(settings);
    });
    assert_eq!(acktr, want);
    // the format of the paper calls it by another name
    let old = read("Hopper: {trainer: a2c, max_steps: 1e5}", "hopper").config;
    assert_eq!((old.algorithm.name(), old.run.total_steps, old.run.horizon), ("a2c", 1_600_000, 5));
}

#[test]
fn rewards_for_imitation_have_ml_agents_keys_and_some_of_their_own() {
    let text = "
behaviors:
  Hopper:
    reward_signals:
      extrinsic: {}
      gail:
        strength: 0.1
        gamma: 0.9
        learning_rate: 1e-3
        demo_path: hopper.demo
        use_actions: true
        use_vail: false
        network_settings: {hidden_units: 64, num_layers: 3}
      amp: {observations: [touch, height], gradient_penalty: 5, logit_decay: 0, share: 0.5}
";
    let rewards = read(text, "hopper").config.rewards;
    let gail = Imitation {
        form: Form::Gail,
        hidden: vec![64; 3],
        activation: Activation::Swish,
        lr: 1e-3,
        actions: true,
        share: 1.0,
        demonstrations: Some("hopper.demo".into()),
        ..Imitation::default()
    };
    let amp = Imitation {
        hidden: vec![128; 2],
        observations: vec!["touch".into(), "height".into()],
        gradient_penalty: 5.0,
        logit_decay: 0.0,
        share: 0.5,
        ..Imitation::default()
    };
    let gail = RewardConfig { kind: RewardKind::Imitation(gail), strength: 0.1, gamma: 0.9 };
    assert_eq!(rewards[1..], [gail, RewardConfig::new(RewardKind::Imitation(amp))]);
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
    let rewards = read(text, "hopper").config.rewards;
    let curiosity = RewardKind::Curiosity(Novelty { hidden: vec![256], lr: 1e-3 });
    let rnd = RewardKind::Rnd(Novelty { hidden: vec![64, 64], lr: 3e-4 });
    let reward = |kind, strength, gamma| RewardConfig { kind, strength, gamma };
    let task = reward(RewardKind::Task, 0.5, 0.98);
    assert_eq!(rewards, [task, reward(curiosity, 0.02, 0.95), reward(rnd, 1.0, 0.99)]);
    // the paper's own way
    let text = "Hopper: {use_curiosity: true, curiosity_strength: 0.01, curiosity_enc_size: 256, gamma: 0.995}";
    let old = read(text, "hopper");
    let curiosity = RewardKind::Curiosity(Novelty { hidden: vec![256, 256], lr: 3e-4 });
    assert_eq!(old.config.rewards[1..], [reward(curiosity, 0.01, 0.995)]);
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
";
    let loaded = read(text, "hopper");
    let config = &loaded.config;
    let sac = Sac {
        lr: 1e-3,
        value_lr: 1e-3,
        lr_schedule: LrSchedule::Constant,
        adam_epsilon: 1e-5,
        replay: 200_000,
        warmup: 1000,
        batch: 512,
        updates: 8,
        tau: 0.01,
        n_step: 1,
        init_alpha: 0.5,
    };
    assert_eq!(config.algorithm, Algorithm::Sac(sac));
    assert_eq!((config.run.agents, config.run.horizon, config.run.total_steps), (16, 4, 200_000));
    assert!(config.statistics.normalize_observations);
    assert_eq!((&config.network.hidden[..], config.network.critic()), (&[256, 256][..], &[256, 256][..]));
    let defaults = read("behaviors: {Hopper: {trainer_type: sac}}", "hopper").config;
    let sac = Sac {
        lr: 3e-4,
        value_lr: 3e-4,
        replay: 50_000,
        warmup: 0,
        batch: 128,
        updates: 64,
        tau: 0.005,
        init_alpha: 1.0,
        ..sac
    };
    assert_eq!((defaults.algorithm, defaults.run.agents), (Algorithm::Sac(sac), 16));
}

/// Settings without a meaning for the file's trainer lead to a note.
#[test]
fn settings_of_another_trainer_are_noted() {
    let text = "
behaviors:
  Hopper:
    trainer_type: a2c
    hyperparameters: {num_epoch: 3, epsilon: 0.3}
";
    let Loaded { notes, config, .. } = read(text, "hopper");
    for part in ["num_epoch has no effect: a2c makes one step", "epsilon has no effect: a2c bounds no ratio"] {
        assert!(notes.iter().any(|note| note.contains(part)), "{part}: {notes:?}");
    }
    assert_eq!((notes.len(), config.algorithm.name()), (2, "a2c"), "{notes:?}");
}
