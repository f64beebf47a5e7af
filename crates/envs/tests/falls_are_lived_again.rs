//! With `relive`, a share of the episodes of Marathon Man, steered or in a player's hands, starts in a state from 0.75 to 1.5 s before
//! his last fall: pose, velocities and gait. Who falls at once keeps the state of the fall before. Without it, or before any fall,
//! an episode starts as ever.

mod common;

use common::begun;
use marathon_envs::{AgentState, Step, VecEnv};
use std::ops::RangeInclusive;

const AGENTS: usize = 16;
/// Decisions from a state that is kept to a fall, and how far noise takes an angle, rad.
const BEFORE: RangeInclusive<usize> = 30..=60;
const NOISE: f64 = 0.0101;

/// An episode of each: a force carries his weight, and lets him go after some decisions. Returns where each of those was that fell,
/// decision by decision, and starts their next episodes.
fn fall(env: &mut VecEnv, step: &mut Step, after: usize) -> Vec<Option<Vec<AgentState>>> {
    let (stand, actions) = (vec![0.0; env.spec().command.len()], vec![0.0; AGENTS * env.spec().act]);
    (0..AGENTS).for_each(|agent| env.set_command(agent, Some(&stand)).unwrap());
    let mut ways = vec![Vec::new(); AGENTS];
    let mut fallen = [false; AGENTS];
    for decision in 0..after + 200 {
        let weight = if decision < after { 82.0 * 9.81 } else { 0.0 };
        (0..AGENTS).for_each(|agent| env.push(agent, 1, [0.0, 0.0, weight], [0.0; 3]).unwrap());
        env.step(&actions, &mut step.as_mut()).unwrap();
        for agent in (0..AGENTS).filter(|agent| !fallen[*agent]).collect::<Vec<_>>() {
            ways[agent].push(env.state(agent).unwrap());
            fallen[agent] = step.terminated[agent];
        }
    }
    env.reset_agents(&fallen, &mut step.obs).unwrap();
    ways.into_iter().zip(fallen).map(|(way, fell)| fell.then_some(way)).collect()
}

/// Whether an episode that starts in a state may have been meant to start in another one.
fn is_from(start: &AgentState, state: &AgentState) -> bool {
    let near = |a: &[f64], b: &[f64], by: f64| a.iter().zip(b).all(|(a, b)| (a - b).abs() < by);
    start.qpos[..2] == [0.0; 2]
        && near(&start.qpos[2..7], &state.qpos[2..7], 1e-9)
        && near(&start.qpos[7..], &state.qpos[7..], NOISE)
        && near(&start.qvel[..6], &state.qvel[..6], 0.0251)
        && near(&start.qvel[6..], &state.qvel[6..], 10.0 * NOISE)
}

fn starts_before_the_fall(id: &str, list: &[(&str, &str)]) {
    let (mut env, mut step) = begun(id, AGENTS, 5, list);
    let ways = fall(&mut env, &mut step, 70);
    let mut relived = Vec::new();
    for (agent, way) in ways.iter().enumerate() {
        let Some(way) = way else { continue };
        let start = env.state(agent).unwrap();
        let from: Vec<usize> = (1..way.len()).filter(|ago| is_from(&start, &way[way.len() - 1 - ago])).collect();
        if way.len() > 2 * BEFORE.start() {
            assert!(from.iter().any(|ago| BEFORE.contains(ago)), "{id}: agent {agent} starts {from:?} before its fall");
            relived.push((agent, start));
        } else {
            assert!(from.is_empty(), "{id}: agent {agent} has not been up for long enough");
        }
    }
    assert!(relived.len() > AGENTS / 2, "{id}: {} fell", relived.len());
    // a fall at once has no state of its own before it
    let ways = fall(&mut env, &mut step, 5);
    for (agent, before) in relived {
        let Some(way) = &ways[agent] else { continue };
        if way.len() < *BEFORE.start() {
            let start = env.state(agent).unwrap();
            assert!((start.qpos[2] - before.qpos[2]).abs() < 1e-9, "{id}: agent {agent} starts where it did before");
        }
    }
}

#[test]
fn the_steered_figure_starts_before_his_fall() {
    starts_before_the_fall("MarathonManSteer-v0", &[("relive", "1")]);
}

#[test]
fn so_does_the_figure_in_a_players_hands() {
    starts_before_the_fall("MarathonManController-v0", &[("relive", "1"), ("mortal", "1"), ("clip", "walk,stand")]);
}

#[test]
fn without_it_nobody_does() {
    let (mut env, mut step) = begun("MarathonManSteer-v0", AGENTS, 5, &[]);
    let ways = fall(&mut env, &mut step, 70);
    for (agent, way) in ways.iter().enumerate() {
        let (start, Some(way)) = (env.state(agent).unwrap(), way) else { continue };
        assert!(way.iter().all(|state| !is_from(&start, state)), "agent {agent}");
    }
    assert!(ways.iter().flatten().count() > AGENTS / 2);
}
