//! The promise: a ragdoll in a game lives the life that `marathon eval` measures. The same seed gives the same returns,
//! lengths and distances, to the last bit, whatever the frame rate, the order in which the ragdolls came, and who runs
//! beside them.

use crate::common::{Log, app, assets, policy, run_until};
use bevy::prelude::*;
use bevy_marathon::prelude::*;
use marathon_envs::{Options, Value};
use marathon_learn::{
    Control, EvalOptions, Evaluation, IterationStats, Policy as Net, Snapshot, TrainConfig, evaluate, train,
};
use marathon_physics::lanes::Isa;
use marathon_runs::TaskOptions;
use std::time::Duration;

const EPISODES: usize = 20;
const SEED: u64 = 5;

/// Plays one episode each in a game.
fn play(agent: &str, policy: Net, frame: Duration, order: impl Fn(usize) -> usize) -> Vec<Episode> {
    let mut app = app(frame);
    let handle = app.world_mut().resource_mut::<Assets<PolicyAsset>>().add(policy);
    let mut ragdolls = [Entity::PLACEHOLDER; EPISODES];
    for i in 0..EPISODES {
        let number = order(i);
        // another character in between
        if i % 3 == 0 {
            app.world_mut().spawn(Ragdoll::agent(agent).with_seed(99, i as u64));
        }
        let ragdoll = Ragdoll::agent(agent).with_seed(SEED, number as u64);
        ragdolls[number] = app.world_mut().spawn((ragdoll, CharacterPolicy(handle.clone()))).id();
    }
    let first = |world: &World, who| world.resource::<Log>().ended.iter().find(|e| e.ragdoll == who).cloned();
    run_until(&mut app, 20_000, "the end of every first episode", |world| {
        ragdolls.iter().all(|r| first(world, *r).is_some())
    });
    ragdolls.iter().filter_map(|r| first(app.world(), *r)).map(|e| e.episode).collect()
}

fn measure(task_config: &TaskConfig, policy: &Net) -> Evaluation {
    let factory = task_config.factory().expect("the task exists");
    let options = EvalOptions { episodes: EPISODES, seed: SEED, threads: 1 };
    evaluate(&*factory, Isa::best(), policy, &options).expect("the policy fits")
}

fn compare(agent: &str, eval: &Evaluation, episodes: &[Episode]) {
    let n = EPISODES as f64;
    let mean = |f: &dyn Fn(&Episode) -> f64| episodes.iter().map(f).sum::<f64>() / n;
    assert_eq!(mean(&|e| e.total).to_bits(), eval.return_mean.to_bits(), "{agent}: mean return");
    assert_eq!(mean(&|e| e.decisions as f64), eval.length_mean, "{agent}: mean length");
    assert_eq!(mean(&|e| e.distance).to_bits(), eval.distance_mean.to_bits(), "{agent}: mean distance");
    let least = episodes.iter().map(|e| e.total).fold(f64::INFINITY, f64::min);
    assert_eq!(least.to_bits(), eval.return_min.to_bits(), "{agent}: lowest return");
}

/// A policy that comes with its agent.
fn shipped(agent: &str, frame: Duration, order: impl Fn(usize) -> usize) {
    let task_config = TaskConfig::named(agent).expect("the agent exists");
    compare(agent, &measure(&task_config, &policy(agent)), &play(agent, policy(agent), frame, order));
}

#[test]
fn at_sixty_frames_per_second() {
    shipped("hopper", Duration::from_nanos(16_666_667), |i| i);
}

#[test]
fn at_an_odd_frame_rate_in_another_order() {
    shipped("hopper", Duration::from_millis(73), |i| (i * 7 + 3) % EPISODES);
}

#[test]
fn on_four_legs() {
    shipped("ant", Duration::from_millis(33), |i| i);
}

/// A policy is played in its own task: with the arguments that it notes, and with its clip, which no other program knows.
#[test]
fn in_the_task_that_the_policy_notes() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("mine.motion");
    std::fs::copy(assets().join("motions/marathon_man/run.motion"), &file).expect("a clip");
    let given = [("clip", file.to_string_lossy().as_ref()), ("start", "first"), ("control", "torque"), ("future", "2")]
        .map(|(name, value): (&str, &str)| {
            (name.to_string(), value.parse::<Value>().unwrap_or_else(|never| match never {}))
        });
    let plain = TaskConfig::named("MarathonMan").expect("the agent exists");
    let task_config = plain.clone().with(&TaskOptions { given: given.into() }).expect("arguments that it takes");
    let policy = hardly_trained(&task_config);
    assert_eq!(policy.meta().options.get("clip"), task_config.options.get("clip"));
    let eval = measure(&task_config, &policy);
    compare("MarathonMan", &eval, &play("MarathonMan", policy.clone(), Duration::from_millis(40), |i| i));
    // the file is not needed, and explicit options take precedence over those that the policy notes
    drop(folder);
    let other = task_config.overlay(&TaskConfig { options: Options::new().with("start", "random"), ..plain });
    assert_ne!(measure(&other, &policy).length_mean, eval.length_mean);
}

/// A role that does not decide goes on with its last action: a commander's word holds for a hundred decisions.
#[test]
fn a_role_that_does_not_decide_goes_on() {
    let given = [("commander", "adversary"), ("input", "continuous")];
    let given = given.map(|(name, value)| (name.to_string(), Value::Text(value.into())));
    let plain = TaskConfig::named("WalkerController").expect("the agent exists");
    let task_config = plain.with(&TaskOptions { given: given.into() }).expect("arguments that it takes");
    let (runner, others) = roles_hardly_trained(&task_config);
    let (name, commander) = others.into_iter().next().expect("two roles");
    assert_eq!(name, "commander");
    let mut app = app(Duration::from_millis(8));
    let [runner, commander] =
        [runner, commander].map(|policy| app.world_mut().resource_mut::<Assets<PolicyAsset>>().add(policy));
    let parts = (Ragdoll::agent("WalkerController"), CharacterPolicy(runner), Opponent(commander));
    let walker = app.world_mut().spawn(parts).id();
    let mut told = Vec::new();
    run_until(&mut app, 2_000, "the end of the episode", |world| {
        let episode = world.get::<Episode>(walker).filter(|episode| episode.decisions > 1);
        told.extend(episode.filter(|e| e.number == 1).map(|episode| episode.info[1]));
        !world.resource::<Log>().ended.is_empty()
    });
    assert!(told.len() > 20 && told[0] != 0.0, "{told:?}");
    let of_one = told.len().min(98);
    assert!(told[..of_one].iter().all(|x| *x == told[0]), "{told:?}");
}

/// A policy of some steps of training.
fn hardly_trained(task_config: &TaskConfig) -> Net {
    roles_hardly_trained(task_config).0
}

/// The first role's, and the others' with their names.
fn roles_hardly_trained(task_config: &TaskConfig) -> (Net, Vec<(String, Net)>) {
    let factory = task_config.factory().expect("the task exists");
    let config = TrainConfig::default().with(|config| {
        (config.run.agents, config.run.horizon, config.run.total_steps) = (16, 8, 256);
        config.network.hidden = vec![8];
    });
    let mut quiet = |_: &IterationStats, _: &Snapshot<'_>| Control::Continue;
    let trained = train(&*factory, Isa::best(), &config, None, &mut quiet).expect("it trains");
    (trained.policy, trained.others)
}
