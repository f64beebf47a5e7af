//! The promise: a ragdoll in a game lives the life that `marathon eval` measures. The same seed gives the same returns,
//! lengths and distances, to the last bit, whatever the frame rate, the order in which the ragdolls came, and who runs
//! beside them.

mod common;

use bevy::prelude::*;
use common::{Log, app, policy, run_until};
use marathon_envs::registry;
use marathon_game::prelude::*;
use marathon_learn::{EvalOptions, Evaluation, evaluate};
use marathon_physics::lanes::Isa;
use std::time::Duration;

const EPISODES: usize = 20;
const SEED: u64 = 5;

/// Plays one episode each in a game.
fn play(agent: &str, frame: Duration, order: impl Fn(usize) -> usize) -> Vec<Episode> {
    let mut app = app(frame);
    let handle = app.world_mut().resource_mut::<Assets<PolicyAsset>>().add(policy(agent));
    let mut ragdolls = [Entity::PLACEHOLDER; EPISODES];
    for i in 0..EPISODES {
        let number = order(i);
        // somebody else in between
        if i % 3 == 0 {
            app.world_mut().spawn(Ragdoll::agent(agent).with_seed(99, i as u64));
        }
        let ragdoll = Ragdoll::agent(agent).with_seed(SEED, number as u64);
        ragdolls[number] = app.world_mut().spawn((ragdoll, Policy(handle.clone()))).id();
    }
    let first = |world: &World, who| world.resource::<Log>().ended.iter().find(|e| e.ragdoll == who).cloned();
    run_until(&mut app, 20_000, "the end of every first episode", |world| {
        ragdolls.iter().all(|r| first(world, *r).is_some())
    });
    ragdolls.iter().filter_map(|r| first(app.world(), *r)).map(|e| e.episode).collect()
}

fn measure(agent: &str) -> Evaluation {
    let factory = registry::factory(agent, Isa::best()).expect("the agent exists");
    let options = EvalOptions { episodes: EPISODES, seed: SEED, threads: 1 };
    evaluate(&*factory, Isa::best(), &policy(agent), &options).expect("the policy fits")
}

fn compare(agent: &str, episodes: &[Episode]) {
    let eval = measure(agent);
    let n = EPISODES as f64;
    let mean = |f: &dyn Fn(&Episode) -> f64| episodes.iter().map(f).sum::<f64>() / n;
    assert_eq!(mean(&|e| e.total).to_bits(), eval.return_mean.to_bits(), "{agent}: mean return");
    assert_eq!(mean(&|e| e.decisions as f64), eval.length_mean, "{agent}: mean length");
    assert_eq!(mean(&|e| e.distance).to_bits(), eval.distance_mean.to_bits(), "{agent}: mean distance");
    let least = episodes.iter().map(|e| e.total).fold(f64::INFINITY, f64::min);
    assert_eq!(least.to_bits(), eval.return_min.to_bits(), "{agent}: lowest return");
}

#[test]
fn at_sixty_frames_per_second() {
    let episodes = play("hopper", Duration::from_nanos(16_666_667), |i| i);
    compare("hopper", &episodes);
}

#[test]
fn at_an_odd_frame_rate_in_another_order() {
    let episodes = play("hopper", Duration::from_millis(73), |i| (i * 7 + 3) % EPISODES);
    compare("hopper", &episodes);
}

#[test]
fn on_four_legs() {
    let episodes = play("ant", Duration::from_millis(33), |i| i);
    compare("ant", &episodes);
}
