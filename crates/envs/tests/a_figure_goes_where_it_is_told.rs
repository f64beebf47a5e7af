//! The steered Marathon Man. The commanded direction turns as commanded. The target velocity changes with a limited
//! acceleration. The gait's phase advances with the pace, which follows the target velocity. The reward is the
//! documented formula, and adaptive starts fit the command. Style demonstrations are the observations that the clips
//! produce.

use crate::common;
use std::f64::consts::{FRAC_PI_2, TAU};

use crate::common::{action, isas, make};
use marathon_envs::agents::marathon::marathon_man::clips;
use marathon_envs::agents::marathon::marathon_man::gait::{Footwork, gaits};
use marathon_envs::agents::marathon::marathon_man::steer::{MAX_HEADING_LAG, STYLE};
use marathon_envs::{AgentState, Autoreset, Demonstrations, VecEnv, VecEnvOptions, agent, factory};
use marathon_motion::dynamics::Motion;
use marathon_physics::Model;
use marathon_physics::lanes::Isa;

const ID: &str = "MarathonManSteer-v0";
const AGENTS: usize = 16;
/// Indices in the observation: target velocity, own velocity, joint angles and velocities, gait, and next pose.
const TARGET: usize = 4;
const VELOCITY: usize = 13;
const ANGLES: usize = 19;
const GAIT: usize = 79;
const NEXT: usize = 82;

fn demonstrations(id: &str, isa: Isa) -> Demonstrations {
    factory(id, isa).unwrap().demonstrations().expect("an agent with clips has demonstrations")
}

#[test]
fn demonstrations_are_the_observations_of_a_clip() {
    let (id, all) = ("MarathonManSpinKick-v0", demonstrations("MarathonManSpinKick-v0", Isa::F64));
    let clip = clips::shipped("spinkick").unwrap();
    let mut env = make(id, 1, 1, Some(Isa::F64), Autoreset::Disabled);
    let (obs_len, dt) = (env.spec().obs, env.spec().dt);
    let rows = (clip.duration() / dt + 1e-9).floor() as usize + 1;
    assert_eq!((all.obs_len, all.act_len, all.obs.len()), (obs_len, 0, rows * obs_len));
    let pairs: Vec<[usize; 2]> = (1..rows).map(|row| [row - 1, row]).collect();
    assert_eq!((&all.decisions, all.motions.len(), &all.motions[0]), (&pairs, 1, &(0..rows - 1)));
    // without the phase and the comparison with the clip, whose row only the start of an episode sets
    let own = 4..65;
    let mut obs = vec![0.0f32; obs_len];
    env.reset(Some(1), &mut obs).unwrap();
    for row in 0..rows {
        let mut state = AgentState { qpos: vec![0.0; clip.layout().nq()], qvel: vec![0.0; clip.layout().nv()] };
        clip.qpos(row as f64 * dt, &mut state.qpos);
        clip.qvel(row as f64 * dt, &mut state.qvel);
        env.set_state(0, &state).unwrap();
        env.observe(&[true], &mut obs).unwrap();
        assert_eq!(all.row(row)[own.clone()], obs[own.clone()], "row {row}");
    }
}

#[test]
fn demonstrations_of_loops_are_closed_and_as_fast_as_the_clips() {
    let all = demonstrations(ID, Isa::best());
    assert_eq!(all.motions.len(), 5);
    // velocity along the heading; walking in circles is slower by this measure than along the path
    for (motion, speed) in all.motions.iter().zip([0.88, 0.84, 0.78, 3.2, 0.0]) {
        let first = all.decisions[motion.start][0];
        assert_eq!(all.decisions[motion.end - 1], [first + motion.len() - 1, first]);
        let sum: f32 = motion.clone().map(|i| all.row(all.decisions[i][0])[VELOCITY]).sum();
        let mean = f64::from(sum) / motion.len() as f64;
        assert!((mean - speed).abs() < 0.1, "{mean} m/s, expected {speed}");
    }
}

#[test]
fn demonstrations_do_not_depend_on_the_vector_width() {
    let want = demonstrations(ID, Isa::F32);
    for isa in isas().filter(|isa| *isa != Isa::F64) {
        assert!(demonstrations(ID, isa) == want, "{}", isa.name());
    }
}

#[test]
fn style_groups_have_names() {
    let spec = factory(ID, Isa::best()).unwrap().spec().clone();
    let named: Vec<&str> = spec.observations.iter().map(|group| group.name.as_str()).collect();
    assert!(STYLE.iter().all(|name| named.contains(name)), "{named:?}");
    assert!(["command", "touch", "gait", "next_pose"].iter().all(|name| named.contains(name) && !STYLE.contains(name)));
}

/// Heading of the butt's forward axis: the torso's rotation, then the waist's about z and y. The waist's rotation about
/// x follows and does not change the axis.
fn heading(state: &AgentState) -> f64 {
    let [w, x, y, z, yaw, pitch] = state.qpos[3..9] else { panic!("a free joint and a waist") };
    let axis = [yaw.cos() * pitch.cos(), yaw.sin() * pitch.cos(), -pitch.sin()];
    let rows = [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
        [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
    ];
    let [forward, left] = rows.map(|row| row.iter().zip(&axis).map(|(a, b)| a * b).sum::<f64>());
    left.atan2(forward)
}

/// Velocity of the center of mass along the ground, m/s.
fn center_velocity(model: &Model, state: &AgentState) -> [f64; 2] {
    let motion = Motion::of(model, &state.qpos, &state.qvel, &vec![0.0; model.nv]);
    let (_, velocity, _) = motion.momentum(model);
    [velocity.x, velocity.y]
}

/// Observation of an agent.
fn row(obs: &[f32], agent: usize, n: usize) -> Vec<f64> {
    obs[agent * n..(agent + 1) * n].iter().map(|x| f64::from(*x)).collect()
}

/// DeepMimic's weights of the joints in the order of `qpos`. They are the abdomen, the right and the left leg (three
/// hip axes, knee, two ankle axes), and the right and the left arm (two shoulder axes, elbow).
fn weights() -> Vec<f64> {
    let (leg, arm) = ([0.5, 0.5, 0.5, 0.3, 0.2, 0.2], [0.3, 0.3, 0.2]);
    [0.5; 3].into_iter().chain(leg).chain(leg).chain(arm).chain(arm).collect()
}

#[test]
fn the_gait_follows_the_command_and_stays_near_the_body_speed() {
    let mut env = make(ID, AGENTS, 1, Some(Isa::F64), Autoreset::Disabled);
    let (n, dt) = (env.spec().obs, env.spec().dt);
    let mut out = env.buffers();
    for agent in 0..AGENTS {
        // a turn on the spot uses the pace of walking on a circle of 0.4 m
        let command = if agent % 4 == 0 { [0.0, FRAC_PI_2] } else { [3.0 * agent as f64 / (AGENTS - 1) as f64, 0.0] };
        env.set_command(agent, Some(&command)).unwrap();
    }
    env.reset(Some(7), &mut out.obs).unwrap();
    let mut actions = vec![0.0; AGENTS * env.spec().act];
    let (mut over, mut checked, mut faster) = ([false; AGENTS], 0, 0);
    let mut info = vec![0.0f32; AGENTS * 2];
    for decision in 0..40 {
        for (agent, row) in actions.chunks_exact_mut(21).enumerate() {
            action(agent, decision, 0.1, row);
        }
        let before = out.obs.clone();
        env.step(&actions, &mut out).unwrap();
        env.info(&mut info).unwrap();
        for agent in (0..AGENTS).filter(|agent| !over[*agent]).collect::<Vec<_>>() {
            let (was, is) = (row(&before, agent, n), row(&out.obs, agent, n));
            let [[pace, cos, sin], [next_pace, next_cos, next_sin]] =
                [&was, &is].map(|obs| [obs[GAIT], obs[GAIT + 1], obs[GAIT + 2]]);
            let turned = next_sin.atan2(next_cos) - sin.atan2(cos);
            let expected = TAU * gaits().frequency(pace) * dt;
            assert!((turned.rem_euclid(TAU) - expected).abs() < 1e-5, "agent {agent}: {turned}, expected {expected}");
            // toward the target at 4 m/s^2, within 0.8 m/s of the body's speed; the gap may only shrink
            let asked = is[TARGET].hypot(is[TARGET + 1]).max(0.4 * was[1].abs());
            let change = next_pace - pace;
            assert!(change.abs() < 4.0 * dt + 1e-5);
            // under a command of 0, the velocity error is the speed
            if was[0] == 0.0 {
                let speed = f64::from(info[2 * agent]);
                let led = speed + (asked - speed).clamp(-0.8, 0.8);
                let expected = (led - pace).clamp(-4.0 * dt, 4.0 * dt);
                assert!((change - expected).abs() < 1e-5, "agent {agent}: {change}, expected {expected}");
            }
            if change > 1e-5 && pace > asked + 1e-5 {
                // the body is faster than the pace by more than the allowed lead
                faster += 1;
            }
            // the next pose minus the present one
            let next = gaits().moment(
                next_sin.atan2(next_cos) / TAU + gaits().frequency(next_pace) * dt,
                next_pace,
                Footwork::straight(),
                0.0,
            );
            for joint in 0..21 {
                let (got, expected) = (is[NEXT + joint], gaits().angle(&next, joint) - is[ANGLES + joint]);
                assert!((got - expected).abs() < 1e-4, "joint {joint}: {got}, expected {expected}");
            }
            checked += 1;
            over[agent] = out.terminated[agent] || out.truncated[agent];
        }
    }
    assert!(checked > 10 * AGENTS && faster < checked / 4, "{checked} {faster}");
}

#[test]
fn the_commanded_direction_turns_as_told_and_rewards_are_their_formula() {
    let mut env = make(ID, AGENTS, 1, Some(Isa::F64), Autoreset::Disabled);
    let (n, dt) = (env.spec().obs, env.spec().dt);
    let mut out = env.buffers();
    for agent in 0..AGENTS {
        let share = agent as f64 / (AGENTS - 1) as f64;
        env.set_command(agent, Some(&[3.0 * share, FRAC_PI_2 * (2.0 * share - 1.0)])).unwrap();
    }
    env.reset(Some(5), &mut out.obs).unwrap();
    let model = agent(ID).unwrap().model().unwrap();
    let mut actions = vec![0.0; AGENTS * env.spec().act];
    let mut over = [false; AGENTS];
    let mut directions: Vec<f64> = (0..AGENTS).map(|agent| heading(&env.state(agent).unwrap())).collect();
    let mut info = vec![0.0f32; AGENTS * 2];
    let (mut checked, mut behind, mut reached, mut limited) = (0, 0.0f64, 0, 0);
    // target velocities in the world
    let mut targets: Vec<[f64; 2]> = (0..AGENTS)
        .map(|agent| {
            let (sin, cos) = directions[agent].sin_cos();
            let [x, y] = [0, 1].map(|i| f64::from(out.obs[agent * n + TARGET + i]));
            [cos * x - sin * y, sin * x + cos * y]
        })
        .collect();
    for decision in 0..60 {
        for (agent, row) in actions.chunks_exact_mut(21).enumerate() {
            action(agent, decision, 0.1, row);
        }
        let before = out.obs.clone();
        env.step(&actions, &mut out).unwrap();
        env.info(&mut info).unwrap();
        for agent in (0..AGENTS).filter(|agent| !over[*agent]).collect::<Vec<_>>() {
            let (was, is) = (row(&before, agent, n), row(&out.obs, agent, n));
            let angle = is[2].atan2(is[3]);
            assert!((is[2].hypot(is[3]) - 1.0).abs() < 1e-5 && angle.abs() < MAX_HEADING_LAG + 1e-5);
            behind = behind.max(angle.abs());
            // angles are compared modulo a full turn
            let (own, off) = (heading(&env.state(agent).unwrap()), |a: f64| a.sin().atan2(a.cos()));
            let velocity = center_velocity(&model, &env.state(agent).unwrap());
            // the turn rate is limited to a lateral acceleration of 3 m/s^2 at the body's speed
            let most = 3.0 / velocity[0].hypot(velocity[1]);
            let expected = (off(directions[agent] - own) + was[1].clamp(-most, most) * dt)
                .clamp(-MAX_HEADING_LAG, MAX_HEADING_LAG);
            limited += usize::from(was[1].abs() > most);
            directions[agent] = own + expected;
            assert!((angle - expected).abs() < 1e-5, "agent {agent}: {angle}, expected {expected}");
            let [off_command, a] = [0, 1].map(|i| f64::from(info[2 * agent + i]));
            assert!((a - angle.abs()).abs() < 1e-5);
            // the target follows the commanded velocity at 4 m/s^2, and turns are limited to 2.5 m/s^2
            let (direction, target) = (own + expected, &mut targets[agent]);
            let at = |speed: f64| [speed * direction.cos(), speed * direction.sin()];
            let (told, able) = (at(was[0]), at(was[0].min(2.5 / was[1].abs())));
            let missing = [able[0] - target[0], able[1] - target[1]];
            let share = (4.0 * dt / missing[0].hypot(missing[1])).min(1.0);
            *target = [target[0] + share * missing[0], target[1] + share * missing[1]];
            reached += usize::from(share == 1.0);
            let seen = [is[TARGET], is[TARGET + 1]];
            let expected =
                [own.cos() * target[0] + own.sin() * target[1], own.cos() * target[1] - own.sin() * target[0]];
            assert!((seen[0] - expected[0]).hypot(seen[1] - expected[1]) < 1e-4, "{seen:?}, expected {expected:?}");
            let off = |v: [f64; 2]| (velocity[0] - v[0]).hypot(velocity[1] - v[1]);
            assert!((off(told) - off_command).abs() < 1e-4, "{} {off_command}", off(told));
            let e = off(*target).powi(2);
            let gait = |lead: f64| {
                gaits().moment(is[GAIT + 2].atan2(is[GAIT + 1]) / TAU, is[GAIT], Footwork::straight(), lead)
            };
            let (mut apart, mut faster, mut total) = (0.0, 0.0, 0.0);
            for (joint, weight) in weights().into_iter().enumerate() {
                let [now, led] = [0.0, 1e-6].map(|lead| gaits().angle(&gait(lead), joint));
                apart += weight * (now - is[ANGLES + joint]).powi(2);
                faster += weight * ((led - now) / 1e-6 - is[ANGLES + 21 + joint]).powi(2);
                total += weight;
            }
            let worth = 0.3 * (-5.0 * e).exp()
                + 0.2 * (-0.5 * e).exp()
                + 0.05 * (-100.0 * e).exp()
                + 0.2 * (-4.0 * a * a).exp()
                + 0.2 * (-5.0 * apart / total).exp()
                + 0.05 * (-faster / total).exp();
            assert!((f64::from(out.reward[agent]) - worth).abs() < 1e-5, "{} {worth}", out.reward[agent]);
            checked += 1;
            over[agent] = out.terminated[agent] || out.truncated[agent];
        }
    }
    assert!(checked > 20 * AGENTS && behind > 0.5 && reached > 50, "{checked} {behind} {reached}");
    assert!(limited > 0 && limited < checked / 2, "{limited} of {checked}");
}

/// Agents at their start, their forward speeds and the commanded ones.
fn starts(start: &str, seed: u64) -> (VecEnv, Vec<[f64; 2]>) {
    const MANY: usize = 512;
    let options = [("start".to_string(), start.into())].into_iter().collect();
    let mut env = VecEnv::new(ID, &VecEnvOptions { agents: MANY, options, ..VecEnvOptions::default() }).unwrap();
    let mut out = env.buffers();
    env.reset(Some(seed), &mut out.obs).unwrap();
    let n = env.spec().obs;
    let speeds = (0..MANY).map(|agent| row(&out.obs, agent, n)).map(|obs| [obs[VELOCITY], obs[0]]).collect();
    (env, speeds)
}

#[test]
fn adaptive_starts_fit_the_command_and_try_again() {
    let run = |speeds: &[[f64; 2]], fast: bool| {
        let of: Vec<bool> = speeds.iter().filter(|s| (s[1] > 2.0) == fast).map(|s| s[0] > 2.0).collect();
        of.iter().filter(|run| **run).count() as f64 / of.len() as f64
    };
    let (_, random) = starts("random", 3);
    assert!((run(&random, true) - 0.2).abs() < 0.1 && (run(&random, false) - 0.2).abs() < 0.1);
    // half of them fit, and one in five of the others runs
    let (mut env, adaptive) = starts("adaptive", 3);
    assert!((run(&adaptive, true) - 0.6).abs() < 0.12, "{}", run(&adaptive, true));
    assert!((run(&adaptive, false) - 0.1).abs() < 0.06, "{}", run(&adaptive, false));

    // the gait alone does not prevent falls; half of the next episodes begin in the same pose, up to noise
    let (agents, act) = (env.agents(), env.spec().act);
    let first: Vec<AgentState> = (0..agents).map(|agent| env.state(agent).unwrap()).collect();
    let mut out = env.buffers();
    let (mut again, mut ended) = (0, vec![false; agents]);
    for _ in 0..80 {
        env.step(&vec![0.0; agents * act], &mut out).unwrap();
        for agent in (0..agents).filter(|agent| out.terminated[*agent]) {
            if !std::mem::replace(&mut ended[agent], true) {
                let state = env.state(agent).unwrap();
                let joints = state.qpos[7..].iter().zip(&first[agent].qpos[7..]);
                again += usize::from(joints.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) < 0.021);
            }
        }
    }
    let ended = ended.iter().filter(|ended| **ended).count();
    let share = again as f64 / ended as f64;
    assert!(ended > 100 && (share - 0.5).abs() < 0.12, "{again} of {ended}");
}

/// 64 agents with some arguments, and their first observations.
fn begun(options: &[(&str, &str)]) -> (VecEnv, Vec<f32>) {
    let options = common::options(options);
    let options = VecEnvOptions { agents: 64, options, autoreset: Autoreset::Disabled, ..Default::default() };
    let mut env = VecEnv::new(ID, &options).unwrap();
    let mut obs = env.buffers().obs;
    env.reset(Some(3), &mut obs).unwrap();
    (env, obs)
}

#[test]
fn sharp_commands_are_extremes_half_of_the_time() {
    let share = |commands: &str| {
        let (env, obs) = begun(&[("commands", commands)]);
        let sharp = |row: &&[f32]| f64::from(row[1].abs()) > 0.999 * FRAC_PI_2 || row[0] > 2.999;
        let rests = |row: &&[f32]| row[0] == 0.0 && row[1] == 0.0;
        let rows = || obs.chunks_exact(env.spec().obs);
        [rows().filter(sharp).count(), rows().filter(rests).count()].map(|n| n as f64 / 64.0)
    };
    // a fifth rests; of the extremes, two thirds of a third and half of the turns
    let ([sharp, rests], [even, stands]) = (share("sharp"), share("even"));
    assert!((0.1..0.45).contains(&sharp) && even < 0.05, "{sharp} {even}");
    assert!((0.15..0.4).contains(&rests) && stands < 0.15, "{rests} {stands}");
}

#[test]
fn episodes_may_start_standing_and_falls_may_have_a_penalty() {
    let (mut env, obs) = begun(&[("start", "first"), ("fall_penalty", "20")]);
    let n = env.spec().obs;
    for row in obs.chunks_exact(n) {
        // upright and at rest, up to noise and the sway of standing
        assert!(
            row[VELOCITY..VELOCITY + 3].iter().all(|v| v.abs() < 0.2) && row[6] > 0.8,
            "{:?}",
            &row[..VELOCITY + 3]
        );
    }
    let mut out = env.buffers();
    let actions = vec![1.0; 64 * env.spec().act];
    let mut felled = 0;
    for _ in 0..80 {
        env.step(&actions, &mut out).unwrap();
        for (down, reward) in out.terminated.iter().zip(&out.reward) {
            felled += usize::from(*down);
            assert!(!down || *reward == -20.0);
        }
    }
    assert!(felled > 0);
}
