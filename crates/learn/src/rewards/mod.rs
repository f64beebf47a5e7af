//! Rewards that a learner gives itself for what is new to it, beside the task's own: curiosity and random network
//! distillation, each with a value stream and a discount of its own, as in ML-Agents.
//!
//! A signal has networks of its own. They judge each step of a rollout ([`SignalNets::reward`]), and learn from the same
//! minibatches as policy and value function ([`SignalNets::gradient`]): where they have learned, the reward fades.

pub mod curiosity;
pub mod rnd;

use crate::lanes::BLOCK;
use crate::lanes::buffer::Blocks;
use crate::lanes::f32_lanes;
use crate::lanes::noise::SplitMix;
use crate::nets::mlp::CHUNK;
use crate::rewards::curiosity::{Curiosity, CuriositySpace};
use crate::rewards::rnd::{Rnd, RndSpace};
use marathon_envs::Spec;
use marathon_physics::lanes::{Isa, Kernel, Real};
use serde::{Deserialize, Serialize};
use std::marker::PhantomData;

/// Most signals beside the task's reward.
pub const MAX_SIGNALS: usize = 2;

/// What rewards novelty.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum SignalKind {
    /// The error of a prediction of the next state's features from this one's and the action; the features are those that
    /// tell the action (Pathak et al., "Curiosity-driven exploration by self-supervised prediction", 2017).
    Curiosity,
    /// The error of a network that learns what another one with random parameters makes of the observation (Burda et al.,
    /// "Exploration by random network distillation", 2018).
    Rnd,
}

impl SignalKind {
    /// Name in configurations and reports.
    pub fn name(self) -> &'static str {
        match self {
            SignalKind::Curiosity => "curiosity",
            SignalKind::Rnd => "rnd",
        }
    }
}

/// A reward signal; the defaults are ML-Agents'.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Signal {
    /// What rewards novelty.
    pub kind: SignalKind,
    /// Factor of the reward.
    pub strength: f64,
    /// Discount per decision. Such rewards do not end with an episode: its last state is worth what the value function
    /// says.
    pub gamma: f64,
    /// Widths of the network that makes features of an observation; the last is their number.
    pub hidden: Vec<usize>,
    /// Learning rate of the signal's networks.
    pub lr: f64,
}

impl Signal {
    /// With ML-Agents' defaults.
    pub fn new(kind: SignalKind) -> Self {
        Self { kind, strength: 1.0, gamma: 0.99, hidden: vec![128, 128], lr: 3e-4 }
    }
}

/// A block of steps: rows of sixteen, normalized.
#[derive(Clone, Copy)]
pub struct Step<'a, S> {
    /// Observations, `[obs][16]`.
    pub obs: &'a [S],
    /// Actions as drawn, `[action][16]`.
    pub action: &'a [S],
    /// What was observed next, before a reset.
    pub next: &'a [S],
}

/// Networks of a signal.
#[derive(Clone, Debug)]
pub enum SignalNets {
    /// Of curiosity.
    Curiosity(Curiosity),
    /// Of random network distillation.
    Rnd(Rnd),
}

/// Work space of a signal.
pub enum SignalSpace {
    /// Of curiosity.
    Curiosity(Box<CuriositySpace<f32>>),
    /// Of random network distillation.
    Rnd(Box<RndSpace<f32>>),
}

impl SignalNets {
    /// For a task; the stream of random numbers is for parameters that are not learned.
    pub(crate) fn new(spec: &Spec, signal: &Signal, random: &mut SplitMix) -> Self {
        match signal.kind {
            SignalKind::Curiosity => Self::Curiosity(Curiosity::new(spec.obs, spec.act, &signal.hidden)),
            SignalKind::Rnd => Self::Rnd(Rnd::new(spec.obs, &signal.hidden, random)),
        }
    }
    /// Number of parameters that are learned.
    pub fn count(&self) -> usize {
        match self {
            Self::Curiosity(nets) => nets.count(),
            Self::Rnd(nets) => nets.count(),
        }
    }
    /// Fills them for the start of a run.
    pub(crate) fn init(&self, params: &mut [f32], random: &mut SplitMix) {
        match self {
            Self::Curiosity(nets) => nets.init(params, random),
            Self::Rnd(nets) => nets.init(params, random),
        }
    }
    /// Work space.
    pub fn space(&self) -> SignalSpace {
        match self {
            Self::Curiosity(nets) => SignalSpace::Curiosity(Box::new(nets.space())),
            Self::Rnd(nets) => SignalSpace::Rnd(Box::new(nets.space())),
        }
    }

    /// Rewards of at most [`CHUNK`] blocks of steps, a row of sixteen each.
    pub fn reward(&self, isa: Isa, params: &[f32], steps: &[Step<'_, f32>], space: &mut SignalSpace, out: &mut [f32]) {
        match (self, space) {
            (Self::Curiosity(nets), SignalSpace::Curiosity(space)) => {
                f32_lanes!(isa, T => nets.losses::<T>(params, steps, space));
                nets.reward(space, steps.len(), out);
            }
            (Self::Rnd(nets), SignalSpace::Rnd(space)) => {
                f32_lanes!(isa, T => nets.losses::<T>(params, steps, space));
                nets.reward(space, steps.len(), out);
            }
            _ => unreachable!("a signal makes its own space"),
        }
    }

    /// Overwrites `gradient` with that of the signal's loss, summed over the steps.
    pub fn gradient(
        &self,
        isa: Isa,
        params: &[f32],
        steps: &[Step<'_, f32>],
        space: &mut SignalSpace,
        gradient: &mut [f32],
    ) {
        match (self, space) {
            (Self::Curiosity(nets), SignalSpace::Curiosity(space)) => f32_lanes!(isa, T => {
                nets.losses::<T>(params, steps, space);
                nets.gradient::<T>(params, steps.len(), space, gradient);
            }),
            (Self::Rnd(nets), SignalSpace::Rnd(space)) => f32_lanes!(isa, T => {
                nets.losses::<T>(params, steps, space);
                nets.gradient::<T>(params, steps.len(), space, gradient);
            }),
            _ => unreachable!("a signal makes its own space"),
        }
    }
}

/// Copies rows of sixteen into features `first..` of a block.
pub(crate) fn place<S: Copy + Default>(block: &mut [S], first: usize, rows: &[S]) {
    block[first * BLOCK..first * BLOCK + rows.len()].copy_from_slice(rows);
}

/// Squared distances: `delta = weight (guess - truth)`, and `half = |guess - truth|^2 / 2` in a row of sixteen per block.
pub(crate) struct Distance<'a, T: Real> {
    pub guess: &'a Blocks<T::Scalar>,
    pub truth: &'a Blocks<T::Scalar>,
    pub weight: f64,
    pub delta: &'a mut Blocks<T::Scalar>,
    pub half: &'a mut [T::Scalar],
    pub blocks: usize,
    pub lanes: PhantomData<T>,
}

impl<T: Real> Kernel<T> for Distance<'_, T> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let (weight, features) = (T::lit(self.weight), self.guess.features());
        for b in 0..self.blocks.min(CHUNK) {
            let (guess, truth, delta) = (self.guess.block(b), self.truth.block(b), self.delta.block_mut(b));
            for lane in (0..BLOCK).step_by(T::LANES) {
                let mut sum = T::zero();
                for k in 0..features {
                    let at = k * BLOCK + lane;
                    let d = T::load(&guess[at..]) - T::load(&truth[at..]);
                    sum = (d * T::lit(0.5)).mul_add(d, sum);
                    (d * weight).store(&mut delta[at..]);
                }
                sum.store(&mut self.half[b * BLOCK + lane..]);
            }
        }
    }
}

/// Adds `factor` times features `first..` of one buffer to all features of another.
pub(crate) struct Gather<'a, T: Real> {
    pub from: &'a Blocks<T::Scalar>,
    pub first: usize,
    pub factor: f64,
    pub to: &'a mut Blocks<T::Scalar>,
    pub blocks: usize,
    pub lanes: PhantomData<T>,
}

impl<T: Real> Kernel<T> for Gather<'_, T> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let factor = T::lit(self.factor);
        for b in 0..self.blocks.min(CHUNK) {
            let (from, to) = (&self.from.block(b)[self.first * BLOCK..], self.to.block_mut(b));
            for (to, from) in to.chunks_exact_mut(T::LANES).zip(from.chunks_exact(T::LANES)) {
                factor.mul_add(T::load(from), T::load(to)).store(to);
            }
        }
    }
}
