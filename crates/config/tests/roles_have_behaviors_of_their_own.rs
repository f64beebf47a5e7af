//! A task with several roles in a file of ML-Agents: the behavior with the task's name speaks of the run and of the first role,
//! `task/role` of another, under any of the task's names. A role that the file does not speak of has the settings of the first; one that the
//! task lacks is refused.

use marathon_config::parse;
use std::path::Path;

const FILE: &str = "
default_settings:
  trainer_type: ppo
  hyperparameters: {learning_rate: 0.001}
behaviors:
  Tag-v0:
    max_steps: 1000000
  Tag-v0/opponent:
    trainer_type: ppo
    hyperparameters: {learning_rate: 0.0002}
    network_settings: {hidden_units: 24, num_layers: 1}
";

fn path() -> &'static Path {
    Path::new("tag.yaml")
}

#[test]
fn a_role_has_the_settings_of_its_behavior() {
    let config = parse(path(), FILE.as_bytes(), "Tag-v0").unwrap().config;
    assert_eq!(config.roles.keys().collect::<Vec<_>>(), ["opponent"]);
    config.validate().unwrap();
    let [opponent, referee] = ["opponent", "referee"].map(|role| config.of_role(role));
    assert_eq!(opponent.network.hidden, [24]);
    assert_eq!(opponent.run, config.run);
    let lr = |config: &marathon_learn::TrainConfig| config.algorithm.rates();
    assert!(lr(&opponent).starts_with("lr is 2e-4") && lr(&referee).starts_with("lr is 1e-3"));
    assert_eq!((&referee.network, referee.algorithm), (&config.network, config.algorithm));
}

#[test]
fn a_role_that_there_is_not_is_refused_by_name() {
    let spec = marathon_envs::factory_with(
        "TerrainWalker2d-v0",
        &[("course".to_string(), "adversary".parse().unwrap())].into_iter().collect(),
        marathon_physics::lanes::Isa::F32,
    )
    .unwrap();
    let file = FILE.replace("Tag-v0/opponent", "TerrainWalker2d-v0/bilder").replace("Tag-v0", "TerrainWalker2d-v0");
    let config = parse(path(), file.as_bytes(), "TerrainWalker2d-v0").unwrap().config;
    let error = config.check_roles(spec.spec()).unwrap_err().to_string();
    assert_eq!(error, "configuration: roles is bilder, expected runner, builder; did you mean 'builder'?");
}

#[test]
fn a_role_goes_by_any_name_of_its_task() {
    for name in ["TerrainWalker2d/builder", "terrainwalker2d-v0/builder", "TERRAINWALKER2D/builder"] {
        let file = FILE.replace("Tag-v0/opponent", name).replace("Tag-v0", "TerrainWalker2d");
        let roles = parse(path(), file.as_bytes(), "TerrainWalker2d-v0").unwrap().config.roles;
        assert_eq!(roles["builder"].network.hidden, [24], "{name}");
    }
    // the most particular name is taken, and what is said of other tasks is theirs
    let file = format!("{FILE}  Tag/opponent: {{network_settings: {{hidden_units: 8}}}}\n  Chase-v0/hunter: {{}}\n");
    let roles = parse(path(), file.as_bytes(), "Tag-v0").unwrap().config.roles;
    assert_eq!((roles.len(), &roles["opponent"].network.hidden[..]), (1, &[24][..]));
}
