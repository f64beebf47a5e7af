//! Each agent can have its own masses, friction, strength and gravity. They apply to that agent only and last across
//! resets until changed. Invalid values are rejected.

use marathon_envs::{VecEnv, VecEnvOptions};

const N: usize = 20;

fn hoppers() -> (VecEnv, Vec<f32>) {
    let mut env = VecEnv::new("Hopper-v0", &VecEnvOptions { agents: N, ..Default::default() }).unwrap();
    let mut obs = env.buffers().obs;
    env.reset(Some(3), &mut obs).unwrap();
    (env, obs)
}

/// Observations of every agent after a few decisions.
fn live(env: &mut VecEnv) -> Vec<Vec<f32>> {
    let mut out = env.buffers();
    let actions = vec![0.5; N * env.spec().act];
    for _ in 0..5 {
        env.step(&actions, &mut out).unwrap();
    }
    out.obs.chunks(env.spec().obs).map(<[f32]>::to_vec).collect()
}

#[test]
fn a_variation_is_one_agents_own() {
    let plain = live(&mut hoppers().0);
    let (mut env, _) = hoppers();
    let model = env.unvaried().clone();
    let mut moon = model.clone();
    moon.gravity[2] = -1.62;
    let mut weak = model.clone();
    weak.strength.fill(0.1);
    let mut heavy = model.clone();
    heavy.mass.fill(3.0);
    for (agent, variation) in [(2, &moon), (17, &weak), (19, &heavy)] {
        env.vary(agent, variation).unwrap();
    }
    let varied = live(&mut env);
    for agent in 0..N {
        assert_eq!(varied[agent] == plain[agent], ![2, 17, 19].contains(&agent), "agent {agent}");
    }

    // across a reset, until withdrawn
    let mut obs = env.buffers().obs;
    env.reset(Some(3), &mut obs).unwrap();
    assert_eq!(live(&mut env), varied);
    for agent in [2, 17, 19] {
        env.vary(agent, &model).unwrap();
    }
    env.reset(Some(3), &mut obs).unwrap();
    assert_eq!(live(&mut env), plain);
}

#[test]
fn nonsense_is_refused() {
    let (mut env, _) = hoppers();
    let model = env.unvaried().clone();
    let mut says = |agent: usize, change: &dyn Fn(&mut marathon_physics::Variation), expected: &str| {
        let mut variation = model.clone();
        change(&mut variation);
        let text = env.vary(agent, &variation).unwrap_err().to_string();
        assert!(text.contains(expected), "{text}");
    };
    says(N, &|_| {}, "agent is 20");
    says(0, &|v| v.mass[1] = 0.0, "mass is 0, expected a factor from 1e-30 to 1e30");
    says(0, &|v| v.friction = f64::NAN, "friction is NaN");
    says(0, &|v| v.strength[0] = f64::INFINITY, "strength is inf");
    says(0, &|v| v.gravity[0] = f64::NAN, "gravity is NaN");
    says(0, &|v| v.mass.truncate(1), "mass [bodies] has 1 numbers");
}

#[test]
fn a_push_is_of_a_body_that_there_is() {
    let (mut env, _) = hoppers();
    let bodies = env.unvaried().mass.len();
    let text = |e: Result<(), marathon_envs::EnvError>| e.unwrap_err().to_string();
    assert!(text(env.push(0, bodies, [1.0; 3], [0.0; 3])).contains(&format!("body is {bodies}, expected less")));
    assert!(text(env.push(N, 1, [1.0; 3], [0.0; 3])).contains("agent is 20"));
    assert!(text(env.push(0, 1, [f64::NAN; 3], [0.0; 3])).contains("push is NaN"));
    let plain = live(&mut hoppers().0);
    env.push(5, 1, [200.0, 0.0, 0.0], [0.0; 3]).unwrap();
    let pushed = live(&mut env);
    for agent in 0..N {
        assert_eq!(pushed[agent] == plain[agent], agent != 5, "agent {agent}");
    }
}
