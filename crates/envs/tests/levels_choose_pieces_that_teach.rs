//! Levels with a bank of pieces. Courses depend on the agent's own runs only: not on threads, nor on an interruption. Names
//! of levels reach all kinds of ground.

use crate::common;
use marathon_envs::{Autoreset, VecEnv, VecEnvOptions, agent};

const AGENTS: usize = 20;
/// Slot of `info`.
const DIFFICULTY: usize = 1;

fn env(id: &str, options: &[(&str, &str)], threads: usize) -> VecEnv {
    let options = common::options(options);
    let options = VecEnvOptions {
        agents: AGENTS,
        seed: 3,
        options,
        threads,
        autoreset: Autoreset::SameStep,
        ..Default::default()
    };
    VecEnv::new(id, &options).unwrap_or_else(|e| panic!("{e}"))
}

/// Pushes the agents ahead, each to another place, and there down. Returns the numbers of all decisions.
fn run(env: &mut VecEnv, body: usize, decisions: std::ops::Range<usize>) -> Vec<f32> {
    let (mut out, mut seen) = (env.buffers(), Vec::new());
    let model = agent(&env.spec().id.clone()).unwrap().model().unwrap();
    let mass = model.bodies.iter().map(|b| b.mass).sum::<f64>();
    let actions = vec![0.0; AGENTS * env.spec().act];
    for decision in decisions {
        for i in 0..AGENTS {
            let far = 6.0 + ((7 * i + decision / 100) % 20) as f64;
            let x = env.state(i).unwrap().qpos[0];
            let ahead = [20.0 * mass, 0.0, 9.81 * mass];
            env.push(i, body, if x < far { ahead } else { [0.0, 0.0, -200.0 * mass] }, [0.0; 3]).unwrap();
        }
        env.step(&actions, &mut out).unwrap();
        seen.extend(out.obs.iter().chain(&out.reward).chain(&out.info));
    }
    seen
}

fn grounds(env: &mut VecEnv) -> Vec<Vec<f32>> {
    (0..AGENTS).map(|i| env.ground(i, 0).unwrap()).collect()
}

#[test]
fn courses_depend_neither_on_threads_nor_on_interruptions() {
    for (id, decisions) in [("TerrainHopper-v0", 400), ("TerrainAnt-v0", 300)] {
        for levels in ["sfl", "plr", "accel"] {
            let options = [("levels", levels), ("difficulty", "1")];
            let mut first = env(id, &options, 1);
            let mut out = first.buffers();
            first.reset(Some(4), &mut out.obs).unwrap();
            let start = grounds(&mut first);
            run(&mut first, 1, 0..decisions);
            let saved = first.save();
            let expected = run(&mut first, 1, decisions..2 * decisions);
            let last = grounds(&mut first);
            assert!((0..AGENTS).all(|i| last[i] != start[i]), "{id}, {levels}: all agents have fallen");

            // resumed elsewhere
            let mut second = env(id, &options, 2);
            second.load(&saved).unwrap();
            assert!(run(&mut second, 1, decisions..2 * decisions) == expected, "{id}, {levels}");
            assert!(grounds(&mut second) == last, "{id}, {levels}");

            // never interrupted, on two threads
            let mut third = env(id, &options, 2);
            third.reset(Some(4), &mut out.obs).unwrap();
            run(&mut third, 1, 0..decisions);
            assert!(run(&mut third, 1, decisions..2 * decisions) == expected, "{id}, {levels}");
        }
    }
}

/// ACCEL starts with small pieces. The others draw fresh pieces of all sizes.
#[test]
fn edited_levels_begin_easy() {
    let difficulty = |levels: &str, course: &str| {
        let mut env = env("TerrainWalker2d-v0", &[("levels", levels), ("course", course), ("difficulty", "0.8")], 1);
        let mut out = env.buffers();
        env.reset(Some(1), &mut out.obs).unwrap();
        let n = env.spec().info.len();
        let mut info = vec![0.0; AGENTS * n];
        env.info(&mut info).unwrap();
        info.chunks_exact(n).map(|row| row[DIFFICULTY]).sum::<f32>() / AGENTS as f32
    };
    for course in ["mixed", "gaps", "stairs"] {
        let [accel, sfl, plr] = ["accel", "sfl", "plr"].map(|levels| difficulty(levels, course));
        assert!(accel > 0.01 && accel < 0.12, "{course}: {accel}");
        assert!(sfl > 0.13 && plr > 0.13 && sfl < 0.4 && plr < 0.4, "{course}: {sfl} {plr}");
    }
}

/// Courses without random pieces stay as they are.
#[test]
fn courses_without_pieces_are_as_with_fixed_levels() {
    for course in ["flat", "bumps", "blocks", "meters"] {
        let of = |levels: &str| {
            let mut env = env("TerrainWalker2d-v0", &[("levels", levels), ("course", course), ("difficulty", "1")], 1);
            let mut out = env.buffers();
            env.reset(Some(1), &mut out.obs).unwrap();
            grounds(&mut env)
        };
        assert!(of("sfl") == of("fixed") && of("accel") == of("fixed"), "{course}");
    }
}

#[test]
fn levels_reach_all_kinds_of_ground() {
    for (levels, builder) in [("adversary", "inverse"), ("regret", "regret")] {
        let short = env("TerrainWalker2d-v0", &[("levels", levels)], 1).spec().clone();
        let long = [("course", "adversary"), ("builder", builder), ("levels", "fixed")];
        let long = env("TerrainWalker2d-v0", &long, 1).spec().clone();
        assert_eq!((short.roles.len(), short.reward_terms), (long.roles.len(), long.reward_terms), "{levels}");
    }
    let options = VecEnvOptions { options: common::options(&[("levels", "curriculum")]), ..Default::default() };
    let error = VecEnv::new("TerrainWalker2d-v0", &options).err().map(|e| e.to_string()).unwrap_or_default();
    assert!(error.contains("curriculum") && error.contains("distance"), "{error}");
}
