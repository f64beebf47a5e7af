//! An adversary builds the ground ahead of the figure that runs, and earns what it loses.

use crate::common::courses::{AGENTS, FIGURES, env, height, torso};
use crate::common::{self, action, center, go_on};
use marathon_envs::{Autoreset, VecEnv, VecEnvOptions, agent};

/// The adversary builds a meter whenever the runner reaches one, and earns the runner's reward with the opposite sign.
#[test]
fn an_adversary_builds_ahead_of_the_runner() {
    for id in FIGURES {
        let plain = env(id, &[], Autoreset::Disabled).spec().clone();
        let options = [("course", "adversary"), ("difficulty", "1"), ("falls", "hurt")];
        let mut env = env(id, &options, Autoreset::Disabled);
        let spec = env.spec().clone();
        let [runner, builder] = &spec.roles[..] else { panic!("two roles: {:?}", spec.roles) };
        // a runner's policy runs on any course
        assert_eq!((runner.obs.clone(), runner.act.clone()), (0..plain.obs, 0..plain.act), "{id}");
        let own = plain.reward_terms.iter().position(|term| term == "termination").unwrap();
        assert_eq!(spec.reward_terms[runner.terms.clone()], [&plain.reward_terms[..own], &["fall".into()]].concat());
        assert_eq!((spec.act, builder.act.clone()), (plain.act + 1, plain.act..plain.act + 1));
        assert!(builder.intermittent && spec.reward_terms[builder.terms.clone()] == ["inverse"]);

        let mut out = env.buffers();
        env.reset(Some(1), &mut out.obs).unwrap();
        let (n, act, k) = (spec.obs, spec.act, spec.reward_terms.len());
        let mut actions = vec![0.0; AGENTS * act];
        for i in 0..AGENTS {
            assert!(env.ground(i, 0).unwrap().iter().all(|z| *z == 0.0));
            // a different step up or down for each agent
            actions[act * i + act - 1] = 0.1 * (i as f32 - 10.0);
        }
        env.step(&actions, &mut out).unwrap();
        for i in 0..AGENTS {
            let ground = env.ground(i, 0).unwrap();
            let step = 0.1 * (i as f64 - 10.0);
            assert!(
                (height(&ground, 6.0, 0.0) - step).abs() < 1e-6 && height(&ground, 5.0, 0.0) == 0.0,
                "{id}, agent {i}"
            );
            assert!((height(&ground, 50.0, 0.0) - step).abs() < 1e-6);
            let terms = &out.terms[k * i..k * (i + 1)];
            assert_eq!(terms[k - 1], -terms[..k - 1].iter().sum::<f32>());
            assert_eq!(out.reward[i], terms[..k - 1].iter().sum::<f32>());
        }
        // it does not act again before the next meter
        let before: Vec<_> = (0..AGENTS).map(|i| env.ground(i, 0).unwrap()).collect();
        actions.iter_mut().for_each(|a| *a = 0.0);
        actions.chunks_exact_mut(act).for_each(|row| row[act - 1] = 1.0);
        env.step(&actions, &mut out).unwrap();
        assert!((0..AGENTS).all(|i| env.ground(i, 0).unwrap() == before[i]), "{id}");
        // pushed ahead by more than a meter
        let weight = agent(id).unwrap().model().unwrap().bodies.iter().map(|b| b.mass).sum::<f64>() * 9.81;
        for i in 0..AGENTS {
            env.push(i, 1, [2.0 * weight, 0.0, weight], [0.0; 3]).unwrap();
        }
        for _ in 0..(0.5 / spec.dt) as usize {
            env.step(&actions, &mut out).unwrap();
        }
        let site = n - 19..n;
        for i in 0..AGENTS {
            let state = env.state(i).unwrap();
            let (ground, obs) = (env.ground(i, 0).unwrap(), &out.obs[n * i..n * (i + 1)]);
            let x = center(&agent(id).unwrap().model().unwrap(), &state, torso(id))[0];
            let [six, seven] = [6.0, 7.0].map(|x| height(&ground, x, 0.0));
            assert!(x > 1.0 && seven > six + 0.5, "{id}, agent {i} at {x}: {six} {seven}");
            for (point, seen) in obs[site.clone()].iter().take(12).enumerate() {
                let expected = height(&ground, x + 0.5 * (point + 1) as f64, 0.0) - height(&ground, x, 0.0);
                assert!((expected - f64::from(*seen)).abs() < 1e-3, "{id}, agent {i}: {expected} {seen}");
            }
        }
    }
}

/// With `builder=regret`, a reference runs on the same ground after the runner, from the start and with its own
/// actions. The adversary earns how much more the reference earns.
#[test]
fn a_reference_runs_over_the_same_ground() {
    for id in FIGURES {
        let options = [("course", "adversary"), ("difficulty", "0.3"), ("builder", "regret")];
        let [mut env, mut other] = [(); 2].map(|()| env(id, &options, Autoreset::Disabled));
        let spec = env.spec().clone();
        let [runner, builder, reference] = &spec.roles[..] else { panic!("three roles: {:?}", spec.roles) };
        assert_eq!((&runner.obs, runner.act.len()), (&reference.obs, reference.act.len()), "{id}");
        assert_eq!([&runner.name, &builder.name, &reference.name], ["runner", "builder", "reference"]);
        let (act, k, own) = (spec.act, spec.reward_terms.len(), runner.act.len());
        assert_eq!((spec.reward_terms[k - 2].as_str(), spec.reward_terms[k - 1].as_str()), ("regret", "reference"));
        let (mut out, mut seen) = (env.buffers(), other.buffers());
        env.reset(Some(1), &mut out.obs).unwrap();
        other.reset(Some(1), &mut seen.obs).unwrap();
        let model = agent(id).unwrap().model().unwrap();
        let torso_at = |env: &VecEnv, i| center(&model, &env.state(i).unwrap(), torso(id))[0];
        let who = |env: &VecEnv| {
            [0, 1, 2].map(|role| {
                let mut decides = [false; AGENTS];
                env.decides(role, &mut decides).unwrap();
                decides
            })
        };
        // for each agent: the decision at which the reference began, the sums of rewards, and the runner's distance
        let (mut began, mut earned) = ([None; AGENTS], [[0.0_f32; 3]; AGENTS]);
        let (mut ground, mut way) = (vec![Vec::new(); AGENTS], [0.0; AGENTS]);
        let mut over = [false; AGENTS];
        for decision in 0..spec.max_episode_steps {
            let mut actions = vec![0.0; AGENTS * act];
            actions.chunks_exact_mut(act).enumerate().for_each(|(i, row)| action(i, decision, 1.0, row));
            let decides = who(&env);
            // actions of a role that does not run have no effect; the other environment gets different ones
            let before: Vec<f64> = (0..AGENTS).map(|i| torso_at(&env, i)).collect();
            env.step(&actions, &mut out).unwrap();
            for (i, row) in actions.chunks_exact_mut(act).enumerate() {
                if began[i].is_some() || !decides[0][i] {
                    row[..own].fill(0.7);
                } else {
                    row[own..2 * own].fill(-0.7);
                }
            }
            other.step(&actions, &mut seen).unwrap();
            let running: Vec<usize> = (0..AGENTS).filter(|i| !over[*i]).collect();
            if running.is_empty() {
                break;
            }
            for i in running {
                assert_eq!(env.state(i).unwrap(), other.state(i).unwrap(), "{id}, agent {i}, decision {decision}");
                let terms = &out.terms[k * i..k * (i + 1)];
                let [theirs, of_runner] = [terms[k - 1], terms[..k - 2].iter().sum::<f32>()];
                assert_eq!(terms[k - 2], theirs - of_runner, "{id}");
                assert_eq!(out.reward[i], of_runner);
                for (sum, x) in earned[i].iter_mut().zip([of_runner, terms[k - 2], theirs]) {
                    *sum += x;
                }
                if decision > 0 && !decides[0][i] && began[i].is_none() {
                    // it is back at the start, on the same ground
                    began[i] = Some(decision);
                    assert!(
                        before[i] != 0.0 && torso_at(&env, i).abs() < 0.2,
                        "{id}, agent {i}: {}",
                        torso_at(&env, i)
                    );
                    ground[i] = env.ground(i, 0).unwrap();
                    way[i] = out.info[spec.info.len() * i];
                }
                let now = who(&env).map(|decides| decides[i]);
                over[i] = out.terminated[i] || out.truncated[i];
                match began[i] {
                    None => assert!(theirs == 0.0 && !now[2] && !over[i], "{id}, agent {i}: {now:?}"),
                    Some(_) => {
                        // all roles act at the end of an episode
                        let reference = (now[0] == over[i]) && now[2];
                        assert!(of_runner == 0.0 && reference, "{id}, agent {i}: {now:?}");
                        assert_eq!(env.ground(i, 0).unwrap(), ground[i], "{id}, agent {i}");
                        assert_eq!(out.info[spec.info.len() * i], way[i]);
                    }
                }
                // the runner's part ends before the reference begins
                if !now[0] && began[i].is_none() {
                    assert!(now == [false; 3], "{id}, agent {i}: {now:?}");
                }
            }
        }
        assert!(began.iter().all(Option::is_some) && over == [true; AGENTS], "{id}: {began:?} {over:?}");
        assert!(earned.iter().all(|[own, regret, theirs]| (regret - (theirs - own)).abs() < 1e-2), "{id}");
        assert!(earned.iter().all(|[own, _, theirs]| *own != 0.0 && *theirs != 0.0), "{id}");
    }
}

/// Ground built by an adversary is part of snapshots. It does not depend on threads or on other agents.
#[test]
fn built_ground_is_saved_and_restored() {
    let id = "TerrainHopper-v0";
    let options = [("course", "adversary"), ("falls", "hurt")];
    let mut first = env(id, &options, Autoreset::SameStep);
    let mut out = first.buffers();
    first.reset(Some(4), &mut out.obs).unwrap();
    go_on(&mut first, &mut out, 0, 60, 1.0, |_, _| {});
    let saved = first.save();
    let mut on = Vec::new();
    go_on(&mut first, &mut out, 60, 160, 1.0, |_, step| on.push(step.clone()));

    let given = common::options(&options);
    let threads = VecEnvOptions { agents: AGENTS, seed: 9, threads: 2, options: given, ..Default::default() };
    let mut other = VecEnv::new(id, &threads).unwrap();
    other.load(&saved).unwrap();
    let mut again = Vec::new();
    go_on(&mut other, &mut out, 60, 160, 1.0, |_, step| again.push(step.clone()));
    assert!(on == again);
    assert!((0..AGENTS).all(|i| first.ground(i, 0).unwrap() == other.ground(i, 0).unwrap()));
}
