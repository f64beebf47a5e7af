//! An agent's trajectory depends on its number and the seed, not on other agents, its slot, or the instruction set.
//!
//! The same agents execute the same actions among 1, 7, 16 and 100 agents, on 1, 2 and 3 threads, with every
//! instruction set of single precision that this processor has. All observations, rewards and endings are equal to the
//! bit.

use crate::common::{isas, make, play};
use marathon_envs::{AgentState, Autoreset, Step, VecEnv};
use marathon_physics::lanes::Isa;

const DECISIONS: usize = 60;

/// All observations and rewards of the first `agents` agents, by decision.
fn lives(id: &str, agents: usize, n: usize, threads: usize, isa: Isa) -> Vec<Vec<u32>> {
    let mut env = make(id, n, threads, Some(isa), Autoreset::SameStep);
    let (obs, terms, infos) = (env.spec().obs, env.spec().reward_terms.len(), env.spec().info.len());
    let mut lives = vec![Vec::new(); agents];
    play(&mut env, DECISIONS, 0.9, |_, step: &Step| {
        for (i, life) in lives.iter_mut().enumerate() {
            life.extend(step.obs[i * obs..][..obs].iter().map(|x| x.to_bits()));
            life.extend(step.final_obs[i * obs..][..obs].iter().map(|x| x.to_bits()));
            life.extend(step.terms[i * terms..][..terms].iter().map(|x| x.to_bits()));
            life.extend(step.info[i * infos..][..infos].iter().map(|x| x.to_bits()));
            life.extend([step.reward[i].to_bits(), step.forward[i].to_bits()]);
            life.push(u32::from(step.terminated[i]) | u32::from(step.truncated[i]) << 1);
        }
    });
    lives
}

/// Compares many settings with one.
fn check(id: &str) {
    let reference = lives(id, 100, 100, 1, Isa::F32);
    for isa in isas().filter(|isa| *isa != Isa::F64) {
        for (n, threads) in [(1, 1), (7, 1), (16, 2), (100, 1), (100, 2), (100, 3)] {
            for (i, life) in lives(id, n, n, threads, isa).iter().enumerate() {
                assert!(
                    *life == reference[i],
                    "{id}: agent {i} of {n} on {threads} threads with {} lived another life",
                    isa.name()
                );
            }
        }
    }
}

#[test]
fn hopper() {
    check("Hopper-v0");
}

#[test]
fn walker() {
    check("Walker2d-v1");
}

#[test]
fn humanoid() {
    check("Humanoid-v0");
}

#[test]
fn ant() {
    check("Ant-v0");
}

/// Every agent has its own place in the clip that it follows.
#[test]
fn marathon_man() {
    check("MarathonManWalkLeft-v0");
}

/// Every agent has its own commands and commanded direction.
#[test]
fn marathon_man_steered() {
    check("MarathonManSteer-v0");
}

/// Every agent has its own skill and clip.
#[test]
fn marathon_man_in_a_players_hands() {
    check("MarathonManController-v0");
}

/// Every agent has its own commands and velocities in its memory.
#[test]
fn walker_controller() {
    check("WalkerController-v0");
}

/// Every agent has its own commanded direction.
#[test]
fn ant_controller() {
    check("AntController-v0");
}

/// Every agent has its own course.
#[test]
fn ant_on_courses() {
    check("TerrainAnt-v0");
}

/// The gait and the course share a memory.
#[test]
fn marathon_man_on_courses() {
    check("TerrainMarathonMan-v0");
}

/// The same in a plane.
#[test]
fn hopper_on_courses() {
    check("TerrainHopper-v0");
}

/// Gymnasium's tasks observe forces and inertias, and some read the physics as of its last step.
#[test]
fn gymnasiums_ant() {
    check("Ant-v5");
}

#[test]
fn gymnasiums_humanoid() {
    check("Humanoid-v5");
}

#[test]
fn gymnasiums_double_pendulum() {
    check("InvertedDoublePendulum-v5");
}

#[test]
fn gymnasiums_reacher() {
    check("Reacher-v5");
}

#[test]
fn gymnasiums_pusher() {
    check("Pusher-v5");
}

/// dm_control's tasks: touch sensors, starts that are drawn repeatedly, and starts that settle.
#[test]
fn dm_controls_hopper() {
    check("hopper-stand-v0");
}

#[test]
fn dm_controls_humanoid() {
    check("humanoid-walk-v0");
}

#[test]
fn dm_controls_cheetah() {
    check("cheetah-run-v0");
}

/// Start states of the agents' episodes, `[episode][agent]`. The agents begin them one by one, in an order given by
/// `turns`.
fn starts(env: &mut VecEnv, episodes: usize, turns: impl Fn(usize, usize) -> usize) -> Vec<Vec<AgentState>> {
    let n = env.agents();
    let mut obs = vec![0.0; n * env.spec().obs];
    env.reset(Some(3), &mut obs).unwrap();
    let mut starts: Vec<Vec<AgentState>> = vec![(0..n).map(|i| env.state(i).unwrap()).collect()];
    let mut begun = vec![0; n];
    starts.resize(episodes, starts[0].clone());
    for turn in 0..n * (episodes - 1) {
        let agent = turns(turn, n);
        let mask: Vec<bool> = (0..n).map(|i| i == agent).collect();
        env.reset_agents(&mask, &mut obs).unwrap();
        begun[agent] += 1;
        starts[begun[agent]][agent] = env.state(agent).unwrap();
    }
    starts
}

/// A start that needs physics is prepared beside those of other agents. This must not affect it.
#[test]
fn starts_do_not_depend_on_when_they_are_made() {
    for id in ["humanoid-stand-v0", "cheetah-run-v0"] {
        let [mut a, mut b] = [Isa::F32, Isa::best()].map(|isa| make(id, 20, 1, Some(isa), Autoreset::Disabled));
        // episode by episode, and agent by agent
        let by_episode = starts(&mut a, 4, |turn, n| turn % n);
        let by_agent = starts(&mut b, 4, |turn, _| turn / 3);
        assert!(by_episode == by_agent, "{id}");
        let all: Vec<&AgentState> = by_episode.iter().flatten().collect();
        assert!((1..all.len()).all(|i| !all[..i].contains(&all[i])), "{id}: two starts are the same");
    }
}

/// Agents differ from each other. Otherwise the tests above would pass for the wrong reason.
#[test]
fn no_two_agents_live_the_same_life() {
    let lives = lives("Hopper-v0", 40, 40, 1, Isa::best());
    for (i, life) in lives.iter().enumerate() {
        assert!(lives[..i].iter().all(|other| other != life), "agent {i} has a twin");
    }
}
