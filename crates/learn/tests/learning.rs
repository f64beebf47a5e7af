//! The trainer learns: it solves a task with drift, limits and unscaled observations within seconds.

use crate::common::{self, PuckTask, learning_config, ppo};
use marathon_learn::{
    A2c, Acktr, Activation, Algorithm, Control, IterationStats, LrSchedule, Sac, Schedule, Snapshot, TrainConfig,
    evaluate, train,
};
use marathon_physics::lanes::Isa;

/// The return of the best policy is about 64: holding still at the origin, minus the way there and the effort against
/// drift.
fn learned(config: &TrainConfig) -> f64 {
    let task = PuckTask::new();
    let mut returns = Vec::new();
    let mut observer = |stats: &IterationStats, _: &Snapshot<'_>| {
        returns.extend(stats.learned.return_mean);
        assert!(stats.learned.kl.is_finite() && stats.learned.value_loss.is_finite() && stats.learned.std_mean > 0.0);
        Control::Continue
    };
    let output = train(&task, Isa::best(), config, None, &mut observer).unwrap();
    let result = evaluate(&task, Isa::best(), &output.policy, &Default::default()).unwrap();
    println!("first {:?}, last {:?}, {result:?}, {:?}", returns.first(), returns.last(), output.last);
    assert!(returns[0] < 0.0, "the untrained policy is bad: {}", returns[0]);
    assert_eq!(result.episodes, 64);
    assert!(result.falls == 0 && output.last.unwrap().learned.explained_variance > 0.5);
    result.return_mean
}

#[test]
fn adaptive_rate_solves_the_task() {
    assert!(learned(&learning_config()) > 52.0);
}

#[test]
fn linear_rate_with_value_clipping_and_swish_solves_the_task() {
    let config = learning_config().with(|c| {
        ppo(c).lr_schedule = LrSchedule::Linear;
        ppo(c).value_clip = Some(0.5);
        c.network.activation = Activation::Swish;
        ppo(c).entropy_coef.to = 0.0;
    });
    assert!(learned(&config) > 52.0);
}

#[test]
fn constant_rate_with_elu_solves_the_task() {
    assert!(
        learned(&learning_config().with(|c| {
            ppo(c).lr_schedule = LrSchedule::Constant;
            c.network.activation = Activation::Elu;
        })) > 52.0
    );
}

/// With ten times the rate of the paper's comparison, which takes ten times as many steps.
#[test]
fn a2c_solves_the_task() {
    let mut a2c = A2c { lr: 3e-3, entropy_coef: Schedule::constant(0.0), ..Default::default() };
    a2c.action_std.init_log = -0.5;
    let config = TrainConfig::a2c().with(|c| {
        c.run.total_steps = 400_000;
        c.run.threads = 1;
        c.algorithm = Algorithm::A2c(a2c);
    });
    assert!(learned(&config) > 52.0);
}

/// With half the steps, and with the original settings of OpenAI Baselines.
#[test]
fn acktr_solves_the_task_in_half_the_steps() {
    assert!(
        learned(&TrainConfig::acktr().with(|c| {
            c.run.total_steps = 200_000;
            c.run.threads = 1;
        })) > 55.0
    );
}

/// With a quarter of PPO's steps.
#[test]
fn sac_solves_the_task_in_a_quarter_of_the_steps() {
    let task = PuckTask::new();
    let sac = Sac { warmup: 2000, ..Sac::default() };
    let config = TrainConfig::sac().with(|c| {
        c.algorithm = Algorithm::Sac(sac);
        c.run.total_steps = 100_000;
        c.network.hidden = vec![32, 32];
        c.network.critic_hidden = Some(vec![64, 64]);
        c.run.threads = 1;
    });
    let output = train(&task, Isa::best(), &config, None, &mut common::silent).unwrap();
    let result = evaluate(&task, Isa::best(), &output.policy, &Default::default()).unwrap();
    println!("{result:?} {:?}", output.last);
    assert!(output.policy.meta().squash && result.falls == 0 && result.return_mean > 52.0, "{result:?}");
}

#[test]
fn observer_can_stop_and_looks_at_every_iteration() {
    let mut seen = Vec::new();
    let mut observer = |stats: &IterationStats, snapshot: &Snapshot<'_>| {
        seen.push(stats.steps);
        assert_eq!(snapshot.checkpoint().steps(), stats.steps);
        assert_eq!(snapshot.policy().meta().training.as_ref().unwrap().steps, stats.steps);
        if seen.len() == 3 { Control::Stop } else { Control::Continue }
    };
    let output = train(&PuckTask::new(), Isa::best(), &learning_config(), None, &mut observer).unwrap();
    let last = output.last.unwrap();
    assert_eq!((seen, last.iteration), (vec![4096, 8192, 12288], 3));
    // WebAssembly has no clock of processor time
    assert!(cfg!(target_family = "wasm") || last.cpu_seconds > 0.0);
    assert_eq!(last.learned.reward_terms.len(), 2);
}

/// A non-finite number in one observation of every episode of one agent does not keep the others from learning.
#[test]
fn poisoned_observation_is_contained() {
    let mut task = PuckTask::new();
    task.poison = Some((5, 20));
    let output = train(&task, Isa::best(), &learning_config(), None, &mut common::silent).unwrap();
    let (policy, normalizer) = (&output.policy, output.policy.normalizer());
    let numbers = policy.params().iter().chain(policy.log_std()).chain(normalizer.mean()).chain(normalizer.std());
    assert!(numbers.into_iter().all(|x| x.is_finite()));
    let result = evaluate(&PuckTask::new(), Isa::best(), policy, &Default::default()).unwrap();
    assert!(result.return_mean > 52.0, "{result:?}");
}

#[test]
fn impossible_settings_are_refused_with_the_nearest_possible_one() {
    let refuse = |config: TrainConfig| {
        let result = train(&PuckTask::new(), Isa::best(), &config, None, &mut common::silent);
        result.expect_err("an error").to_string()
    };
    assert_eq!(
        refuse(learning_config().with(|c| c.run.agents = 100)),
        "configuration: run.agents is 100, expected a multiple of 16, such as 96, or 1, 2, 4 or 8"
    );
    assert!(refuse(learning_config().with(|c| ppo(c).minibatches = 5000)).contains("at most 256"));
    assert!(refuse(learning_config().with(|c| c.rewards[0].gamma = 1.5)).contains("gamma is 1.5"));
    assert!(refuse(learning_config().with(|c| ppo(c).lr = f64::NAN)).contains("lr is NaN"));
    let isa = train(&PuckTask::new(), Isa::F64, &learning_config(), None, &mut common::silent);
    assert!(isa.err().unwrap().to_string().contains("f64"));
    let acktr = Algorithm::Acktr(Acktr { lr_schedule: LrSchedule::Adaptive, ..Default::default() });
    assert!(refuse(TrainConfig::acktr().with(|c| c.algorithm = acktr)).contains("constant or linear"));
    let acktr = Algorithm::Acktr(Acktr { kl_clip: 0.0, ..Default::default() });
    assert!(refuse(TrainConfig::acktr().with(|c| c.algorithm = acktr)).contains("kl_clip is 0"));
}

/// A setting of another algorithm is refused by its name.
#[test]
fn settings_that_mean_nothing_to_an_algorithm_are_refused() {
    for (json, name) in [
        (r#"{"a2c": {"epochs": 3}}"#, "epochs"),
        (r#"{"acktr": {"max_grad_norm": 0.5}}"#, "max_grad_norm"),
        (r#"{"sac": {"gae_lambda": 0.9}}"#, "gae_lambda"),
        (r#"{"ppo": {"kl_clip": 0.1}}"#, "kl_clip"),
        (r#"{"run": {"lr": 0.1}}"#, "lr"),
        (r#"{"roles": {"opponent": {"run": {}}}}"#, "run"),
        (r#"{"rewards": {"rnd": {"share": 0.1}}}"#, "share"),
        (r#"{"rewards": {"novelty": {}}}"#, "novelty"),
    ] {
        let error = serde_json::from_str::<TrainConfig>(json).unwrap_err().to_string();
        assert!(error.contains(&format!("unknown field `{name}`")), "{error}");
    }
}

/// Missing fields have their defaults, a number is a constant schedule, and the section of an algorithm chooses it.
#[test]
fn a_configuration_is_written_by_names_of_its_fields() {
    let read = |json: &str| serde_json::from_str::<TrainConfig>(json).unwrap();
    assert_eq!(read("{}"), TrainConfig::default());
    let config = read(
        r#"{"run": {"agents": 32}, "network": {"hidden": [8]}, "rewards": {"task": {"gamma": 0.9}, "rnd": {"strength": 0.1}},
            "ppo": {"clip": 0.3, "action_std": {"min": {"from": 0.4, "to": 0.1}}}, "roles": {"opponent": {"a2c": {"lr": 0.1}}}}"#,
    );
    assert_eq!((config.run.agents, config.network.critic(), config.task_reward().gamma), (32, &[8][..], 0.9));
    assert_eq!((config.rewards.len(), config.rewards[1].kind.name(), config.rewards[1].strength), (2, "rnd", 0.1));
    let Algorithm::Ppo(ppo) = config.algorithm else { panic!("{config:?}") };
    assert_eq!((ppo.clip, ppo.action_std.min), (Schedule::constant(0.3), Schedule { from: 0.4, to: 0.1 }));
    let role = config.of_role("opponent");
    assert_eq!((role.algorithm.name(), &role.network, role.run), ("a2c", &Default::default(), config.run.clone()));
    // it is written as it is read, with all fields
    let written = serde_json::to_value(&config).unwrap();
    assert_eq!((&written["ppo"]["clip"], &written["ppo"]["epochs"]), (&0.3.into(), &4.into()));
    assert_eq!(serde_json::from_value::<TrainConfig>(written).unwrap(), config);
    let two = serde_json::from_str::<TrainConfig>(r#"{"ppo": {}, "sac": {}}"#).unwrap_err().to_string();
    assert!(two.contains("found ppo and sac, expected the settings of one algorithm"), "{two}");
}
