//! A run: workers that collect, learn and report in step.
//!
//! Workers run the same program on their own blocks of agents. One iteration:
//!
//! 1. *Collect*: every worker plays a horizon with its agents ([`Collector::collect`]) and estimates advantages.
//! 2. *Update*: the algorithm ([`Learner::update`]), which shares its work out among the [`workers`]. All workers apply the
//!    same steps to their replicas.
//! 3. *Report*: the numbers of the iteration. With `rollouts` above 1, steps 1 and 2 are done so many times first.
//!
//! A task with several [roles](marathon_envs::Role) has a learner for each: step 2 is done for one after the other.
//!
//! The first worker is the caller's thread; with one worker there is no other. The first rollout has no update: it fills the
//! statistics that normalize observations and rewards, without which the first updates would see inputs and losses of
//! arbitrary size.

mod average;
mod barrier;
pub mod checkpoint;
mod clock;
pub mod config;
pub mod evaluate;
pub mod initialize;
mod iteration;
pub mod memory;
pub mod observer;
pub mod remote;
mod roles;
mod states;
pub mod stats;
mod workers;

use crate::algorithms::loss::LossSums;
use crate::algorithms::schedule::Progress;
use crate::algorithms::{MemoryPlan, Now, share};
use crate::error::Error;
use crate::policy::Policy;
use crate::rollout::collect::Collector;
use crate::rollout::context::RolloutContext;
use crate::rollout::data::{Experience, Rollout};
use crate::rollout::sums::Totals;
use barrier::Barrier;
use checkpoint::Checkpoint;
use config::TrainConfig;
use marathon_envs::{ShardFactory, Spec};
use marathon_physics::lanes::Isa;
use observer::{Control, Observer, Snapshot};
use remote::{Players, Remote, Spent, check_travels};
use roles::{RoleParts, RoleReplica};
use stats::IterationStats;
use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use workers::{Crew, Worker};

pub use roles::check_demonstrations;

/// Result of a finished run.
#[derive(Debug)]
pub struct TrainOutput {
    /// The trained policy: of a task with several roles, the first one's.
    pub policy: Policy,
    /// The other roles' policies, by the roles' names.
    pub others: Vec<(String, Policy)>,
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
        check_travels(config, factory.spec())?;
    }
    let mut trainer = match resume {
        None => TrainLoop::new(factory, isa, config)?,
        Some(checkpoint) => TrainLoop::resume(factory, isa, config, checkpoint)?,
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
    Ok(trainer.output(last))
}

/// A run that is made an iteration at a time.
pub struct TrainLoop {
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

/// State that all threads of a run share.
struct Shared {
    config: TrainConfig,
    spec: Spec,
    /// Each worker's agents.
    collectors: Vec<Mutex<Collector>>,
    /// State that the workers share to train each role.
    crews: Vec<Crew>,
    /// The roles, with their settings.
    roles: Vec<RoleParts>,
    /// Where all workers wait for each other.
    barrier: Arc<Barrier>,
    seconds: Vec<Mutex<Seconds>>,
    /// The remote players have given up.
    stop: AtomicBool,
    /// Whether others play in the place of the collectors, which then only keep the states of the agents.
    elsewhere: AtomicBool,
    /// The run is over for the other threads.
    quit: AtomicBool,
}

/// State that learning changes; every worker has an equal copy.
struct Replica {
    /// Of each role.
    roles: Vec<RoleReplica>,
    progress: Progress,
}

impl Replica {
    fn copy(&self) -> Self {
        Self { roles: self.roles.iter().map(RoleReplica::copy).collect(), progress: self.progress }
    }

    /// Rollout context of each role for a horizon.
    fn collecting(&self) -> Vec<RolloutContext<'_>> {
        self.roles.iter().map(|role| role.learner.collecting(&role.statistics)).collect()
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

/// Sums over an iteration, of a role.
#[derive(Clone, Default)]
struct Sums {
    totals: Totals,
    updates: LossSums,
}

impl TrainLoop {
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
        let mut roles = RoleParts::all(config, &spec)?;
        roles.iter_mut().try_for_each(|role| role.learn_from(factory))?;
        memory::check(&roles, isa, config)?;
        let (workers, blocks) = (config.run.worker_count(), config.run.blocks());
        let shares: Vec<_> = (0..workers).map(|id| share(blocks, workers, id)).collect();
        let of_workers: Vec<usize> = shares.iter().map(|share| share.len()).collect();
        let replica = Replica {
            roles: roles.iter().map(|role| RoleReplica::new(role, isa, &of_workers)).collect(),
            progress: Progress { iteration: 0, steps: 0, total_steps: config.run.total_steps },
        };
        let collector = |share: &Range<usize>| {
            let plans = replica.roles.iter().zip(&roles).map(|(replica, role)| replica.role_setup(role)).collect();
            Mutex::new(Collector::new(factory, (share.start, share.len()), config.run.seed, plans))
        };
        let collectors = shares.iter().map(collector).collect();
        let barrier = Arc::new(Barrier::new(workers));
        let crew = |(role, RoleReplica { learner, .. }): (&RoleParts, &RoleReplica)| {
            let shape = learner.shape();
            let rollouts = shares.iter().map(|share| Rollout::new(share.len(), config.run.horizon, &shape)).collect();
            let MemoryPlan { items, moments, .. } = role.config.algorithm.memory_plan(&role.setup(isa));
            Crew::new(isa, &**learner, (items, moments), rollouts, barrier.clone())
        };
        let crews = roles.iter().zip(&replica.roles).map(crew).collect();
        let shared = Shared {
            seconds: (0..workers).map(|_| Mutex::default()).collect(),
            stop: AtomicBool::new(false),
            elsewhere: AtomicBool::new(false),
            quit: AtomicBool::new(false),
            collectors,
            crews,
            barrier,
            roles,
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
                let _guard = shared.barrier.guard();
                loop {
                    shared.barrier.wait();
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
        check_travels(&self.shared.config, &self.shared.spec)?;
        let mut remote = Remote::new(players, &self.shared.config.run);
        let made = self.work(Some(&mut remote));
        if let Some(error) = remote.error {
            return Err(error);
        }
        made.map(|(sums, seconds)| self.report(&sums, seconds)).transpose()
    }

    /// Has all workers make an iteration; returns its sums and its seconds, unless the players have ended the run before it.
    fn work(&mut self, remote: Option<&mut Remote<'_>>) -> Option<(Vec<Sums>, f64)> {
        let start = clock::wall();
        let shared = &self.shared;
        let _guard = shared.barrier.guard();
        shared.stop.store(false, Ordering::Release);
        shared.elsewhere.store(remote.is_some(), Ordering::Release);
        shared.barrier.wait();
        let sums = shared.iterate(0, &mut self.replica, remote)?;
        Some((sums, clock::wall() - start))
    }

    /// The policy as it is now: of a task with several roles, the first one's.
    pub fn policy(&self) -> Policy {
        self.policy_of(0)
    }
    /// The policies of all roles, and everything needed to go on from here.
    pub fn output(&self, last: Option<IterationStats>) -> TrainOutput {
        let named = |(i, role): (usize, &RoleParts)| (role.role.name.clone(), self.policy_of(i));
        let others = self.shared.roles.iter().enumerate().skip(1).map(named).collect();
        TrainOutput { policy: self.policy(), others, checkpoint: self.checkpoint(), last }
    }

    fn policy_of(&self, i: usize) -> Policy {
        let Replica { roles, progress } = &self.replica;
        self.shared.roles[i].policy(&roles[i], progress, &self.shared.config)
    }

    /// Everything needed to go on from here.
    pub fn checkpoint(&self) -> Checkpoint {
        Checkpoint::of(self)
    }

    /// The numbers of an iteration.
    fn report(&mut self, sums: &[Sums], wall: f64) -> Result<IterationStats, Error> {
        let (shared, Replica { roles, progress }) = (&self.shared, &self.replica);
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
        for (role, RoleReplica { learner, .. }) in shared.roles.iter().zip(roles) {
            let parameters = learner.params();
            let count = parameters.iter().filter(|x| !x.is_finite()).count();
            if count > 0 {
                let (parameters, rates) = (parameters.len(), role.config.algorithm.rates());
                return Err(Error::Diverged { count, parameters, steps: progress.steps, rates });
            }
        }
        average::absorb(shared, &mut self.replica, sums[0].totals.samples);

        let Replica { roles, progress } = &self.replica;
        let learned = |i: usize| {
            let Sums { totals, updates } = &sums[i];
            shared.roles[i].learned(&*roles[i].learner, totals, updates)
        };
        let played = &sums[0].totals.sums;
        let per_episode = |x: f64| (played.episodes > 0.0).then(|| x / played.episodes);
        let names = shared.spec.own_metrics().map(|metric| metric.name.clone());
        let worked = (seconds.collect + seconds.update).max(1e-12);
        Ok(IterationStats {
            iteration: progress.iteration,
            steps: progress.steps,
            wall_seconds: self.clocks.wall,
            cpu_seconds: self.clocks.cpu,
            env_share: seconds.env / worked,
            update_share: seconds.update / worked,
            episodes: played.episodes as u64,
            length_mean: per_episode(played.lengths),
            speed_mean: per_episode(played.speeds / shared.spec.dt),
            fall_fraction: per_episode(played.falls),
            diverged: played.diverged as u64,
            metrics: names.zip(&played.metrics).map(|(name, x)| (name, x / sums[0].totals.samples)).collect(),
            learned: learned(0),
            others: (1..roles.len()).map(|i| (shared.roles[i].role.name.clone(), learned(i))).collect(),
        })
    }
}

impl Drop for TrainLoop {
    /// Ends the other workers.
    fn drop(&mut self) {
        self.shared.quit.store(true, Ordering::Release);
        self.shared.barrier.leave();
        for thread in self.threads.drain(..) {
            // one that has panicked has said so, and the first worker has panicked with it
            let _ = thread.join();
        }
    }
}
