//! Shared by the tests of this crate.

pub mod courses;
#[path = "../../../physics/tests/common/numbers.rs"]
pub mod numbers;

#[path = "../../../physics/tests/common/oracle.rs"]
mod oracle;

use marathon_envs::{AgentState, Autoreset, Options, Step, VecEnv, VecEnvOptions};
use marathon_motion::kinematics::Pose;
use marathon_physics::Model;
use marathon_physics::lanes::Isa;
pub use oracle::{oracle, package, scratch};

/// The suite's own agents, whose rewards end with a termination term.
pub fn own_agents() -> Vec<String> {
    let own = |id: &String| marathon_envs::agent(id).is_ok_and(|agent| agent.facts().termination_reward.is_some());
    marathon_envs::ids().into_iter().filter(own).collect()
}

/// Arguments of a task, as on a command line.
pub fn options(list: &[(&str, &str)]) -> Options {
    let read = |text: &str| text.parse::<marathon_envs::Value>().unwrap_or_else(|never| match never {});
    list.iter().map(|(name, value)| (name.to_string(), read(value))).collect()
}

/// Instruction sets of this processor.
pub fn isas() -> impl Iterator<Item = Isa> {
    Isa::ALL.into_iter().filter(|isa| isa.supported())
}

/// A fixed sequence of numbers in [-1, 1) that are exact in single precision.
pub struct Noise(u64);

impl Noise {
    pub fn new(seed: u64) -> Self {
        Noise(seed ^ 0x9e37_79b9_7f4a_7c15)
    }

    pub fn next(&mut self) -> f32 {
        // the generator of Knuth's MMIX; its upper bits suffice for test inputs
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) as f32 / (1 << 23) as f32 - 1.0
    }
}

/// Action of an agent at a decision. It depends on these numbers only, so it is the same in any batch.
pub fn action(agent: usize, decision: usize, scale: f32, row: &mut [f32]) {
    let mut noise = Noise::new((agent as u64) << 32 | decision as u64);
    noise.next();
    for a in row {
        *a = scale * noise.next();
    }
}

/// An environment with default arguments.
pub fn make(id: &str, agents: usize, threads: usize, isa: Option<Isa>, autoreset: Autoreset) -> VecEnv {
    let options = VecEnvOptions { agents, seed: 11, threads, isa, autoreset, ..Default::default() };
    VecEnv::new(id, &options).unwrap_or_else(|e| panic!("{e}"))
}

/// An environment of `agents` agents at the start, in double precision and with these arguments. The caller resets
/// ended episodes.
pub fn begun(id: &str, agents: usize, seed: u64, list: &[(&str, &str)]) -> (VecEnv, Step) {
    let options = VecEnvOptions {
        agents,
        isa: Some(Isa::F64),
        autoreset: Autoreset::Disabled,
        options: options(list),
        ..Default::default()
    };
    let mut env = VecEnv::new(id, &options).unwrap();
    let mut step = env.buffers();
    env.reset(Some(seed), &mut step.obs).unwrap();
    (env, step)
}

/// Resets and executes `decisions` decisions with [`action`]. Calls `each` after every one.
pub fn play(env: &mut VecEnv, decisions: usize, scale: f32, mut each: impl FnMut(usize, &Step)) -> Step {
    let mut out = env.buffers();
    env.reset(Some(5), &mut out.obs).expect("the arrays fit");
    go_on(env, &mut out, 0, decisions, scale, &mut each);
    out
}

/// Executes decisions `from .. to`.
pub fn go_on(env: &mut VecEnv, out: &mut Step, from: usize, to: usize, scale: f32, mut each: impl FnMut(usize, &Step)) {
    let act = env.spec().act;
    let mut actions = vec![0.0; env.agents() * act];
    for decision in from..to {
        for (agent, row) in actions.chunks_exact_mut(act).enumerate() {
            action(agent, decision, scale, row);
        }
        env.step(&actions, &mut *out).expect("the arrays fit");
        each(decision, out);
    }
}

/// Center of a geom, m.
pub fn center(model: &Model, state: &AgentState, geom: &str) -> [f64; 3] {
    let pose = Pose::of(model, &state.qpos);
    let geom = model.geoms.iter().find(|g| g.name == geom).unwrap();
    let mut local = pose.pos[0];
    [local.x, local.y, local.z] = geom.pos;
    (pose.quat[geom.body] * local + pose.pos[geom.body]).to_array()
}
