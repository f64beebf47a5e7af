//! One, two, four or eight agents are trained like any others. Training and reports use only their data, though a block
//! has sixteen lanes, and the promises of equal bits hold.

use crate::common::{PuckTask, learning_config, ppo, silent, small_config};
use marathon_envs::{BLOCK, BlockStep, EnvError, Shard, ShardFactory, Spec};
use marathon_learn::{Algorithm, Control, IterationStats, Ratio, Snapshot, TrainConfig, evaluate, train};
use marathon_physics::lanes::Isa;

/// Every agent's reward, first observation and metric are its index.
struct Numbered(PuckTask);
struct NumberedShard(Box<dyn Shard>, usize);

impl NumberedShard {
    fn mark(&self, block: usize, row: &mut [f32]) {
        row[..BLOCK].iter_mut().enumerate().for_each(|(i, x)| *x = ((self.1 + block) * BLOCK + i) as f32);
    }
}

impl ShardFactory for Numbered {
    fn spec(&self) -> &Spec {
        self.0.spec()
    }
    fn shard(&self, first: usize, blocks: usize, seed: u64) -> Box<dyn Shard> {
        Box::new(NumberedShard(self.0.shard(first, blocks, seed), first))
    }
}

impl Shard for NumberedShard {
    fn spec(&self) -> &Spec {
        self.0.spec()
    }
    fn blocks(&self) -> usize {
        self.0.blocks()
    }
    fn reset(&mut self, block: usize, mask: u16, obs: &mut [f32]) {
        self.0.reset(block, mask, obs);
        self.mark(block, obs);
    }
    fn step(&mut self, block: usize, action: &[f32], obs: &mut [f32], out: &mut BlockStep) {
        self.0.step(block, action, obs, out);
        (out.terminated, out.diverged) = (0, 0);
        self.mark(block, obs);
        self.mark(block, &mut out.reward);
        self.mark(block, &mut out.terms);
        self.mark(block, &mut out.info[BLOCK..]);
    }
    fn save(&self, block: usize, bytes: &mut Vec<u8>) {
        self.0.save(block, bytes);
    }
    fn load<'a>(&mut self, block: usize, bytes: &'a [u8]) -> Result<&'a [u8], EnvError> {
        self.0.load(block, bytes)
    }
}

#[test]
fn what_is_reported_is_theirs_alone() {
    const LIMIT: usize = 8;
    for agents in [1, 2, 4, 8, 16, 32] {
        let config = small_config().with(|c| {
            c.run.agents = agents;
            c.run.horizon = 24;
            ppo(c).minibatches = 1;
            c.run.total_steps = 24 * agents as u64;
        });
        let mut seen = Vec::new();
        let mut observer = |stats: &IterationStats, _: &Snapshot<'_>| {
            assert_eq!(stats.metrics, [("near".into(), stats.learned.reward_terms[0])]);
            seen.push((stats.steps, stats.episodes, stats.learned.return_mean, stats.learned.reward_terms[0]));
            Control::Continue
        };
        let output = train(&Numbered(PuckTask::with_limit(LIMIT)), Isa::best(), &config, None, &mut observer).unwrap();
        // the mean of 0, 1, .. agents - 1
        let mean = (agents - 1) as f64 / 2.0;
        assert_eq!(seen, [(24 * agents as u64, 3 * agents as u64, Some(mean * LIMIT as f64), mean)], "{agents} agents");
        let variance = (0..agents).map(|i| (i as f64 - mean).powi(2)).sum::<f64>() / agents as f64;
        let normalizer = output.policy.normalizer();
        assert_eq!(normalizer.mean()[0] as f64, mean, "{agents} agents");
        assert!((normalizer.std()[0] as f64 - variance.max(1e-8).sqrt()).abs() < 1e-4, "{agents} agents");
    }
}

#[test]
fn one_agent_solves_the_task() {
    let config = learning_config().with(|c| {
        c.run.agents = 1;
        c.run.horizon = 1024;
        c.run.total_steps = 100_000;
    });
    for config in [config.clone().with(|c| ppo(c).ratio = Ratio::PerAction), config] {
        let task = PuckTask::new();
        let output = train(&task, Isa::best(), &config, None, &mut silent).unwrap();
        let result = evaluate(&task, Isa::best(), &output.policy, &Default::default()).unwrap();
        assert!(result.return_mean > 50.0 && result.falls == 0, "{result:?}");
    }
}

#[test]
fn vector_width_and_interruptions_change_nothing() {
    let task = PuckTask::with_limit(20);
    for config in [
        small_config().with(|c| {
            c.run.agents = 2;
            c.run.horizon = 96;
            c.run.total_steps = 4 * 192;
        }),
        TrainConfig::a2c().with(|c| {
            c.run.agents = 1;
            c.run.total_steps = 4 * 50 * 5;
        }),
        TrainConfig::acktr().with(|c| {
            c.run.agents = 4;
            c.run.total_steps = 4 * 10 * 80;
        }),
    ] {
        let whole = train(&task, Isa::best(), &config, None, &mut silent).unwrap();
        for isa in [Isa::F32, Isa::X4, Isa::X8, Isa::X16].into_iter().filter(|isa| isa.supported()) {
            let other = train(&task, isa, &config, None, &mut silent).unwrap();
            assert_eq!(whole.policy.params(), other.policy.params(), "{} {}", config.algorithm.name(), isa.name());
        }
        let mut stop = |_: &IterationStats, _: &Snapshot<'_>| Control::Stop;
        let half = train(&task, Isa::best(), &config, None, &mut stop).unwrap();
        let resumed = train(&task, Isa::best(), &config, Some(half.checkpoint), &mut silent).unwrap();
        assert_eq!(whole.policy.params(), resumed.policy.params(), "{}", config.algorithm.name());
    }
}

#[test]
fn what_does_not_divide_sixteen_is_refused() {
    for (agents, algorithm) in
        [(3, Algorithm::default()), (12, Algorithm::default()), (1, TrainConfig::sac().algorithm)]
    {
        let config = learning_config().with(|c| {
            c.run.agents = agents;
            c.algorithm = algorithm;
        });
        let error = train(&PuckTask::new(), Isa::best(), &config, None, &mut silent).err().unwrap().to_string();
        assert!(error.contains(&format!("agents is {agents}, expected a multiple of 16, such as 16")), "{error}");
    }
}
