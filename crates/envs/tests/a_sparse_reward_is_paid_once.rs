//! `MarathonManSparse-v0` earns nothing until its episode ends by a fall, by the time limit (also a caller's) or by the
//! clip's end. The last decision pays the distance from the start to the last foot contact, 1 for 20 m. The test
//! computes the distance from the states and the observed contacts.

use crate::common::action;
use marathon_envs::{Autoreset, Options, VecEnv, VecEnvOptions};
use marathon_motion::kinematics::Pose;
use marathon_physics::lanes::Isa;

/// Indices of the contacts of the right and of the left foot in the observation.
const TOUCHES: [std::ops::Range<usize>; 2] = [59..62, 62..65];

/// Number of episodes ended by falls, and by time.
fn ends(scale: f32, limit: Option<usize>, clip: Option<&str>, isa: Isa) -> [usize; 2] {
    const AGENTS: usize = 20;
    let (id, given) = match clip {
        Some(clip) => {
            ("MarathonMan-v0", Options::new().with("clip", clip).with("reward", "sparse").with("start", "first"))
        }
        None => ("MarathonManSparse-v0", Options::new()),
    };
    let options = VecEnvOptions {
        agents: AGENTS,
        seed: 7,
        isa: Some(isa),
        autoreset: Autoreset::Disabled,
        max_episode_steps: limit,
        options: given,
        ..VecEnvOptions::default()
    };
    let model = marathon_envs::agent(id).unwrap().model().unwrap();
    let center = |env: &VecEnv, agent: usize, name: &str| {
        let pose = Pose::of(&model, &env.state(agent).unwrap().qpos);
        let geom = model.geoms.iter().find(|geom| geom.name == name).expect("a part is a geom");
        pose.point(geom.body, geom.pos.into()).x
    };
    let mut env = VecEnv::new(id, &options).unwrap();
    assert_eq!(env.spec().reward_terms, ["distance"]);
    let (obs, mut out) = (env.spec().obs, env.buffers());
    env.reset(None, &mut out.obs).unwrap();
    let from: Vec<f64> = (0..AGENTS).map(|agent| center(&env, agent, "butt")).collect();
    let (mut last, mut over, mut count) = (from.clone(), [false; AGENTS], [0; 2]);
    for t in 0..900 {
        let mut actions = vec![0.0; AGENTS * 21];
        actions.chunks_mut(21).enumerate().for_each(|(agent, row)| action(agent, t, scale, row));
        env.step(&actions, &mut out).unwrap();
        for agent in (0..AGENTS).filter(|agent| !over[*agent]).collect::<Vec<_>>() {
            let seen = &out.final_obs[agent * obs..][..obs];
            let feet = ["right_right_foot", "left_left_foot"].into_iter().zip(TOUCHES);
            let down = feet.filter(|(_, touches)| seen[touches.clone()].iter().any(|touch| *touch > 0.0));
            last[agent] = down.map(|(foot, _)| center(&env, agent, foot)).max_by(f64::total_cmp).unwrap_or(last[agent]);
            over[agent] = out.terminated[agent] || out.truncated[agent];
            let paid = f64::from(out.reward[agent]);
            if !over[agent] {
                assert_eq!(paid, 0.0, "decision {t}");
                continue;
            }
            let way = (last[agent] - from[agent]) / 20.0;
            assert!((paid - way).abs() < 1e-5, "decision {t}: paid {paid}, expected {way}");
            count[usize::from(out.truncated[agent])] += 1;
        }
    }
    assert!(over.iter().all(|over| *over));
    count
}

#[test]
fn it_is_the_way_of_the_feet_whatever_ends_the_episode() {
    for isa in [Isa::F64, Isa::best()] {
        let [falls, timeouts] = ends(1.0, None, None, isa);
        assert!(falls > 10, "{falls} falls, {timeouts} episodes to the end");
        let [falls, timeouts] = ends(0.0, Some(12), None, isa);
        assert!(timeouts > 10, "{falls} falls, {timeouts} episodes to the end");
        let [falls, timeouts] = ends(0.0, None, Some("punch"), isa);
        assert!(falls + timeouts == 20, "{falls} falls, {timeouts} episodes to the end");
    }
}
