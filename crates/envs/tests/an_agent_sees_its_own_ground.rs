//! The height of the ground at any point is that of the surface that the physics collides with, including its
//! triangles. Each agent observes its own ground, at points relative to its heading.

use std::sync::Arc;

use crate::common::{Noise, isas};
use marathon_envs::{Agent, AgentState, Facts, Obs, Part, Registry, Senses, Terms, VecEnv, VecEnvOptions, names};
use marathon_physics::lanes::{Isa, Real};

const MODEL: &str = r#"
<mujoco>
  <asset>
    <hfield name="hills" nrow="5" ncol="7" size="3 2 1 0.5"/>
  </asset>
  <worldbody>
    <geom name="ground" type="hfield" hfield="hills" pos="0.5 -0.25 0.125" euler="0 0 30" contype="0" conaffinity="1"/>
    <body name="eye" pos="0 0 6">
      <freejoint/>
      <geom name="eye" size="0.1" contype="1" conaffinity="0"/>
      <body name="tail"><joint name="tail" axis="0 1 0"/><geom name="tail" size="0.05" pos="-0.3 0 0" contype="0" conaffinity="0"/></body>
    </body>
    FLOOR
  </worldbody>
  <actuator><motor name="tail" joint="tail"/></actuator>
</mujoco>"#;

const EYE: Part = Part::named(&["eye"], "eye");
const POINTS: [[f64; 2]; 3] = [[0.0, 0.0], [0.5, 0.0], [0.25, -0.75]];

/// It observes its position, the ground height below it, and a height scan.
struct Eye {
    floor: bool,
}

impl Agent for Eye {
    fn facts(&self) -> Facts {
        let floor = r#"<geom name="floor" type="plane" size="0 0 1" pos="0 0 -0.25" contype="0" conaffinity="1"/>"#;
        Facts {
            id: if self.floor { "EyeAboveFloor-v0" } else { "Eye-v0" }.into(),
            model: MODEL.replace("FLOOR", if self.floor { floor } else { "" }).into(),
            reward_terms: names(["none"]),
            parts: names(["eye"]),
            ..Facts::default()
        }
    }

    #[inline(always)]
    fn observe<T: Real>(&self, s: &Senses<T>, out: &mut Obs<T>) {
        let [x, y, z] = s.position(EYE);
        out.vector([x, y, z]);
        out.scalar(s.ground_height(x, y));
        out.height_scan(s, EYE, &POINTS);
    }

    #[inline(always)]
    fn step_reward<T: Real>(&self, _: &Senses<T>, terms: &mut Terms<T>) {
        terms.add("none", 1.0, T::zero());
    }

    #[inline(always)]
    fn terminated<T: Real>(&self, s: &Senses<T>) -> T::Mask {
        s.terminate_never()
    }
}

const OBS: usize = 4 + POINTS.len();

fn eyes(floor: bool, agents: usize, isa: Isa) -> VecEnv {
    let mut registry = Registry::empty();
    registry.register(Arc::new(Eye { floor })).unwrap_or_else(|e| panic!("{e}"));
    let options = VecEnvOptions { agents, isa: Some(isa), ..Default::default() };
    let id = registry.ids()[0].clone();
    VecEnv::from_registry(&registry, &id, &options).unwrap_or_else(|e| panic!("{e}"))
}

/// Hills of one agent.
fn hills(agent: usize) -> Vec<f32> {
    let mut noise = Noise::new(agent as u64);
    (0..35).map(|_| 0.5 + 0.5 * noise.next()).collect()
}

/// Moves an agent to a point, with a yaw.
fn put(env: &mut VecEnv, agent: usize, [x, y]: [f64; 2], yaw: f64) {
    let (s, c) = (0.5 * yaw).sin_cos();
    let state = AgentState { qpos: vec![x, y, 6.0, c, 0.0, 0.0, s, 0.0], qvel: vec![0.0; 7] };
    env.set_state(agent, &state).unwrap_or_else(|e| panic!("{e}"));
}

fn look(env: &mut VecEnv) -> Vec<f32> {
    let mut obs = vec![0.0; env.agents() * OBS];
    env.observe(&vec![true; env.agents()], &mut obs).unwrap_or_else(|e| panic!("{e}"));
    obs
}

/// Height of hills at a point of the field's frame, from the triangles' corners in double precision.
fn surface(heights: &[f32], [x, y]: [f64; 2]) -> f64 {
    let (column, row) = ((x + 3.0).clamp(0.0, 6.0), (y + 2.0).clamp(0.0, 4.0));
    let (c, r) = ((column as usize).min(5), (row as usize).min(3));
    let (u, v) = (column - c as f64, row - r as f64);
    let at = |c: usize, r: usize| f64::from(heights[r * 7 + c]);
    let (a, b) = (at(c, r), at(c + 1, r + 1));
    if u > v { (1.0 - u) * a + (u - v) * at(c + 1, r) + v * b } else { (1.0 - v) * a + (v - u) * at(c, r + 1) + u * b }
}

/// A point of the world in the field's frame.
fn in_field([x, y]: [f64; 2]) -> [f64; 2] {
    let (s, c) = 30.0_f64.to_radians().sin_cos();
    let (dx, dy) = (x - 0.5, y + 0.25);
    [c * dx + s * dy, c * dy - s * dx]
}

#[test]
fn the_ground_is_as_high_as_its_triangles() {
    const N: usize = 20;
    for floor in [false, true] {
        for isa in isas() {
            let mut env = eyes(floor, N, isa);
            let mut noise = Noise::new(3);
            let mut covered = 0;
            for agent in 0..N {
                env.set_ground(agent, 0, &hills(agent)).expect("the field's grid");
            }
            for _ in 0..20 {
                let places: Vec<[f64; 2]> =
                    (0..N).map(|_| [4.0, 3.0].map(|reach| f64::from(noise.next()) * reach)).collect();
                let yaws: Vec<f64> = (0..N).map(|_| 3.0 * f64::from(noise.next())).collect();
                for agent in 0..N {
                    put(&mut env, agent, places[agent], yaws[agent]);
                }
                for (agent, seen) in look(&mut env).chunks(OBS).enumerate() {
                    let ground = |place: [f64; 2]| {
                        let [x, y] = in_field(place);
                        let on = x.abs() < 3.0 && y.abs() < 2.0;
                        let hills = 0.125 + surface(&hills(agent), [x, y]);
                        if on || !floor { hills } else { -0.25 }
                    };
                    let [x, y] = in_field(places[agent]);
                    covered += usize::from(x.abs() < 3.0 && y.abs() < 2.0);
                    let expected = ground(places[agent]);
                    assert!((f64::from(seen[3]) - expected).abs() < 1e-5, "{}: {} {expected}", isa.name(), seen[3]);
                    // ahead and to the left
                    let (s, c) = yaws[agent].sin_cos();
                    for (k, [ahead, left]) in POINTS.into_iter().enumerate() {
                        let [x, y] = places[agent];
                        let near = [x + c * ahead - s * left, y + s * ahead + c * left];
                        let [u, v] = in_field(near);
                        // in single precision, a point may be on the other side of the border
                        if (u.abs() - 3.0).abs() > 1e-4 && (v.abs() - 2.0).abs() > 1e-4 {
                            let expected = ground(near) - 6.0;
                            let found = f64::from(seen[4 + k]);
                            assert!((found - expected).abs() < 1e-5, "{}: {found} {expected}", isa.name());
                        }
                    }
                }
            }
            assert!((100..390).contains(&covered), "{covered} of 400 places lie on the field");
        }
    }
}

/// The observed ground supports the agent: a ball that falls on the hills comes to rest on them.
#[test]
fn the_observed_ground_supports_the_agent() {
    let mut env = eyes(true, 1, Isa::best());
    // a valley along y, so that the ball does not roll away
    let valley: Vec<f32> = (0..35).map(|k| 0.5 + 0.25 * ((k % 7) as f32 - 3.0).abs()).collect();
    env.set_ground(0, 0, &valley).expect("the field's grid");
    let state = AgentState { qpos: vec![0.5, -0.25, 1.2, 1.0, 0.0, 0.0, 0.0, 0.0], qvel: vec![0.0; 7] };
    env.set_state(0, &state).unwrap_or_else(|e| panic!("{e}"));
    let mut out = env.buffers();
    for _ in 0..900 {
        env.step(&[0.0], &mut out).expect("the arrays fit");
    }
    let [z, ground] = [out.final_obs[2], out.final_obs[3]];
    // it rests on both slopes, its center higher than its radius by the factor below
    let rest = 0.1 * (1.0_f32 + 0.0625).sqrt();
    assert!((z - ground - rest).abs() < 0.02 && (ground - 0.625).abs() < 0.02, "{z} above {ground}");
}
