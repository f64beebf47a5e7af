//! A worker's part in learning from a rollout: gradients of groups of samples, their sum, and what the algorithms make their
//! steps with. [`run`](crate::trainer) has the whole.

use crate::algorithms::loss::{Loss, LossSums, Objective, Samples};
use crate::algorithms::parameters::{Layout, Learner, Totals};
use crate::algorithms::sac;
use crate::lanes::BLOCK;
use crate::lanes::buffer::Blocks;
use crate::lanes::f32_lanes;
use crate::nets::gaussian::Gaussian;
use crate::nets::mlp::{CHUNK, Tape};
use crate::optim::adam;
use crate::optim::kfac::Kfac;
use crate::rewards::SignalSpace;
use crate::rollout::collect::Rollout;
use crate::trainer::{NETWORKS, Run, share};
use marathon_physics::lanes::Real;
use std::marker::PhantomData;
use std::ops::Range;
use std::sync::RwLockReadGuard;
use std::sync::atomic::Ordering;

/// Most groups of a minibatch: bounds the memory for partial gradients and the threads that can share a minibatch.
const MAX_GROUPS: usize = 32;

/// What a group of samples contributes.
pub struct Partial {
    pub gradient: Vec<f32>,
    /// Sums for the factors of the Fisher matrix, for ACKTR.
    pub moments: Vec<f32>,
    pub sums: LossSums,
}

impl Partial {
    /// Room for parameters and moments.
    pub fn new(parameters: usize, moments: usize) -> Self {
        Self { gradient: vec![0.0; parameters], moments: vec![0.0; moments], sums: LossSums::default() }
    }
}

/// A worker's slice of the gradient.
pub struct Slice {
    gradient: Vec<f32>,
    squares: Vec<f64>,
}

impl Slice {
    /// For pieces of the parameters.
    pub fn new(pieces: &[Range<usize>]) -> Self {
        Self { gradient: vec![0.0; pieces.iter().map(|r| r.len()).sum()], squares: vec![0.0; pieces.len()] }
    }
}

/// A worker's space for computing gradients.
pub struct Workspace {
    input: Blocks<f32>,
    actor: Tape<f32>,
    critic: Tape<f32>,
    signals: Vec<SignalSpace>,
    pub gradient: Vec<f32>,
    moments: Vec<f32>,
    rows: Vec<[f32; BLOCK]>,
    pub sac: Option<Box<sac::Space>>,
}

impl Workspace {
    /// For a worker of a run.
    pub fn new(run: &Run<'_>) -> Self {
        let Layout { actor, critic, .. } = &run.layout;
        Self {
            input: actor.input(),
            actor: actor.tape(),
            critic: critic.tape(),
            signals: run.layout.signals.iter().map(|(nets, _)| nets.space()).collect(),
            gradient: vec![0.0; run.layout.len],
            moments: vec![0.0; run.kfac.as_ref().map_or(0, Kfac::moments_len)],
            rows: vec![[0.0; BLOCK]; run.spec.act],
            sac: run.sac.as_ref().map(|_| Box::new(sac::Space::new(run))),
        }
    }
}

/// Sums over an iteration's updates.
#[derive(Default)]
pub struct Means {
    /// Of the objective.
    pub sums: LossSums,
    /// Samples seen.
    pub samples: f64,
}

impl Run<'_> {
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
}

/// A worker's part in learning from a rollout.
pub struct Update<'u> {
    pub run: &'u Run<'u>,
    pub id: usize,
    /// The worker's replica: every worker must change it alike.
    pub learner: &'u mut Learner,
    /// Sums over the rollout.
    pub totals: &'u Totals,
    /// Of all workers.
    pub rollouts: Vec<&'u Rollout>,
    /// Which worker has each block, and its place there.
    pub place: Vec<(usize, usize)>,
    pub space: &'u mut Workspace,
    pub means: &'u mut Means,
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
        self.add_up(groups)
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
        self.add_up(groups)
    }

    /// Waits for all groups, sums the worker's slice of their gradients, and waits for the others' slices.
    fn add_up(&mut self, groups: usize) -> LossSums {
        self.run.barrier.wait();
        let sums = self.run.reduce(self.id, groups);
        self.run.barrier.wait();
        self.means.samples += sums.samples;
        self.means.sums += sums;
        sums
    }

    /// The worker's own rollout.
    pub fn own_rollout(&self) -> &Rollout {
        self.rollouts[self.id]
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

/// Groups that a list of items is split into.
pub fn group_count(items: usize) -> usize {
    items.div_ceil(CHUNK).clamp(1, MAX_GROUPS)
}
