//! Soft actor-critic (Haarnoja et al., "Soft actor-critic algorithms and applications", 2018): learns from everything that
//! was experienced, not from the last rollout alone.
//!
//! Each rollout of all agents goes into a [`Replay`]. Then, `updates` times, a batch is drawn from it:
//!
//! ```text
//! a' ~ pi(s')     y = r + gamma^n (min(Q1', Q2')(s', a') - alpha ln pi(a'|s'))       r: n rewards; no value after a failure
//! Q1, Q2:  (Q(s, a) - y)^2 / 2
//! pi:      alpha ln pi(a|s) - min(Q1, Q2)(s, a),  a ~ pi(s)
//! alpha:   -ln alpha (ln pi(a|s) - number of actions),  so that the entropy becomes minus the number of actions
//! ```
//!
//! `Q'` are slow copies of the value networks: `Q' <- Q' + tau (Q - Q')`. All parts take a step of Adam at once. A batch
//! is made of blocks: sixteen agents at one moment, moments and blocks by chance. The parameters are `policy, Q1, Q2, ln alpha`.

use super::loss::LossSums;
use super::parameters::Places;
use super::schedule::{Progress, Schedule};
use super::{Common, Description, Learner, Needs, Now, Saved, Setup, Workers, check, load_adam, save_adam};
use crate::error::Error;
use crate::lanes::BLOCK;
use crate::lanes::buffer::Blocks;
use crate::lanes::f32_lanes;
use crate::lanes::noise::{Noise, PARAMETERS, SAMPLES, SplitMix};
use crate::nets::acting::{Acting, Distribution};
use crate::nets::mlp::{CHUNK, Mlp, Tape};
use crate::nets::normalize::{Normalize, Normalizer};
use crate::nets::squash::{Draw, LOG_STD, Normals, Objective};
use crate::optim::adam::Adam;
use crate::optim::sum;
use crate::policy::{Policy, PolicyMeta};
use crate::rewards::Stream;
use crate::rollout::collect::Collecting;
use crate::rollout::data::{Experience, Shape};
use crate::rollout::replay::{self, Batch, Replay};
use crate::rollout::statistics::Statistics;
use crate::rollout::sums::Totals;
use marathon_physics::lanes::{Isa, Real};
use serde::{Deserialize, Serialize};
use std::marker::PhantomData;
use std::sync::{Arc, RwLock};

/// Settings of SAC.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Sac {
    /// Learning rate of the policy and of the entropy's weight.
    pub lr: f64,
    /// Learning rate of the value networks.
    pub value_lr: f64,
    /// How both move.
    pub schedule: Schedule,
    /// Added to the root of Adam's second moment.
    pub adam_epsilon: f64,
    /// Agent-steps that are kept, rounded down to whole decisions of all agents.
    pub replay: usize,
    /// Agent-steps before the first update.
    pub warmup: u64,
    /// Samples of an update, a multiple of 16.
    pub batch: usize,
    /// Updates after each rollout.
    pub updates: usize,
    /// Part of the way that the slow value networks go in an update.
    pub tau: f64,
    /// Rewards that count before the value of the state that they lead to.
    pub n_step: usize,
    /// Weight of the entropy at the start.
    pub init_alpha: f64,
}

impl Default for Sac {
    fn default() -> Self {
        Self {
            lr: 1e-3,
            value_lr: 1e-3,
            schedule: Schedule::Constant,
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
    pub fn validate(&self, common: &Common<'_>) -> Result<(), Error> {
        if common.agents < BLOCK {
            let nearest = format!("a multiple of {BLOCK}, such as {BLOCK} with sac");
            return Err(Error::config("agents", common.agents, nearest));
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
            return Err(Error::config("scale_rewards", true, why));
        }
        if common.statistics.follow_statistics {
            let why = "false with sac, whose replay is normalized anew whenever it is drawn from";
            return Err(Error::config("follow_statistics", true, why));
        }
        check::task_alone(common, "sac")?;
        super::actor_critic::refuse_adaptive(self.schedule, "sac")
    }

    /// What a run needs.
    pub(super) fn needs(&self, setup: &Setup<'_>) -> Needs {
        let layout = Layout::new(setup);
        let (obs, act) = (setup.spec.obs as u64, setup.spec.act as u64);
        Needs {
            parameters: layout.places.len(),
            moments: 0,
            items: self.batch / BLOCK,
            shape: layout.shape(setup.common.lanes()),
            replay: self.replay as u64 * (2 * obs + act + 1),
        }
    }
}

/// The networks without their parameters: `policy, Q1, Q2, ln alpha`.
#[derive(Clone)]
struct Layout {
    obs: usize,
    act: usize,
    /// Gives means and deviations.
    actor: Mlp,
    /// Sees the action too.
    critic: Mlp,
    /// First parameters of the two value networks.
    critic_starts: [usize; 2],
    /// The logarithm of the entropy's weight.
    alpha: usize,
    places: Places,
}

impl Layout {
    fn new(setup: &Setup<'_>) -> Self {
        let (obs, act, network) = (setup.spec.obs, setup.spec.act, setup.common.network);
        let actor = Mlp::new(&[&[obs], &network.actor_hidden[..], &[2 * act]].concat(), network.activation);
        let critic = Mlp::new(&[&[obs + act], &network.critic_hidden[..], &[1]].concat(), network.activation);
        let mut places = Places::default();
        // room for deviations as other algorithms have them: the networks' places are older than this code
        places.add(actor.len() + act);
        let critic_starts = [(); 2].map(|()| places.add(critic.len()).start);
        let alpha = places.add(1).start;
        Self { obs, act, actor, critic, critic_starts, alpha, places }
    }
    fn shape(&self, lanes: usize) -> Shape {
        Shape { obs: self.obs, act: self.act, log_probs: 1, streams: 1, next_obs: true, lanes }
    }
    /// The parameters of the two value networks.
    fn critics<'a>(&self, params: &'a [f32]) -> [&'a [f32]; 2] {
        self.critic_starts.map(|start| &params[start..start + self.critic.len()])
    }
    /// The same of their slow copies.
    fn critics_of_targets<'a>(&self, targets: &'a [f32]) -> [&'a [f32]; 2] {
        self.critic_starts.map(|start| &targets[start - self.critic_starts[0]..][..self.critic.len()])
    }
}

/// The networks with their parameters.
#[derive(Clone)]
struct Networks {
    layout: Layout,
    isa: Isa,
    params: Vec<f32>,
    /// Slow copies of the value networks.
    targets: Vec<f32>,
}

impl Networks {
    /// At the start of a run.
    fn new(setup: &Setup<'_>, init_alpha: f64) -> Self {
        let layout = Layout::new(setup);
        let mut params = vec![0.0; layout.places.len()];
        let mut random = SplitMix::new(setup.common.seed, PARAMETERS);
        let init = setup.common.network.initialization;
        init.policy(&layout.actor, &mut params, &mut random);
        for start in layout.critic_starts {
            init.value(&layout.critic, &mut params[start..], &mut random);
        }
        params[layout.alpha] = Real::ln(init_alpha) as f32;
        let targets = params[layout.critic_starts[0]..layout.alpha].to_vec();
        Self { layout, isa: setup.isa, params, targets }
    }
}

/// What SAC learns with.
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
    /// Of each worker's blocks; all workers read them.
    replays: Arc<Vec<RwLock<Replay>>>,
    space: Option<Box<Space>>,
}

/// Work space of a worker.
struct Space {
    batch: Batch,
    obs: Blocks<f32>,
    joined: Blocks<f32>,
    actor: Tape<f32>,
    critics: [Tape<f32>; 2],
    inputs: [Blocks<f32>; 2],
    z: Vec<f32>,
    action: Vec<f32>,
    log_prob: Vec<f32>,
    target: Vec<f32>,
    gradient: Vec<f32>,
}

impl Space {
    fn new(layout: &Layout) -> Self {
        let row = |n: usize| vec![0.0; n * CHUNK * BLOCK];
        Self {
            batch: Batch::default(),
            obs: layout.actor.input(),
            joined: layout.critic.input(),
            actor: layout.actor.tape(),
            critics: [layout.critic.tape(), layout.critic.tape()],
            inputs: [layout.critic.input(), layout.critic.input()],
            z: row(layout.act),
            action: row(layout.act),
            log_prob: row(1),
            target: row(1),
            gradient: vec![0.0; layout.places.len()],
        }
    }
}

impl SacLearner {
    /// At the start of a run, for workers with so many blocks each.
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
            streams: Stream::all(setup.common.rewards, (setup.spec.obs, setup.spec.act), setup.common.seed, |n| 0..n),
            adam: Adam::new(nets.params.len(), settings.adam_epsilon),
            nets,
            lr: settings.lr,
            skipped: 0,
            replays: Arc::new(blocks.iter().map(replay).collect()),
            space: None,
        }
    }

    /// Takes the rollout in and makes the updates.
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
        self.lr = settings.lr * progress.rate(settings.schedule);
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
                    // noise belongs to the update and the place in the batch
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

    /// One step of Adam of all parts, and of the slow value networks.
    fn step(&mut self, workers: &dyn Workers, progress: &Progress, sums: &LossSums) {
        let Self { settings, nets, adam, lr, .. } = self;
        if !workers.squares().iter().all(|s| s.is_finite()) {
            self.skipped += 1;
            return;
        }
        adam.advance();
        let value_lr = settings.value_lr * progress.rate(settings.schedule);
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
    fn collecting(&self, statistics: &Statistics) -> Collecting<'_> {
        let layout = &self.nets.layout;
        Collecting {
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
            // the replay keeps observations as they are
            values: None,
            reward_scale: statistics.reward_scale() * self.streams[0].strength,
            return_center: statistics.returns.mean[0] as f32,
        }
    }
    /// A replay is normalized anew whenever it is drawn from.
    fn follow(&mut self, _: &Normalizer, _: &Normalizer) {}
    fn describe(&self, _: &Totals, sums: &LossSums) -> Description {
        let per_sample = |x: f64| if sums.samples > 0.0 { x / sums.samples } else { 0.0 };
        // the deviations depend on the state, and the values are not those of a rollout
        Description {
            lr: self.lr,
            skipped: self.skipped,
            explained_variance: 0.0,
            entropy: per_sample(sums.entropy),
            std_mean: per_sample(sums.std),
        }
    }
    /// The means of the policy; its deviations depend on the state and are left out.
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
                        expected: "what the settings make room for".into(),
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

/// Gradient of all parts over a chunk of samples, in `gradient`, which is returned with the sums of the losses.
fn gradient(
    nets: &Networks,
    normalizer: &Normalizer,
    noise: &mut [Noise],
    space: &mut Space,
    gradient: &mut [f32],
) -> LossSums {
    let (layout, isa, act, n) = (&nets.layout, nets.isa, nets.layout.act, noise.len());
    let params = &nets.params;
    let (actor, critics) = (&params[..layout.actor.len()], layout.critics(params));
    let alpha = Real::exp(params[layout.alpha] as f64);
    let Space { batch, obs, joined, actor: tape, critics: tapes, inputs, z, action, log_prob, target, .. } = space;
    let (z, action) = (&mut z[..n * act * BLOCK], &mut action[..n * act * BLOCK]);
    let log_prob = &mut log_prob[..n * BLOCK];

    // what the value networks should say
    normalize(isa, normalizer, &batch.next, obs);
    layout.actor.forward(isa, actor, obs, tape, n);
    draw(isa, tape.output(), noise, (z, action, log_prob), act);
    join(obs, action, act, joined, n);
    for (tape, slow) in tapes.iter_mut().zip(layout.critics_of_targets(&nets.targets)) {
        layout.critic.forward(isa, slow, joined, tape, n);
    }
    for i in 0..n * BLOCK {
        let of = |tape: &Tape<f32>| tape.output().block(i / BLOCK)[i % BLOCK];
        let soft = Real::min(of(&tapes[0]), of(&tapes[1])) - alpha as f32 * log_prob[i];
        let discount = batch.discount[i];
        target[i] = batch.reward[i] + if discount > 0.0 { discount * soft } else { 0.0 };
    }

    // value networks
    let mut sums = LossSums { samples: (n * BLOCK) as f64, ..LossSums::default() };
    normalize(isa, normalizer, &batch.obs, obs);
    join(obs, &batch.action, act, joined, n);
    let starts = layout.critic_starts;
    for ((tape, params), start) in tapes.iter_mut().zip(critics).zip(starts) {
        layout.critic.forward(isa, params, joined, tape, n);
        let (output, delta) = tape.output_and_delta();
        for b in 0..n {
            for (lane, (d, q)) in delta.block_mut(b).iter_mut().zip(output.block(b)).enumerate() {
                *d = q - target[b * BLOCK + lane];
                sums.value += 0.5 * (*d as f64) * (*d as f64);
            }
        }
        let part = &mut gradient[start..start + layout.critic.len()];
        layout.critic.backward(isa, params, joined, tape, part, n);
    }

    // policy: the derivative of the smaller value with respect to the action
    layout.actor.forward(isa, actor, obs, tape, n);
    draw(isa, tape.output(), noise, (z, action, log_prob), act);
    join(obs, action, act, joined, n);
    for (tape, params) in tapes.iter_mut().zip(critics) {
        layout.critic.forward(isa, params, joined, tape, n);
    }
    let [one, two] = tapes;
    for b in 0..n {
        let (q1, d1) = one.output_and_delta();
        let (q2, d2) = two.output_and_delta();
        let rows = q1.block(b).iter().zip(q2.block(b)).zip(d1.block_mut(b).iter_mut().zip(d2.block_mut(b)));
        for (lane, ((q1, q2), (d1, d2))) in rows.enumerate() {
            let first = q1 <= q2;
            (*d1, *d2) = (if first { -1.0 } else { 0.0 }, if first { 0.0 } else { -1.0 });
            let lp = log_prob[b * BLOCK + lane] as f64;
            sums.policy += alpha * lp - if first { *q1 } else { *q2 } as f64;
            sums.entropy -= lp;
        }
    }
    for ((tape, params), input) in [one, two].into_iter().zip(critics).zip(inputs.iter_mut()) {
        layout.critic.input_gradient(isa, params, tape, input, n);
    }
    let minus_q = [&inputs[0], &inputs[1]];
    f32_lanes!(isa, T => <T as Real>::enter(Objective::<T> {
        output: tape.output_and_delta(), z, action, minus_q, first: layout.obs, alpha, act, blocks: n, lanes: PhantomData,
    }));
    let (part, rest) = gradient.split_at_mut(layout.actor.len());
    layout.actor.backward(isa, actor, obs, tape, part, n);
    rest[..act].fill(0.0);

    // weight of the entropy, and the mean deviation
    gradient[layout.alpha] = log_prob.iter().map(|lp| act as f64 - *lp as f64).sum::<f64>() as f32;
    for b in 0..n {
        let logs = &tape.output().block(b)[act * BLOCK..];
        let std = |l: &f32| Real::exp((*l as f64).clamp(LOG_STD[0], LOG_STD[1]));
        sums.std += logs.iter().map(std).sum::<f64>() / act as f64;
    }
    sums
}

fn normalize(isa: Isa, normalizer: &Normalizer, raw: &[f32], input: &mut Blocks<f32>) {
    f32_lanes!(isa, T => <T as Real>::enter(Normalize::<T> {
        normalizer, raw, input, copy: None, sums: None, lanes: PhantomData,
    }));
}

/// Draws actions with the next numbers of each block's noise.
fn draw(
    isa: Isa,
    output: &Blocks<f32>,
    noise: &mut [Noise],
    (z, action, log_prob): (&mut [f32], &mut [f32], &mut [f32]),
    act: usize,
) {
    let blocks = noise.len();
    f32_lanes!(isa, T => {
        <T as Real>::enter(Normals::<T> { noise, z: &mut *z, act, lanes: PhantomData });
        <T as Real>::enter(Draw::<T> { output, z, act, action, log_prob, blocks, lanes: PhantomData });
    });
}

/// Observations and actions side by side.
fn join(obs: &Blocks<f32>, action: &[f32], act: usize, joined: &mut Blocks<f32>, n: usize) {
    for (b, action) in action.chunks_exact(act * BLOCK).take(n).enumerate() {
        let (first, second) = joined.block_mut(b).split_at_mut(obs.features() * BLOCK);
        first.copy_from_slice(obs.block(b));
        second.copy_from_slice(action);
    }
}
