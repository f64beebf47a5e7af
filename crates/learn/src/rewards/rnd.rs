//! Random network distillation (Burda et al., 2018): a network learns the output of a second network with fixed random
//! parameters. Its squared error is large for new observations, and is the reward.

use super::kernels::{Distance, place};
use super::{Minibatch, Reward, RewardModel, Step};
use crate::lanes::BLOCK;
use crate::lanes::buffer::Blocks;
use crate::lanes::f32_lanes;
use crate::lanes::noise::{SIGNALS, SplitMix};
use crate::nets::activation::Activation;
use crate::nets::init;
use crate::nets::mlp::{CHUNK, Mlp, Tape};
use marathon_physics::lanes::{Isa, Real};
use std::marker::PhantomData;

/// The two networks, which have the same shape, and the parameters of the fixed one.
#[derive(Clone, Debug)]
pub struct Rnd {
    net: Mlp,
    target: Vec<f32>,
}

/// Work space.
pub struct RndSpace<S> {
    /// The fixed network's parameters.
    fixed: Vec<S>,
    input: Blocks<S>,
    target: Tape<S>,
    guess: Tape<S>,
    /// Half the squared error, a row per block.
    half: Vec<S>,
}

impl Reward for Rnd {
    fn count(&self) -> usize {
        self.count()
    }
    fn init(&self, params: &mut [f32], random: &mut SplitMix) {
        self.init(params, random);
    }
    fn reward_model(&self) -> Box<dyn RewardModel> {
        Box::new(RndModel { nets: self.clone(), space: self.space() })
    }
}

/// The networks with their work space.
struct RndModel {
    nets: Rnd,
    space: RndSpace<f32>,
}

impl RewardModel for RndModel {
    fn reward(&mut self, isa: Isa, params: &[f32], steps: &[Step<'_, f32>], out: &mut [f32]) {
        f32_lanes!(isa, T => self.nets.losses::<T>(params, steps, &mut self.space));
        self.nets.reward(&self.space, steps.len(), out);
    }
    fn gradient(&mut self, isa: Isa, params: &[f32], steps: &[Step<'_, f32>], _: &Minibatch<'_>, gradient: &mut [f32]) {
        f32_lanes!(isa, T => {
            self.nets.losses::<T>(params, steps, &mut self.space);
            self.nets.gradient::<T>(params, steps.len(), &mut self.space, gradient);
        });
    }
}

impl Rnd {
    /// Creates the networks for observations of length `obs`, with fixed parameters from a seed.
    pub fn seeded(obs: usize, hidden: &[usize], seed: u64) -> Self {
        Self::new(obs, hidden, &mut SplitMix::new(seed, SIGNALS))
    }
    /// Like [`Rnd::seeded`], from a stream of random numbers. The last width is the number of features.
    pub(crate) fn new(obs: usize, hidden: &[usize], random: &mut SplitMix) -> Self {
        let net = Mlp::new(&[&[obs], hidden].concat(), Activation::Swish);
        let mut target = vec![0.0; net.len()];
        init::orthogonal(&net, &mut target, 1.0, random);
        Self { net, target }
    }
    /// Number of trained parameters.
    pub fn count(&self) -> usize {
        self.net.len()
    }
    /// Initializes the parameters.
    pub(crate) fn init(&self, params: &mut [f32], random: &mut SplitMix) {
        init::orthogonal(&self.net, params, 1.0, random);
    }
    /// Work space.
    pub fn space<S: Copy + Default + From<f32>>(&self) -> RndSpace<S> {
        RndSpace {
            fixed: self.target.iter().map(|x| S::from(*x)).collect(),
            input: self.net.input(),
            target: self.net.inference_tape(),
            guess: self.net.tape(),
            half: vec![S::default(); CHUNK * BLOCK],
        }
    }

    /// Runs both networks on the observations.
    pub fn losses<T: Real>(
        &self,
        params: &[T::Scalar],
        steps: &[Step<'_, T::Scalar>],
        space: &mut RndSpace<T::Scalar>,
    ) {
        let RndSpace { fixed, input, target, guess, half } = space;
        let n = steps.len();
        for (b, step) in steps.iter().enumerate() {
            place(input.block_mut(b), 0, step.obs);
        }
        self.net.forward_on::<T>(fixed, input, target, n);
        self.net.forward_on::<T>(&params[..self.count()], input, guess, n);
        let (output, delta) = guess.output_and_delta();
        T::enter(Distance::<T> {
            guess: output,
            truth: target.output(),
            weight: 2.0,
            delta,
            half,
            blocks: n,
            lanes: PhantomData,
        });
    }

    /// The squared error after [`Rnd::losses`].
    pub fn reward(&self, space: &RndSpace<f32>, blocks: usize, out: &mut [f32]) {
        out[..blocks * BLOCK].iter_mut().zip(&space.half).for_each(|(out, half)| *out = 2.0 * half);
    }

    /// Gradient of the sum of that error after [`Rnd::losses`].
    pub fn gradient<T: Real>(
        &self,
        params: &[T::Scalar],
        blocks: usize,
        space: &mut RndSpace<T::Scalar>,
        gradient: &mut [T::Scalar],
    ) {
        let n = self.count();
        self.net.backward_on::<T>(&params[..n], &space.input, &mut space.guess, &mut gradient[..n], blocks);
    }

    /// The loss of one row after [`Rnd::losses`], for tests.
    pub fn loss<S: Copy>(&self, space: &RndSpace<S>, at: usize) -> S {
        space.half[at]
    }
}
