//! The workers of a run: what they share, and how each sees the others.
//!
//! A list of samples is split into groups; whichever worker is free takes the next group and leaves its gradient in that
//! group's place. Then each worker sums a slice of the gradient over the groups. The split into groups and the order of
//! every sum depend on the configuration alone, so the result does not depend on the number of workers, nor on who did what.

use super::barrier::Barrier;
use crate::algorithms::loss::LossSums;
use crate::algorithms::{Learner, MAX_GROUPS, Partial, ShowPiece, Workers, group_count, share};
use crate::optim::sum;
use crate::rollout::data::Rollout;
use marathon_physics::lanes::Isa;
use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, RwLock, RwLockReadGuard};

/// State that the workers of a run share to train one learner.
pub struct Crew {
    isa: Isa,
    /// Rollouts of each worker's agents.
    pub rollouts: Vec<RwLock<Rollout>>,
    /// Gradients of the groups of the current list of samples.
    partials: Vec<RwLock<Partial>>,
    /// Sums over the groups, a slice per worker.
    slices: Vec<RwLock<Slice>>,
    /// Pieces of the parameters, with their networks.
    pieces: Vec<(usize, Range<usize>)>,
    networks: usize,
    /// Next part of the current piece of work to be taken.
    ticket: AtomicUsize,
    /// Where they wait for each other.
    barrier: Arc<Barrier>,
}

/// A worker's slice of the gradient.
struct Slice {
    gradient: Vec<f32>,
    squares: Vec<f64>,
}

impl Crew {
    /// For workers with those rollouts who meet at a barrier, and lists of at most `items` items.
    pub fn new(
        isa: Isa,
        learner: &dyn Learner,
        (items, moments): (usize, usize),
        rollouts: Vec<Rollout>,
        barrier: Arc<Barrier>,
    ) -> Self {
        let (workers, places) = (rollouts.len(), learner.places());
        let pieces = places.pieces();
        let slice = |id| {
            let own = &pieces[share(pieces.len(), workers, id)];
            let len = own.iter().map(|(_, range)| range.len()).sum();
            RwLock::new(Slice { gradient: vec![0.0; len], squares: vec![0.0; own.len()] })
        };
        let partial = |_| RwLock::new(Partial::new(places.total(), moments));
        Self {
            isa,
            partials: (0..group_count(items)).map(partial).collect(),
            slices: (0..workers).map(slice).collect(),
            pieces,
            networks: places.count(),
            rollouts: rollouts.into_iter().map(RwLock::new).collect(),
            ticket: AtomicUsize::new(0),
            barrier,
        }
    }
}

/// A worker among the others.
pub struct Worker<'a> {
    crew: &'a Crew,
    id: usize,
    /// Groups of the last gradient.
    groups: usize,
}

impl<'a> Worker<'a> {
    /// Worker `id`.
    pub fn new(crew: &'a Crew, id: usize) -> Self {
        Self { crew, id, groups: 0 }
    }

    /// The next of `parts` parts of a piece of work that no worker has taken yet.
    fn take(&self, parts: usize) -> Option<usize> {
        let part = self.crew.ticket.fetch_add(1, Ordering::Relaxed);
        (part < parts).then_some(part)
    }

    /// Waits until all parts are done; the caller must wait once more before it takes a part of the next piece of work.
    fn done(&self) {
        self.crew.barrier.wait();
        if self.id == 0 {
            self.crew.ticket.store(0, Ordering::Relaxed);
        }
    }

    fn partials(&self) -> Vec<RwLockReadGuard<'a, Partial>> {
        self.crew.partials[..self.groups].iter().map(|p| p.read().expect("no worker has panicked")).collect()
    }

    /// Sums the worker's slice of the gradient over the groups; returns the sums of the whole list.
    fn reduce(&self) -> LossSums {
        let Crew { pieces, slices, isa, .. } = self.crew;
        let partials = self.partials();
        let mut slice = slices[self.id].write().expect("no worker has panicked");
        let Slice { gradient, squares } = &mut *slice;
        let mut rest = &mut gradient[..];
        for (square, (_, range)) in squares.iter_mut().zip(&pieces[share(pieces.len(), slices.len(), self.id)]) {
            let (out, after) = rest.split_at_mut(range.len());
            let parts: [&[f32]; MAX_GROUPS] = std::array::from_fn(|g| match partials.get(g) {
                Some(p) => &p.gradient[range.clone()],
                None => &[],
            });
            *square = sum::reduce(*isa, &parts[..self.groups], out);
            rest = after;
        }
        let mut sums = LossSums::default();
        partials.iter().for_each(|p| sums += p.sums);
        sums
    }
}

impl Workers for Worker<'_> {
    fn share_out(&mut self, items: usize, work: &mut dyn FnMut(Range<usize>, &mut Partial)) -> LossSums {
        self.groups = group_count(items);
        while let Some(group) = self.take(self.groups) {
            let mut partial = self.crew.partials[group].write().expect("no worker has panicked");
            work(share(items, self.groups, group), &mut partial);
        }
        self.done();
        let sums = self.reduce();
        self.wait();
        sums
    }

    fn squares(&self) -> Vec<f64> {
        let mut squares = vec![0.0; self.crew.networks];
        let slices = self.crew.slices.iter().map(|s| s.read().expect("no worker has panicked"));
        let all = slices.flat_map(|s| s.squares.clone());
        for ((network, _), square) in self.crew.pieces.iter().zip(all) {
            squares[*network] += square;
        }
        squares
    }

    fn pieces(&self, show: ShowPiece<'_>) {
        let mut pieces = self.crew.pieces.iter();
        for slice in &self.crew.slices {
            let slice = slice.read().expect("no worker has panicked");
            let mut rest = &slice.gradient[..];
            for (network, range) in pieces.by_ref().take(slice.squares.len()) {
                let (gradient, after) = rest.split_at(range.len());
                show(*network, range.clone(), gradient);
                rest = after;
            }
        }
    }

    fn divide(&mut self, parts: usize, work: &mut dyn FnMut(usize, &[&Partial])) {
        let partials = self.partials();
        let partials: Vec<&Partial> = partials.iter().map(|p| &**p).collect();
        while let Some(part) = self.take(parts) {
            work(part, &partials);
        }
        self.done();
    }

    fn wait(&self) {
        self.crew.barrier.wait();
    }
}
