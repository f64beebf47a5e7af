//! The commanded Ant. It observes its command and its body relative to its heading. The commanded direction turns as
//! commanded and waits. The reward is the documented formula, and lying on its back is a failure.

use crate::common::{action, make};
use marathon_envs::{AgentState, Autoreset, agent};
use marathon_motion::dynamics::Motion;
use marathon_motion::kinematics::Pose;
use marathon_physics::Model;
use marathon_physics::lanes::Isa;
use marathon_physics::model::Geom;

const ID: &str = "AntController-v0";
const AGENTS: usize = 24;

/// Rows of the torso's rotation matrix. Its forward axis is the first column.
fn rotation(state: &AgentState) -> [[f64; 3]; 3] {
    let [w, x, y, z] = state.qpos[3..7] else { panic!("a free joint") };
    [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
        [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
        [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
    ]
}

fn heading(state: &AgentState) -> f64 {
    let r = rotation(state);
    r[1][0].atan2(r[0][0])
}

fn wrapped(angle: f64) -> f64 {
    angle.sin().atan2(angle.cos())
}

/// A ground vector in axes rotated by an angle.
fn seen_from(angle: f64, [x, y]: [f64; 2]) -> [f64; 2] {
    let (sin, cos) = angle.sin_cos();
    [cos * x + sin * y, cos * y - sin * x]
}

fn motion(model: &Model, state: &AgentState) -> Motion {
    Motion::of(model, &state.qpos, &state.qvel, &vec![0.0; model.nv])
}

#[test]
fn observation_reward_and_direction_are_those_of_the_page() {
    let mut env = make(ID, AGENTS, 1, Some(Isa::F64), Autoreset::Disabled);
    let model = agent(ID).unwrap().model().unwrap();
    let spec = env.spec().clone();
    let (n, act, k, dt) = (spec.obs, spec.act, spec.reward_terms.len(), spec.dt);
    assert_eq!((n, act), (35, 8));
    let told = |agent: usize| {
        let x = agent as f64 / AGENTS as f64;
        // a third stands, a third moves without turning, a third turns at the highest rate
        [[0.0; 3], [3.0 * x, -2.0 * x, 0.0], [-3.0 * x, 2.0 * x, std::f64::consts::FRAC_PI_2]][agent % 3]
    };
    for agent in 0..AGENTS {
        env.set_command(agent, Some(&told(agent))).unwrap();
    }
    let mut out = env.buffers();
    env.reset(Some(5), &mut out.obs).unwrap();
    let mut directions: Vec<f64> = (0..AGENTS).map(|i| heading(&env.state(i).unwrap())).collect();
    let (mut over, mut rested, mut waited) = ([false; AGENTS], 0.0f64, 0);
    let mut actions = vec![0.0; AGENTS * act];
    for decision in 0..150 {
        for (agent, row) in actions.chunks_exact_mut(act).enumerate() {
            action(agent, decision, if agent < 6 { 0.0 } else { 1.0 }, row);
        }
        env.step(&actions, &mut out).unwrap();
        for i in 0..AGENTS {
            over[i] |= out.terminated[i];
            if over[i] {
                continue;
            }
            let (state, [speed, left, turn]) = (env.state(i).unwrap(), told(i));
            let (motion, facing) = (motion(&model, &state), heading(&state));
            let behind = wrapped(directions[i] - facing) + turn * dt;
            waited += usize::from(behind > 1.0);
            let off = behind.clamp(-1.0, 1.0);
            directions[i] = facing + off;

            let obs: Vec<f64> = out.obs[n * i..n * (i + 1)].iter().map(|x| f64::from(*x)).collect();
            let r = rotation(&state);
            let up = seen_from(facing, [r[0][2], r[1][2]]);
            let velocity = seen_from(facing, [state.qvel[0], state.qvel[1]]);
            let spin = [0, 1, 2].map(|row| (0..3).map(|c| r[row][c] * state.qvel[3 + c]).sum::<f64>());
            let turning = seen_from(facing, [spin[0], spin[1]]);
            let mut expected = vec![speed, left, turn, off.sin(), off.cos(), state.qpos[2]];
            expected.extend([up[0], up[1], r[2][2], velocity[0], velocity[1], state.qvel[2]]);
            expected.extend([turning[0], turning[1], spin[2]]);
            for (j, (got, expected)) in obs.iter().zip(&expected).enumerate() {
                assert!(
                    (got - expected).abs() < 1e-5 * (1.0 + expected.abs()),
                    "agent {i}, number {j}: {got} {expected}"
                );
            }
            assert!(obs[15..19].iter().all(|touch| *touch == 0.0 || *touch == 1.0));
            for (got, expected) in obs[19..].iter().zip(state.qpos[7..].iter().chain(&state.qvel[6..])) {
                assert!((got - expected).abs() < 1e-5 * (1.0 + expected.abs()));
            }

            let (_, center, _) = motion.momentum(&model);
            let going = seen_from(directions[i], [center.x, center.y]);
            let slip = (going[0] - speed).hypot(going[1] - left);
            // the twelve capsules and the torso
            let velocities = part_velocities(&model, &state, &motion);
            assert_eq!(velocities.len(), 13);
            let squares: Vec<f64> = velocities.iter().map(|v| v.iter().map(|x| x * x).sum()).collect();
            let square = squares.iter().sum::<f64>() / squares.len() as f64;
            let still: f64 = [0.4, 0.04, 0.004].iter().map(|most| (-square / most).exp()).sum();
            let still = if i % 3 == 0 { 0.3 * still } else { 0.0 };
            rested = rested.max(still);
            let effort: f64 =
                actions[act * i..act * (i + 1)].iter().map(|a| f64::from(a * a)).sum::<f64>() / act as f64;
            let near = |x: f64, scale: f64| (-scale * x * x).exp();
            let expected =
                [near(slip, 4.0), -0.5 * slip, 0.5 * near(off, 4.0), -0.5 * off.abs(), still, -0.05 * effort];
            for (j, expected) in expected.into_iter().enumerate() {
                let got = f64::from(out.terms[k * i + j]);
                assert!((got - expected).abs() < 1e-4, "agent {i}, {decision}, term {j}: {got}, expected {expected}");
            }
            let info = &out.info[spec.info.len() * i..];
            assert!((f64::from(info[0]) - slip).abs() < 1e-4 && (f64::from(info[1]) - off.abs()).abs() < 1e-4);
        }
    }
    assert!(rested > 0.1 && waited > 10, "{rested} {waited}");
}

/// Velocities of the geoms' centers, m/s.
fn part_velocities(model: &Model, state: &AgentState, motion: &Motion) -> Vec<[f64; 3]> {
    let pose = Pose::of(model, &state.qpos);
    let of_geom = |geom: &Geom| {
        let (body, mut local) = (geom.body, pose.pos[0]);
        [local.x, local.y, local.z] = geom.pos;
        let arm = pose.quat[body] * local + pose.pos[body] - motion.com[body];
        (motion.velocity[body] + motion.spin[body].cross(arm)).to_array()
    };
    model.geoms.iter().filter(|geom| geom.body != 0).map(of_geom).collect()
}

#[test]
fn on_its_back_it_has_failed() {
    let mut env = make(ID, 2, 1, None, Autoreset::Disabled);
    let mut out = env.buffers();
    env.reset(Some(1), &mut out.obs).unwrap();
    let mut state = env.state(1).unwrap();
    state.qpos[2] = 0.6;
    state.qpos[3..7].copy_from_slice(&[0.0, 1.0, 0.0, 0.0]);
    env.set_state(1, &state).unwrap();
    env.step(&[0.0; 16], &mut out).unwrap();
    assert_eq!((out.terminated[0], out.terminated[1]), (false, true));
    assert_eq!(out.reward[1], -1.0);
}

#[test]
fn its_schedule_draws_all_there_is() {
    let mut env = make(ID, 200, 1, None, Autoreset::Disabled);
    let mut out = env.buffers();
    env.reset(Some(1), &mut out.obs).unwrap();
    let n = env.spec().obs;
    let commands: Vec<&[f32]> = out.obs.chunks_exact(n).map(|obs| &obs[..3]).collect();
    let share = |is: &dyn Fn(&&[f32]) -> bool| commands.iter().copied().filter(is).count() as f64 / 200.0;
    let standing = share(&|c| c.iter().all(|x| *x == 0.0));
    let straight = share(&|c| c[0] != 0.0 && c[1] == 0.0);
    assert!((0.08..0.24).contains(&standing) && (0.24..0.45).contains(&straight), "{standing} {straight}");
    for (i, most) in [(0, 3.0), (1, 2.0), (2, std::f32::consts::FRAC_PI_2)] {
        let ends = commands.iter().fold([0.0f32; 2], |[low, high], c| [low.min(c[i]), high.max(c[i])]);
        assert!(ends[0] < -0.9 * most && ends[0] >= -most && ends[1] > 0.9 * most && ends[1] <= most, "{i}: {ends:?}");
    }
}
