//! The assault courses. Each agent has its own ground in each episode, observes it and stands on it. A curriculum rises
//! with the distance covered. The reward is the documented formula.

use crate::common::courses::{AGENTS, FIGURES, POINTS, env, height, in_space, torso};
use crate::common::{action, center, go_on};
use marathon_envs::{AgentState, Autoreset, Step, VecEnv, agent};
use marathon_motion::kinematics::Pose;
use marathon_physics::Model;
use std::f64::consts::PI;

/// Slots of `info`.
const DISTANCE: usize = 0;
const DIFFICULTY: usize = 1;

/// Feet of the Ant and of Marathon Man.
const ANKLES: [&str; 4] = ["left_ankle_geom", "right_ankle_geom", "third_ankle_geom", "fourth_ankle_geom"];
const SOLES: [&str; 2] = ["right_right_foot", "left_left_foot"];

/// The coordinate of a figure's height.
fn up(id: &str) -> usize {
    if in_space(id) { 2 } else { 1 }
}

/// The forward axis of a geom's body, as in the spawn pose.
fn axis(model: &Model, state: &AgentState, geom: &str) -> [f64; 3] {
    let body = model.geoms.iter().find(|g| g.name == geom).unwrap().body;
    let (now, spawn) = (Pose::of(model, &state.qpos), Pose::of(model, &model.qpos0));
    let mut ahead = now.pos[0];
    [ahead.x, ahead.y, ahead.z] = [1.0, 0.0, 0.0];
    (now.quat[body] * (spawn.quat[body].inverse() * ahead)).to_array()
}

/// Size of a figure's observation of the ground, without the heights of its feet.
fn seen(id: &str) -> usize {
    match id {
        "TerrainMarathonMan-v0" => 45 + 51,
        _ if in_space(id) => 45,
        _ => 26,
    }
}

#[test]
fn a_figure_sees_the_ground_that_it_has() {
    for (id, own, eyes, feet) in [
        ("TerrainHopper-v0", 30, "foot", &["foot"][..]),
        ("TerrainWalker2d-v0", 41, "torso", &["left_foot", "right_foot"][..]),
        ("TerrainAnt-v0", 53, "torso_geom", &ANKLES[..]),
        ("TerrainMarathonMan-v0", 103, "butt", &SOLES[..]),
    ] {
        let model = agent(id).unwrap().model().unwrap();
        let mut blind = env(id, &[("heights", "false"), ("difficulty", "1")], Autoreset::Disabled);
        assert_eq!(blind.spec().obs, own + feet.len(), "{id}");
        let mut env = env(id, &[("difficulty", "1")], Autoreset::Disabled);
        // in a plane 57 and 69 numbers, as in the original
        let n = env.spec().obs;
        assert_eq!(n, own + feet.len() + seen(id), "{id}");
        let mut out = env.buffers();
        env.reset(Some(1), &mut out.obs).unwrap();
        let grounds: Vec<Vec<f32>> = (0..AGENTS).map(|i| env.ground(i, 0).unwrap()).collect();
        assert!((1..AGENTS).all(|i| grounds[i] != grounds[0] && grounds[i].iter().any(|z| *z != 0.0)), "{id}");
        let differs = |ground: &[f32]| ground[..POINTS] != ground[ground.len() - POINTS..];
        assert!(grounds.iter().all(|ground| differs(ground) == in_space(id)), "{id}");
        // somewhere on the course, high enough to touch nothing
        for (i, ground) in grounds.iter().enumerate() {
            let mut state = env.state(i).unwrap();
            state.qpos[0] += 5.0 + 4.9 * i as f64;
            let y = if in_space(id) { 0.7 * (i % 5) as f64 - 1.3 } else { 0.0 };
            if in_space(id) {
                state.qpos[1] = y;
                // faces to the left, with the hands off the ground
                let turn = 0.3 * (i % 3) as f64;
                let [w, z] = [(0.5 * turn).cos(), (0.5 * turn).sin()];
                let q: [f64; 4] = std::array::from_fn(|k| state.qpos[3 + k]);
                let turned = [w * q[0] - z * q[3], w * q[1] - z * q[2], w * q[2] + z * q[1], w * q[3] + z * q[0]];
                state.qpos[3..7].copy_from_slice(&turned);
            }
            state.qpos[up(id)] += 1.0 + height(ground, state.qpos[0], y);
            env.set_state(i, &state).unwrap();
        }
        env.observe(&[true; AGENTS], &mut out.obs).unwrap();
        for (i, (ground, obs)) in grounds.iter().zip(out.obs.chunks_exact(n)).enumerate() {
            let state = env.state(i).unwrap();
            let mut expected: Vec<f64> = Vec::new();
            for foot in feet {
                let [x, y, z] = center(&model, &state, foot);
                expected.push(z - height(ground, x, y));
            }
            let [x, y, z] = center(&model, &state, eyes);
            let clipped = |ground: f64| (ground - z).clamp(-3.0, 3.0);
            if in_space(id) {
                // nine rows ahead, with five points from left to right in each
                let [c, d, _] = axis(&model, &state, eyes);
                let [c, d] = [c / c.hypot(d), d / c.hypot(d)];
                let mut see = |ahead: f64, left: f64| {
                    expected.push(clipped(height(ground, x + ahead * c - left * d, y + ahead * d + left * c)));
                };
                (0..45).for_each(|k| see(0.4 * f64::from(k / 5) - 0.4, 0.6 - 0.3 * f64::from(k % 5)));
                if seen(id) > 45 {
                    (0..51).for_each(|k| see(0.1 * f64::from(k / 3), 0.2 - 0.2 * f64::from(k % 3)));
                }
            } else {
                expected.extend((0..25).map(|k| clipped(height(ground, x - 2.0 + 0.2 * f64::from(k), 0.0))));
                expected.push((x / 0.2).rem_euclid(1.0));
            }
            for (k, (expected, seen)) in expected.iter().zip(&obs[own..]).enumerate() {
                let off = (expected - f64::from(*seen)).abs();
                // single precision at 100 m, where the ground may rise by 6 m per m; the phase jumps from 1 to 0
                let jumps = k == feet.len() + 25 && off > 0.999;
                assert!(off < 1e-3 || jumps, "{id}, agent {i}, number {k}: {expected} {seen}");
            }
        }
        // the rest of the observation does not depend on the ground's
        let mut step = blind.buffers();
        blind.reset(Some(1), &mut step.obs).unwrap();
        env.reset(Some(1), &mut out.obs).unwrap();
        for (all, some) in out.obs.chunks_exact(n).zip(step.obs.chunks_exact(own + feet.len())) {
            assert_eq!(all[..some.len()], *some, "{id}");
        }
    }
}

/// Ground is drawn for each episode from seed, agent, episode and options.
#[test]
fn each_episode_has_its_course() {
    let id = "TerrainHopper-v0";
    let mut first = env(id, &[], Autoreset::SameStep);
    let mut out = first.buffers();
    first.reset(Some(7), &mut out.obs).unwrap();
    let before: Vec<_> = (0..AGENTS).map(|i| first.ground(i, 0).unwrap()).collect();
    let mut ended = [false; AGENTS];
    go_on(&mut first, &mut out, 0, 200, 1.0, |_, step| {
        ended.iter_mut().zip(&step.terminated).for_each(|(ended, now)| *ended |= now);
    });
    assert!(ended.iter().all(|ended| *ended), "wild actions make a Hopper fall");
    assert!((0..AGENTS).all(|i| first.ground(i, 0).unwrap() != before[i]));
    first.reset(Some(7), &mut out.obs).unwrap();
    assert!((0..AGENTS).all(|i| first.ground(i, 0).unwrap() == before[i]));

    let mut flat = env(id, &[("course", "flat")], Autoreset::SameStep);
    flat.reset(Some(7), &mut out.obs).unwrap();
    assert!(flat.ground(0, 0).unwrap().iter().all(|z| *z == 0.0));
    let mut random = env(id, &[("levels", "random"), ("difficulty", "0.8")], Autoreset::SameStep);
    random.reset(Some(7), &mut out.obs).unwrap();
    let n = random.spec().info.len();
    let mut info = vec![0.0; AGENTS * n];
    random.info(&mut info).unwrap();
    let difficulties: Vec<f32> = info.chunks_exact(n).map(|row| row[DIFFICULTY]).collect();
    let [least, most] =
        [f32::min as fn(f32, f32) -> f32, f32::max].map(|pick| difficulties.iter().copied().reduce(pick).unwrap());
    assert!(least < 0.25 && most > 0.55 && most <= 0.8, "{least} to {most}");
}

/// Moves agents `x` meters ahead, lying, and waits until their episodes end.
fn fall_at(env: &mut VecEnv, out: &mut Step, x: &[f64]) {
    for (i, x) in x.iter().enumerate() {
        let mut state = env.state(i).unwrap();
        let ground = env.ground(i, 0).unwrap();
        state.qpos[0] += x;
        // on its side, because only feet may touch the ground
        state.qpos[1] += height(&ground, state.qpos[0], 0.0) - 0.8;
        state.qpos[2] += 0.5 * PI;
        env.set_state(i, &state).unwrap();
    }
    let actions = vec![0.0; AGENTS * env.spec().act];
    env.step(&actions, &mut *out).unwrap();
    assert!(out.terminated.iter().all(|over| *over), "a lying figure has fallen");
}

#[test]
fn a_curriculum_rises_and_falls_with_the_way() {
    let mut env = env("TerrainHopper-v0", &[("levels", "distance"), ("difficulty", "0.5")], Autoreset::SameStep);
    let mut out = env.buffers();
    env.reset(Some(1), &mut out.obs).unwrap();
    assert!(env.ground(3, 0).unwrap().iter().all(|z| *z == 0.0), "it begins with level ground");
    let n = env.spec().info.len();
    let (mut levels, mut rounds, mut changes) = ([0.0f64; AGENTS], [0; AGENTS], [0; 3]);
    let (actions, mut info) = (vec![0.0; AGENTS * env.spec().act], vec![0.0; AGENTS * n]);
    let weight = agent("TerrainHopper-v0").unwrap().model().unwrap().bodies.iter().map(|b| b.mass).sum::<f64>() * 9.81;
    for _ in 0..400 {
        for i in 0..AGENTS {
            // moved as far as its turn requires, then down
            let far = [20.0, 20.0, 12.0, 4.0][(i + rounds[i]) % 4];
            let x = env.state(i).unwrap().qpos[0];
            let force = if x < far { [20.0 * weight / 9.81, 0.0, weight] } else { [0.0, 0.0, -20.0 * weight] };
            env.push(i, 1, force, [0.0; 3]).unwrap();
        }
        env.step(&actions, &mut out).unwrap();
        env.info(&mut info).unwrap();
        for i in (0..AGENTS).filter(|i| out.terminated[*i]) {
            // 5 % harder after 16 m, 5 % easier after less than 8 m, unchanged in between
            let far = f64::from(out.info[n * i + DISTANCE]);
            let change = if far >= 16.0 { 2 } else { usize::from(far >= 8.0) };
            changes[change] += 1;
            levels[i] = (levels[i] + [-0.05, 0.0, 0.05][change]).clamp(0.0, 1.0);
            rounds[i] += 1;
            let difficulty = f64::from(info[n * i + DIFFICULTY]);
            assert!((difficulty - 0.5 * levels[i]).abs() < 1e-6, "agent {i}, {far} m: {difficulty} {levels:?}");
        }
    }
    assert!(changes.iter().all(|n| *n >= AGENTS / 2) && levels.iter().any(|level| *level > 0.05), "{changes:?}");
    let rough = (0..AGENTS).filter(|i| env.ground(*i, 0).unwrap().iter().any(|z| *z != 0.0)).count();
    assert_eq!(rough, levels.iter().filter(|level| **level > 0.0).count());
    // a manual reset starts at level 0
    env.reset(Some(1), &mut out.obs).unwrap();
    assert!(env.ground(0, 0).unwrap().iter().all(|z| *z == 0.0));
}

#[test]
fn a_figure_stands_on_its_ground() {
    for id in FIGURES {
        let model = agent(id).unwrap().model().unwrap();
        let options = [("course", "bumps"), ("difficulty", "1"), ("falls", "hurt")];
        let mut env = env(id, &options, Autoreset::Disabled);
        let mut out = env.buffers();
        env.reset(Some(1), &mut out.obs).unwrap();
        let ground = env.ground(0, 0).unwrap();
        for i in 0..AGENTS {
            let mut state = env.state(i).unwrap();
            state.qpos[0] += 5.0 + i as f64;
            state.qpos[up(id)] += 0.3 + height(&ground, state.qpos[0], 0.0);
            env.set_state(i, &state).unwrap();
        }
        let actions = vec![0.0; AGENTS * env.spec().act];
        for _ in 0..150 {
            env.step(&actions, &mut out).unwrap();
        }
        for i in 0..AGENTS {
            let state = env.state(i).unwrap();
            let [x, y, z] = center(&model, &state, torso(id));
            let above = z - height(&ground, x, y);
            // it has fallen, and lies on the ground, not inside it
            assert!((0.03..1.4).contains(&above), "{id}, agent {i}: {above} at {x}");
        }
    }
}

#[test]
fn rewards_are_their_formulas() {
    for (id, effort) in [("TerrainHopper-v0", 0.3), ("TerrainWalker2d-v0", 0.1), ("TerrainAnt-v0", 0.5)] {
        for reward in ["full", "velocity", "sparse"] {
            let model = agent(id).unwrap().model().unwrap();
            let options = [("reward", reward), ("falls", "hurt"), ("difficulty", "1")];
            let mut env = env(id, &options, Autoreset::Disabled);
            let mut out = env.buffers();
            env.reset(Some(2), &mut out.obs).unwrap();
            let (act, n, k) = (env.spec().act, env.spec().obs, env.spec().reward_terms.len());
            let mut actions = vec![0.0; AGENTS * act];
            let (mut hurt, mut lay, mut over, mut hits) = ([false; AGENTS], [false; AGENTS], [false; AGENTS], 0);
            for decision in 0..120 {
                for (agent, row) in actions.chunks_exact_mut(act).enumerate() {
                    action(agent, decision, 1.3, row);
                }
                if decision == 0 {
                    // after the first meters, a fall does not end the episode
                    for i in 0..AGENTS {
                        let mut state = env.state(i).unwrap();
                        state.qpos[0] += 4.8;
                        env.set_state(i, &state).unwrap();
                    }
                }
                env.step(&actions, &mut out).unwrap();
                for i in 0..AGENTS {
                    let obs = &out.obs[n * i..n * (i + 1)];
                    let (state, a) = (env.state(i).unwrap(), &actions[act * i..act * (i + 1)]);
                    let terms = &out.terms[k * i..k * (i + 1)];
                    let distance = f64::from(out.info[env.spec().info.len() * i + DISTANCE]);
                    over[i] |= out.terminated[i];
                    if over[i] {
                        continue;
                    }
                    let expected = match reward {
                        "velocity" => vec![f64::from(obs[0] / 8.0).clamp(0.0, 1.0)],
                        "sparse" => vec![0.0],
                        _ => {
                            let hit = terms[4] != 0.0;
                            // a figure that begins to lie was not lying before
                            assert!(!(hit && lay[i]));
                            hurt[i] |= hit;
                            lay[i] = hit;
                            hits += usize::from(hit);
                            let whole = f64::from(u8::from(!hurt[i]));
                            let pitch = state.qpos[2].rem_euclid(2.0 * PI);
                            let tilt = match in_space(id) {
                                true => f64::from(obs[3]).clamp(-1.0, 1.0).acos(),
                                false => pitch.min(2.0 * PI - pitch),
                            };
                            let clipped = || a.iter().map(|a| f64::from(a.clamp(-1.0, 1.0)));
                            let at_limit = clipped().filter(|a| a.abs() >= 1.0).count() as f64;
                            let spent: f64 = clipped().map(|a| a * a).sum();
                            let posture = whole * (0.5 - tilt / PI);
                            let pain = if hit { -5.0 } else { 0.0 };
                            vec![f64::from(obs[0]) / 4.0, posture, -effort * whole * spent, -0.8 * at_limit, pain]
                        }
                    };
                    for (term, expected) in terms.iter().zip(&expected) {
                        let off = (f64::from(*term) - expected).abs();
                        // error of an arc cosine in single precision
                        let most = if in_space(id) { 5e-4 } else { 1e-4 };
                        assert!(off < most, "{id} {reward}, agent {i}, {decision}: {terms:?} {expected:?}");
                    }
                    assert!(distance >= center(&model, &state, torso(id))[0] - 1e-3);
                }
            }
            assert!(reward != "full" || hits > AGENTS || in_space(id), "{id}: {hits} falls");
        }
    }
}

/// The sparse reward pays the distance at the end of the episode, however it ends.
#[test]
fn the_way_is_paid_at_the_end() {
    let mut env = env("TerrainHopper-v0", &[("reward", "sparse")], Autoreset::SameStep);
    let mut out = env.buffers();
    env.reset(Some(1), &mut out.obs).unwrap();
    let ways: Vec<f64> = (0..AGENTS).map(|i| 5.0 + i as f64).collect();
    fall_at(&mut env, &mut out, &ways);
    for (way, paid) in ways.iter().zip(&out.reward) {
        assert!((f64::from(*paid) - way / 20.0).abs() < 0.02, "{way} {paid}");
    }
}

/// A figure without a new meter for five seconds, or at the end of the course, is truncated, not terminated.
#[test]
fn an_episode_ends_where_nothing_happens_any_more() {
    let mut env = env("TerrainHopper-v0", &[("falls", "hurt"), ("course", "flat")], Autoreset::Disabled);
    let mut out = env.buffers();
    env.reset(Some(1), &mut out.obs).unwrap();
    for i in 0..AGENTS {
        let mut state = env.state(i).unwrap();
        state.qpos[0] = if i == 0 { 105.5 } else { 20.0 };
        env.set_state(i, &state).unwrap();
    }
    let actions = vec![0.0; AGENTS * env.spec().act];
    let mut ends = [None; AGENTS];
    for decision in 1..=300 {
        env.step(&actions, &mut out).unwrap();
        for (end, (truncated, terminated)) in ends.iter_mut().zip(out.truncated.iter().zip(&out.terminated)) {
            assert!(!terminated);
            *end = end.or(truncated.then_some(decision));
        }
    }
    assert_eq!(ends[0], Some(1));
    // it may fall forward by a meter and lie there for five seconds
    assert!(ends[1..].iter().all(|end| end.is_some_and(|at| (251..=300).contains(&at))), "{ends:?}");
}

/// Marathon Man starts in the poses of its clips, but at the beginning of the course and facing along it. The command
/// is to run ahead.
#[test]
fn marathon_man_starts_along_his_course() {
    let id = "TerrainMarathonMan-v0";
    let model = agent(id).unwrap().model().unwrap();
    let mut env = env(id, &[], Autoreset::Disabled);
    let mut out = env.buffers();
    env.reset(Some(5), &mut out.obs).unwrap();
    let (n, mut fastest) = (env.spec().obs, 0.0f64);
    for i in 0..AGENTS {
        let state = env.state(i).unwrap();
        assert_eq!(state.qpos[..2], [0.0; 2]);
        // the root faces along the course, the butt only roughly; the commanded direction is along it
        let [x, y, _] = axis(&model, &state, "butt");
        let angle = y.atan2(x);
        assert!(angle.abs() < 0.3, "agent {i} faces {x} {y}");
        let off: Vec<f64> = out.obs[n * i + 2..n * i + 4].iter().map(|x| f64::from(*x)).collect();
        assert!(
            (off[0] + angle.sin()).abs() < 1e-4 && (off[1] - angle.cos()).abs() < 1e-4,
            "agent {i}: {off:?} {angle}"
        );
        let [vx, vy] = [state.qvel[0], state.qvel[1]];
        // starts from walking or running continue forward, with some sway
        assert!(vx > -0.3 && vy.abs() < 0.6 + 0.1 * vx.abs(), "agent {i}: {vx} {vy}");
        fastest = fastest.max(vx);
        let told = f64::from(out.obs[n * i]);
        assert!((1.0..=3.0).contains(&told) && out.obs[n * i + 1] == 0.0, "agent {i}: commanded {told} m/s");
    }
    assert!(fastest > 1.5, "some agents run: {fastest}");
}
