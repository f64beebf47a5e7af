//! Proximal policy optimization (Schulman et al., 2017), from top to bottom.
//!
//! Workers run the same program on their own blocks of agents. One iteration:
//!
//! 1. *Collect*: every worker plays a horizon with its agents ([`Actor::collect`]) and estimates advantages.
//! 2. *Update*: `epochs` times, the rollout of all workers is shuffled and split into minibatches. A minibatch is split
//!    into groups of samples; whichever worker is free takes the next group and leaves its gradient in that group's
//!    place. Then each worker sums a slice of the gradient over the groups, and all workers apply the same step to their
//!    replicas of the parameters.
//! 3. *Report*: the first worker, which is the caller's thread, tells the observer.
//!
//! The split into groups and the order of every sum depend on the configuration alone, so the result does not depend on
//! the number of workers, nor on who did what. The first rollout has no update: it fills the statistics that normalize
//! observations and rewards, without which the first updates would see inputs and losses of arbitrary size.

use crate::adam;
use crate::advantage::Discounts;
use crate::buffer::Blocks;
use crate::gaussian::Gaussian;
use crate::learner::{Layout, Learner, Totals};
use crate::loss::{Loss, LossSums, Objective, Samples};
use crate::mlp::{CHUNK, Tape};
use crate::noise::{SHUFFLES, SplitMix};
use crate::observer::{Control, IterationStats, Observer, Snapshot};
use crate::rollout::{Acting, Actor, Rollout};
use crate::sync::Barrier;
use crate::{BLOCK, Checkpoint, Error, Policy, PpoConfig, Schedule, clock, f32_lanes};
use marathon_envs::{ShardFactory, Spec};
use marathon_physics::lanes::{Isa, Real};
use std::marker::PhantomData;
use std::ops::Range;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, RwLock};

/// Most groups of a minibatch: bounds the memory for partial gradients and the threads that can share a minibatch.
const MAX_GROUPS: usize = 32;

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
    config.validate()?;
    if isa == Isa::F64 || !isa.supported() {
        return Err(Error::Isa(isa.name(), Isa::best().name()));
    }
    let (run, mut learner) = Run::new(factory, isa, config);
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
        let mut head = Head { observer, clocks: &mut clocks, learner: &mut learner, last: None };
        let replica = head.learner.clone();
        run.work(0, replica, Some(&mut head));
        head.last
    });
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
struct Head<'a> {
    observer: &'a mut dyn Observer,
    clocks: &'a mut Clocks,
    learner: &'a mut Learner,
    last: Option<IterationStats>,
}

/// What the workers share.
pub struct Run<'a> {
    pub isa: Isa,
    pub config: &'a PpoConfig,
    pub spec: Spec,
    pub layout: Layout,
    pub actors: Vec<Mutex<Actor>>,
    rollouts: Vec<RwLock<Rollout>>,
    /// Gradients of the groups of the current minibatch.
    partials: Vec<RwLock<Partial>>,
    /// Sums over the groups, a slice per worker.
    slices: Vec<RwLock<Slice>>,
    norm_blocks: Vec<Range<usize>>,
    /// Next group to be taken, for each minibatch of the iteration.
    tickets: Vec<AtomicUsize>,
    seconds: Vec<Mutex<Seconds>>,
    barrier: Barrier,
    stop: AtomicBool,
}

/// Seconds that a worker spent in the current iteration.
#[derive(Clone, Copy, Default)]
struct Seconds {
    cpu: f64,
    env: f64,
    collect: f64,
    update: f64,
}

struct Partial {
    gradient: Vec<f32>,
    sums: LossSums,
}

struct Slice {
    gradient: Vec<f32>,
    squares: Vec<f64>,
}

/// A worker's space for computing gradients.
struct Workspace {
    input: Blocks<f32>,
    actor: Tape<f32>,
    critic: Tape<f32>,
    gradient: Vec<f32>,
    rows: Vec<[f32; BLOCK]>,
}

/// Means over an iteration's updates.
#[derive(Default)]
struct Updates {
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
            actors.push(Mutex::new(Actor::new(factory, place, config.seed, &layout.actor, &layout.critic)));
            rollouts.push(RwLock::new(Rollout::new(share.len(), config.horizon, spec.obs, spec.act)));
        }
        let groups = (0..config.minibatches).map(|m| group_count(config, m)).max().unwrap_or(1);
        let partial = || Partial { gradient: vec![0.0; layout.len], sums: LossSums::default() };
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
            tickets: (0..config.epochs * config.minibatches).map(|_| AtomicUsize::new(0)).collect(),
            seconds: (0..workers).map(|_| Mutex::default()).collect(),
            barrier: Barrier::new(workers),
            stop: AtomicBool::new(false),
            spec,
            layout,
        };
        (run, learner)
    }

    fn workers(&self) -> usize {
        self.rollouts.len()
    }

    /// The program of worker `id`.
    fn work(&self, id: usize, mut learner: Learner, mut head: Option<&mut Head<'_>>) {
        let _guard = self.barrier.guard();
        let Layout { actor, critic, .. } = &self.layout;
        let mut space = Workspace {
            input: actor.input(),
            actor: actor.tape(),
            critic: critic.tape(),
            gradient: vec![0.0; self.layout.len],
            rows: vec![[0.0; BLOCK]; self.spec.act],
        };
        let mut done = learner.steps >= self.config.total_steps;
        while !done {
            let (cpu, start) = (clock::thread_cpu(), clock::wall());
            let mut seconds = Seconds { env: self.collect(id, &learner), ..Default::default() };
            seconds.collect = clock::wall() - start;
            if id == 0 {
                self.tickets.iter().for_each(|t| t.store(0, Ordering::Relaxed));
            }
            self.barrier.wait();

            let begin = clock::wall();
            let rollouts: Vec<_> = self.rollouts.iter().map(|r| r.read().expect("no worker has panicked")).collect();
            let totals = Totals::new(&rollouts, self.config.horizon);
            let rollouts: Vec<&Rollout> = rollouts.iter().map(|r| &**r).collect();
            let mut updates = Updates::default();
            if learner.iteration > 0 {
                let objective = self.objective(&learner, &totals);
                self.update(id, &mut learner, &rollouts, objective, &mut space, &mut updates);
            }
            learner.absorb(&totals, self.config);
            drop(rollouts);
            seconds.update = clock::wall() - begin;
            seconds.cpu = clock::thread_cpu() - cpu;
            *self.seconds[id].lock().expect("no worker has panicked") = seconds;

            self.barrier.wait();
            done = learner.steps >= self.config.total_steps;
            if let Some(head) = &mut head {
                self.report(head, &learner, &totals, &updates, clock::wall() - start);
            }
            self.barrier.wait();
            done |= self.stop.load(Ordering::Acquire);
        }
    }

    /// Plays a horizon with the worker's agents.
    fn collect(&self, id: usize, learner: &Learner) -> f64 {
        let layout = &self.layout;
        let acting = Acting {
            isa: self.isa,
            actor: (&layout.actor, layout.actor_params(&learner.params)),
            critic: (&layout.critic, layout.critic_params(&learner.params)),
            gaussian: &learner.gaussian(layout),
            normalizer: &learner.normalizer(self.config),
            discounts: Discounts { gamma: self.config.gamma, lambda: self.config.gae_lambda },
            reward_scale: learner.reward_scale(self.config),
            return_center: learner.returns.mean[0] as f32,
        };
        let mut actor = self.actors[id].lock().expect("no worker has panicked");
        let mut rollout = self.rollouts[id].write().expect("no worker has panicked");
        actor.collect(&acting, &mut rollout)
    }

    /// A setting on its linear way from `first` to `last` over the run; it stays where there is no `last`.
    fn moved(&self, learner: &Learner, first: f64, last: Option<f64>) -> f64 {
        let progress = learner.steps as f64 / self.config.total_steps as f64;
        first + (last.unwrap_or(first) - first) * progress
    }

    fn objective(&self, learner: &Learner, totals: &Totals) -> Objective {
        let config = self.config;
        let moved = |first, last| self.moved(learner, first, last);
        let (mean, var) = totals.advantage();
        Objective {
            clip: moved(config.clip, config.final_clip),
            value_clip: config.value_clip,
            entropy_coef: moved(config.entropy_coef, config.final_entropy_coef),
            advantage_mean: mean,
            advantage_scale: 1.0 / var.max(1e-12).sqrt(),
        }
    }

    /// All epochs over one rollout.
    fn update(
        &self,
        id: usize,
        learner: &mut Learner,
        rollouts: &[&Rollout],
        objective: Objective,
        space: &mut Workspace,
        updates: &mut Updates,
    ) {
        let config = self.config;
        // which rollout a block is in, and its place there
        let place: Vec<(usize, usize)> =
            rollouts.iter().enumerate().flat_map(|(r, x)| (0..x.blocks()).map(move |b| (r, b))).collect();
        let mut items: Vec<u32> = (0..item_count(config) as u32).collect();
        if config.schedule == Schedule::Linear {
            learner.lr = config.lr * (1.0 - learner.steps as f64 / config.total_steps as f64);
        }
        for epoch in 0..config.epochs {
            let draw = learner.iteration * config.epochs as u64 + epoch as u64;
            SplitMix::new(config.seed, draw | SHUFFLES).shuffle(&mut items);
            for m in 0..config.minibatches {
                let batch = &items[share(items.len(), config.minibatches, m)];
                let ticket = &self.tickets[epoch * config.minibatches + m];
                let groups = group_count(config, m);
                let gaussian = learner.gaussian(&self.layout);

                // gradients of the groups
                loop {
                    let group = ticket.fetch_add(1, Ordering::Relaxed);
                    if group >= groups {
                        break;
                    }
                    let of_group = &batch[share(batch.len(), groups, group)];
                    let mut partial = self.partials[group].write().expect("no worker has panicked");
                    let mut blocks = of_group.chunks(CHUNK).map(|chunk| {
                        chunk.iter().map(|item| {
                            let (t, b) = (*item as usize / place.len(), *item as usize % place.len());
                            let (r, local) = place[b];
                            (rollouts[r], t * rollouts[r].blocks() + local)
                        })
                    });
                    self.gradient(learner, &gaussian, objective, &mut blocks, space, &mut partial);
                }
                self.barrier.wait();
                let sums = self.reduce(id, groups);
                self.barrier.wait();
                self.step(learner, &sums);
                updates.samples += sums.samples;
                updates.sums += sums;
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
            let mut n = 0;
            for (rollout, item) in chunk {
                space.input.block_mut(n).copy_from_slice(rollout.obs(item));
                samples[n] = rollout.samples(item);
                n += 1;
            }
            // the first chunk's gradient needs no sum
            let gradient = if i == 0 { &mut partial.gradient } else { &mut space.gradient };
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

    /// One step of the optimizer on the worker's replica.
    fn step(&self, learner: &mut Learner, sums: &LossSums) {
        let config = self.config;
        let slices: Vec<_> = self.slices.iter().map(|s| s.read().expect("no worker has panicked")).collect();

        // norm of each network's gradient
        let mut squares = [0.0; 2];
        let all = slices.iter().flat_map(|s| &s.squares);
        for (range, square) in self.norm_blocks.iter().zip(all) {
            squares[(range.start >= self.layout.critic_start) as usize] += square;
        }
        if !(squares[0].is_finite() && squares[1].is_finite()) {
            learner.skipped += 1;
            return;
        }
        let mean = 1.0 / sums.samples;
        let scale = squares.map(|s| mean * (config.max_grad_norm / (s.sqrt() * mean)).min(1.0));

        learner.adam.advance();
        let value_lr = if config.schedule == Schedule::Linear { learner.lr / config.lr } else { 1.0 } * config.value_lr;
        let lr = [learner.lr, value_lr];
        let mut ranges = self.norm_blocks.iter();
        for slice in &slices {
            let mut rest = &slice.gradient[..];
            for range in ranges.by_ref().take(slice.squares.len()) {
                let (gradient, after) = rest.split_at(range.len());
                let net = (range.start >= self.layout.critic_start) as usize;
                learner.adam.update(self.isa, &mut learner.params, range.clone(), gradient, scale[net], lr[net]);
                rest = after;
            }
        }
        let min_std = self.moved(learner, config.min_std, config.final_min_std);
        let [low, high] = [min_std, config.max_std].map(|s| Real::ln(s) as f32);
        learner.params[self.layout.log_std.clone()].iter_mut().for_each(|l| *l = l.clamp(low, high));

        if config.schedule == Schedule::Adaptive {
            let kl = sums.kl * mean;
            let target = self.moved(learner, config.target_kl, config.final_target_kl);
            if kl > 2.0 * target {
                learner.lr = (learner.lr / 1.5).max(config.lr_range[0]);
            } else if kl < 0.5 * target {
                learner.lr = (learner.lr * 1.2).min(config.lr_range[1]);
            }
        }
    }

    /// Tells the observer about the iteration.
    fn report(&self, head: &mut Head<'_>, learner: &Learner, totals: &Totals, updates: &Updates, wall: f64) {
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
        let per_update = |x: f64| if updates.samples > 0.0 { x / updates.samples } else { 0.0 };
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
            kl: per_update(updates.sums.kl),
            clip_fraction: per_update(updates.sums.clipped),
            policy_loss: per_update(updates.sums.policy),
            value_loss: per_update(updates.sums.value),
            explained_variance: totals.explained_variance(),
            entropy: gaussian.entropy(),
            std_mean: gaussian.mean_std(),
            lr: learner.lr,
            skipped_minibatches: learner.skipped,
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
fn share(n: usize, parts: usize, i: usize) -> Range<usize> {
    n * i / parts..n * (i + 1) / parts
}

/// Groups that minibatch `m` is split into.
fn group_count(config: &PpoConfig, m: usize) -> usize {
    share(item_count(config), config.minibatches, m).len().div_ceil(CHUNK).clamp(1, MAX_GROUPS)
}
