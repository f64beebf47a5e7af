//! Speed of the environments under random actions, including resets.

use super::sample::{Sample, on_threads, thread_cpu};
use marathon_envs::{BLOCK, BlockStep, Shard, ShardFactory, Spec};

/// Blocks per thread.
const BLOCKS: usize = 4;
/// Decisions between two readings of the clock, and before the first.
const DECISIONS: usize = 64;
/// Repetitions of a measurement.
const REPETITIONS: usize = 5;
/// Blocks of actions drawn in advance, so that drawing is not measured; a prime.
const STOCK: usize = 257;

/// Speed of the environments of an agent.
pub struct EnvSpeed {
    /// Repetitions, in which a step is a decision.
    pub samples: Vec<Sample>,
    /// Agents on all threads.
    pub agents: usize,
    /// Mean decisions per episode. `None` if no episode ended.
    pub episode_length: Option<f64>,
    /// Agents whose simulation became non-finite.
    pub diverged: u64,
}

/// Measures the environments of an agent on `threads` threads, for `seconds` processor seconds of each thread.
pub fn env_speed(threads: usize, seconds: f64, factory: &dyn ShardFactory) -> EnvSpeed {
    let spec = factory.spec();
    let actions = actions(spec.act);
    let player = |thread: usize| Player::new(factory.shard(thread * BLOCKS, BLOCKS, 1), spec, &actions);
    let mut players: Vec<Player<'_>> = (0..threads).map(player).collect();
    players.iter_mut().for_each(Player::play);
    players.iter_mut().for_each(|player| (player.steps, player.episodes, player.diverged) = (0, 0, 0));

    let each = seconds / REPETITIONS as f64;
    let samples: Vec<Sample> = (0..REPETITIONS)
        .map(|_| {
            let before: u64 = players.iter().map(|player| player.steps).sum();
            let (cpu, wall) = on_threads(&mut players, |_, player| {
                let start = thread_cpu();
                loop {
                    player.play();
                    let cpu = thread_cpu() - start;
                    if cpu >= each {
                        return cpu;
                    }
                }
            });
            let steps = players.iter().map(|player| player.steps).sum::<u64>() - before;
            Sample { steps, cpu: cpu.iter().sum(), wall }
        })
        .collect();
    let total = |count: fn(&Player<'_>) -> u64| players.iter().map(count).sum::<u64>();
    let (steps, episodes) = (total(|p| p.steps), total(|p| p.episodes));
    EnvSpeed {
        samples,
        agents: threads * BLOCKS * BLOCK,
        episode_length: (episodes > 0).then(|| steps as f64 / episodes as f64),
        diverged: total(|p| p.diverged),
    }
}

/// The agents of a thread.
struct Player<'a> {
    shard: Box<dyn Shard>,
    actions: &'a [Vec<f32>],
    obs: Vec<f32>,
    out: BlockStep,
    decision: usize,
    steps: u64,
    episodes: u64,
    diverged: u64,
}

impl<'a> Player<'a> {
    fn new(mut shard: Box<dyn Shard>, spec: &Spec, actions: &'a [Vec<f32>]) -> Self {
        let mut obs = vec![0.0; spec.obs * BLOCK];
        for block in 0..BLOCKS {
            shard.reset(block, u16::MAX, &mut obs);
        }
        Player { shard, actions, obs, out: BlockStep::default(), decision: 0, steps: 0, episodes: 0, diverged: 0 }
    }

    /// Makes [`DECISIONS`] decisions with all agents.
    fn play(&mut self) {
        for _ in 0..DECISIONS {
            self.decision += 1;
            for block in 0..BLOCKS {
                let action = &self.actions[(self.decision * 31 + block * 17) % STOCK];
                self.shard.step(block, action, &mut self.obs, &mut self.out);
                let ended = self.out.terminated | self.out.truncated;
                if ended != 0 {
                    self.shard.reset(block, ended, &mut self.obs);
                    self.episodes += u64::from(ended.count_ones());
                }
                self.diverged += u64::from(self.out.diverged.count_ones());
                self.steps += BLOCK as u64;
            }
        }
    }
}

/// Uniform actions in [-1, 1) (SplitMix64).
fn actions(act: usize) -> Vec<Vec<f32>> {
    let mut state = 1u64;
    let mut next = || {
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (state ^ (state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 40) as f32 / (1u64 << 23) as f32 - 1.0
    };
    (0..STOCK).map(|_| (0..act * BLOCK).map(|_| next()).collect()).collect()
}
