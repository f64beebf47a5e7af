//! A state or action that is not finite ends its own agent's episode, is reported, and does not affect other agents.

use crate::common::{go_on, isas, make};
use marathon_envs::{AgentState, Autoreset};

#[test]
fn a_broken_agent_is_quarantined_and_made_whole() {
    for isa in isas() {
        let mut env = make("walker", 20, 1, Some(isa), Autoreset::SameStep);
        let mut healthy = make("walker", 20, 1, Some(isa), Autoreset::SameStep);
        let (obs, act) = (env.spec().obs, env.spec().act);
        let mut out = env.buffers();
        let mut reference = healthy.buffers();
        env.reset(Some(1), &mut out.obs).unwrap();
        healthy.reset(Some(1), &mut reference.obs).unwrap();

        // one agent gets an extreme velocity, another an action that is not a number
        let AgentState { mut qvel, qpos } = env.state(3).unwrap();
        qvel[1] = 1e9;
        env.set_state(3, &AgentState { qpos, qvel }).unwrap();
        let mut actions = vec![0.1; 20 * act];
        healthy.step(&actions, &mut reference).unwrap();
        actions[5 * act + 2] = f32::NAN;
        actions[6 * act] = f32::INFINITY;
        env.step(&actions, &mut out).unwrap();

        for i in 0..20 {
            let broken = [3, 5, 6].contains(&i);
            let place = format!("agent {i} with {}", isa.name());
            assert_eq!((out.diverged[i], out.terminated[i], out.truncated[i]), (broken, broken, false), "{place}");
            let last = &out.final_obs[i * obs..][..obs];
            if broken {
                assert_eq!((out.reward[i], out.forward[i]), (0.0, 0.0), "{place}");
                assert!(last.iter().all(|x| *x == 0.0), "{place}");
                assert!(out.obs[i * obs..][..obs].iter().any(|x| *x != 0.0), "{place}: a new episode has begun");
            } else {
                assert_eq!(out.reward[i], reference.reward[i], "{place}");
                assert_eq!(last, &reference.final_obs[i * obs..][..obs], "{place}");
            }
        }
        go_on(&mut env, &mut out, 0, 20, 0.3, |_, step| {
            assert!(step.obs.iter().all(|x| x.is_finite()));
            assert!(step.diverged.iter().all(|d| !d), "whole again");
        });
    }
}

/// Without automatic resets, a diverged agent is harmless until its caller resets it.
#[test]
fn a_broken_agent_may_wait_for_its_reset() {
    let mut env = make("humanoid", 4, 1, None, Autoreset::Disabled);
    let (obs, act) = (env.spec().obs, env.spec().act);
    let mut out = env.buffers();
    env.reset(None, &mut out.obs).unwrap();
    let mut actions = vec![0.0; 4 * act];
    actions[0] = f32::NAN;
    env.step(&actions, &mut out).unwrap();
    assert_eq!(out.diverged, [true, false, false, false]);
    actions[0] = 0.0;
    env.step(&actions, &mut out).unwrap();
    assert!(out.obs.iter().all(|x| x.is_finite()));
    let others = out.obs[obs..].to_vec();
    env.reset_agents(&[true, false, false, false], &mut out.obs).unwrap();
    assert_eq!(out.obs[obs..], others, "other rows are left alone");
    assert!(env.set_state(0, &AgentState { qpos: vec![f64::NAN; 28], qvel: vec![0.0; 27] }).is_err());
    assert!(env.set_state(0, &AgentState { qpos: vec![0.0; 3], qvel: vec![0.0; 27] }).is_err());
}
