//! A crate that depends on this one can add an agent, with the same features as the built-in ones.
//!
//! The agent here is a probe. It observes the result of every helper of the library, and the test computes the same
//! numbers from the state in plain double precision. An agent with a wrong description is rejected with a helpful
//! message.

use crate::common;
use std::f64::consts::PI;
use std::sync::Arc;

use crate::common::{action, isas};
use marathon_envs::memory::Average;
use marathon_envs::senses::{angle, clamp, unit};
use marathon_envs::{
    Agent, AgentState, Autoreset, Facts, Motors, Obs, Part, Registry, ResetNoise, Senses, Start, Terms, VecEnv,
    VecEnvOptions, names,
};
use marathon_physics::lanes::Real;

/// A ball with an arm on a hinge and a tail on a rail, high above the floor.
const MODEL: &str = r#"
<mujoco model="probe">
  <option timestep="0.004" gravity="0 0 0"/>
  <worldbody>
    <geom name="floor" type="plane" size="0 0 1" contype="0" conaffinity="1"/>
    <body name="ball" pos="0 0 2">
      <freejoint/>
      <geom name="ball" size="0.2" contype="1" conaffinity="0"/>
      <body name="arm" pos="0.3 0 0">
        <joint name="shoulder" axis="0 1 0" damping="1" armature="0.1"/>
        <geom name="arm" type="capsule" fromto="0 0 0 0.4 0 0" size="0.05" contype="1" conaffinity="0"/>
      </body>
      <body name="tail" pos="-0.3 0 0">
        <joint name="rail" type="slide" axis="1 0 0" damping="1" armature="0.1"/>
        <geom name="tail" size="0.05" contype="1" conaffinity="0"/>
      </body>
    </body>
  </worldbody>
  <actuator>
    <motor name="shoulder" joint="shoulder" gear="1"/>
    <motor name="rail" joint="rail" gear="1"/>
  </actuator>
</mujoco>"#;

const PARTS: [&str; 2] = ["ball", "arm"];
const BALL: Part = Part::named(&PARTS, "ball");
const ARM: Part = Part::named(&PARTS, "arm");
const ACTIONS: [&str; 2] = ["shoulder", "rail"];
const SHOULDER: Motors = Motors::named(&ACTIONS, &["shoulder"]);

#[derive(Clone)]
struct Probe(Facts);

fn facts() -> Facts {
    Facts {
        id: "Probe-v0".into(),
        summary: "observes what the helpers say".into(),
        model: MODEL.into(),
        frame_skip: 2,
        max_episode_steps: 30,
        observation: Some(32),
        actions: names(ACTIONS),
        reward_terms: names(["speed", "average"]),
        parts: names(PARTS),
        feet: names(["ball"]),
        touch: names(["arm"]),
        memory: Average::SLOTS,
        termination_reward: Some(-5.0),
        ..Facts::default()
    }
}

impl Agent for Probe {
    fn facts(&self) -> Facts {
        self.0.clone()
    }

    fn reset(&self, start: &mut Start) {
        start.add_noise(ResetNoise { joint_position: 0.3, joint_velocity: 0.5, root_velocity: 2.0 });
    }

    #[inline(always)]
    fn observe<T: Real>(&self, s: &Senses<T>, out: &mut Obs<T>) {
        out.vector(s.position(BALL));
        out.vector(s.linear_velocity(BALL));
        out.vector(s.linear_velocity(ARM));
        out.scalar(s.velocity(BALL));
        out.scalar(s.normalized_velocity(BALL, 2.0));
        out.scalar(s.forward_bonus(BALL));
        out.scalar(s.upright_bonus(BALL));
        out.scalar(s.forward_bonus_of(ARM, 1.0));
        out.scalar(s.upright_bonus_of(ARM, 2.0));
        out.scalar(s.left_bonus(BALL));
        out.scalar(s.right_bonus(BALL));
        out.scalar(s.flexion(ARM));
        out.scalar(s.height(ARM));
        out.scalar(s.height_penalty(BALL, 2.01));
        out.scalar(s.effort(Motors::NONE));
        out.scalar(s.effort(SHOULDER));
        out.scalar(s.effort_mean(Motors::NONE));
        out.scalar(s.effort_sum(Motors::NONE));
        out.scalar(s.joints_at_limit_penalty(Motors::NONE));
        out.scalar(s.joints_at_limit_penalty(SHOULDER));
        out.touch_sensors(s);
        out.scalar(s.joint_velocity(1));
        let [x, y, z, w] = s.joint_rotation(0);
        out.vector([x, y, z]);
        out.scalar(w);
    }

    #[inline(always)]
    fn remember<T: Real>(&self, s: &Senses<T>, memory: &mut [T]) {
        Average::update(memory, s.velocity(BALL));
    }

    #[inline(always)]
    fn step_reward<T: Real>(&self, s: &Senses<T>, terms: &mut Terms<T>) {
        terms.add("speed", 2.0, s.velocity(BALL));
        terms.add("average", 1.0, s.memory(Average::MEAN));
    }

    #[inline(always)]
    fn terminated<T: Real>(&self, s: &Senses<T>) -> T::Mask {
        T::or(s.terminate_never(), s.terminate_on_non_foot_contact())
    }
}

fn registry() -> Registry {
    let mut registry = Registry::default();
    registry.register(Arc::new(Probe(facts()))).unwrap_or_else(|e| panic!("{e}"));
    registry
}

fn make(agents: usize) -> VecEnv {
    VecEnv::from_registry(&registry(), "probe", &VecEnvOptions { agents, seed: 2, ..Default::default() }).unwrap()
}

/// `v` rotated by a unit quaternion w x y z.
fn turn(q: &[f64], v: [f64; 3]) -> [f64; 3] {
    let [w, x, y, z] = [q[0], q[1], q[2], q[3]];
    let r = [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
        [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
        [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
    ];
    r.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
}

fn degrees(u: [f64; 3], v: [f64; 3]) -> f64 {
    (u[0] * v[0] + u[1] * v[1] + u[2] * v[2]).clamp(-1.0, 1.0).acos().to_degrees()
}

/// The probe's observation by textbook formulas.
fn expected(state: &AgentState, action: &[f32]) -> Vec<f64> {
    let (q, v) = (&state.qpos, &state.qvel);
    let (root, shoulder) = (&q[3..7], q[7]);
    let ball = [q[0], q[1], q[2]];
    let (forward, up) = (turn(root, [1.0, 0.0, 0.0]), turn(root, [0.0, 0.0, 1.0]));
    // the arm rotates about the ball's y axis; its capsule's center is 0.2 along its x axis
    let (s, c) = shoulder.sin_cos();
    let (arm_forward, arm_up) = (turn(root, [c, 0.0, -s]), turn(root, [s, 0.0, c]));
    let arm = turn(root, [0.3 + 0.2 * c, 0.0, -0.2 * s]);
    let spin = turn(root, [v[3], v[4], v[5]]);
    let swing = turn(root, [-0.2 * s * v[6], 0.0, -0.2 * c * v[6]]);
    let cross =
        [spin[1] * arm[2] - spin[2] * arm[1], spin[2] * arm[0] - spin[0] * arm[2], spin[0] * arm[1] - spin[1] * arm[0]];
    let a: Vec<f64> = action.iter().map(|x| f64::from(*x).clamp(-1.0, 1.0)).collect();
    let at_limit = |i: usize| if a[i].abs() >= 1.0 { 0.2 } else { 0.0 };
    let sideways = forward[1].asin().to_degrees();
    let mut out = vec![];
    out.extend(ball);
    out.extend([v[0], v[1], v[2]]);
    out.extend([0, 1, 2].map(|i| v[i] + cross[i] + swing[i]));
    out.push(v[0] / 4.0);
    out.push((v[0] / 2.0).clamp(0.0, 1.0));
    out.push(0.5 - degrees(forward, [1.0, 0.0, 0.0]) / 180.0);
    out.push(0.5 - degrees(up, [0.0, 0.0, 1.0]) / 180.0);
    out.push(1.0 - 2.0 * degrees(arm_forward, [1.0, 0.0, 0.0]) / 180.0);
    out.push(2.0 - 4.0 * degrees(arm_up, [0.0, 0.0, 1.0]) / 180.0);
    out.extend([sideways / 180.0, -sideways / 180.0]);
    out.push(arm_forward[2].asin().to_degrees() / 90.0);
    out.push(ball[2] + arm[2]);
    out.push((2.01 - ball[2]).clamp(0.0, 2.01));
    let (e0, e1) = (a[0] * a[0], a[1] * a[1]);
    out.extend([e0 + e1, e1, (e0 + e1) / 2.0, a[0].abs() + a[1].abs(), at_limit(0) + at_limit(1), at_limit(1)]);
    out.push(0.0);
    out.push(v[7]);
    // the parent relative to the child: minus the angle
    let (half_s, half_c) = (-shoulder / 2.0).sin_cos();
    let sign = if half_c < 0.0 { -1.0 } else { 1.0 };
    out.extend([0.0, sign * half_s, 0.0, sign * half_c]);
    out
}

#[test]
fn every_helper_is_its_formula() {
    for isa in isas() {
        let options =
            VecEnvOptions { agents: 40, isa: Some(isa), autoreset: Autoreset::Disabled, ..Default::default() };
        let mut env = VecEnv::from_registry(&registry(), "Probe-v0", &options).unwrap();
        let mut out = env.buffers();
        env.reset(Some(4), &mut out.obs).unwrap();
        // all orientations, angular velocities and arm angles
        let mut noise = common::Noise::new(8);
        for agent in 0..40 {
            let mut state = env.state(agent).unwrap();
            for x in &mut state.qpos[3..8] {
                *x = f64::from(noise.next()) * 3.0;
            }
            for x in &mut state.qvel {
                *x = f64::from(noise.next()) * 2.0;
            }
            env.set_state(agent, &state).unwrap();
        }
        let mut averages = vec![Vec::new(); 40];
        for t in 0..12 {
            let mut actions = vec![0.0; 40 * 2];
            for (agent, row) in actions.chunks_exact_mut(2).enumerate() {
                action(agent, t, 1.5, row);
            }
            env.step(&actions, &mut out).unwrap();
            for agent in 0..40 {
                let state = env.state(agent).unwrap();
                let place = format!("{}, agent {agent}, decision {t}", isa.name());
                let theirs = expected(&state, &actions[agent * 2..][..2]);
                assert_eq!(theirs.len(), 32);
                for (i, (x, y)) in out.obs[agent * 32..][..32].iter().zip(&theirs).enumerate() {
                    // single precision; angles near 0 and 180 degrees are as sensitive as a square root
                    assert!((f64::from(*x) - y).abs() < 1e-4, "{place}, observation {i}: {x}, expected {y}");
                }
                averages[agent].push(state.qvel[0] / 4.0);
                let last = &averages[agent][averages[agent].len().saturating_sub(9)..];
                let mean = last.iter().sum::<f64>() / last.len() as f64;
                let terms = [state.qvel[0] / 2.0, mean, 0.0];
                for (x, y) in out.terms[agent * 3..][..3].iter().zip(terms) {
                    assert!((f64::from(*x) - y).abs() < 1e-5, "{place}: {x}, expected {y}");
                }
            }
        }
    }
}

#[test]
fn angles_are_exact_where_an_arc_cosine_is_not() {
    let tiny = 1e-4_f64;
    let measured = angle::<f64>([tiny.cos(), tiny.sin(), 0.0], [1.0, 0.0, 0.0]);
    assert!((measured / tiny - 1.0).abs() < 1e-9, "{measured}");
    assert!((angle::<f64>([-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]) - PI).abs() < 1e-12);
    let single = angle::<f32>([1.0, 1e-4, 0.0], [1.0, 0.0, 0.0]);
    assert!((single / 1e-4 - 1.0).abs() < 1e-5, "{single}");
    assert_eq!((clamp(3.0_f64, -1.0, 2.0), unit(-0.5_f64), unit(0.25_f64)), (2.0, 0.0, 0.25));
}

#[test]
fn failure_and_time_limit_are_the_agents_own() {
    let mut env = make(3);
    let mut out = env.buffers();
    env.reset(None, &mut out.obs).unwrap();
    // the arm hits the floor in one agent; the ball is a foot and may touch it
    for (agent, height, pitch) in [(0, 0.1, PI), (1, 0.1, 0.0)] {
        let mut state = env.state(agent).unwrap();
        state.qpos[2] = height + 0.1;
        state.qpos[3..7].copy_from_slice(&[1.0, 0.0, 0.0, 0.0]);
        state.qpos[7] = if pitch == 0.0 { -1.0 } else { 1.0 };
        state.qvel.fill(0.0);
        env.set_state(agent, &state).unwrap();
    }
    env.step(&[0.0; 6], &mut out).unwrap();
    assert_eq!(out.terminated, [true, false, false]);
    assert_eq!((out.reward[0], &out.terms[..3]), (-5.0, &[0.0, 0.0, -5.0][..]));
    for t in 2..=30 {
        env.step(&[0.0; 6], &mut out).unwrap();
        assert_eq!(out.truncated[2], t == 30, "decision {t}");
    }
}

/// Other tests read the registry of this process, so this one has a process of its own.
#[test]
fn the_global_registry_takes_agents_of_other_crates() {
    let program = std::env::current_exe().expect("this program");
    let name = "an_agent_of_ones_own::registered_in_a_process_of_its_own";
    let output = std::process::Command::new(program).args(["--ignored", "--exact", name]).output().expect("it runs");
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success() && text.contains("1 passed"), "{text}");
}

#[test]
#[ignore = "the test above runs it"]
fn registered_in_a_process_of_its_own() {
    let mine = Facts { id: "Global-v3".into(), ..facts() };
    marathon_envs::register(Arc::new(Probe(mine.clone()))).unwrap();
    assert!(marathon_envs::ids().contains(&"Global-v3".to_string()));
    let env = VecEnv::new("global", &VecEnvOptions::default()).unwrap();
    assert_eq!((env.spec().id.as_str(), env.spec().obs), ("Global-v3", 32));
    let again = marathon_envs::register(Arc::new(Probe(mine))).unwrap_err().to_string();
    assert!(again.contains("registered already") && again.contains("'Global-v0'"), "{again}");
}

#[test]
fn a_wrong_description_is_refused_with_a_helpful_message() {
    let refuse = |facts: Facts| Registry::empty().register(Arc::new(Probe(facts))).unwrap_err().to_string();
    for (facts, message) in [
        (Facts { observation: Some(30), ..facts() }, "agent 'Probe-v0': it observes 32 numbers, but its facts say 30"),
        (Facts { observation: Some(40), ..facts() }, "agent 'Probe-v0': it observes 32 numbers, but its facts say 40"),
        (
            Facts { reward_terms: names(["speed", "mean"]), ..facts() },
            r#"agent 'Probe-v0': it adds the reward terms ["speed", "average"], but its facts say ["speed", "mean"]"#,
        ),
        (
            Facts { touch: names(["amr"]), ..facts() },
            "agent 'Probe-v0': touch sensor 'amr' is not a geom of its model; did you mean 'arm'? known: ball, arm, tail",
        ),
        (
            Facts { actions: names(["rail", "shoulder"]), ..facts() },
            r#"agent 'Probe-v0': its actions are ["rail", "shoulder"], but the actuators of its model are ["shoulder", "rail"]"#,
        ),
        (Facts { frame_skip: 0, ..facts() }, "agent 'Probe-v0': frame_skip is 0, expected at least 1"),
    ] {
        assert_eq!(refuse(facts), message);
    }
    let broken = refuse(Facts { model: "<mujoco><worldbody></mujoco>".into(), ..facts() });
    assert!(broken.starts_with("model of agent 'Probe-v0': "), "{broken}");
}
