//! A run: workers that collect, learn and report in step.
//!
//! Workers run the same program on their own blocks of agents. One iteration:
//!
//! 1. *Collect*: every worker plays a horizon with its agents ([`Collector::collect`]) and estimates advantages.
//! 2. *Update*: the algorithm ([`Learner::update`]), which shares its work out among the [`workers`]. All workers apply the
//!    same steps to their replicas.
//! 3. *Report*: the numbers of the iteration. With `rollouts` above 1, steps 1 and 2 are done so many times first.
//!
//! The first worker is the caller's thread; with one worker there is no other. The first rollout has no update: it fills the
//! statistics that normalize observations and rewards, without which the first updates would see inputs and losses of
//! arbitrary size.

mod barrier;
pub mod checkpoint;
mod clock;
pub mod config;
pub mod evaluate;
mod flat;
mod memory;
pub mod observer;
pub mod remote;
mod states;
pub mod stats;
mod workers;

use crate::algorithms::loss::LossSums;
use crate::algorithms::schedule::Progress;
use crate::algorithms::{Learner, Needs, Now, share};
use crate::error::Error;
use crate::policy::{Policy, PolicyMeta, Training};
use crate::rollout::collect::Collector;
use crate::rollout::data::{Experience, Rollout};
use crate::rollout::statistics::Statistics;
use crate::rollout::sums::Totals;
use checkpoint::Checkpoint;
use config::{RunConfig, TrainConfig};
use marathon_envs::{ShardFactory, Spec};
use marathon_physics::lanes::Isa;
use observer::{Control, Observer, Snapshot};
use remote::{Players, Remote, Spent, check_algorithm};
use stats::IterationStats;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use workers::{Crew, Worker};

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
    config: &TrainConfig,
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
    mut players: Option<&mut dyn Players>,
    factory: &dyn ShardFactory,
    isa: Isa,
    config: &TrainConfig,
    resume: Option<Checkpoint>,
    observer: &mut dyn Observer,
) -> Result<TrainOutput, Error> {
    if players.is_some() {
        config.validate()?;
        check_algorithm(config)?;
    }
    let mut trainer = match resume {
        None => Trainer::new(factory, isa, config)?,
        Some(checkpoint) => Trainer::resume(factory, isa, config, checkpoint)?,
    };
    let mut last = None;
    while !trainer.is_done() {
        let stats = match &mut players {
            None => trainer.iterate()?,
            Some(players) => match trainer.iterate_with(&mut **players)? {
                Some(stats) => stats,
                None => break,
            },
        };
        let control = observer.iteration(&stats, &Snapshot(&trainer));
        last = Some(stats);
        if control == Control::Stop {
            break;
        }
    }
    Ok(TrainOutput { policy: trainer.policy(), checkpoint: trainer.checkpoint(), last })
}

/// A run that is made an iteration at a time.
pub struct Trainer {
    shared: Arc<Shared>,
    /// The first worker's.
    replica: Replica,
    /// The other workers.
    threads: Vec<JoinHandle<()>>,
    clocks: Clocks,
}

/// Seconds used by a run, over all its parts before and after interruptions.
#[derive(Clone, Copy, Debug, Default)]
struct Clocks {
    /// Wall-clock time of iterations.
    wall: f64,
    /// Processor time of all workers in them.
    cpu: f64,
}

/// What all threads of a run share.
struct Shared {
    config: TrainConfig,
    spec: Spec,
    crew: Crew,
    seconds: Vec<Mutex<Seconds>>,
    /// Those who play elsewhere have given up.
    stop: AtomicBool,
    /// Whether others play in the place of the collectors, which then only keep the states of the agents.
    elsewhere: AtomicBool,
    /// The run is over for the other threads.
    quit: AtomicBool,
}

/// What learning changes; every worker has the same.
struct Replica {
    learner: Box<dyn Learner>,
    statistics: Statistics,
    progress: Progress,
}

impl Replica {
    fn copy(&self) -> Self {
        Self { learner: self.learner.replica(), statistics: self.statistics.clone(), progress: self.progress }
    }

    /// Takes in the statistics of a rollout.
    fn absorb(&mut self, totals: &Totals) {
        if let Some([before, after]) = self.statistics.absorb(totals, self.progress.iteration == 0) {
            self.learner.follow(&before, &after);
        }
        self.progress.iteration += 1;
        self.progress.steps += totals.samples as u64;
    }
}

/// Seconds that a worker spent in the current iteration.
#[derive(Clone, Copy, Default)]
struct Seconds {
    cpu: f64,
    env: f64,
    collect: f64,
    update: f64,
}

/// Sums over an iteration.
#[derive(Default)]
struct Sums {
    totals: Totals,
    updates: LossSums,
}

impl Trainer {
    /// A run at its start.
    ///
    /// # Errors
    /// If the configuration is invalid, or the run needs more memory than there is.
    pub fn new(factory: &dyn ShardFactory, isa: Isa, config: &TrainConfig) -> Result<Self, Error> {
        Self::make(factory, isa, config, None)
    }

    /// A run that goes on from a checkpoint, with the same bits as if it had never stopped.
    ///
    /// # Errors
    /// The same, and if the checkpoint belongs to another task, network or number of agents.
    pub fn resume(
        factory: &dyn ShardFactory,
        isa: Isa,
        config: &TrainConfig,
        checkpoint: Checkpoint,
    ) -> Result<Self, Error> {
        Self::make(factory, isa, config, Some(checkpoint))
    }

    fn make(
        factory: &dyn ShardFactory,
        isa: Isa,
        config: &TrainConfig,
        resume: Option<Checkpoint>,
    ) -> Result<Self, Error> {
        config.validate()?;
        if isa == Isa::F64 || !isa.supported() {
            return Err(Error::Isa(isa.name(), Isa::best().name()));
        }
        let spec = factory.spec().clone();
        let setup = config.setup(&spec, isa);
        memory::check(&setup, config)?;
        let (workers, blocks) = (config.run.worker_count(), config.run.blocks());
        let shares: Vec<_> = (0..workers).map(|id| share(blocks, workers, id)).collect();
        let of_workers: Vec<usize> = shares.iter().map(|share| share.len()).collect();
        let replica = Replica {
            learner: config.algorithm.learner(&setup, &of_workers),
            statistics: Statistics::new(spec.obs, config.statistics),
            progress: Progress { iteration: 0, steps: 0, total_steps: config.run.total_steps },
        };
        let (with, shape) = (replica.learner.collecting(&replica.statistics), replica.learner.shape());
        let collector = |share: &std::ops::Range<usize>| {
            let place = (share.start, share.len());
            Collector::new(factory, place, config.run.seed, shape.lanes, &with)
        };
        let collectors = shares.iter().map(collector).collect();
        let rollouts = shares.iter().map(|share| Rollout::new(share.len(), config.run.horizon, &shape)).collect();
        let Needs { items, moments, .. } = config.algorithm.needs(&setup);
        let crew = Crew::new(isa, &*replica.learner, (items, moments), collectors, rollouts);
        let shared = Shared {
            seconds: (0..workers).map(|_| Mutex::default()).collect(),
            stop: AtomicBool::new(false),
            elsewhere: AtomicBool::new(false),
            quit: AtomicBool::new(false),
            crew,
            spec,
            config: config.clone(),
        };
        let mut trainer = Self { shared: Arc::new(shared), replica, threads: Vec::new(), clocks: Clocks::default() };
        if let Some(checkpoint) = resume {
            checkpoint.restore(&mut trainer)?;
        }
        for id in 1..workers {
            let (shared, mut replica) = (trainer.shared.clone(), trainer.replica.copy());
            let work = move || {
                let _guard = shared.crew.barrier.guard();
                loop {
                    shared.crew.barrier.wait();
                    if shared.quit.load(Ordering::Acquire) {
                        return;
                    }
                    shared.iterate(id, &mut replica, None);
                }
            };
            trainer.threads.push(std::thread::spawn(work));
        }
        Ok(trainer)
    }

    /// Whether all steps are done.
    pub fn is_done(&self) -> bool {
        self.replica.progress.steps >= self.shared.config.run.total_steps
    }
    /// The configuration.
    pub fn config(&self) -> &TrainConfig {
        &self.shared.config
    }
    /// The task.
    pub fn spec(&self) -> &Spec {
        &self.shared.spec
    }

    /// Makes the next iteration.
    ///
    /// # Errors
    /// If a parameter is no longer finite; the run cannot go on then.
    ///
    /// # Panics
    /// If an environment panics; all workers end.
    pub fn iterate(&mut self) -> Result<IterationStats, Error> {
        let (sums, seconds) = self.work(None).expect("nobody but players gives up");
        self.report(&sums, seconds)
    }

    /// The same with rollouts that `players` play. None if they end the run before the iteration; an iteration of several
    /// rollouts that they end halfway is reported as far as it got.
    ///
    /// # Errors
    /// The same, and if what the players deliver does not fit.
    pub fn iterate_with(&mut self, players: &mut dyn Players) -> Result<Option<IterationStats>, Error> {
        check_algorithm(&self.shared.config)?;
        let mut remote = Remote::new(players, &self.shared.config.run);
        let made = self.work(Some(&mut remote));
        if let Some(error) = remote.error {
            return Err(error);
        }
        made.map(|(sums, seconds)| self.report(&sums, seconds)).transpose()
    }

    /// Has all workers make an iteration; returns its sums and its seconds, unless the players have ended the run before it.
    fn work(&mut self, remote: Option<&mut Remote<'_>>) -> Option<(Sums, f64)> {
        let start = clock::wall();
        let shared = &self.shared;
        let _guard = shared.crew.barrier.guard();
        shared.stop.store(false, Ordering::Release);
        shared.elsewhere.store(remote.is_some(), Ordering::Release);
        shared.crew.barrier.wait();
        let sums = shared.iterate(0, &mut self.replica, remote)?;
        Some((sums, clock::wall() - start))
    }

    /// The policy as it is now.
    pub fn policy(&self) -> Policy {
        let (config, Replica { learner, statistics, progress }) = (&self.shared.config, &self.replica);
        let mut meta =
            PolicyMeta::of(&self.shared.spec, config.network.actor_hidden.clone(), config.network.activation);
        meta.observation_clip = config.statistics.observation_clip as f32;
        let run = RunConfig { threads: 0, ..config.run.clone() };
        let config = TrainConfig { run, ..config.clone() };
        meta.training = Some(Training {
            config: serde_json::to_value(config).expect("a configuration is plain data"),
            steps: progress.steps,
            iterations: progress.iteration,
        });
        learner.policy(meta, statistics.normalizer())
    }

    /// Everything needed to go on from here.
    pub fn checkpoint(&self) -> Checkpoint {
        Checkpoint::of(self)
    }

    /// The numbers of an iteration.
    fn report(&mut self, sums: &Sums, wall: f64) -> Result<IterationStats, Error> {
        let (shared, Replica { learner, progress, .. }) = (&self.shared, &self.replica);
        let mut seconds = Seconds::default();
        for of_worker in &shared.seconds {
            let s = of_worker.lock().expect("no worker has panicked");
            seconds.cpu += s.cpu;
            seconds.env += s.env;
            seconds.collect += s.collect;
            seconds.update += s.update;
        }
        self.clocks.wall += wall;
        self.clocks.cpu += seconds.cpu;
        let parameters = learner.params();
        let count = parameters.iter().filter(|x| !x.is_finite()).count();
        if count > 0 {
            let (parameters, rates) = (parameters.len(), shared.config.algorithm.rates());
            return Err(Error::Diverged { count, parameters, steps: progress.steps, rates });
        }

        let Sums { totals, updates } = sums;
        let sums = &totals.sums;
        let per_episode = |x: f64| (sums.episodes > 0.0).then(|| x / sums.episodes);
        let per_sample = |x: f64| if updates.samples > 0.0 { x / updates.samples } else { 0.0 };
        let names = shared.config.rewards.iter().skip(1).map(|reward| reward.kind.name().to_string());
        let of_rewards = names.zip(&sums.rewards).map(|(name, x)| (name, x / totals.samples));
        let about = learner.describe(totals, updates);
        let worked = (seconds.collect + seconds.update).max(1e-12);
        Ok(IterationStats {
            iteration: progress.iteration,
            steps: progress.steps,
            wall_seconds: self.clocks.wall,
            cpu_seconds: self.clocks.cpu,
            env_share: seconds.env / worked,
            update_share: seconds.update / worked,
            episodes: sums.episodes as u64,
            return_mean: per_episode(sums.returns),
            length_mean: per_episode(sums.lengths),
            speed_mean: per_episode(sums.speeds / shared.spec.dt),
            fall_fraction: per_episode(sums.falls),
            diverged: sums.diverged as u64,
            reward_terms: sums.terms.iter().map(|x| x / totals.samples).collect(),
            kl: per_sample(updates.kl),
            clip_fraction: per_sample(updates.clipped),
            policy_loss: per_sample(updates.policy),
            value_loss: per_sample(updates.value),
            explained_variance: about.explained_variance,
            entropy: about.entropy,
            std_mean: about.std_mean,
            lr: about.lr,
            skipped_minibatches: about.skipped,
            signal_rewards: of_rewards.collect(),
        })
    }
}

impl Drop for Trainer {
    /// Ends the other workers.
    fn drop(&mut self) {
        self.shared.quit.store(true, Ordering::Release);
        self.shared.crew.barrier.leave();
        for thread in self.threads.drain(..) {
            // one that has panicked has said so, and the first worker has panicked with it
            let _ = thread.join();
        }
    }
}

impl Shared {
    /// Worker `id`'s part in an iteration. None if the players have ended the run before it.
    fn iterate(&self, id: usize, replica: &mut Replica, mut remote: Option<&mut Remote<'_>>) -> Option<Sums> {
        let (cpu, mut cpu_elsewhere) = (clock::thread_cpu(), 0.0);
        let (mut seconds, mut sums) = (Seconds::default(), Sums::default());
        // a run that was given up halfway goes on there
        let rollouts = self.config.run.rollouts as u64;
        let first = replica.progress.iteration % rollouts;
        for n in first..rollouts {
            let begin = clock::wall();
            let spent = self.collect(id, replica, remote.as_deref_mut());
            seconds.env += spent.env;
            cpu_elsewhere += spent.cpu_elsewhere;
            seconds.collect += clock::wall() - begin;
            self.crew.barrier.wait();
            if self.stop.load(Ordering::Acquire) {
                if n == first {
                    return None;
                }
                break;
            }

            let begin = clock::wall();
            sums.totals.add(&self.learn(id, replica, &mut sums.updates));
            seconds.update += clock::wall() - begin;
            seconds.cpu = clock::thread_cpu() - cpu + cpu_elsewhere;
            *self.seconds[id].lock().expect("no worker has panicked") = seconds;
            self.crew.barrier.wait();
        }
        Some(sums)
    }

    /// Learns from the rollout of all workers.
    fn learn(&self, id: usize, replica: &mut Replica, sums: &mut LossSums) -> Totals {
        let rollouts: Vec<_> = self.crew.rollouts.iter().map(|r| r.read().expect("no worker has panicked")).collect();
        let totals = Totals::new(&rollouts, self.config.run.horizon);
        let experience = Experience::new(rollouts.iter().map(|r| &**r).collect(), &totals, id);
        let now = Now { progress: &replica.progress, statistics: &replica.statistics };
        replica.learner.update(&mut Worker::new(&self.crew, id), &experience, now, sums);
        replica.absorb(&totals);
        totals
    }

    /// Plays a horizon with the worker's agents. If others play, the first worker has them play all agents.
    fn collect(&self, id: usize, replica: &Replica, remote: Option<&mut Remote<'_>>) -> Spent {
        if self.elsewhere.load(Ordering::Acquire) {
            let Some(remote) = remote else { return Spent::default() };
            return remote.collect(self, replica).unwrap_or_else(|| {
                self.stop.store(true, Ordering::Release);
                Spent::default()
            });
        }
        let mut collector = self.crew.collectors[id].lock().expect("no worker has panicked");
        let mut rollout = self.crew.rollouts[id].write().expect("no worker has panicked");
        let with = replica.learner.collecting(&replica.statistics);
        let env = collector.collect(&with, &mut rollout, clock::wall);
        Spent { env, cpu_elsewhere: 0.0 }
    }
}
