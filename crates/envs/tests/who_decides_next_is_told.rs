//! In a task with several roles, `VecEnv::decides` returns for each agent which roles act next. The builder of an
//! assault course acts at the start of an episode and whenever the runner has made a new meter. The test computes this
//! from the distances, for different numbers of threads and autoreset modes.

use marathon_envs::{Autoreset, EnvError, Options, VecEnv, VecEnvOptions};

const AGENTS: usize = 21;
const STEPS: usize = 260;
const RUNNER: usize = 0;
const BUILDER: usize = 1;
/// Body of the torso.
const TORSO: usize = 1;
const PUSH: [f64; 3] = [350.0, 0.0, 100.0];

fn walkers(autoreset: Autoreset) -> VecEnv {
    let options = Options::new().with("course", "adversary").with("falls", "hurt");
    let limit = Some(90);
    let options = VecEnvOptions {
        agents: AGENTS,
        threads: 2,
        autoreset,
        max_episode_steps: limit,
        options,
        ..Default::default()
    };
    VecEnv::new("TerrainWalker2d-v0", &options).unwrap()
}

fn decides(env: &VecEnv, role: usize) -> Vec<bool> {
    let mut out = vec![false; env.agents()];
    env.decides(role, &mut out).unwrap();
    out
}

/// The farthest x of each runner, m: the first number of `info`.
fn farthest(info: &[f32]) -> Vec<f32> {
    info.chunks_exact(2).map(|row| row[0]).collect()
}

/// Present positions of the runners. After a step, `info` belongs to the states at its end, not to episodes that have
/// begun since.
fn at_start(env: &VecEnv) -> Vec<f32> {
    let mut info = vec![0.0; 2 * AGENTS];
    env.info(&mut info).unwrap();
    farthest(&info)
}

#[test]
fn the_builder_decides_at_starts_and_new_meters() {
    for autoreset in [Autoreset::SameStep, Autoreset::NextStep, Autoreset::Disabled] {
        let mut env = walkers(autoreset);
        let mut out = env.buffers();
        env.reset(Some(3), &mut out.obs).unwrap();
        assert_eq!(decides(&env, BUILDER), [true; AGENTS]);
        let (mut from, mut meters, mut over) = (at_start(&env), [0.0; AGENTS], vec![false; AGENTS]);
        let (mut at_meters, mut nothing, mut starts) = (0, 0, 0);
        for step in 0..STEPS {
            // some agents stand still
            for agent in (0..AGENTS).filter(|agent| agent % 3 != 0) {
                env.push(agent, TORSO, PUSH, [0.0; 3]).unwrap();
            }
            env.step(&[0.0; 7 * AGENTS], &mut out).unwrap();
            let ended: Vec<bool> = out.terminated.iter().zip(&out.truncated).map(|(a, b)| *a || *b).collect();
            if autoreset == Autoreset::Disabled {
                env.reset_agents(&ended, &mut out.obs).unwrap();
            }
            let (told, reached, now) = (decides(&env, BUILDER), farthest(&out.info), at_start(&env));
            assert_eq!(decides(&env, RUNNER), [true; AGENTS]);
            for agent in 0..AGENTS {
                let begun = match autoreset {
                    // the step in which it begins ignores its action
                    Autoreset::NextStep => over[agent],
                    _ => ended[agent],
                };
                let new = (reached[agent] - from[agent]).floor();
                let expected = begun || ended[agent] || new > meters[agent];
                assert_eq!(told[agent], expected, "{autoreset:?}, decision {step}, agent {agent}");
                (at_meters, nothing, starts) = match (begun, expected) {
                    (false, true) if !ended[agent] => (at_meters + 1, nothing, starts),
                    (false, _) => (at_meters, nothing + 1, starts),
                    (true, _) => (at_meters, nothing, starts + 1),
                };
                meters[agent] = new;
                if begun {
                    (from[agent], meters[agent]) = (now[agent], 0.0);
                }
            }
            over = ended;
        }
        assert!(at_meters > 50 && nothing > 1000 && starts >= 2 * AGENTS, "{at_meters} {nothing} {starts}");
    }
}

#[test]
fn all_roles_act_at_starts_and_after_a_load() {
    let mut env = walkers(Autoreset::SameStep);
    let mut out = env.buffers();
    env.reset(Some(3), &mut out.obs).unwrap();
    let saved = env.save();
    let step = |env: &mut VecEnv, out: &mut marathon_envs::Step| {
        env.step(&[0.0; 7 * AGENTS], &mut *out).unwrap();
        assert_eq!(decides(env, BUILDER), [false; AGENTS]);
    };
    step(&mut env, &mut out);
    let state = env.state(17).unwrap();
    env.set_state(17, &state).unwrap();
    let mut only = [false; AGENTS];
    only[17] = true;
    assert_eq!(decides(&env, BUILDER), only);
    step(&mut env, &mut out);
    env.observe(&only, &mut out.obs).unwrap();
    assert_eq!(decides(&env, BUILDER), only);
    step(&mut env, &mut out);
    env.reset_agents(&only, &mut out.obs).unwrap();
    assert_eq!(decides(&env, BUILDER), only);
    // a rejected snapshot changes nothing
    env.load(&saved[..saved.len() - 1]).unwrap_err();
    assert_eq!(decides(&env, BUILDER), only);
    env.load(&saved).unwrap();
    assert_eq!(decides(&env, BUILDER), [true; AGENTS]);
    step(&mut env, &mut out);
}

#[test]
fn a_single_role_always_acts_and_unknown_roles_are_refused() {
    let mut env = VecEnv::new("Hopper-v0", &VecEnvOptions { agents: 3, ..Default::default() }).unwrap();
    let mut out = env.buffers();
    env.reset(Some(1), &mut out.obs).unwrap();
    env.step(&[0.0; 12], &mut out).unwrap();
    assert_eq!(decides(&env, 0), [true; 3]);
    assert!(matches!(env.decides(1, &mut [false; 3]), Err(EnvError::Option { option: "role", .. })));
    assert!(matches!(env.decides(0, &mut [false; 2]), Err(EnvError::Shape { found: 2, expected: 3, .. })));
}
