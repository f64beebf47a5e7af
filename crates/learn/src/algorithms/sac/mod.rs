//! Soft actor-critic (Haarnoja et al., "Soft actor-critic algorithms and applications", 2018): learns from a replay of
//! all rollouts, not from the last one alone.
//!
//! Each rollout of all agents goes into a replay. Then, `updates` times, a batch is drawn from it:
//!
//! ```text
//! a' ~ pi(s')     y = r + gamma^n (min(Q1', Q2')(s', a') - alpha ln pi(a'|s'))       r: n rewards; no value after a failure
//! Q1, Q2:  (Q(s, a) - y)^2 / 2
//! pi:      alpha ln pi(a|s) - min(Q1, Q2)(s, a),  a ~ pi(s)
//! alpha:   -ln alpha (ln pi(a|s) - number of actions),  so that the entropy becomes minus the number of actions
//! ```
//!
//! `Q'` are slow copies of the value networks: `Q' <- Q' + tau (Q - Q')`. All parts take a step of Adam at once. A
//! batch consists of randomly drawn blocks: sixteen agents at one moment. The parameters are `policy, Q1, Q2, ln
//! alpha`.

mod networks;

use super::loss::LossSums;
use super::parameters::Places;
use super::schedule::{LrSchedule, Progress};
use super::{Description, Learner, MemoryPlan, Now, Saved, Setup, SharedConfig, Workers, check, load_adam, save_adam};
use crate::error::Error;
use crate::lanes::BLOCK;
use crate::lanes::noise::{Noise, SAMPLES, SplitMix};
use crate::nets::acting::{Acting, Distribution};
use crate::nets::mlp::{CHUNK, Mlp};
use crate::nets::normalize::Normalizer;
use crate::optim::adam::Adam;
use crate::optim::sum;
use crate::policy::{Policy, PolicyMeta};
use crate::rewards::Stream;
use crate::rollout::context::RolloutContext;
use crate::rollout::data::{Experience, Shape};
use crate::rollout::replay::{self, Replay};
use crate::rollout::statistics::Statistics;
use crate::rollout::sums::Totals;
use networks::{Layout, Networks, Space, gradient};
use serde::{Deserialize, Serialize};
use std::sync::{Arc, RwLock};

/// Settings of SAC.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Sac {
    /// Learning rate of the policy and of the entropy weight.
    pub lr: f64,
    /// Learning rate of the value networks.
    pub value_lr: f64,
    /// Schedule of both learning rates.
    pub lr_schedule: LrSchedule,
    /// Added to the root of Adam's second moment.
    pub adam_epsilon: f64,
    /// Agent-steps in the replay, rounded down to whole decisions of all agents.
    pub replay: usize,
    /// Agent-steps before the first update.
    pub warmup: u64,
    /// Samples per update, a multiple of 16.
    pub batch: usize,
    /// Updates after each rollout.
    pub updates: usize,
    /// Update rate of the slow value networks.
    pub tau: f64,
    /// Rewards that are summed before the value of the state that they lead to.
    pub n_step: usize,
    /// Weight of the entropy at the start.
    pub init_alpha: f64,
}

impl Default for Sac {
    fn default() -> Self {
        Self {
            lr: 1e-3,
            value_lr: 1e-3,
            lr_schedule: LrSchedule::Constant,
            adam_epsilon: 1e-5,
            replay: 1_000_000,
            warmup: 10_000,
            batch: 256,
            updates: 32,
            tau: 0.005,
            n_step: 1,
            init_alpha: 0.2,
        }
    }
}

impl Sac {
    /// Checks every field.
    ///
    /// # Errors
    /// Names the field, its value and the values that are valid.
    pub fn validate(&self, common: &SharedConfig<'_>) -> Result<(), Error> {
        if common.agents < BLOCK {
            let nearest = format!("a multiple of {BLOCK}, such as {BLOCK} with sac");
            return Err(Error::config("run.agents", common.agents, nearest));
        }
        if self.batch == 0 || !self.batch.is_multiple_of(BLOCK) || self.batch > 1 << 20 {
            return Err(Error::config("batch", self.batch, format!("a multiple of {BLOCK} up to {}", 1 << 20)));
        }
        if self.updates == 0 || self.n_step == 0 {
            let found = format!("{}, {}", self.updates, self.n_step);
            return Err(Error::config("updates, n_step", found, "at least 1"));
        }
        let decisions = self.n_step.max(common.horizon);
        if self.replay / common.agents.max(1) < decisions || self.replay > 1 << 31 {
            let expected = format!("a rollout at least, {}, and at most 2^31", common.agents * decisions);
            return Err(Error::config("replay", self.replay, expected));
        }
        check::positive(&[
            ("tau", self.tau),
            ("init_alpha", self.init_alpha),
            ("lr", self.lr),
            ("value_lr", self.value_lr),
            ("adam_epsilon", self.adam_epsilon),
        ])?;
        if self.tau > 1.0 {
            return Err(Error::config("tau", self.tau, "at most 1"));
        }
        if common.statistics.scale_rewards {
            let why = "false with sac: rewards of another scale would stay in the replay";
            return Err(Error::config("statistics.scale_rewards", true, why));
        }
        if common.statistics.follow_statistics {
            let why = "false with sac, whose replay is normalized anew whenever it is drawn from";
            return Err(Error::config("statistics.follow_statistics", true, why));
        }
        check::task_alone(common, "sac")?;
        super::actor_critic::refuse_adaptive(self.lr_schedule, "sac")
    }

    /// Memory that a run needs.
    pub(super) fn memory_plan(&self, setup: &Setup<'_>) -> MemoryPlan {
        let layout = Layout::new(setup);
        let (obs, act) = (setup.spec.obs as u64, setup.spec.act as u64);
        MemoryPlan {
            parameters: layout.places.total(),
            moments: 0,
            items: self.batch / BLOCK,
            shape: layout.shape(setup.common.lanes()),
            replay: self.replay as u64 * (2 * obs + act + 1),
        }
    }
}

/// SAC with its networks, optimizer and replay.
pub struct SacLearner {
    settings: Sac,
    seed: u64,
    lanes: usize,
    blocks: usize,
    rollout_steps: u64,
    streams: Vec<Stream>,
    nets: Networks,
    adam: Adam,
    lr: f64,
    skipped: u64,
    /// One replay per worker, for its blocks. All workers read all of them.
    replays: Arc<Vec<RwLock<Replay>>>,
    space: Option<Box<Space>>,
}

impl SacLearner {
    /// Creates a learner at the start of a run, for workers with `blocks[i]` blocks each.
    pub fn new(settings: Sac, setup: &Setup<'_>, blocks: &[usize]) -> Self {
        let nets = Networks::new(setup, settings.init_alpha);
        let slots = (settings.replay / setup.common.agents).max(1);
        let replay = |n: &usize| RwLock::new(Replay::new(*n, slots, (setup.spec.obs, setup.spec.act)));
        Self {
            settings,
            seed: setup.common.seed,
            lanes: setup.common.lanes(),
            blocks: setup.common.blocks(),
            rollout_steps: (setup.common.agents * setup.common.horizon) as u64,
            streams: Stream::all(setup.common.rewards, setup.purpose(), |n| 0..n),
            adam: Adam::new(nets.params.len(), settings.adam_epsilon),
            nets,
            lr: settings.lr,
            skipped: 0,
            replays: Arc::new(blocks.iter().map(replay).collect()),
            space: None,
        }
    }

    /// Adds the rollout to the replay and makes the updates.
    fn learn(
        &mut self,
        workers: &mut dyn Workers,
        experience: &Experience<'_>,
        Now { progress, statistics }: Now<'_>,
        all: &mut LossSums,
    ) {
        let own = &self.replays[experience.worker()];
        own.write().expect("no worker has panicked").push(experience.own());
        workers.wait();
        let (settings, seed, gamma) = (self.settings, self.seed, self.streams[0].gamma);
        let experienced = progress.steps + self.rollout_steps;
        if progress.iteration == 0 || experienced < settings.warmup {
            return;
        }
        let replays = self.replays.clone();
        let replays: Vec<_> = replays.iter().map(|r| r.read().expect("no worker has panicked")).collect();
        let filled = replays[0].filled();
        if filled < settings.n_step {
            return;
        }
        let normalizer = statistics.normalizer();
        self.lr = settings.lr * progress.rate(settings.lr_schedule);
        for u in 0..settings.updates {
            let draw = progress.iteration * settings.updates as u64 + u as u64;
            let mut random = SplitMix::new(seed, draw | SAMPLES);
            let ages = filled - settings.n_step + 1;
            let pick = |random: &mut SplitMix| (random.below(self.blocks), settings.n_step - 1 + random.below(ages));
            let picks: Vec<(usize, usize)> = (0..settings.batch / BLOCK).map(|_| pick(&mut random)).collect();
            let nets = &self.nets;
            let space = self.space.get_or_insert_with(|| Box::new(Space::new(&nets.layout)));
            let sums = workers.share_out(picks.len(), &mut |group, partial| {
                partial.sums = LossSums::default();
                for (i, chunk) in picks[group.clone()].chunks(CHUNK).enumerate() {
                    space.batch.clear();
                    for (block, age) in chunk {
                        let (worker, local) = experience.place(*block);
                        replays[worker].sample(local, *age, settings.n_step, gamma, &mut space.batch);
                    }
                    // the noise depends on the update and the position in the batch
                    let first = group.start + i * CHUNK;
                    let noise = |b: usize| Noise::of(seed, draw, (first + b) as u64);
                    let mut noise: Vec<Noise> = (0..chunk.len()).map(noise).collect();
                    if i == 0 {
                        partial.sums += gradient(nets, &normalizer, &mut noise, space, &mut partial.gradient);
                    } else {
                        let mut more = std::mem::take(&mut space.gradient);
                        partial.sums += gradient(nets, &normalizer, &mut noise, space, &mut more);
                        sum::add(nets.isa, &mut partial.gradient, &more);
                        space.gradient = more;
                    }
                }
            });
            *all += sums;
            self.step(workers, progress, &sums);
        }
    }

    /// Takes one step of Adam of all parts, and moves the slow value networks.
    fn step(&mut self, workers: &dyn Workers, progress: &Progress, sums: &LossSums) {
        let Self { settings, nets, adam, lr, .. } = self;
        if !workers.squares().iter().all(|s| s.is_finite()) {
            self.skipped += 1;
            return;
        }
        adam.advance();
        let value_lr = settings.value_lr * progress.rate(settings.lr_schedule);
        let rates = [*lr, value_lr, value_lr, *lr];
        workers.pieces(&mut |net, range, gradient| {
            adam.update(nets.isa, &mut nets.params, range, gradient, 1.0 / sums.samples, rates[net]);
        });
        let tau = settings.tau as f32;
        for (slow, fast) in nets.targets.iter_mut().zip(&nets.params[nets.layout.critic_starts[0]..]) {
            *slow += tau * (fast - *slow);
        }
    }
}

impl Learner for SacLearner {
    fn update(&mut self, workers: &mut dyn Workers, experience: &Experience<'_>, now: Now<'_>, sums: &mut LossSums) {
        self.learn(workers, experience, now, sums);
    }
    fn replica(&self) -> Box<dyn Learner> {
        Box::new(Self {
            streams: self.streams.clone(),
            nets: self.nets.clone(),
            adam: self.adam.clone(),
            replays: self.replays.clone(),
            space: None,
            ..*self
        })
    }
    fn places(&self) -> &Places {
        &self.nets.layout.places
    }
    fn params(&self) -> &[f32] {
        &self.nets.params
    }
    fn params_mut(&mut self) -> &mut Vec<f32> {
        &mut self.nets.params
    }
    fn shape(&self) -> Shape {
        self.nets.layout.shape(self.lanes)
    }
    fn collecting(&self, statistics: &Statistics) -> RolloutContext<'_> {
        let layout = &self.nets.layout;
        RolloutContext {
            acting: Acting {
                isa: self.nets.isa,
                net: &layout.actor,
                params: &self.nets.params[..layout.actor.len()],
                normalizer: statistics.normalizer(),
                distribution: Distribution::Squashed,
                action_scale: 1.0,
            },
            streams: &self.streams,
            params: &self.nets.params,
            // the replay keeps raw observations
            values: None,
            reward_scale: statistics.reward_scale() * self.streams[0].strength,
            return_center: statistics.returns.mean[0] as f32,
        }
    }
    /// Does nothing: the replay is normalized at every draw.
    fn follow(&mut self, _: &Normalizer, _: &Normalizer) {}
    fn describe(&self, _: &Totals, sums: &LossSums) -> Description {
        let per_sample = |x: f64| if sums.samples > 0.0 { x / sums.samples } else { 0.0 };
        // the deviations depend on the state, and the values do not belong to a rollout
        Description {
            lr: self.lr,
            skipped: self.skipped,
            explained_variance: 0.0,
            entropy: per_sample(sums.entropy),
            std_mean: per_sample(sums.std),
        }
    }
    /// The means of the policy. Its deviations depend on the state and are left out.
    fn policy(&self, mut meta: PolicyMeta, normalizer: Normalizer) -> Policy {
        meta.squash = true;
        let layout = &self.nets.layout;
        let net = Mlp::new(&[&[layout.obs], &meta.hidden[..], &[layout.act]].concat(), meta.activation);
        let mut params = Vec::with_capacity(net.len());
        for ((weights, biases), (own_weights, own_biases)) in layout.actor.layers().zip(net.layers()) {
            params.extend_from_slice(&self.nets.params[weights][..own_weights.len()]);
            params.extend_from_slice(&self.nets.params[biases][..own_biases.len()]);
        }
        Policy::assemble(meta, net, params, normalizer, vec![0.0; layout.act])
    }
    fn save(&self) -> Saved {
        let mut saved = Saved::default();
        saved.list("params", &self.nets.params);
        saved.list("targets", &self.nets.targets);
        save_adam(&self.adam, &mut saved);
        let mut replay = replay::Saved::default();
        for of_worker in self.replays.iter() {
            let of_worker = of_worker.read().expect("no worker has panicked");
            (0..of_worker.blocks()).for_each(|b| of_worker.save(b, &mut replay));
        }
        saved.list("replay_filled", &[replay.filled]);
        for (name, numbers) in replay::NUMBERS.into_iter().zip(&replay.numbers) {
            saved.list(name, numbers);
        }
        for (name, flags) in replay::FLAGS.into_iter().zip(&replay.flags) {
            saved.list(name, flags);
        }
        saved.scalar("lr", self.lr);
        saved.scalar("skipped", self.skipped as f64);
        saved
    }
    fn load(&mut self, saved: &Saved) -> Result<(), Error> {
        saved.copy("params", &mut self.nets.params)?;
        saved.copy("targets", &mut self.nets.targets)?;
        load_adam(&mut self.adam, saved)?;
        let filled: &[u64] = saved.get("replay_filled")?;
        let mut replay = replay::Saved { filled: filled.first().copied().unwrap_or(0), ..Default::default() };
        for (name, numbers) in replay::NUMBERS.into_iter().zip(&mut replay.numbers) {
            *numbers = saved.get::<f32>(name)?.to_vec();
        }
        for (name, flags) in replay::FLAGS.into_iter().zip(&mut replay.flags) {
            *flags = saved.get::<u32>(name)?.to_vec();
        }
        let mut block = 0;
        for of_worker in self.replays.iter() {
            let mut of_worker = of_worker.write().expect("no worker has panicked");
            for b in 0..of_worker.blocks() {
                if !of_worker.load(b, block, &replay) {
                    return Err(Error::Mismatch {
                        what: "checkpoint: replay".into(),
                        found: format!("{} decisions", replay.filled),
                        expected: "as many numbers as the settings need".into(),
                    });
                }
                block += 1;
            }
        }
        self.lr = saved.number("lr")?;
        self.skipped = saved.number("skipped")? as u64;
        Ok(())
    }
}
