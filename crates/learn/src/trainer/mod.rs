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

mod barrier;
pub mod checkpoint;
pub mod clock;
pub mod config;
pub mod evaluate;
mod memory;
pub mod observer;
pub mod remote;
pub mod workers;

use crate::algorithms::a2c;
use crate::algorithms::acktr;
use crate::algorithms::parameters::{Layout, Learner, Totals};
use crate::algorithms::ppo;
use crate::algorithms::sac;
use crate::error::Error;
use crate::lanes::BLOCK;
use crate::optim::kfac::Kfac;
use crate::policy::Policy;
use crate::rewards::MAX_SIGNALS;
use crate::rollout::collect::{Actor, Rollout};
use crate::trainer::barrier::Barrier;
use crate::trainer::checkpoint::Checkpoint;
use crate::trainer::config::Algorithm;
use crate::trainer::config::PpoConfig;
use crate::trainer::config::Schedule;
use crate::trainer::observer::{Control, IterationStats, Observer, Snapshot};
use crate::trainer::remote::{Players, Remote, Spent, check_algorithm};
use crate::trainer::workers::{Means, Partial, Slice, Update, Workspace, group_count};
use marathon_envs::{ShardFactory, Spec};
use marathon_physics::lanes::{Isa, Real};
use std::ops::Range;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, RwLock};

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
/// If the configuration is invalid, the checkpoint belongs to another task, network or number of agents, the run needs more
/// memory than there is, or a parameter is no longer finite.
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
    memory::check(factory.spec(), config)?;
    let (mut run, mut learner) = Run::new(factory, isa, config);
    let mut remote = players.map(|players| Remote::new(players, config));
    run.elsewhere = remote.is_some();
    let mut clocks = Clocks::default();
    if let Some(checkpoint) = resume {
        checkpoint.restore(&run, &mut learner, &mut clocks)?;
    }

    let replicas: Vec<Learner> = (1..run.workers()).map(|_| learner.clone()).collect();
    let (last, diverged) = std::thread::scope(|scope| {
        for (id, replica) in (1..).zip(replicas) {
            let run = &run;
            scope.spawn(move || run.work(id, replica, None));
        }
        let remote = remote.as_mut();
        let mut head =
            Head { observer, clocks: &mut clocks, learner: &mut learner, remote, last: None, diverged: None };
        let replica = head.learner.clone();
        run.work(0, replica, Some(&mut head));
        (head.last, head.diverged)
    });
    if let Some(error) = diverged {
        return Err(error);
    }
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
    /// Why there is nothing more to learn.
    diverged: Option<Error>,
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
    pub partials: Vec<RwLock<Partial>>,
    /// Sums over the groups, a slice per worker.
    pub slices: Vec<RwLock<Slice>>,
    pub norm_blocks: Vec<Range<usize>>,
    /// Next part of a piece of shared work to be taken, for each piece of a rollout.
    pub tickets: Vec<AtomicUsize>,
    seconds: Vec<Mutex<Seconds>>,
    pub barrier: Barrier,
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
        let norm_blocks = layout.norm_blocks();
        let slice = |id| Slice::new(&norm_blocks[share(norm_blocks.len(), workers, id)]);
        let learner = Learner::new(&layout, &spec, config);
        let run = Self {
            isa,
            config,
            actors,
            rollouts,
            partials: (0..groups).map(|_| RwLock::new(Partial::new(layout.len, moments))).collect(),
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

    /// Number of workers.
    pub fn workers(&self) -> usize {
        self.rollouts.len()
    }

    /// The program of worker `id`.
    fn work(&self, id: usize, mut learner: Learner, mut head: Option<&mut Head<'_, '_>>) {
        let _guard = self.barrier.guard();
        let mut space = Workspace::new(self);
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
        learner.absorb(&totals, &self.layout, self.config);
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
        let count = learner.params.iter().filter(|x| !x.is_finite()).count();
        if count > 0 {
            let PpoConfig { lr, value_lr, .. } = *self.config;
            let parameters = learner.params.len();
            head.diverged = Some(Error::Diverged { count, parameters, steps: learner.steps, lr, value_lr });
            self.stop.store(true, Ordering::Release);
            return;
        }

        let (sums, gaussian) = (&totals.sums, learner.gaussian(&self.layout));
        let per_episode = |x: f64| (sums.episodes > 0.0).then(|| x / sums.episodes);
        let per_sample = |x: f64| if means.samples > 0.0 { x / means.samples } else { 0.0 };
        let signals = self.config.signals.iter().zip(&sums.signals);
        let (explained_variance, entropy, std_mean) = match self.sac {
            // the deviations depend on the state, and the values are not those of a rollout
            Some(_) => (0.0, per_sample(means.sums.entropy), per_sample(means.sums.std)),
            None => (totals.explained_variance(), gaussian.entropy(), gaussian.mean_std()),
        };
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
            kl: per_sample(means.sums.kl),
            clip_fraction: per_sample(means.sums.clipped),
            policy_loss: per_sample(means.sums.policy),
            value_loss: per_sample(means.sums.value),
            explained_variance,
            entropy,
            std_mean,
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

/// Pairs of decision and block in a rollout.
fn item_count(config: &PpoConfig) -> usize {
    config.blocks() * config.horizon
}

/// Part `i` of `0..n` split into `parts` nearly equal runs.
pub fn share(n: usize, parts: usize, i: usize) -> Range<usize> {
    n * i / parts..n * (i + 1) / parts
}
