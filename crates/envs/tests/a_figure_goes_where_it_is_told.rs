//! Marathon Man told where to go: the direction that he is to keep turns as commanded, his gait goes round as fast as its pace
//! asks for and its pace follows the command, his reward is its formula, and the demonstrations of his style are what he would
//! observe in his clips.

mod common;

use std::f64::consts::{FRAC_PI_2, TAU};

use common::{action, isas, make};
use marathon_envs::agents::marathon::marathon_man::clips;
use marathon_envs::agents::marathon::marathon_man::gait::gaits;
use marathon_envs::agents::marathon::marathon_man::steer::{MOST_BEHIND, STYLE};
use marathon_envs::{AgentState, Autoreset, Demonstrations, factory};
use marathon_physics::lanes::Isa;

const ID: &str = "MarathonManSteer-v0";
const AGENTS: usize = 16;

fn demonstrations(id: &str, isa: Isa) -> Demonstrations {
    factory(id, isa).unwrap().demonstrations().expect("an agent with clips has demonstrations")
}

#[test]
fn demonstrations_are_what_he_observes_in_a_clip() {
    let (id, all) = ("MarathonManSpinKick-v0", demonstrations("MarathonManSpinKick-v0", Isa::F64));
    let clip = clips::find("spinkick").unwrap();
    let mut env = make(id, 1, 1, Some(Isa::F64), Autoreset::Disabled);
    let (obs_len, dt) = (env.spec().obs, env.spec().dt);
    let rows = (clip.duration() / dt + 1e-9).floor() as usize + 1;
    assert_eq!((all.obs_len, all.act_len, all.obs.len()), (obs_len, 0, rows * obs_len));
    let pairs: Vec<[usize; 2]> = (1..rows).map(|row| [row - 1, row]).collect();
    assert_eq!((&all.decisions, all.motions.len(), &all.motions[0]), (&pairs, 1, &(0..rows - 1)));
    // all but the phase and what compares him with the clip, whose row only the start of an episode sets
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
    // the component of the velocity along the heading; walks in circles are slower than their paths
    for (motion, speed) in all.motions.iter().zip([0.88, 0.84, 0.78, 3.2, 0.0]) {
        let first = all.decisions[motion.start][0];
        assert_eq!(all.decisions[motion.end - 1], [first + motion.len() - 1, first]);
        let sum: f32 = motion.clone().map(|i| all.row(all.decisions[i][0])[11]).sum();
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
fn his_style_has_names() {
    let spec = factory(ID, Isa::best()).unwrap().spec().clone();
    let named: Vec<&str> = spec.observations.iter().map(|group| group.name.as_str()).collect();
    assert!(STYLE.iter().all(|name| named.contains(name)), "{named:?}");
    assert!(["command", "touch", "gait", "next_pose"].iter().all(|name| named.contains(name) && !STYLE.contains(name)));
}

/// Angle of the butt's forward axis along the ground: the torso's rotation, then the waist's about z and y. That about x,
/// which follows, leaves the axis where it is.
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

/// What an agent observes.
fn row(obs: &[f32], agent: usize, n: usize) -> Vec<f64> {
    obs[agent * n..(agent + 1) * n].iter().map(|x| f64::from(*x)).collect()
}

/// DeepMimic's weights of the joints in the order of `qpos`: abdomen, then a right and a left leg (hip of three axes, knee,
/// ankle of two), then a right and a left arm (shoulder of two axes, elbow).
fn weights() -> Vec<f64> {
    let (leg, arm) = ([0.5, 0.5, 0.5, 0.3, 0.2, 0.2], [0.3, 0.3, 0.2]);
    [0.5; 3].into_iter().chain(leg).chain(leg).chain(arm).chain(arm).collect()
}

#[test]
fn his_gait_follows_the_command_and_leads_him_by_little() {
    let mut env = make(ID, AGENTS, 1, Some(Isa::F64), Autoreset::Disabled);
    let (n, dt) = (env.spec().obs, env.spec().dt);
    let mut out = env.buffers();
    for agent in 0..AGENTS {
        // a turn on the spot takes the pace of a walk on a circle of 0.4 m
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
        env.step(&actions, &mut out.as_mut()).unwrap();
        env.info(&mut info).unwrap();
        for agent in (0..AGENTS).filter(|agent| !over[*agent]).collect::<Vec<_>>() {
            let (was, is) = (row(&before, agent, n), row(&out.obs, agent, n));
            let [[pace, cos, sin], [next_pace, next_cos, next_sin]] =
                [&was, &is].map(|obs| [obs[77], obs[78], obs[79]]);
            let turned = next_sin.atan2(next_cos) - sin.atan2(cos);
            let expected = TAU * gaits().frequency(pace) * dt;
            assert!((turned.rem_euclid(TAU) - expected).abs() < 1e-5, "agent {agent}: {turned}, expected {expected}");
            // to the command by 4 m/s^2, but no farther from his own speed than 0.8 m/s: it may come nearer, never leave
            let asked = was[0].max(0.4 * was[1].abs());
            let change = next_pace - pace;
            assert!(change.abs() < 4.0 * dt + 1e-5);
            // told to go nowhere, the error of his velocity is his speed
            if was[0] == 0.0 {
                let speed = f64::from(info[2 * agent]);
                let led = speed + (asked - speed).clamp(-0.8, 0.8);
                let expected = (led - pace).clamp(-4.0 * dt, 4.0 * dt);
                assert!((change - expected).abs() < 1e-5, "agent {agent}: {change}, expected {expected}");
            }
            if change > 1e-5 && pace > asked + 1e-5 {
                // he is faster than the pace by more than it may be behind
                faster += 1;
            }
            // the next pose, less his own
            let next =
                gaits().moment(next_sin.atan2(next_cos) / TAU + gaits().frequency(next_pace) * dt, next_pace, 0.0);
            for joint in 0..21 {
                let expected = gaits().angle(&next, joint) - is[17 + joint];
                assert!(
                    (is[80 + joint] - expected).abs() < 1e-4,
                    "joint {joint}: {}, expected {expected}",
                    is[80 + joint]
                );
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
    let mut actions = vec![0.0; AGENTS * env.spec().act];
    let mut over = [false; AGENTS];
    let mut directions: Vec<f64> = (0..AGENTS).map(|agent| heading(&env.state(agent).unwrap())).collect();
    let mut info = vec![0.0f32; AGENTS * 2];
    let (mut checked, mut behind) = (0, 0.0f64);
    for decision in 0..60 {
        for (agent, row) in actions.chunks_exact_mut(21).enumerate() {
            action(agent, decision, 0.1, row);
        }
        let before = out.obs.clone();
        env.step(&actions, &mut out.as_mut()).unwrap();
        env.info(&mut info).unwrap();
        for agent in (0..AGENTS).filter(|agent| !over[*agent]).collect::<Vec<_>>() {
            let (was, is) = (row(&before, agent, n), row(&out.obs, agent, n));
            let angle = is[2].atan2(is[3]);
            assert!((is[2].hypot(is[3]) - 1.0).abs() < 1e-5 && angle.abs() < MOST_BEHIND + 1e-5);
            behind = behind.max(angle.abs());
            // an angle is as good as another one a whole turn away
            let (own, off) = (heading(&env.state(agent).unwrap()), |a: f64| a.sin().atan2(a.cos()));
            let expected = (off(directions[agent] - own) + was[1] * dt).clamp(-MOST_BEHIND, MOST_BEHIND);
            directions[agent] = own + expected;
            assert!((angle - expected).abs() < 1e-5, "agent {agent}: {angle}, expected {expected}");
            let [e, a] = [0, 1].map(|i| f64::from(info[2 * agent + i]));
            assert!((a - angle.abs()).abs() < 1e-5);
            let gait = gaits().moment(is[79].atan2(is[78]) / TAU, is[77], 0.0);
            let (mut apart, mut total) = (0.0, 0.0);
            for (joint, weight) in weights().into_iter().enumerate() {
                apart += weight * (gaits().angle(&gait, joint) - is[17 + joint]).powi(2);
                total += weight;
            }
            let worth = 0.35 * (-5.0 * e * e).exp()
                + 0.25 * (-0.5 * e * e).exp()
                + 0.2 * (-4.0 * a * a).exp()
                + 0.2 * (-5.0 * apart / total).exp();
            assert!((f64::from(out.reward[agent]) - worth).abs() < 1e-5, "{} {worth}", out.reward[agent]);
            checked += 1;
            over[agent] = out.terminated[agent] || out.truncated[agent];
        }
    }
    assert!(checked > 20 * AGENTS && behind > 0.5, "{checked} {behind}");
}
