//! A task that is small enough to be learned within a test: hold a drifting puck at the origin of a plane.

pub mod numbers;
#[path = "../../../physics/tests/common/oracle.rs"]
mod oracle;

use marathon_envs::{BLOCK, BlockStep, EnvError, Metric, MetricSource, Options, Shard, ShardFactory, Spec};
use marathon_learn::{Algorithm, Ppo, Sac, TrainConfig};
#[allow(unused_imports, reason = "every test file uses a part")]
pub use oracle::oracle;

/// Per agent: position, velocity and drift in two axes, decisions of the episode, random state.
#[derive(Clone, Copy, Default)]
struct Puck {
    pos: [f32; 2],
    vel: [f32; 2],
    drift: [f32; 2],
    steps: u32,
    random: u64,
}

/// The task; `limit` decisions per episode.
pub struct PuckTask {
    pub spec: Spec,
    /// Makes one agent's observation NaN at a decision, to test the trainer's reaction.
    pub poison: Option<(usize, u32)>,
}

impl PuckTask {
    pub fn new() -> Self {
        Self::with_limit(64)
    }
    pub fn with_limit(limit: usize) -> Self {
        let spec = Spec {
            id: "Puck-v0".into(),
            obs: 6,
            act: 2,
            action_names: vec!["x".into(), "y".into()],
            action_low: vec![-1.0; 2],
            action_high: vec![1.0; 2],
            dt: 0.05,
            frame_skip: 2,
            max_episode_steps: limit,
            reward_terms: vec!["near".into(), "effort".into()],
            info: vec!["speed".into(), "near".into()],
            metrics: vec![
                Metric { name: "forward".into(), source: MetricSource::Forward },
                Metric { name: "near".into(), source: MetricSource::Info(1) },
            ],
            options: Options::new(),
            nq: 2,
            nv: 2,
            ..Spec::default()
        };
        Self { spec, poison: None }
    }
    pub fn renamed(mut self, id: &str) -> Self {
        self.spec.id = id.into();
        self
    }
}

impl ShardFactory for PuckTask {
    fn spec(&self) -> &Spec {
        &self.spec
    }
    fn shard(&self, first: usize, blocks: usize, seed: u64) -> Box<dyn Shard> {
        let agent = |i: usize| Puck {
            random: (seed ^ ((first * BLOCK + i) as u64 * 0x9e37_79b9)).wrapping_mul(0x2545_f491_4f6c_dd1d) | 1,
            ..Default::default()
        };
        let pucks = (0..blocks * BLOCK).map(agent).collect();
        Box::new(PuckShard { spec: self.spec.clone(), pucks, first, poison: self.poison })
    }
}

struct PuckShard {
    spec: Spec,
    pucks: Vec<Puck>,
    first: usize,
    poison: Option<(usize, u32)>,
}

impl Puck {
    fn uniform(&mut self) -> f32 {
        self.random = self.random.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.random >> 40) as f32 / (1u64 << 23) as f32 - 1.0
    }
    fn observe(&self, lane: usize, obs: &mut [f32]) {
        let numbers = [self.pos, self.vel, self.drift].concat();
        for (k, x) in numbers.iter().enumerate() {
            // scaled and shifted, so that learning needs the normalizer
            obs[k * BLOCK + lane] = 30.0 * x + 7.0;
        }
    }
}

impl Shard for PuckShard {
    fn spec(&self) -> &Spec {
        &self.spec
    }
    fn blocks(&self) -> usize {
        self.pucks.len() / BLOCK
    }
    fn reset(&mut self, block: usize, mask: u16, obs: &mut [f32]) {
        for lane in (0..BLOCK).filter(|i| mask >> i & 1 == 1) {
            let p = &mut self.pucks[block * BLOCK + lane];
            for axis in 0..2 {
                p.pos[axis] = p.uniform();
                p.vel[axis] = 0.5 * p.uniform();
                p.drift[axis] = 2.0 * p.uniform();
            }
            p.steps = 0;
            p.observe(lane, obs);
        }
    }
    fn step(&mut self, block: usize, action: &[f32], obs: &mut [f32], out: &mut BlockStep) {
        (out.terminated, out.truncated, out.diverged) = (0, 0, 0);
        out.terms.resize(2 * BLOCK, 0.0);
        out.info.resize(2 * BLOCK, 0.0);
        for lane in 0..BLOCK {
            let p = &mut self.pucks[block * BLOCK + lane];
            let (mut near, mut effort) = (0.0, 0.0);
            let x0 = p.pos[0];
            for axis in 0..2 {
                let a = action[axis * BLOCK + lane].clamp(-1.0, 1.0);
                p.vel[axis] += 0.05 * (8.0 * a + p.drift[axis] - p.vel[axis]);
                p.pos[axis] += 0.05 * p.vel[axis];
                near += 0.5 - p.pos[axis] * p.pos[axis];
                effort -= 0.05 * a * a;
            }
            p.steps += 1;
            let fell = p.pos.iter().any(|x| x.abs() > 2.0);
            out.terms[lane] = near;
            out.terms[BLOCK + lane] = effort;
            (out.info[lane], out.info[BLOCK + lane]) = (p.vel[0], near);
            out.reward[lane] = near + effort;
            out.forward[lane] = p.pos[0] - x0;
            out.terminated |= (fell as u16) << lane;
            out.truncated |= ((!fell && p.steps as usize >= self.spec.max_episode_steps) as u16) << lane;
            p.observe(lane, obs);
            if let Some((agent, step)) = self.poison
                && (self.first + block) * BLOCK + lane == agent
                && p.steps == step
            {
                obs[lane] = f32::NAN;
            }
        }
    }
    fn save(&self, block: usize, bytes: &mut Vec<u8>) {
        for p in &self.pucks[block * BLOCK..(block + 1) * BLOCK] {
            for x in [p.pos, p.vel, p.drift].concat() {
                bytes.extend_from_slice(&x.to_le_bytes());
            }
            bytes.extend_from_slice(&p.steps.to_le_bytes());
            bytes.extend_from_slice(&p.random.to_le_bytes());
        }
    }
    fn load<'a>(&mut self, block: usize, mut bytes: &'a [u8]) -> Result<&'a [u8], EnvError> {
        for p in &mut self.pucks[block * BLOCK..(block + 1) * BLOCK] {
            for x in p.pos.iter_mut().chain(&mut p.vel).chain(&mut p.drift) {
                *x = f32::from_le_bytes(take(&mut bytes)?);
            }
            p.steps = u32::from_le_bytes(take(&mut bytes)?);
            p.random = u64::from_le_bytes(take(&mut bytes)?);
        }
        Ok(bytes)
    }
}

fn take<const N: usize>(bytes: &mut &[u8]) -> Result<[u8; N], EnvError> {
    let short = || EnvError::Snapshot("it ends too early".into());
    let (head, rest) = bytes.split_first_chunk().ok_or_else(short)?;
    *bytes = rest;
    Ok(*head)
}

/// PPO's settings in a configuration of PPO.
pub fn ppo(config: &mut TrainConfig) -> &mut Ppo {
    match &mut config.algorithm {
        Algorithm::Ppo(ppo) => ppo,
        other => panic!("a configuration of {}", other.name()),
    }
}

/// A small setting for tests of equality.
pub fn small_config() -> TrainConfig {
    TrainConfig::default().with(|c| {
        c.run.agents = 80;
        c.run.horizon = 24;
        ppo(c).minibatches = 3;
        ppo(c).epochs = 2;
        c.run.total_steps = 4 * 80 * 24;
        c.network.hidden = vec![13, 8];
        c.network.critic_hidden = Some(vec![16]);
        c.run.threads = 1;
    })
}

/// A small setting with another algorithm, by its name.
pub fn small_of(algorithm: &str) -> TrainConfig {
    let small = small_config();
    let config = TrainConfig::of(algorithm).expect("the name of an algorithm");
    // for SAC, updates from the third rollout on, and a replay that is soon full
    let algorithm = match config.algorithm {
        Algorithm::Sac(sac) => {
            Algorithm::Sac(Sac { replay: 80 * 40, warmup: 80 * 18, batch: 528, updates: 2, n_step: 3, ..sac })
        }
        other => other,
    };
    config.with(|c| {
        c.algorithm = algorithm;
        c.run.agents = small.run.agents;
        c.run.horizon = 6;
        c.run.rollouts = 4;
        c.run.total_steps = small.run.total_steps;
        c.network.hidden = small.network.hidden;
        c.network.critic_hidden = small.network.critic_hidden;
        c.run.threads = 1;
    })
}

/// An observer that never stops.
pub fn silent(_: &marathon_learn::IterationStats, _: &marathon_learn::Snapshot<'_>) -> marathon_learn::Control {
    marathon_learn::Control::Continue
}

/// A configuration with which the puck is learned within seconds.
pub fn learning_config() -> TrainConfig {
    TrainConfig::default().with(|c| {
        c.run.agents = 128;
        c.run.horizon = 32;
        ppo(c).minibatches = 4;
        c.run.total_steps = 400_000;
        c.network.hidden = vec![32, 32];
        c.network.critic_hidden = Some(vec![32, 32]);
        c.run.threads = 1;
    })
}
