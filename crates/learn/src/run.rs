//! A run: workers that collect, learn and report in step. What is the same for every algorithm that learns from its own
//! rollouts is here; what is each one's own is in [`ppo`], [`a2c`] and [`acktr`].
//!
//! Workers run the same program on their own blocks of agents. One iteration:
//!
//! 1. *Collect*: every worker plays a horizon with its agents ([`Actor::collect`]) and estimates advantages.
//! 2. *Update*: the algorithm. It asks for gradients of an objective over lists of samples ([`Update::gradient`]): a list
//!    is split into groups; whichever worker is free takes the next group and leaves its gradient in that group's place.
//!    Then each worker sums a slice of the gradient over the groups, and all workers apply the same step to their
//!    replicas of the parameters.
//! 3. *Report*: the first worker, which is the caller's thread, tells the observer. With `rollouts` above 1, steps 1 and
//!    2 are done so many times first.
//!
//! The split into groups and the order of every sum depend on the configuration alone, so the result does not depend on
//! the number of workers, nor on who did what. The first rollout has no update: it fills the statistics that normalize
//! observations and rewards, without which the first updates would see inputs and losses of arbitrary size.

use crate::adam;
use crate::buffer::Blocks;
use crate::gaussian::Gaussian;
use crate::kfac::Kfac;
use crate::learner::{Layout, Learner, Totals};
use crate::loss::{Loss, LossSums, Objective, Samples};
use crate::mlp::{CHUNK, Tape};
use crate::observer::{Control, IterationStats, Observer, Snapshot};
use crate::remote::{Players, Remote, Spent, check_algorithm};
use crate::rollout::{Actor, Rollout};
use crate::signal::{MAX_SIGNALS, SignalSpace};
use crate::sync::Barrier;
use crate::{Algorithm, BLOCK, Checkpoint, Error, Policy, PpoConfig, Schedule, a2c, acktr, clock, f32_lanes, ppo, sac};
use marathon_envs::{ShardFactory, Spec};
use marathon_physics::lanes::{Isa, Real};
use std::marker::PhantomData;
use std::ops::Range;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, RwLock, RwLockReadGuard};

/// Most groups of a minibatch: bounds the memory for partial gradients and the threads that can share a minibatch.
const MAX_GROUPS: usize = 32;

/// Networks of a run at most: policy, value function, signals.
pub const NETWORKS: usize = 2 + MAX_SIGNALS;

/// What a finished run returns.
#[derive(Debug)]
pub struct TrainOutput {
    /// The trained policy.
    pub policy: Policy,
    /// Everything needed to go on.
    pub checkpoint: Checkpoint,
    /// Statistics of the last iteration of this call, if there was one.
    pub last: Option<IterationStats>,
}

/// Trains a policy until `config.total_steps` are done or the observer asks to stop.
///
/// With `resume`, goes on from a checkpoint, with the same bits as if it had never stopped. The same seed gives the same
/// policy for any number of threads and any instruction set.
///
/// # Errors
/// If the configuration is invalid, or the checkpoint belongs to another task, network or number of agents.
///
/// # Panics
/// If an environment or the observer panics; all workers end.
pub fn train(
    factory: &dyn ShardFactory,
    isa: Isa,
    config: &PpoConfig,
    resume: Option<Checkpoint>,
    observer: &mut dyn Observer,
) -> Result<TrainOutput, Error> {
    train_with(None, factory, isa, config, resume, observer)
}

/// The same with rollouts that `players` play; the policy has the same bits. Its threads only learn.
///
/// # Errors
/// The same, and if what the players deliver does not fit.
///
/// # Panics
/// As [`train`].
pub fn train_with(
    players: Option<&mut dyn Players>,
    factory: &dyn ShardFactory,
    isa: Isa,
    config: &PpoConfig,
    resume: Option<Checkpoint>,
    observer: &mut dyn Observer,
) -> Result<TrainOutput, Error> {
    config.validate()?;
    if isa == Isa::F64 || !isa.supported() {
        return Err(Error::Isa(isa.name(), Isa::best().name()));
    }
    if players.is_some() {
        check_algorithm(config)?;
    }
    let (mut run, mut learner) = Run::new(factory, isa, config);
    let mut remote = players.map(|players| Remote::new(players, config));
    run.elsewhere = remote.is_some();
    let mut clocks = Clocks::default();
    if let Some(checkpoint) = resume {
        checkpoint.restore(&run, &mut learner, &mut clocks)?;
    }

    let replicas: Vec<Learner> = (1..run.workers()).map(|_| learner.clone()).collect();
    let last = std::thread::scope(|scope| {
        for (id, replica) in (1..).zip(replicas) {
            let run = &run;
            scope.spawn(move || run.work(id, replica, None));
        }
        let remote = remote.as_mut();
        let mut head = Head { observer, clocks: &mut clocks, learner: &mut learner, remote, last: None };
        let replica = head.learner.clone();
        run.work(0, replica, Some(&mut head));
        head.last
    });
    if let Some(error) = remote.and_then(|remote| remote.error) {
        return Err(error);
    }
    let snapshot = Snapshot::new(&run, &learner, &clocks);
    Ok(TrainOutput { policy: snapshot.policy(), checkpoint: snapshot.checkpoint(), last })
}

/// Seconds used by a run, over all its parts before and after interruptions.
#[derive(Clone, Copy, Debug, Default)]
pub struct Clocks {
    /// Wall-clock time, without the observer's.
    pub wall: f64,
    /// Processor time of all workers, without the observer's.
    pub cpu: f64,
}

/// What the first worker has besides.
struct Head<'a, 'p> {
    observer: &'a mut dyn Observer,
    clocks: &'a mut Clocks,
    learner: &'a mut Learner,
    remote: Option<&'a mut Remote<'p>>,
    last: Option<IterationStats>,
}

/// What the workers share.
pub struct Run<'a> {
    pub isa: Isa,
    pub config: &'a PpoConfig,
    pub spec: Spec,
    pub layout: Layout,
    pub actors: Vec<Mutex<Actor>>,
    pub rollouts: Vec<RwLock<Rollout>>,
    /// Gradients of the groups of the current list of samples.
    partials: Vec<RwLock<Partial>>,
    /// Sums over the groups, a slice per worker.
    slices: Vec<RwLock<Slice>>,
    norm_blocks: Vec<Range<usize>>,
    /// Next part of a piece of shared work to be taken, for each piece of a rollout.
    tickets: Vec<AtomicUsize>,
    seconds: Vec<Mutex<Seconds>>,
    barrier: Barrier,
    stop: AtomicBool,
    /// Whether others play in the place of the actors, which then only keep the states of the agents.
    elsewhere: bool,
    /// What only ACKTR has.
    pub kfac: Option<Kfac>,
    /// What only SAC has.
    pub sac: Option<sac::Shared>,
}

/// Seconds that a worker spent in the current iteration.
#[derive(Clone, Copy, Default)]
struct Seconds {
    cpu: f64,
    env: f64,
    collect: f64,
    update: f64,
}

/// What a group of samples contributes.
pub struct Partial {
    pub gradient: Vec<f32>,
    /// Sums for the factors of the Fisher matrix, for ACKTR.
    pub moments: Vec<f32>,
    pub sums: LossSums,
}

struct Slice {
    gradient: Vec<f32>,
    squares: Vec<f64>,
}

/// A worker's space for computing gradients.
pub struct Workspace {
    input: Blocks<f32>,
    actor: Tape<f32>,
    critic: Tape<f32>,
    signals: Vec<SignalSpace>,
    gradient: Vec<f32>,
    moments: Vec<f32>,
    rows: Vec<[f32; BLOCK]>,
    pub sac: Option<Box<sac::Space>>,
}

/// Sums over an iteration's updates.
#[derive(Default)]
struct Means {
    sums: LossSums,
    samples: f64,
}

impl<'a> Run<'a> {
    fn new(factory: &dyn ShardFactory, isa: Isa, config: &'a PpoConfig) -> (Self, Learner) {
        let spec = factory.spec().clone();
        let layout = Layout::new(&spec, config);
        let (workers, blocks) = (config.worker_count(), config.blocks());
        let mut actors = Vec::new();
        let mut rollouts = Vec::new();
        for id in 0..workers {
            let share = share(blocks, workers, id);
            let place = (share.start, share.len());
            actors.push(Mutex::new(Actor::new(factory, place, config.seed, &layout)));
            rollouts.push(RwLock::new(Rollout::new(share.len(), config.horizon, (spec.obs, spec.act), &layout)));
        }
        let largest = (0..config.minibatches).map(|m| share(item_count(config), config.minibatches, m).len()).max();
        let groups = group_count(largest.unwrap_or(1));
        let kfac = match &config.algorithm {
            Algorithm::Acktr(_) => Some(Kfac::new(&layout)),
            _ => None,
        };
        let sac = match &config.algorithm {
            Algorithm::Sac(settings) => {
                let of_workers: Vec<usize> = (0..workers).map(|id| share(blocks, workers, id).len()).collect();
                Some(sac::Shared::new(settings, config.agents, &of_workers, (spec.obs, spec.act)))
            }
            _ => None,
        };
        let (pieces, groups) = match &config.algorithm {
            Algorithm::Sac(sac) => (sac.updates, group_count(sac.batch / BLOCK)),
            _ => (config.epochs * config.minibatches, groups),
        };
        let moments = kfac.as_ref().map_or(0, Kfac::moments_len);
        let partial =
            || Partial { gradient: vec![0.0; layout.len], moments: vec![0.0; moments], sums: LossSums::default() };
        let norm_blocks = layout.norm_blocks();
        let slice = |id| {
            let own = &norm_blocks[share(norm_blocks.len(), workers, id)];
            Slice { gradient: vec![0.0; own.iter().map(|r| r.len()).sum()], squares: vec![0.0; own.len()] }
        };
        let learner = Learner::new(&layout, &spec, config);
        let run = Self {
            isa,
            config,
            actors,
            rollouts,
            partials: (0..groups).map(|_| RwLock::new(partial())).collect(),
            slices: (0..workers).map(|id| RwLock::new(slice(id))).collect(),
            norm_blocks,
            // one more than minibatches: ACKTR shares the factors of the layers out as well
            tickets: (0..=pieces).map(|_| AtomicUsize::new(0)).collect(),
            seconds: (0..workers).map(|_| Mutex::default()).collect(),
            barrier: Barrier::new(workers),
            stop: AtomicBool::new(false),
            elsewhere: false,
            kfac,
            sac,
            spec,
            layout,
        };
        (run, learner)
    }

    fn workers(&self) -> usize {
        self.rollouts.len()
    }

    /// The program of worker `id`.
    fn work(&self, id: usize, mut learner: Learner, mut head: Option<&mut Head<'_, '_>>) {
        let _guard = self.barrier.guard();
        let Layout { actor, critic, .. } = &self.layout;
        let mut space = Workspace {
            input: actor.input(),
            actor: actor.tape(),
            critic: critic.tape(),
            signals: self.layout.signals.iter().map(|(nets, _)| nets.space()).collect(),
            gradient: vec![0.0; self.layout.len],
            moments: vec![0.0; self.kfac.as_ref().map_or(0, Kfac::moments_len)],
            rows: vec![[0.0; BLOCK]; self.spec.act],
            sac: self.sac.as_ref().map(|_| Box::new(sac::Space::new(self))),
        };
        let mut done = learner.steps >= self.config.total_steps;
        while !done {
            let (cpu, start) = (clock::thread_cpu(), clock::wall());
            let (mut seconds, mut totals, mut means) = (Seconds::default(), Totals::default(), Means::default());
            let mut cpu_elsewhere = 0.0;
            // a run that was given up halfway goes on there
            let first = learner.iteration % self.config.rollouts as u64;
            for n in first..self.config.rollouts as u64 {
                let begin = clock::wall();
                let spent = self.collect(id, &learner, head.as_deref_mut());
                seconds.env += spent.env;
                cpu_elsewhere += spent.cpu_elsewhere;
                seconds.collect += clock::wall() - begin;
                if id == 0 {
                    self.tickets.iter().for_each(|t| t.store(0, Ordering::Relaxed));
                }
                self.barrier.wait();
                if self.stop.load(Ordering::Acquire) {
                    // those who play elsewhere have given up
                    if n == first {
                        return;
                    }
                    break;
                }

                let begin = clock::wall();
                totals.add(&self.learn(id, &mut learner, &mut space, &mut means));
                seconds.update += clock::wall() - begin;
                seconds.cpu = clock::thread_cpu() - cpu + cpu_elsewhere;
                *self.seconds[id].lock().expect("no worker has panicked") = seconds;
                self.barrier.wait();
            }
            done = learner.steps >= self.config.total_steps;
            if let Some(head) = &mut head {
                self.report(head, &learner, &totals, &means, clock::wall() - start);
            }
            self.barrier.wait();
            done |= self.stop.load(Ordering::Acquire);
        }
    }

    /// Learns from the rollout of all workers.
    fn learn(&self, id: usize, learner: &mut Learner, space: &mut Workspace, means: &mut Means) -> Totals {
        let rollouts: Vec<_> = self.rollouts.iter().map(|r| r.read().expect("no worker has panicked")).collect();
        let totals = Totals::new(&rollouts, self.config.horizon);
        // the first rollout only fills the statistics, and a replay
        if learner.iteration > 0 || self.sac.is_some() {
            let rollouts: Vec<&Rollout> = rollouts.iter().map(|r| &**r).collect();
            // which rollout a block is in, and its place there
            let place = rollouts.iter().enumerate().flat_map(|(r, x)| (0..x.blocks()).map(move |b| (r, b))).collect();
            let update = Update { run: self, id, learner, totals: &totals, rollouts, place, space, means };
            match &self.config.algorithm {
                Algorithm::Ppo => ppo::update(update),
                Algorithm::A2c(a2c) => a2c::update(update, a2c),
                Algorithm::Acktr(acktr) => acktr::update(update, acktr),
                Algorithm::Sac(sac) => sac::update(update, sac),
            }
        }
        learner.absorb(&totals, self.config);
        totals
    }

    /// Plays a horizon with the worker's agents. If others play, the first worker has them play all agents.
    fn collect(&self, id: usize, learner: &Learner, head: Option<&mut Head<'_, '_>>) -> Spent {
        if self.elsewhere {
            let Some(remote) = head.and_then(|head| head.remote.as_mut()) else { return Spent::default() };
            let spent = remote.collect(self, learner);
            return spent.unwrap_or_else(|| {
                self.stop.store(true, Ordering::Release);
                Spent::default()
            });
        }
        let mut actor = self.actors[id].lock().expect("no worker has panicked");
        let mut rollout = self.rollouts[id].write().expect("no worker has panicked");
        let env = learner.acting(self.isa, &self.layout, self.config, |acting| actor.collect(acting, &mut rollout));
        Spent { env, cpu_elsewhere: 0.0 }
    }

    /// A setting on its linear way from `first` to `last` over the run; it stays where there is no `last`.
    pub fn moved(&self, learner: &Learner, first: f64, last: Option<f64>) -> f64 {
        let progress = (learner.steps as f64 / self.config.total_steps as f64).min(1.0);
        first + (last.unwrap_or(first) - first) * progress
    }

    /// The part of its first value that a learning rate still has under the linear schedule; 1 under the others.
    pub fn linear(&self, learner: &Learner) -> f64 {
        match self.config.schedule {
            // an iteration of several rollouts may lead beyond the end
            Schedule::Linear => (1.0 - learner.steps as f64 / self.config.total_steps as f64).max(0.0),
            Schedule::Constant | Schedule::Adaptive => 1.0,
        }
    }

    /// Number of blocks of samples in a rollout.
    pub fn items(&self) -> usize {
        item_count(self.config)
    }

    /// Keeps the standard deviations of the actions within their bounds.
    pub fn bound_std(&self, learner: &mut Learner) {
        let min_std = self.moved(learner, self.config.min_std, self.config.final_min_std);
        let [low, high] = [min_std, self.config.max_std].map(|s| Real::ln(s) as f32);
        learner.params[self.layout.log_std.clone()].iter_mut().for_each(|l| *l = l.clamp(low, high));
    }

    /// Sums of the squares of the gradient that the last [`Update::gradient`] left: of the policy's part, of the value
    /// function's, and of the signals'.
    pub fn squares(&self) -> [f64; NETWORKS] {
        let mut squares = [0.0; NETWORKS];
        let slices = self.slices.iter().map(|s| s.read().expect("no worker has panicked"));
        let all = slices.flat_map(|s| s.squares.clone());
        for (range, square) in self.norm_blocks.iter().zip(all) {
            squares[self.layout.network(range)] += square;
        }
        squares
    }

    /// Shows every piece of that gradient with its place among the parameters; no piece is in two networks.
    pub fn pieces(&self, mut show: impl FnMut(Range<usize>, &[f32])) {
        let mut ranges = self.norm_blocks.iter();
        for slice in &self.slices {
            let slice = slice.read().expect("no worker has panicked");
            let mut rest = &slice.gradient[..];
            for range in ranges.by_ref().take(slice.squares.len()) {
                let (gradient, after) = rest.split_at(range.len());
                show(range.clone(), gradient);
                rest = after;
            }
        }
    }

    /// Gradient of the objective summed over a group of items, a chunk at a time.
    fn gradient<'r, C>(
        &self,
        learner: &Learner,
        gaussian: &Gaussian<f32>,
        objective: Objective,
        chunks: &mut dyn Iterator<Item = C>,
        space: &mut Workspace,
        partial: &mut Partial,
    ) where
        C: Iterator<Item = (&'r Rollout, usize)>,
    {
        let (layout, isa) = (&self.layout, self.isa);
        let (actor, critic) = (layout.actor_params(&learner.params), layout.critic_params(&learner.params));
        partial.sums = LossSums::default();
        for (i, chunk) in chunks.enumerate() {
            let mut samples = [Samples { action: &[], log_prob: &[], advantage: &[], value: &[], target: &[] }; CHUNK];
            let (mut n, mut steps) = (0, Vec::new());
            for (rollout, item) in chunk {
                space.input.block_mut(n).copy_from_slice(rollout.obs(item));
                samples[n] = rollout.samples(item);
                n += 1;
                if !layout.signals.is_empty() {
                    steps.push(rollout.step(item));
                }
            }
            // the first chunk's gradient needs no sum
            let gradient = if i == 0 { &mut partial.gradient } else { &mut space.gradient };
            for ((nets, place), space) in layout.signals.iter().zip(&mut space.signals) {
                nets.gradient(isa, &learner.params[place.clone()], &steps, space, &mut gradient[place.clone()]);
            }
            let (of_actor, of_critic) = gradient.split_at_mut(layout.critic_start);
            let (of_net, of_std) = of_actor.split_at_mut(layout.actor.len());
            layout.actor.forward(isa, actor, &space.input, &mut space.actor, n);
            layout.critic.forward(isa, critic, &space.input, &mut space.critic, n);
            partial.sums += f32_lanes!(isa, T => <T as Real>::enter(Loss::<T> {
                objective,
                gaussian,
                samples: &samples[..n],
                mean: space.actor.output_and_delta(),
                value: space.critic.output_and_delta(),
                d_log_std: &mut of_std[..self.spec.act],
                rows: &mut space.rows,
                lanes: PhantomData,
            }));
            layout.actor.backward(isa, actor, &space.input, &mut space.actor, of_net, n);
            let of_critic = &mut of_critic[..layout.critic.len()];
            layout.critic.backward(isa, critic, &space.input, &mut space.critic, of_critic, n);
            if i > 0 {
                adam::add(isa, &mut partial.gradient, &space.gradient);
            }
            if let Some(kfac) = &self.kfac {
                let moments = if i == 0 { &mut partial.moments } else { &mut space.moments };
                let tapes = (&mut space.actor, &mut space.critic);
                kfac.moments(isa, (actor, critic), gaussian, &samples[..n], &space.input, tapes, moments);
                if i > 0 {
                    adam::add(isa, &mut partial.moments, &space.moments);
                }
            }
        }
    }

    /// Sums the worker's slice of the gradient over the groups; returns the sums of the whole minibatch.
    fn reduce(&self, id: usize, groups: usize) -> LossSums {
        let partials: Vec<_> =
            self.partials[..groups].iter().map(|p| p.read().expect("no worker has panicked")).collect();
        let mut slice = self.slices[id].write().expect("no worker has panicked");
        let Slice { gradient, squares } = &mut *slice;
        let mut rest = &mut gradient[..];
        for (square, range) in
            squares.iter_mut().zip(&self.norm_blocks[share(self.norm_blocks.len(), self.workers(), id)])
        {
            let (out, after) = rest.split_at_mut(range.len());
            let parts: [&[f32]; MAX_GROUPS] = std::array::from_fn(|g| match partials.get(g) {
                Some(p) => &p.gradient[range.clone()],
                None => &[],
            });
            *square = adam::reduce(self.isa, &parts[..groups], out);
            rest = after;
        }
        let mut sums = LossSums::default();
        partials.iter().for_each(|p| sums += p.sums);
        sums
    }

    /// Tells the observer about the iteration.
    fn report(&self, head: &mut Head<'_, '_>, learner: &Learner, totals: &Totals, means: &Means, wall: f64) {
        let mut seconds = Seconds::default();
        for of_worker in &self.seconds {
            let s = of_worker.lock().expect("no worker has panicked");
            seconds.cpu += s.cpu;
            seconds.env += s.env;
            seconds.collect += s.collect;
            seconds.update += s.update;
        }
        head.clocks.wall += wall;
        head.clocks.cpu += seconds.cpu;
        head.learner.clone_from(learner);

        let (sums, gaussian) = (&totals.sums, learner.gaussian(&self.layout));
        let per_episode = |x: f64| (sums.episodes > 0.0).then(|| x / sums.episodes);
        let per_sample = |x: f64| if means.samples > 0.0 { x / means.samples } else { 0.0 };
        let signals = self.config.signals.iter().zip(&sums.signals);
        let worked = (seconds.collect + seconds.update).max(1e-12);
        let stats = IterationStats {
            iteration: learner.iteration,
            steps: learner.steps,
            wall_seconds: head.clocks.wall,
            cpu_seconds: head.clocks.cpu,
            env_share: seconds.env / worked,
            update_share: seconds.update / worked,
            episodes: sums.episodes as u64,
            return_mean: per_episode(sums.returns),
            length_mean: per_episode(sums.lengths),
            speed_mean: per_episode(sums.speeds / self.spec.dt),
            fall_fraction: per_episode(sums.falls),
            diverged: sums.diverged as u64,
            reward_terms: sums.terms.iter().map(|x| x / totals.samples).collect(),
            kl: if self.sac.is_some() { 0.0 } else { per_sample(means.sums.kl) },
            clip_fraction: if self.sac.is_some() { 0.0 } else { per_sample(means.sums.clipped) },
            policy_loss: per_sample(means.sums.policy),
            value_loss: per_sample(means.sums.value),
            explained_variance: if self.sac.is_some() { 0.0 } else { totals.explained_variance() },
            // SAC's depend on the state: means over the updates
            entropy: if self.sac.is_some() { per_sample(means.sums.kl) } else { gaussian.entropy() },
            std_mean: if self.sac.is_some() { per_sample(means.sums.clipped) } else { gaussian.mean_std() },
            lr: learner.lr,
            skipped_minibatches: learner.skipped,
            signal_rewards: signals.map(|(signal, x)| (signal.kind, x / totals.samples)).collect(),
        };
        let snapshot = Snapshot::new(self, head.learner, head.clocks);
        if head.observer.iteration(&stats, &snapshot) == Control::Stop {
            self.stop.store(true, Ordering::Release);
        }
        head.last = Some(stats);
    }
}

/// A worker's part in learning from a rollout.
pub struct Update<'u> {
    pub run: &'u Run<'u>,
    pub id: usize,
    /// The worker's replica: every worker must change it alike.
    pub learner: &'u mut Learner,
    /// Sums over the rollout.
    pub totals: &'u Totals,
    rollouts: Vec<&'u Rollout>,
    place: Vec<(usize, usize)>,
    space: &'u mut Workspace,
    means: &'u mut Means,
}

impl Update<'_> {
    /// Leaves the gradient of an objective, summed over a list of items of the rollout, in the run, together with all
    /// other workers; returns the sums of the objective. `piece` counts the calls in a rollout.
    pub fn gradient(&mut self, items: &[u32], piece: usize, objective: Objective) -> LossSums {
        let (run, groups) = (self.run, group_count(items.len()));
        let gaussian = self.learner.gaussian(&run.layout);
        while let Some(group) = self.take(piece, groups) {
            let of_group = &items[share(items.len(), groups, group)];
            let mut partial = run.partials[group].write().expect("no worker has panicked");
            let (place, rollouts) = (&self.place, &self.rollouts);
            let mut chunks = of_group.chunks(CHUNK).map(|chunk| {
                chunk.iter().map(|item| {
                    let (t, b) = (*item as usize / place.len(), *item as usize % place.len());
                    let (r, local) = place[b];
                    (rollouts[r], t * rollouts[r].blocks() + local)
                })
            });
            run.gradient(self.learner, &gaussian, objective, &mut chunks, self.space, &mut partial);
        }
        run.barrier.wait();
        let sums = run.reduce(self.id, groups);
        run.barrier.wait();
        self.means.samples += sums.samples;
        self.means.sums += sums;
        sums
    }

    /// As [`Update::gradient`], for a list of so many items of another kind: `work` fills a group's part, for the items of
    /// a range.
    pub fn share_out(
        &mut self,
        piece: usize,
        items: usize,
        mut work: impl FnMut(Range<usize>, &Learner, &mut Partial, &mut Workspace),
    ) -> LossSums {
        let (run, groups) = (self.run, group_count(items));
        while let Some(group) = self.take(piece, groups) {
            let mut partial = run.partials[group].write().expect("no worker has panicked");
            work(share(items, groups, group), self.learner, &mut partial, self.space);
        }
        run.barrier.wait();
        let sums = run.reduce(self.id, groups);
        run.barrier.wait();
        self.means.samples += sums.samples;
        self.means.sums += sums;
        sums
    }

    /// The worker's own rollout.
    pub fn own_rollout(&self) -> &Rollout {
        self.rollouts[self.id]
    }

    /// Which worker has each block, and its place there.
    pub fn place(&self) -> &[(usize, usize)] {
        &self.place
    }

    /// The next of `parts` parts of a piece of work that nobody has taken yet.
    pub fn take(&self, piece: usize, parts: usize) -> Option<usize> {
        let part = self.run.tickets[piece].fetch_add(1, Ordering::Relaxed);
        (part < parts).then_some(part)
    }

    /// What the groups of the last gradient contributed, in their order; `items` is the length of its list.
    pub fn partials(&self, items: usize) -> Vec<RwLockReadGuard<'_, Partial>> {
        let of_groups = &self.run.partials[..group_count(items)];
        of_groups.iter().map(|p| p.read().expect("no worker has panicked")).collect()
    }

    /// The whole gradient of the last [`Update::gradient`], in a place of the worker's own.
    pub fn whole_gradient(&mut self) -> &[f32] {
        let whole = &mut self.space.gradient;
        self.run.pieces(|range, piece| whole[range].copy_from_slice(piece));
        whole
    }

    /// Waits for all workers.
    pub fn wait(&self) {
        self.run.barrier.wait();
    }

    /// Notes the divergence of a step that is known without looking at samples, in place of the estimate.
    pub fn set_kl(&mut self, estimate: f64, sums: &LossSums) {
        self.means.sums.kl += (estimate * sums.samples) - sums.kl;
    }
}

/// Pairs of decision and block in a rollout.
fn item_count(config: &PpoConfig) -> usize {
    config.blocks() * config.horizon
}

/// Part `i` of `0..n` split into `parts` nearly equal runs.
pub fn share(n: usize, parts: usize, i: usize) -> Range<usize> {
    n * i / parts..n * (i + 1) / parts
}

/// Groups that a list of items is split into.
fn group_count(items: usize) -> usize {
    items.div_ceil(CHUNK).clamp(1, MAX_GROUPS)
}
