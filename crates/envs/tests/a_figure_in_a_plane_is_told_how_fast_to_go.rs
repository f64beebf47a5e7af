//! The paper's controllers. Figures in a plane observe their command. The mean velocity is that of three decisions. The
//! reward is the original's formula, with additional terms for standing still and for a late jump.

use crate::common::action;
use marathon_envs::{Autoreset, Options, Step, VecEnv, VecEnvOptions, agent};
use marathon_motion::dynamics::Motion;
use marathon_physics::Model;
use std::f64::consts::PI;

const AGENTS: usize = 16;

fn env(id: &str, input: &str) -> VecEnv {
    let options = Options::new().with("input", input);
    let options = VecEnvOptions { agents: AGENTS, options, autoreset: Autoreset::Disabled, ..Default::default() };
    VecEnv::new(id, &options).unwrap_or_else(|e| panic!("{e}"))
}

/// Velocities of the bodies' centers of mass, m/s.
fn velocities(model: &Model, env: &VecEnv, agent: usize) -> Vec<[f64; 3]> {
    let state = env.state(agent).unwrap();
    let motion = Motion::of(model, &state.qpos, &state.qvel, &vec![0.0; model.nv]);
    (1..model.bodies.len()).map(|i| motion.velocity[i].to_array()).collect()
}

/// Height of the torso, m.
fn height(model: &Model, env: &VecEnv, agent: usize) -> f64 {
    let state = env.state(agent).unwrap();
    Motion::of(model, &state.qpos, &state.qvel, &vec![0.0; model.nv]).com[1].z
}

#[test]
fn observations_are_the_originals_and_the_command() {
    // with buttons, the original has 34 and 46 numbers, one of them the jump; it has no target velocity and no awaited
    // jump
    for (id, own, buttons) in [("HopperController-v0", 31, 36), ("WalkerController-v0", 43, 48)] {
        for (input, numbers) in [("discrete", buttons), ("continuous", buttons - 2)] {
            let mut env = env(id, input);
            let spec = env.spec().clone();
            let commands = spec.command.len();
            assert_eq!((spec.obs, commands), (numbers, (numbers - own - 1) / 2), "{id} {input}");
            let mut out = env.buffers();
            let told: Vec<f64> = [-2.5, 1.0][..commands].to_vec();
            env.set_command(3, Some(&told)).unwrap();
            env.reset(Some(1), &mut out.obs).unwrap();
            let seen = &out.obs[3 * numbers + own..][..commands];
            let seen: Vec<f64> = seen.iter().map(|x| f64::from(*x)).collect();
            assert_eq!(seen, told, "{id} {input}");
        }
    }
}

#[test]
fn the_reward_is_its_formula() {
    for input in ["discrete", "continuous"] {
        let id = "WalkerController-v0";
        let mut env = env(id, input);
        let model = agent(id).unwrap().model().unwrap();
        let (n, act, k) = (env.spec().obs, env.spec().act, env.spec().reward_terms.len());
        assert_eq!(env.spec().reward_terms[..8], TERMS);
        let commands = env.spec().command.len();
        let mut told = vec![vec![0.0; commands]; AGENTS];
        for (agent, command) in told.iter_mut().enumerate() {
            // a third is to stand
            command[0] = if agent % 3 == 0 { 0.0 } else { agent as f64 * 0.5 - 4.0 };
            if commands > 1 {
                command[1] = f64::from(u8::from(agent % 2 == 0));
            }
            env.set_command(agent, Some(command)).unwrap();
        }
        let mut out: Step = env.buffers();
        env.reset(Some(2), &mut out.obs).unwrap();
        let first = |env: &VecEnv, agent: usize| velocities(&model, env, agent)[0][0];
        let mut past: Vec<[f64; 3]> = (0..AGENTS).map(|agent| [first(&env, agent); 3]).collect();
        let mut targets: Vec<f64> = past.iter().map(|past| past[0]).collect();
        let mut actions = vec![0.0; AGENTS * act];
        let (mut leapt, mut rested, mut over) = (0, 0.0f64, [false; AGENTS]);
        let (mut aloft, mut jumped, mut rose) = ([0; AGENTS], [false; AGENTS], [0.0f64; AGENTS]);
        let masses: Vec<f64> = model.bodies[1..].iter().map(|body| body.mass).collect();
        for decision in 0..60 {
            for (agent, row) in actions.chunks_exact_mut(act).enumerate() {
                // four of them have zero actions
                action(agent, decision, if agent < 4 { 0.0 } else { 1.0 }, row);
            }
            env.step(&actions, &mut out).unwrap();
            for agent in (0..AGENTS).filter(|agent| !over[*agent]).collect::<Vec<_>>() {
                let obs: Vec<f64> = out.obs[agent * n..(agent + 1) * n].iter().map(|x| f64::from(*x)).collect();
                let moving = velocities(&model, &env, agent);
                past[agent] = [moving[0][0], past[agent][0], past[agent][1]];
                let mean = past[agent].iter().sum::<f64>() / 3.0;
                let own = n - commands - 1;
                assert!((obs[own] - mean).abs() < 1e-4, "{} {mean}", obs[own]);
                targets[agent] = follow(targets[agent], told[agent][0], env.spec().dt);
                assert!((obs[own + 1] - targets[agent]).abs() < 1e-4, "{} {}", obs[own + 1], targets[agent]);
                over[agent] = out.terminated[agent];
                if over[agent] {
                    assert_eq!(out.reward[agent], -40.0);
                    continue;
                }
                let (command, jump) = (told[agent][0], told[agent].get(1).copied().unwrap_or(0.0));
                let off = (command - mean).abs();
                assert!((f64::from(out.info[agent]) - off).abs() < 1e-4);
                let tilt = obs[3].clamp(-1.0, 1.0).acos();
                let (touching, feet) = (obs[9] + obs[10], [obs[41], obs[42]]);
                let leap = if touching > 0.0 { 0.0 } else { 1.0 + feet[0].min(feet[1]) };
                let square = |v: &[f64; 3]| v.iter().map(|x| x * x).sum::<f64>();
                let speed2 = moving.iter().map(square).sum::<f64>() / moving.len() as f64;
                let rests = command == 0.0 && jump == 0.0;
                let still =
                    if rests { 1.5 * [0.4, 0.04].map(|most| (-speed2 / most).exp()).iter().sum::<f64>() } else { 0.0 };
                let effort: f64 = actions[agent * act..(agent + 1) * act].iter().map(|a| f64::from(a * a)).sum();
                // a jump is 0.1 s off the ground, after the center of mass has risen at 0.7 m/s
                let up: f64 = masses.iter().zip(&moving).map(|(mass, v)| mass * v[2]).sum();
                let rises = up / masses.iter().sum::<f64>();
                aloft[agent] = if leap > 0.0 && (aloft[agent] > 0 || rises > 0.7) { aloft[agent] + 1 } else { 0 };
                jumped[agent] |= aloft[agent] >= 10;
                rose[agent] = rose[agent].max(rises);
                let awaited = if jumped[agent] { 0.0 } else { jump };
                assert!(commands == 1 || obs[n - 1] == awaited);
                let late = if command == 0.0 { 6.0 * awaited * (1.0 - 0.6 * rose[agent].min(1.0)) } else { 0.0 };
                let low = (1.1 - height(&model, &env, agent)).clamp(0.0, 1.1);
                let [velocity, pace] = paid(targets[agent], mean);
                let expected = [velocity, pace, 0.5 - tilt / PI, jump * leap, -late, still, -low, -EFFORT * effort];
                for (i, expected) in expected.into_iter().enumerate() {
                    let got = f64::from(out.terms[agent * k + i]);
                    assert!((got - expected).abs() < 2e-3, "agent {agent}, term {i}: {got}, expected {expected}");
                }
                leapt += usize::from(jump * leap > 0.0);
                rested = rested.max(still);
            }
        }
        assert!((leapt > 0) == (input == "discrete") && rested > 0.05, "{leapt} {rested}");
    }
}

/// Under a jump command, a standing figure pays for each decision until it has been off the ground for 0.1 s after
/// rising. It pays less the faster it has risen, and again after a new command. A figure that falls meanwhile, as it
/// does when it pulls up its legs, has not jumped. The Hopper, for which pulling up the leg is easier, does not earn
/// the `jump` term for that either.
#[test]
fn a_jump_that_is_late_costs() {
    for (id, jumped, dt, drawn) in [("WalkerController-v0", 10, 0.01, 1.0), ("HopperController-v0", 5, 0.02, 0.0)] {
        let mut env = env(id, "discrete");
        assert_eq!(env.spec().dt, dt);
        let (act, k) = (env.spec().act, env.spec().reward_terms.len());
        let mut out: Step = env.buffers();
        env.reset(Some(2), &mut out.obs).unwrap();
        // high enough that a fall takes 0.17 s; setting a state restarts the command
        let lift = |env: &mut VecEnv, command: [f64; 2], upward: f64| {
            for agent in 0..AGENTS {
                env.set_command(agent, Some(&command)).unwrap();
                let mut state = env.state(agent).unwrap();
                state.qvel.fill(0.0);
                state.qvel[1] = upward;
                state.qpos[1] += 0.15;
                env.set_state(agent, &state).unwrap();
            }
        };
        // the `jump` and `late` terms
        let mut paid = |env: &mut VecEnv, command: [f64; 2]| {
            (0..AGENTS).for_each(|agent| env.set_command(agent, Some(&command)).unwrap());
            env.step(&vec![0.0; AGENTS * act], &mut out).unwrap();
            [3, 4].map(|term| {
                let terms = (0..AGENTS).map(|agent| out.terms[agent * k + term]);
                terms.fold([f32::MAX, f32::MIN], |[low, high], x| [low.min(x), high.max(x)])
            })
        };
        let (jump, stand) = ([0.0, 1.0], [0.0, 0.0]);
        lift(&mut env, jump, 0.0);
        for decision in 1..=3 * jumped / 2 {
            let [jumps, late] = paid(&mut env, jump);
            assert_eq!(late, [-6.0; 2], "{id}, decision {decision}");
            assert!(
                (drawn..1.5).contains(&f64::from(jumps[0])) && (drawn == 1.0 || jumps[1] == 0.0),
                "{id}: {jumps:?}"
            );
        }
        lift(&mut env, jump, 1.0);
        for decision in 1..=5 * jumped / 2 {
            let [jumps, late] = paid(&mut env, jump);
            assert!(jumps[0] > 1.0, "{id}, decision {decision}: {jumps:?}");
            if decision < jumped {
                // 0.6 of it is waived at 1 m/s, of which gravity has taken a tenth or two
                assert!(late[0] > -3.2 && late[1] < -2.4, "{id}, decision {decision}: {late:?}");
            } else {
                assert_eq!(late, [0.0; 2], "{id}, decision {decision}");
            }
        }
        (0..jumped).for_each(|_| _ = paid(&mut env, jump));
        // on the ground again, with a new command: it applies from the decision after the one in which it is set
        let told = [stand, stand, jump, jump].map(|command| paid(&mut env, command)[1]);
        assert_eq!(told[..3], [[0.0; 2]; 3], "{id}");
        assert!(told[3][0] >= -6.0 && told[3][1] < -4.0, "{id}: {told:?}");
        // a figure that is to run does not have to hurry
        lift(&mut env, [4.0, 1.0], 0.0);
        for _ in 1..jumped {
            assert_eq!(paid(&mut env, [4.0, 1.0])[1], [0.0; 2], "{id}");
        }
    }
}

/// Weight of the effort.
const EFFORT: f64 = 0.05;
/// Terms of the reward.
const TERMS: [&str; 8] = ["velocity", "pace", "uprightness", "jump", "late", "still", "height", "effort"];

/// The target velocity after a decision of `dt` seconds. It follows the command at 5 m/s^2.
fn follow(target: f64, told: f64, dt: f64) -> f64 {
    target + (told - target).clamp(-5.0 * dt, 5.0 * dt)
}

/// Values of the velocity terms.
fn paid(target: f64, velocity: f64) -> [f64; 2] {
    let off = (target - velocity).abs();
    [(-4.0 * off * off).exp(), 4.0 - off]
}

/// With an adversary, its action is the command from the next decision on. The figure observes and earns the same as
/// without one, and the adversary earns the velocity error.
#[test]
fn an_adversary_commands() {
    for id in ["HopperController-v0", "WalkerController-v0"] {
        for input in ["discrete", "continuous"] {
            let plain = env(id, input).spec().clone();
            let given = Options::new().with("input", input).with("commander", "adversary");
            let options =
                VecEnvOptions { agents: AGENTS, options: given, autoreset: Autoreset::Disabled, ..Default::default() };
            let mut env = VecEnv::new(id, &options).unwrap();
            let spec = env.spec().clone();
            let [runner, commander] = &spec.roles[..] else { panic!("two roles: {:?}", spec.roles) };
            let buttons = usize::from(input == "discrete");
            assert_eq!((runner.obs.clone(), runner.act.clone()), (0..plain.obs, 0..plain.act), "{id} {input}");
            assert_eq!(commander.act, plain.act..plain.act + 1 + buttons);
            assert!(commander.intermittent && spec.command.is_empty());
            // `info` shows the adversary's command
            let infos = 2 + buttons;
            assert_eq!(spec.info, ["velocity_error", "told_velocity", "told_jump"][..infos]);
            assert_eq!(spec.reward_terms[runner.terms.clone()], [&plain.reward_terms[..8], &["fall".into()]].concat());
            assert_eq!(spec.reward_terms[commander.terms.clone()], ["disobedience", "felled"]);

            let (n, act, k) = (spec.obs, spec.act, spec.reward_terms.len());
            let mut out = env.buffers();
            env.reset(Some(1), &mut out.obs).unwrap();
            let (mut told, mut fallen) = ([[0.0; 2]; AGENTS], [false; AGENTS]);
            // indices of command, velocity and target in the figure's observation
            let own = plain.obs - 3 - 2 * buttons;
            let (at, target) = (own + 1 + buttons, own + 2 + buttons);
            let mut targets: Vec<f64> = out.obs.chunks_exact(n).map(|obs| f64::from(obs[target])).collect();
            let mut actions = vec![0.0; AGENTS * act];
            for decision in 0..80 {
                for (i, row) in actions.chunks_exact_mut(act).enumerate() {
                    action(i, decision, 1.0, &mut row[..plain.act]);
                    row[plain.act..].fill([0.1, 0.5, -0.3, -1.0][(i + decision / 7) % 4]);
                }
                env.step(&actions, &mut out).unwrap();
                for i in 0..AGENTS {
                    let (obs, terms) = (&out.obs[n * i..n * (i + 1)], &out.terms[k * i..k * (i + 1)]);
                    let said = f64::from(actions[act * i + plain.act]);
                    let pressed = f64::from(u8::from(said > 0.2));
                    let next = match input {
                        "discrete" => [4.0 * (pressed - f64::from(u8::from(said < -0.2))), pressed],
                        _ => [4.0 * said, 0.0],
                    };
                    let mean = f64::from(obs[at]);
                    targets[i] = follow(targets[i], told[i][0], spec.dt);
                    let off = (told[i][0] - mean).abs();
                    let near = |got: f32, expected: f64| (f64::from(got) - expected).abs() < 1e-4;
                    if !fallen[i] {
                        assert!(near(obs[own], next[0]) && (buttons == 0 || near(obs[own + 1], next[1])));
                        assert!(near(obs[plain.obs], next[0]) && near(obs[plain.obs + 1], next[1]));
                        assert!(near(obs[target], targets[i]), "{id} {input}, agent {i}");
                        let [velocity, pace] = paid(targets[i], mean);
                        assert!(
                            (f64::from(terms[0]) - velocity).abs() < 1e-3 && near(terms[1], pace),
                            "{id} {input}, agent {i}"
                        );
                        let info = &out.info[infos * i..infos * (i + 1)];
                        assert!(near(terms[9], off / 4.0) && near(info[0], off));
                        assert!(info[1..].iter().zip(told[i]).all(|(got, expected)| near(*got, expected)));
                        let down = out.terminated[i];
                        let expected = if down { [-40.0, 10.0] } else { [0.0; 2] };
                        assert_eq!([terms[8], terms[10]], expected, "{id} {input}, agent {i}");
                        assert!(near(out.reward[i], terms[..9].iter().map(|x| f64::from(*x)).sum()));
                    }
                    told[i] = next;
                    fallen[i] |= out.terminated[i];
                }
            }
            assert!(fallen.iter().any(|f| *f), "{id}: no agent has fallen");
        }
    }
}
