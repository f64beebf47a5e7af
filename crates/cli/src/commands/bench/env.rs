//! The environments under random actions, resets included.

use super::Plan;
use super::row::{More, Row, Sample, on_threads, thread_cpu};
use crate::error::CliError;
use marathon_envs::{BLOCK, BlockStep, Shard, ShardFactory, Spec, registry};
use marathon_physics::lanes::Isa;

/// Blocks of each thread.
const BLOCKS: usize = 4;
/// Decisions between two looks at the clock, and before the first.
const DECISIONS: usize = 64;
/// Repetitions of a row.
const REPETITIONS: usize = 5;
/// Blocks of actions drawn beforehand, so that drawing them is not what is measured; a prime.
const STOCK: usize = 257;

/// Measures the agents for every instruction set.
///
/// # Errors
/// If an agent cannot be simulated.
pub fn run(plan: &Plan, emit: &mut dyn FnMut(Row)) -> Result<(), CliError> {
    for id in &plan.agents {
        for isa in &plan.isas {
            let factory = registry::factory(id, *isa)?;
            emit(measure(plan, &*factory, *isa));
        }
    }
    Ok(())
}

fn measure(plan: &Plan, factory: &dyn ShardFactory, isa: Isa) -> Row {
    let spec = factory.spec();
    let actions = actions(spec.act);
    let player = |thread: usize| Player::new(factory.shard(thread * BLOCKS, BLOCKS, 1), spec, &actions);
    let mut players: Vec<Player<'_>> = (0..plan.threads).map(player).collect();
    players.iter_mut().for_each(Player::play);
    players.iter_mut().for_each(|player| (player.steps, player.episodes) = (0, 0));

    let each = plan.seconds / REPETITIONS as f64;
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
    let (steps, episodes) = players.iter().fold((0, 0), |(s, e), player| (s + player.steps, e + player.episodes));
    let episode_length = (episodes > 0).then(|| steps as f64 / episodes as f64);
    let more = More::Env { frame_skip: spec.frame_skip, episode_length };
    Row::new(&spec.id, isa, (plan.threads, plan.threads * BLOCKS * BLOCK), &samples, more)
}

/// A thread's agents.
struct Player<'a> {
    shard: Box<dyn Shard>,
    actions: &'a [Vec<f32>],
    obs: Vec<f32>,
    out: BlockStep,
    decision: usize,
    steps: u64,
    episodes: u64,
}

impl<'a> Player<'a> {
    fn new(mut shard: Box<dyn Shard>, spec: &Spec, actions: &'a [Vec<f32>]) -> Self {
        let mut obs = vec![0.0; spec.obs * BLOCK];
        for block in 0..BLOCKS {
            shard.reset(block, u16::MAX, &mut obs);
        }
        Player { shard, actions, obs, out: BlockStep::default(), decision: 0, steps: 0, episodes: 0 }
    }

    /// Some decisions of all agents.
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
