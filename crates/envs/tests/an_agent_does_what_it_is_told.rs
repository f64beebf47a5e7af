//! Commands come from the agent's schedule or from a caller. The agent observes its command, and the reward uses the
//! observed command. Commands do not depend on lanes, threads, slots or widths, and a snapshot continues them exactly.
//! Memory and ground that a start draws reach the agent.

use std::sync::Arc;

use crate::common::{action, isas};
use marathon_envs::{
    Agent, BLOCK, BlockStep, CommandRange, Ctrl, EpisodeRng, Facts, Obs, Registry, Senses, Start, Step, Terms, VecEnv,
    VecEnvOptions, names,
};
use marathon_physics::lanes::{Isa, Real};

/// A ball on a rail above hills.
const MODEL: &str = r#"
<mujoco model="cart">
  <option timestep="0.01"/>
  <asset>
    <hfield name="hills" nrow="3" ncol="5" size="4 2 1 0.1"/>
  </asset>
  <worldbody>
    <geom name="ground" type="hfield" hfield="hills" contype="0" conaffinity="1"/>
    <body name="cart" pos="0 0 0.3">
      <joint name="rail" type="slide" axis="1 0 0" damping="1"/>
      <joint name="lift" type="slide" axis="0 0 1"/>
      <geom name="cart" size="0.1" contype="1" conaffinity="0"/>
    </body>
  </worldbody>
  <actuator>
    <motor name="rail" joint="rail" gear="20"/>
  </actuator>
</mujoco>"#;

/// Its observation: position, velocity, the two numbers of its command, its memory.
const OBS: usize = 7;
const VELOCITY: usize = 2;
const BRAKE: usize = 3;
const DELAYED: usize = 4;
const DRAWN: usize = 5;
const FORETOLD: usize = 6;

#[derive(Clone, Copy, Default)]
struct Cart {
    /// Whether starts need physics, on hills that they draw.
    hilly: bool,
}

impl Agent for Cart {
    fn facts(&self) -> Facts {
        Facts {
            id: if self.hilly { "HillyCart-v0" } else { "Cart-v0" }.into(),
            model: MODEL.into(),
            frame_skip: 2,
            max_episode_steps: 40,
            reward_terms: names(["error"]),
            info: names(["told", "height"]),
            command: vec![CommandRange::new("velocity", -2.0..=2.0, "m/s"), CommandRange::new("brake", 0.0..=1.0, "")],
            memory: 3,
            termination_reward: None,
            ..Facts::default()
        }
    }

    fn reset(&self, start: &mut Start) {
        start.qpos[0] = start.random.uniform(-1.0, 1.0);
        start.memory[1] = start.random.uniform(1.0, 2.0);
        start.memory[2] = start.scheduled[0];
        if self.hilly {
            let height = start.random.uniform(0.1, 0.2) as f32;
            start.set_ground(0, vec![height; 15]);
            start.settle = 100;
        }
    }

    fn command(&self, random: &mut EpisodeRng, _step: usize, out: &mut [f64]) -> usize {
        out[0] = random.uniform(-2.0, 2.0);
        out[1] = random.whole(0, 1) as f64;
        random.whole(3, 9)
    }

    #[inline(always)]
    fn ctrl<T: Real>(&self, c: &mut Ctrl<T>) {
        // half acts at once, half with the next decision
        c.ctrl[0] = (c.action[0] + c.memory[0]) * T::lit(0.5);
        c.memory[0] = c.action[0];
    }

    #[inline(always)]
    fn observe<T: Real>(&self, s: &Senses<T>, out: &mut Obs<T>) {
        out.scalar(s.readings().qpos(0));
        out.scalar(s.readings().qvel(0));
        out.scalar(s.command(0));
        out.scalar(s.command(1));
        out.scalar(s.memory(0));
        out.scalar(s.memory(1));
        out.scalar(s.memory(2));
    }

    #[inline(always)]
    fn step_reward<T: Real>(&self, s: &Senses<T>, terms: &mut Terms<T>) {
        terms.add("error", -1.0, (s.readings().qvel(0) - s.command(0)).abs());
    }

    #[inline(always)]
    fn info<T: Real>(&self, s: &Senses<T>, out: &mut Obs<T>) {
        out.scalar(s.command(0));
        out.scalar(s.readings().qpos(1));
    }

    #[inline(always)]
    fn terminated<T: Real>(&self, s: &Senses<T>) -> T::Mask {
        s.terminate_never()
    }
}

fn registry() -> Registry {
    let mut registry = Registry::empty();
    for hilly in [false, true] {
        registry.register(Arc::new(Cart { hilly })).unwrap_or_else(|e| panic!("{e}"));
    }
    registry
}

fn carts(id: &str, agents: usize, threads: usize, isa: Option<Isa>) -> VecEnv {
    let options = VecEnvOptions { agents, seed: 11, threads, isa, ..Default::default() };
    VecEnv::from_registry(&registry(), id, &options).unwrap_or_else(|e| panic!("{e}"))
}

/// Executes decisions `from .. to`, and calls `before` before each.
fn go_on(
    env: &mut VecEnv,
    out: &mut Step,
    from: usize,
    to: usize,
    mut before: impl FnMut(usize, &mut VecEnv),
) -> Vec<Step> {
    let mut actions = vec![0.0; env.agents()];
    (from..to)
        .map(|decision| {
            before(decision, env);
            for (agent, row) in actions.chunks_exact_mut(1).enumerate() {
                action(agent, decision, 1.0, row);
            }
            env.step(&actions, &mut *out).expect("the arrays fit");
            out.clone()
        })
        .collect()
}

/// Resets and executes decisions. The first entry holds the first observations.
fn play(env: &mut VecEnv, decisions: usize, before: impl FnMut(usize, &mut VecEnv)) -> Vec<Step> {
    let mut out = env.buffers();
    env.reset(Some(5), &mut out.obs).expect("the array fits");
    let first = out.clone();
    let mut seen = vec![first];
    seen.extend(go_on(env, &mut out, 0, decisions, before));
    seen
}

/// A caller that sets commands of some agents for a while.
fn meddle(decision: usize, env: &mut VecEnv) {
    let n = env.agents();
    for agent in [0, 5, 17, 38].into_iter().filter(|agent| *agent < n) {
        match decision % 23 {
            4 => env.set_command(agent, Some(&[1.5, 0.25])),
            9 => env.set_command(agent, Some(&[-0.5 * agent as f64 / 38.0, 1.0])),
            16 => env.set_command(agent, None),
            _ => Ok(()),
        }
        .unwrap_or_else(|e| panic!("{e}"));
    }
}

fn seen(step: &Step, agent: usize, what: usize) -> f32 {
    step.obs[agent * OBS + what]
}

#[test]
fn the_schedule_draws_a_command_and_holds_it() {
    const N: usize = 24;
    let story = play(&mut carts("Cart-v0", N, 1, None), 39, |_, _| {});
    let mut firsts = Vec::new();
    for agent in 0..N {
        let commands: Vec<[f32; 2]> =
            story.iter().take(39).map(|s| [seen(s, agent, VELOCITY), seen(s, agent, BRAKE)]).collect();
        assert!(commands.iter().all(|[v, b]| v.abs() <= 2.0 && (*b == 0.0 || *b == 1.0)), "{commands:?}");
        let runs: Vec<usize> = commands.chunk_by(|a, b| a[0] == b[0]).map(<[_]>::len).collect();
        // the last command continues
        assert!(runs.len() > 3 && runs[..runs.len() - 1].iter().all(|n| (3..=9).contains(n)), "{runs:?}");
        firsts.push(commands[0][0]);
    }
    assert!((1..N).all(|i| !firsts[..i].contains(&firsts[i])), "each agent draws its own commands: {firsts:?}");
}

#[test]
fn a_start_knows_what_the_schedule_begins_with() {
    const N: usize = 24;
    for id in ["Cart-v0", "HillyCart-v0"] {
        let mut env = carts(id, N, 1, None);
        env.set_command(3, Some(&[-0.5, 0.0])).expect("within the range");
        let story = play(&mut env, 60, |_, _| {});
        for agent in (0..N).filter(|agent| *agent != 3) {
            assert_eq!(seen(&story[0], agent, FORETOLD), seen(&story[0], agent, VELOCITY), "{id}, agent {agent}");
            // the second episode begins after 40 decisions
            assert_eq!(seen(&story[40], agent, FORETOLD), seen(&story[40], agent, VELOCITY), "{id}, agent {agent}");
            assert_ne!(seen(&story[0], agent, FORETOLD), seen(&story[40], agent, FORETOLD));
        }
        // a start depends on seed, agent and episode, not on a caller's commands
        let alone = play(&mut carts(id, N, 1, None), 1, |_, _| {});
        assert_eq!(seen(&story[0], 3, FORETOLD), seen(&alone[0], 3, FORETOLD));
        assert_eq!(seen(&story[0], 3, VELOCITY), -0.5);
    }
}

#[test]
fn the_reward_is_for_the_command_that_was_observed() {
    const N: usize = 20;
    let mut env = carts("Cart-v0", N, 1, None);
    let story = play(&mut env, 90, meddle);
    for pair in story.windows(2) {
        for agent in 0..N {
            // the decision used the command of the observation before it
            let told = seen(&pair[0], agent, VELOCITY);
            assert_eq!(pair[1].info[agent * 2], told, "agent {agent}");
            let velocity = pair[1].final_obs[agent * OBS + 1];
            assert_eq!(pair[1].reward[agent], -(velocity - told).abs(), "agent {agent}");
        }
    }
    let commands = env.context(3).expect("it is there").command();
    assert_eq!(commands[0] as f32, seen(&story[90], 3, VELOCITY));
}

#[test]
fn a_caller_goes_before_the_schedule_until_it_gives_the_command_back() {
    const N: usize = 20;
    let alone = play(&mut carts("Cart-v0", N, 1, None), 38, |_, _| {});
    let told = play(&mut carts("Cart-v0", N, 1, None), 38, |decision, env| match decision {
        10 => env.set_command(7, Some(&[1.25, 0.5])).expect("within the range"),
        20 => env.set_command(7, None).expect("always"),
        _ => {}
    });
    for (k, (a, b)) in alone.iter().zip(&told).enumerate() {
        for agent in 0..N {
            let [a, b] = [a, b].map(|s| [seen(s, agent, VELOCITY), seen(s, agent, BRAKE)]);
            // set before decision 10, so observed after it; the schedule continues in the background
            if agent == 7 && (11..=20).contains(&k) {
                assert_eq!(b, [1.25, 0.5], "observation {k}");
            } else {
                assert_eq!(a, b, "agent {agent}, observation {k}");
            }
        }
    }

    // across the end of an episode, and from the start of one
    let mut env = carts("Cart-v0", 3, 1, None);
    env.set_command(1, Some(&[-1.0, 0.0])).expect("within the range");
    let story = play(&mut env, 60, |_, _| {});
    assert!(story.iter().all(|s| seen(s, 1, VELOCITY) == -1.0 && seen(s, 2, VELOCITY) != -1.0));
}

#[test]
fn what_cannot_be_told_is_refused_and_changes_nothing() {
    let mut env = carts("Cart-v0", 3, 1, None);
    let mut obs = env.buffers().obs;
    env.reset(Some(1), &mut obs).expect("the array fits");
    let before = env.save();
    for (agent, command, complaint) in [
        (0, &[2.5, 0.0][..], "agent 'Cart-v0': command velocity is 2.5, expected -2 to 2 m/s"),
        (0, &[0.0, f64::NAN], "agent 'Cart-v0': command brake is NaN, expected 0 to 1"),
        (0, &[0.0], "command has 1 numbers, expected 2"),
        (3, &[0.0, 0.0], "agent is 3"),
    ] {
        let error = env.set_command(agent, Some(command)).expect_err("it makes no sense").to_string();
        assert!(error.contains(complaint), "{error}");
        assert!(env.save() == before);
    }
    let mut hopper = VecEnv::new("hopper", &VecEnvOptions::default()).expect("it is there");
    let error = hopper.set_command(0, Some(&[1.0])).expect_err("it takes none").to_string();
    assert!(error.contains("command has 1 numbers, expected 0"), "{error}");
}

#[test]
fn no_lane_thread_slot_or_width_shows() {
    for id in ["Cart-v0", "HillyCart-v0"] {
        let lives = |n: usize, threads, isa| {
            let mut env = carts(id, n, threads, Some(isa));
            play(&mut env, 90, meddle)
        };
        let reference = lives(40, 1, Isa::F32);
        for isa in isas().filter(|isa| *isa != Isa::F64) {
            for (n, threads) in [(1, 1), (7, 1), (40, 1), (40, 3)] {
                for (a, b) in lives(n, threads, isa).iter().zip(&reference) {
                    assert_eq!(a.obs, b.obs[..n * OBS], "{id}: {n} on {threads} threads with {}", isa.name());
                    assert_eq!(a.reward, b.reward[..n]);
                }
            }
        }
    }
}

#[test]
fn a_snapshot_continues_what_agents_are_told() {
    const N: usize = 40;
    // during an episode with a caller's commands, and after the caller has returned them to the schedule
    for at in [13, 19, 61] {
        let mut env = carts("Cart-v0", N, 1, None);
        let mut out = play(&mut env, at, meddle).pop().expect("decisions");
        // set, but not observed yet
        env.set_command(9, Some(&[0.125, 0.0])).expect("within the range");
        let snapshot = env.save();
        let uninterrupted = go_on(&mut env, &mut out, at, at + 60, meddle);
        assert_eq!(seen(&uninterrupted[0], 9, VELOCITY), 0.125);

        let mut others = vec![env, carts("Cart-v0", N, 3, None)];
        others.extend(isas().filter(|isa| *isa != Isa::F64).map(|isa| carts("Cart-v0", N, 2, Some(isa))));
        for mut other in others {
            // in another state, with other commands
            let mut out = play(&mut other, 8, meddle).pop().expect("decisions");
            for agent in 0..N {
                other.set_command(agent, Some(&[2.0, 1.0])).expect("within the range");
            }
            other.load(&snapshot).unwrap_or_else(|e| panic!("{e}"));
            assert!(other.save() == snapshot, "saving what was loaded");
            let again = go_on(&mut other, &mut out, at, at + 60, meddle);
            assert!(again == uninterrupted, "the restored environment went another way");
        }
    }
}

/// Sixteen agents move to another slot of another shard.
#[test]
fn a_block_moves_with_its_commands() {
    let shards = registry().shards("Cart-v0", Isa::best()).unwrap_or_else(|e| panic!("{e}"));
    let (mut a, mut b) = (shards.agent_shard(0, 2, 1), shards.agent_shard(7, 3, 99));
    let mut obs = vec![0.0; OBS * BLOCK];
    a.reset(1, !0, &mut obs);
    a.context(20).set_command(Some(&[0.75, 1.0])).expect("within the range");
    let (mut here, mut there) = (BlockStep::default(), BlockStep::default());
    let mut obs_there = obs.clone();
    for decision in 0..30 {
        if decision == 10 {
            let mut bytes = Vec::new();
            a.save(1, &mut bytes);
            assert!(b.load(2, &bytes).unwrap_or_else(|e| panic!("{e}")).is_empty());
        }
        a.step(1, &[0.25; BLOCK], &mut obs, &mut here);
        b.step(2, &[0.25; BLOCK], &mut obs_there, &mut there);
        assert_eq!(obs[VELOCITY * BLOCK + 4], 0.75);
        if decision >= 10 {
            assert_eq!(obs, obs_there);
            assert_eq!(here.reward, there.reward);
        }
    }
}

/// Actions become controls by the agent's own function. Here half of each acts one decision later.
#[test]
fn an_action_becomes_controls_by_the_agents_own_rule() {
    let mut env = carts("Cart-v0", 2, 1, Some(Isa::F64));
    let mut out = env.buffers();
    env.reset(Some(1), &mut out.obs).expect("the array fits");
    let mass =
        env.context(0).map(|_| 4.0 / 3.0 * std::f64::consts::PI * 0.1_f64.powi(3) * 1000.0).expect("it is there");
    let mut velocity = 0.0;
    for (action, ctrl) in [(1.0, 0.5), (0.0, 0.5), (-1.0, -0.5), (-1.0, -1.0)] {
        env.step(&[action, 0.0], &mut out).expect("the arrays fit");
        for _ in 0..2 {
            // the damping is implicit: it acts on the velocity at the end of the step
            velocity = (mass * velocity + 0.01 * 20.0 * ctrl) / (mass + 0.01);
        }
        assert!((f64::from(seen(&out, 0, 1)) - velocity).abs() < 1e-6, "{} {velocity}", seen(&out, 0, 1));
        assert_eq!((seen(&out, 0, DELAYED), seen(&out, 1, 1)), (action, 0.0));
    }
}

#[test]
fn what_a_start_draws_reaches_the_agent() {
    for id in ["Cart-v0", "HillyCart-v0"] {
        let mut env = carts(id, 20, 1, None);
        let story = play(&mut env, 45, |_, _| {});
        let drawn: Vec<f32> = (0..20).map(|agent| seen(&story[0], agent, DRAWN)).collect();
        assert!(drawn.iter().all(|x| (1.0..2.0).contains(x)), "{drawn:?}");
        assert!((1..20).all(|i| !drawn[..i].contains(&drawn[i])), "{drawn:?}");
        for agent in 0..20 {
            // kept until the end of the episode, and drawn again for the next one
            assert!(story[1..40].iter().all(|s| seen(s, agent, DRAWN) == drawn[agent]));
            assert!(story[40..].iter().all(|s| seen(s, agent, DRAWN) == seen(&story[40], agent, DRAWN)));
            assert_ne!(seen(&story[40], agent, DRAWN), drawn[agent]);
        }
    }

    // settled carts lie on the hills that they drew, 10 to 20 cm high, and stay there
    let mut env = carts("HillyCart-v0", 20, 1, None);
    let story = play(&mut env, 39, |_, _| {});
    let height = |step: &Step, agent: usize| 0.3 + step.info[agent * 2 + 1] - 0.1;
    let first: Vec<f32> = (0..20).map(|agent| height(&story[1], agent)).collect();
    assert!(first.iter().all(|z| (0.095..0.2).contains(z)), "{first:?}");
    assert!(first.iter().any(|z| *z < 0.13) && first.iter().any(|z| *z > 0.17), "{first:?}");
    assert!((0..20).all(|agent| (height(&story[39], agent) - first[agent]).abs() < 0.01));
}
