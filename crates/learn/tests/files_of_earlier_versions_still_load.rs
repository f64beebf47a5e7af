//! Files of version 1 still load: runs that were interrupted go on, and policies act. `files/` has a small run of each
//! algorithm, as the program wrote it before each algorithm had settings and a state of its own.

mod common;

use common::silent;
use marathon_envs::factory;
use marathon_learn::{Algorithm, Checkpoint, Moving, Policy, RewardKind, Schedule, TrainConfig, train};
use marathon_physics::lanes::Isa;
use std::path::{Path, PathBuf};

const ALGORITHMS: [&str; 4] = ["ppo", "a2c", "acktr", "sac"];

fn folder(algorithm: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/files").join(algorithm)
}

#[test]
fn checkpoints_go_on() {
    let task = factory("Hopper-v0", Isa::best()).unwrap();
    for algorithm in ALGORITHMS {
        let checkpoint = Checkpoint::load(&folder(algorithm).join("checkpoint")).unwrap();
        assert_eq!((checkpoint.agent(), checkpoint.iteration(), checkpoint.steps()), ("Hopper-v0", 10, 640));
        let config = checkpoint.config().clone();
        assert_eq!(config.algorithm.name(), algorithm);
        assert_eq!((config.run.agents, config.run.horizon, config.run.rollouts, config.run.seed), (16, 4, 2, 3));
        let config = config.with(|config| config.run.total_steps = 1280);
        let output = train(&*task, Isa::best(), &config, Some(checkpoint.clone()), &mut silent).unwrap();
        assert_eq!((output.checkpoint.iteration(), output.checkpoint.steps()), (20, 1280), "{algorithm}");

        // written again, it is of the version of today, and the same run
        let written = tempfile::tempdir().unwrap();
        checkpoint.save(written.path()).unwrap();
        let again = Checkpoint::load(written.path()).unwrap();
        let other = train(&*task, Isa::best(), &config, Some(again), &mut silent).unwrap();
        assert_eq!(other.policy.params(), output.policy.params(), "{algorithm}");
    }
}

#[test]
fn their_settings_are_those_of_the_algorithm() {
    let of = |algorithm: &str| Checkpoint::load(&folder(algorithm).join("checkpoint")).unwrap().config().clone();
    let TrainConfig { rewards, algorithm: Algorithm::Ppo(ppo), statistics, .. } = of("ppo") else { panic!("not PPO") };
    assert_eq!((ppo.minibatches, ppo.epochs, ppo.schedule), (2, 1, Schedule::Adaptive));
    assert_eq!((ppo.deviations.min_std, ppo.target_kl), (Moving { first: 0.1, last: 0.05 }, Moving::still(0.02)));
    assert_eq!((ppo.clip, ppo.entropy_coef.first), (Moving { first: 0.2, last: 0.1 }, 0.01));
    assert!(statistics.normalize_observations && statistics.follow_statistics);
    let properties: Vec<_> = rewards.iter().map(|reward| (reward.kind.name(), reward.strength, reward.gamma)).collect();
    assert_eq!(properties, [("task", 1.0, 0.98), ("rnd", 0.5, 0.97)]);
    assert!(matches!(&rewards[1].kind, RewardKind::Rnd(networks) if networks.hidden == [4]));
    let Algorithm::Sac(sac) = of("sac").algorithm else { panic!("not SAC") };
    assert_eq!((sac.replay, sac.batch, sac.updates, sac.lr), (64, 16, 2, 3e-4));
}

#[test]
fn policies_act() {
    for algorithm in ALGORITHMS {
        let policy = Policy::load(&folder(algorithm).join("policy.safetensors")).unwrap();
        let training = policy.meta().training.as_ref().unwrap();
        assert_eq!((training.steps, &training.config["agents"]), (640, &serde_json::json!(16)), "{algorithm}");
        let action = policy.act(&vec![0.1; policy.meta().obs]);
        assert!(action.iter().all(|a| a.abs() <= 1.0), "{algorithm}: {action:?}");
    }
}

/// What says nothing to anyone is refused, with its place.
#[test]
fn settings_that_never_were_are_refused() {
    let written = tempfile::tempdir().unwrap();
    for file in std::fs::read_dir(folder("a2c").join("checkpoint")).unwrap().flatten() {
        std::fs::copy(file.path(), written.path().join(file.file_name())).unwrap();
    }
    let description = written.path().join("checkpoint.json");
    let mut json: serde_json::Value = serde_json::from_slice(&std::fs::read(&description).unwrap()).unwrap();
    json.as_object_mut().unwrap().remove("checksum");
    json["config"]["rate"] = 1.into();
    std::fs::write(&description, json.to_string()).unwrap();
    let error = Checkpoint::load(written.path()).unwrap_err().to_string();
    assert!(error.contains("config.rate: found 'unknown field `rate`"), "{error}");
}
