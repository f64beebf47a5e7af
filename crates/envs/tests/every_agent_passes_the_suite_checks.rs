//! Requirements for every registered agent: dm_control's suite checks and Marathon's own.

use crate::common::{self, go_on, make, own_agents, play};
use marathon_envs::{Autoreset, ResetNoise, Step, TERMINATION_TERM, VecEnv, VecEnvOptions};

/// Observation length, action length, decisions per second, decisions per episode: the paper's numbers.
#[test]
fn the_specs_are_the_papers() {
    for (id, obs, act, hz) in [
        ("Hopper-v0", 31, 4, 50.0),
        ("Hopper-v1", 31, 4, 50.0),
        ("Walker2d-v0", 41, 6, 100.0),
        ("Walker2d-v1", 43, 6, 100.0),
        ("Humanoid-v0", 88, 21, 40.0),
        ("Humanoid-v1", 92, 21, 40.0),
        ("Ant-v0", 53, 8, 100.0),
        ("Ant-v1", 54, 8, 100.0),
    ] {
        let env = make(id, 1, 1, None, Autoreset::SameStep);
        let spec = env.spec();
        assert_eq!((spec.id.as_str(), spec.obs, spec.act, spec.max_episode_steps), (id, obs, act, 1000));
        assert!((1.0 / spec.dt - hz).abs() < 1e-9, "{id}: {} Hz", 1.0 / spec.dt);
    }
}

/// The touch sensors of the model file are those of the observation.
#[test]
fn touch_sensors_are_those_of_the_model() {
    for id in marathon_envs::ids() {
        let agent = marathon_envs::agent(&id).unwrap();
        let model = agent.model().unwrap();
        let named: Vec<_> = model.sensors.iter().filter(|s| s.element == "touch").map(|s| s.name.as_str()).collect();
        let facts = agent.facts();
        assert_eq!(named, [facts.touch, facts.touch_sites].concat(), "{id}");
    }
}

/// Agents whose episodes random actions rarely or never end. One of them has eight seconds to get up after a fall.
const STEADY: [&str; 10] = [
    "Ant-v0",
    "Ant-v1",
    "AntController-v0",
    "TerrainAnt-v0",
    "MarathonManController-v0",
    "HalfCheetah-v5",
    "Reacher-v5",
    "Pusher-v5",
    "HumanoidStandup-v5",
    "Swimmer-v5",
];

/// Whether it is a task of dm_control, in which episodes are never terminated.
fn is_dm_controls(id: &str) -> bool {
    id.starts_with(char::is_lowercase)
}

/// Observations and rewards are finite; terms add up to the reward; no agent both fails and runs out of time.
#[test]
fn every_step_is_sound() {
    for id in marathon_envs::ids() {
        let mut env = make(&id, 24, 1, None, Autoreset::SameStep);
        let n = env.spec().reward_terms.len();
        let price = marathon_envs::agent(&id).unwrap().facts().termination_reward;
        let priced = price.is_some();
        assert_eq!(env.spec().reward_terms[n - 1] == TERMINATION_TERM, priced, "{id}");
        let mut failed = 0;
        play(&mut env, 150, 1.5, |t, step| {
            let all = step.obs.iter().chain(&step.final_obs).chain(&step.reward).chain(&step.terms).chain(&step.info);
            assert!(all.into_iter().all(|x| x.is_finite()), "{id}, decision {t}");
            for (i, terms) in step.terms.chunks_exact(n).enumerate() {
                let sum = terms.iter().fold(0.0, |sum, x| sum + x);
                assert_eq!(sum, step.reward[i], "{id}, decision {t}, agent {i}: {terms:?}");
                assert!(!(step.terminated[i] && step.truncated[i]));
                assert!(!step.diverged[i]);
                if priced {
                    assert_eq!(terms[n - 1] != 0.0, step.terminated[i]);
                    assert!(!step.terminated[i] || price.is_some_and(|price| f64::from(step.reward[i]) == price));
                }
                failed += usize::from(step.terminated[i]);
            }
        });
        let steady = STEADY.contains(&id.as_str()) || is_dm_controls(&id);
        assert!(failed > 0 || steady, "{id}: wild actions never ended an episode");
    }
}

/// The `-v1` rewards are between 0 and 1 while the agent is on its feet.
#[test]
fn rewards_of_v1_are_between_0_and_1() {
    for id in marathon_envs::ids().iter().filter(|id| id.ends_with("-v1")) {
        let mut env = make(id, 16, 1, None, Autoreset::SameStep);
        play(&mut env, 150, 0.7, |_, step| {
            for (r, t) in step.reward.iter().zip(&step.terminated) {
                assert!(*t || (0.0..=1.0).contains(r), "{id}: {r}");
            }
        });
    }
}

/// Every number of the observation varies, except those that cannot: the sideways components of velocity and axes of a
/// planar agent, two of the four components of its quaternions, masses, and forces without a cause.
#[test]
fn no_observation_is_constant() {
    for id in marathon_envs::ids() {
        let mut env = make(&id, 32, 1, None, Autoreset::SameStep);
        let obs = env.spec().obs;
        let mut least = vec![f32::INFINITY; obs];
        let mut most = vec![f32::NEG_INFINITY; obs];
        play(&mut env, 200, 1.0, |_, step| {
            for row in step.obs.chunks_exact(obs) {
                for (i, x) in row.iter().enumerate() {
                    least[i] = least[i].min(*x);
                    most[i] = most[i].max(*x);
                }
            }
        });
        // bodies without contacts have no contact force
        let forces = env.spec().options.get("include_cfrc_ext_in_observation").map_or(obs, |_| obs - 13 * 6);
        let constant: Vec<usize> = (0..obs).filter(|i| least[*i] == most[*i]).collect();
        assert!(constant.iter().filter(|i| **i >= forces).all(|i| least[*i] == 0.0), "{id}: constant forces");
        let constant: Vec<usize> = constant.into_iter().filter(|i| *i < forces).collect();
        let quaternions =
            |first: usize, joints: usize| (0..joints).flat_map(move |j| [first + 4 * j, first + 4 * j + 2]);
        let planar: Vec<usize> = match id.as_str() {
            "Hopper-v0" | "Hopper-v1" | "HopperController-v0" | "TerrainHopper-v0" => {
                [1, 4, 7].into_iter().chain(quaternions(10, 4)).collect()
            }
            "Walker2d-v0" | "Walker2d-v1" | "WalkerController-v0" | "TerrainWalker2d-v0" => {
                [1, 4, 7].into_iter().chain(quaternions(11, 6)).collect()
            }
            // hips rotate about z, ankles about a horizontal axis
            "Ant-v0" | "Ant-v1" | "TerrainAnt-v0" => {
                (0..4).flat_map(|leg| [13 + 8 * leg, 14 + 8 * leg, 19 + 8 * leg]).collect()
            }
            "AntController-v0" | "Robot-v0" => vec![],
            // no turn is commanded
            "TerrainMarathonMan-v0" => vec![1],
            // the masses of 13 bodies, the last of ten numbers each
            "Humanoid-v5" | "HumanoidStandup-v5" => (0..13).map(|body| 22 + 23 + 10 * body + 9).collect(),
            // the poles fall before the cart reaches the end of the rail
            "InvertedDoublePendulum-v5" => vec![8],
            // heights of puck and goal, and the goal's place
            "Pusher-v5" => vec![19, 20, 21, 22],
            // sideways: axes, velocity; all of the angular velocity but pitch; the position in the clip
            id if id.starts_with("Walker2dStyle") => vec![6, 9, 12, 14, 16, 32],
            id if id.contains("MarathonMan") || id.starts_with("HumanoidStyle") => vec![],
            id if id.ends_with("-v5") || is_dm_controls(id) => vec![],
            // knees, pairs 3 and 6, rotate about y; elbows, pairs 9 and 11, about an axis without x
            _ => vec![31, 33, 43, 45, 55, 63],
        };
        assert_eq!(constant, planar, "{id}: constant observations");
        let fixed = id.starts_with("Humanoid") && id.ends_with("-v5") || id == "Pusher-v5";
        assert!(planar.iter().all(|i| fixed || least[*i] == 0.0), "{id}: what is constant is zero");
    }
}

/// The same seed gives the same episode and another seed a different one. Episodes of one agent differ, and so do
/// agents.
#[test]
fn resets_are_random_and_reproducible() {
    for id in marathon_envs::ids() {
        let mut env = make(&id, 5, 1, None, Autoreset::SameStep);
        let obs = env.spec().obs;
        let mut reset = |seed| {
            let mut o = vec![0.0; 5 * obs];
            env.reset(seed, &mut o).unwrap();
            o
        };
        let (a, b, c) = (reset(Some(1)), reset(None), reset(Some(2)));
        assert_ne!(a, b, "{id}: the second episode is another");
        assert_ne!(a, c, "{id}: another seed");
        assert_eq!(a, reset(Some(1)), "{id}: the same seed");
        assert_eq!(b, reset(None), "{id}: the second episode under the same seed");
        let rows: Vec<_> = a.chunks_exact(obs).collect();
        assert!(rows.windows(2).all(|w| w[0] != w[1]), "{id}: agents differ");
    }
}

/// A start is the spawn pose with noise as documented, inside the joints' ranges, above the floor.
#[test]
fn resets_stay_near_the_spawn_pose() {
    for id in own_agents() {
        let agent = marathon_envs::agent(&id).unwrap();
        if !agent.facts().clips.is_empty() {
            continue; // they start in a clip
        }
        let robot = ResetNoise { joint_position: 0.05, joint_velocity: 0.1, root_velocity: 0.1 };
        let noise = if id == "Robot-v0" { robot } else { ResetNoise::MARATHON };
        let model = agent.model().unwrap();
        let spawn = model.keyframes.iter().find(|key| key.name == "spawn").expect("a start pose");
        let mut env = make(&id, 64, 1, None, Autoreset::SameStep);
        let mut out = env.buffers();
        env.reset(None, &mut out.obs).unwrap();
        let actuated = |joint: usize| model.actuators.iter().any(|a| a.joint() == Some(joint));
        for agent in 0..64 {
            let state = env.state(agent).unwrap();
            for (i, joint) in model.joints.iter().enumerate() {
                if actuated(i) {
                    let (q, v) = (state.qpos[joint.qpos_adr], state.qvel[joint.dof_adr]);
                    assert!(
                        (q - spawn.qpos[joint.qpos_adr]).abs() <= noise.joint_position + 1e-6,
                        "{id} {}",
                        joint.name
                    );
                    assert!(v.abs() <= noise.joint_velocity && v != 0.0, "{id} {}", joint.name);
                    assert!(q >= joint.range[0] - 1e-6 && q <= joint.range[1] + 1e-6, "{id} {}", joint.name);
                }
            }
            let most = noise.joint_velocity.max(noise.root_velocity);
            let velocities = state.qvel.iter().zip(&spawn.qvel);
            assert!(velocities.into_iter().all(|(v, at_spawn)| (v - at_spawn).abs() <= most + 1e-6), "{id}");
        }
        // before the first step there are no contacts
        let feet = agent.facts().touch.len();
        let first = if id.starts_with("Humanoid") || id == "AntController-v0" { 15 } else { 9 };
        let obs = env.spec().obs;
        assert!(out.obs.chunks_exact(obs).all(|row| row[first..first + feet].iter().all(|x| *x == 0.0)), "{id}");
    }
}

/// An episode without termination lasts exactly 1000 decisions and is truncated.
#[test]
fn the_time_limit_truncates() {
    // an idle ant stands
    for id in ["Ant-v0", "Ant-v1"] {
        let mut env = make(id, 2, 1, None, Autoreset::SameStep);
        let mut out = play(&mut env, 999, 0.0, |t, step| {
            assert!(!step.truncated[0] && !step.terminated[0], "decision {t}");
        });
        go_on(&mut env, &mut out, 999, 1000, 0.0, |_, _| {});
        assert_eq!((&out.truncated[..], &out.terminated[..]), (&[true; 2][..], &[false; 2][..]));
        let obs = env.spec().obs;
        assert_ne!(out.obs[..obs], out.final_obs[..obs], "the next episode has begun");
        go_on(&mut env, &mut out, 1000, 1999, 0.0, |_, step| assert!(!step.truncated[0]));
        go_on(&mut env, &mut out, 1999, 2000, 0.0, |_, step| assert!(step.truncated[0]));
    }
}

/// Two environments share nothing.
#[test]
fn environments_do_not_share_memory() {
    let mut a = make("humanoid", 2, 1, None, Autoreset::SameStep);
    let mut b = make("humanoid", 2, 1, None, Autoreset::SameStep);
    let alone: Step = play(&mut a, 20, 0.5, |_, _| {});
    let mut out = a.buffers();
    a.reset(Some(5), &mut out.obs).unwrap();
    for t in 0..20 {
        play(&mut b, 3, 1.0, |_, _| {});
        go_on(&mut a, &mut out, t, t + 1, 0.5, |_, _| {});
    }
    assert_eq!(out, alone);
}

#[test]
fn options_that_make_no_sense_are_refused() {
    let make = |options| VecEnv::new("hopper", &options).map(|_| ()).unwrap_err().to_string();
    assert_eq!(make(VecEnvOptions { agents: 0, ..Default::default() }), "agents is 0, expected at least 1");
    let mut env = common::make("hopper", 2, 1, None, Autoreset::SameStep);
    let mut out = env.buffers();
    env.reset(None, &mut out.obs).unwrap();
    let error = env.step(&[0.0; 7], &mut out).unwrap_err().to_string();
    assert_eq!(error, "actions [agents][act] has 7 numbers, expected 8");
    assert!(env.state(2).unwrap_err().to_string().contains("expected less than the number of agents"));
}
