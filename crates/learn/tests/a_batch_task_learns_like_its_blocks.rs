//! Contract: agents that are stepped all at once ([`BatchAdapter`]) give the same training as agents in blocks: the same
//! bits, for any number of threads and over an interruption. A task that fails ends the run with the reason.

use crate::common::{silent, small_config};
use marathon_envs::{
    AgentShards, BatchAdapter, BatchTask, BatchTaskError, BatchTaskFailed, Shard, ShardFactory, Spec, StepMut, VecEnv,
    VecEnvOptions, registry,
};
use marathon_learn::{
    Checkpoint, Control, EvalOptions, IterationStats, Snapshot, TrainConfig, TrainOutput, evaluate, train,
};
use marathon_physics::lanes::Isa;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;

const TASK: &str = "Hopper-v0";

fn config(threads: usize) -> TrainConfig {
    small_config().with(|c| {
        c.run.threads = threads;
        c.run.total_steps = 3 * small_config().run.rollout_steps();
    })
}

fn task() -> VecEnv {
    // an end in each rollout, and a seed that must not matter
    let agents = small_config().run.agents;
    let options = VecEnvOptions { agents, seed: 99, max_episode_steps: Some(20), ..Default::default() };
    VecEnv::new(TASK, &options).unwrap()
}

fn lockstep(task: impl BatchTask + 'static) -> BatchAdapter {
    BatchAdapter::new(Box::new(task), self::task().spec().clone(), small_config().run.agents)
}

/// The task's own blocks, with the task's limit.
struct Blocks(Arc<dyn AgentShards>);

impl ShardFactory for Blocks {
    fn spec(&self) -> &Spec {
        self.0.spec()
    }
    fn shard(&self, first: usize, blocks: usize, seed: u64) -> Box<dyn Shard> {
        let mut shard = self.0.agent_shard(first, blocks, seed);
        shard.limit_episodes(20);
        shard
    }
}

fn bits(output: &TrainOutput) -> Vec<u32> {
    let policy = &output.policy;
    policy.params().iter().chain(policy.normalizer().mean()).map(|x| x.to_bits()).collect()
}

#[test]
fn the_same_bits_for_any_number_of_threads() {
    let blocks = Blocks(registry::global().shards(TASK, Isa::best()).unwrap());
    let want = train(&blocks, Isa::best(), &config(2), None, &mut silent).unwrap();
    for threads in [1, 2, 3] {
        let got = train(&lockstep(task()), Isa::best(), &config(threads), None, &mut silent).unwrap();
        assert_eq!(bits(&want), bits(&got), "{threads} threads");
        let (a, b) = (want.last.as_ref().unwrap(), got.last.as_ref().unwrap());
        assert_eq!(
            (a.episodes, a.learned.return_mean, a.speed_mean),
            (b.episodes, b.learned.return_mean, b.speed_mean)
        );
        assert_eq!((&a.learned.reward_terms, a.fall_fraction), (&b.learned.reward_terms, b.fall_fraction));
    }
}

#[test]
fn the_same_bits_over_an_interruption() {
    let want = train(&lockstep(task()), Isa::best(), &config(2), None, &mut silent).unwrap();
    let folder = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).unwrap();
    let mut stop = |_: &IterationStats, snapshot: &Snapshot<'_>| {
        snapshot.checkpoint().save(folder.path()).unwrap();
        Control::Stop
    };
    train(&lockstep(task()), Isa::best(), &config(1), None, &mut stop).unwrap();
    let checkpoint = Checkpoint::load(folder.path()).unwrap();
    let got = train(&lockstep(task()), Isa::best(), &config(2), Some(checkpoint), &mut silent).unwrap();
    assert_eq!(bits(&want), bits(&got));
}

#[test]
fn the_same_evaluation_however_often() {
    let blocks = Blocks(registry::global().shards(TASK, Isa::best()).unwrap());
    let factory = lockstep(task());
    // the training factory also evaluates
    let policy = train(&factory, Isa::best(), &config(2), None, &mut silent).unwrap().policy;
    for episodes in [small_config().run.agents, 5] {
        let options = EvalOptions { episodes, seed: 3, threads: 2 };
        let want = evaluate(&blocks, Isa::best(), &policy, &options).unwrap();
        assert_eq!(want.episodes, episodes as u64);
        for _ in 0..2 {
            assert_eq!(evaluate(&factory, Isa::best(), &policy, &options).unwrap(), want);
        }
    }
    let again = train(&factory, Isa::best(), &config(1), None, &mut silent).unwrap().policy;
    assert_eq!(again.params(), policy.params());
}

/// Fails at a decision.
struct Fragile(VecEnv, usize);

impl BatchTask for Fragile {
    fn reset(&mut self, seed: u64, obs: &mut [f32]) -> Result<(), BatchTaskError> {
        BatchTask::reset(&mut self.0, seed, obs)
    }
    fn step(&mut self, actions: &[f32], out: StepMut<'_>) -> Result<(), BatchTaskError> {
        self.1 = self.1.checked_sub(1).ok_or("it has had enough")?;
        BatchTask::step(&mut self.0, actions, out)
    }
    fn save(&self) -> Result<Vec<u8>, BatchTaskError> {
        BatchTask::save(&self.0)
    }
    fn load(&mut self, bytes: &[u8]) -> Result<(), BatchTaskError> {
        BatchTask::load(&mut self.0, bytes)
    }
}

#[test]
#[cfg_attr(target_family = "wasm", ignore = "a panic ends the program")]
fn a_crowd_that_fails_ends_the_run() {
    for threads in [1, 3] {
        let factory = lockstep(Fragile(task(), 7));
        let run = || train(&factory, Isa::best(), &config(threads), None, &mut silent).map(|_| ());
        let panic = catch_unwind(AssertUnwindSafe(run)).expect_err("it fails");
        assert!(panic.is::<BatchTaskFailed>(), "{threads} threads");
        assert_eq!(factory.take_error().expect("a reason").to_string(), "it has had enough");
    }
}
