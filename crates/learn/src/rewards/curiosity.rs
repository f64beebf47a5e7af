//! Curiosity (Pathak et al., 2017): the reward is the error of a prediction.
//!
//! An encoder computes features `f` of an observation. One network predicts the action from the features before and
//! after it, which excludes everything that the agent cannot influence. Another predicts the features that follow:
//!
//! ```text
//! forward = |P(f, a) - f'|^2 / 2        inverse = |I(f, f') - a|^2
//! loss    = 10 (0.2 forward + 0.8 inverse)        reward = forward
//! ```
//!
//! All three learn from the whole loss (with ML-Agents' weights). Actions are bounded to [-1, 1], as the environment
//! uses them.

use super::kernels::{Distance, Gather, place};
use super::{Minibatch, Reward, RewardModel, Step};
use crate::lanes::BLOCK;
use crate::lanes::buffer::Blocks;
use crate::lanes::f32_lanes;
use crate::lanes::noise::SplitMix;
use crate::nets::activation::Activation;
use crate::nets::init;
use crate::nets::mlp::{CHUNK, Mlp, Tape};
use crate::optim::sum::Add;
use marathon_physics::lanes::{Isa, Kernel, Real};
use std::marker::PhantomData;
use std::ops::Range;

/// Weights of the two errors in the loss.
const FORWARD: f64 = 10.0 * 0.2;
const INVERSE: f64 = 10.0 * 0.8;
/// Width of the hidden layer of the two predictors.
const HIDDEN: usize = 256;

/// The three networks. Their parameters follow one another in this order.
#[derive(Clone, Debug)]
pub struct Curiosity {
    encoder: Mlp,
    forward: Mlp,
    inverse: Mlp,
    features: usize,
}

/// Work space.
pub struct CuriositySpace<S> {
    obs: Blocks<S>,
    next: Blocks<S>,
    action: Blocks<S>,
    before: Tape<S>,
    after: Tape<S>,
    /// Features and action, then the predicted features.
    forward_input: Blocks<S>,
    forward: Tape<S>,
    /// Features before and after, then the predicted action.
    inverse_input: Blocks<S>,
    inverse: Tape<S>,
    /// Derivatives with respect to the inputs of both predictors.
    forward_delta: Blocks<S>,
    inverse_delta: Blocks<S>,
    half: Vec<S>,
    inverse_half: Vec<S>,
    gradient: Vec<S>,
}

impl Reward for Curiosity {
    fn count(&self) -> usize {
        self.count()
    }
    fn init(&self, params: &mut [f32], random: &mut SplitMix) {
        self.init(params, random);
    }
    fn reward_model(&self) -> Box<dyn RewardModel> {
        Box::new(CuriosityModel { nets: self.clone(), space: self.space() })
    }
}

/// The networks with their work space.
struct CuriosityModel {
    nets: Curiosity,
    space: CuriositySpace<f32>,
}

impl RewardModel for CuriosityModel {
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

impl Curiosity {
    /// Creates the networks for the given observation and action lengths. The last width is the number of features.
    pub fn new(obs: usize, act: usize, hidden: &[usize]) -> Self {
        let features = hidden.last().copied().unwrap_or(obs);
        let net = |sizes: &[usize]| Mlp::new(sizes, Activation::Swish);
        Self {
            encoder: net(&[&[obs], hidden].concat()),
            forward: net(&[features + act, HIDDEN, features]),
            inverse: net(&[2 * features, HIDDEN, act]),
            features,
        }
    }
    /// Number of parameters.
    pub fn count(&self) -> usize {
        self.encoder.len() + self.forward.len() + self.inverse.len()
    }
    /// Places of the three networks' parameters.
    fn parts(&self) -> [Range<usize>; 3] {
        let (e, f) = (self.encoder.len(), self.forward.len());
        [0..e, e..e + f, e + f..self.count()]
    }
    /// Initializes the parameters.
    pub(crate) fn init(&self, params: &mut [f32], random: &mut SplitMix) {
        for (net, part) in [&self.encoder, &self.forward, &self.inverse].into_iter().zip(self.parts()) {
            init::orthogonal(net, &mut params[part], 1.0, random);
        }
    }
    /// Work space.
    pub fn space<S: Copy + Default>(&self) -> CuriositySpace<S> {
        let act = self.inverse.sizes()[2];
        let row = || vec![S::default(); CHUNK * BLOCK];
        CuriositySpace {
            obs: self.encoder.input(),
            next: self.encoder.input(),
            action: Blocks::new(CHUNK, act),
            before: self.encoder.tape(),
            after: self.encoder.tape(),
            forward_input: self.forward.input(),
            forward: self.forward.tape(),
            inverse_input: self.inverse.input(),
            inverse: self.inverse.tape(),
            forward_delta: self.forward.input(),
            inverse_delta: self.inverse.input(),
            half: row(),
            inverse_half: row(),
            gradient: vec![S::default(); self.encoder.len()],
        }
    }

    /// Runs all networks on the steps and stores the errors with their derivatives.
    pub fn losses<T: Real>(
        &self,
        params: &[T::Scalar],
        steps: &[Step<'_, T::Scalar>],
        space: &mut CuriositySpace<T::Scalar>,
    ) {
        let [encoder, forward, inverse] = self.parts().map(|part| &params[part]);
        let n = steps.len();
        for (b, step) in steps.iter().enumerate() {
            place(space.obs.block_mut(b), 0, step.obs);
            place(space.next.block_mut(b), 0, step.next);
            T::enter(Bound::<T> { from: step.action, to: space.action.block_mut(b), lanes: PhantomData });
        }
        self.encoder.forward_on::<T>(encoder, &space.obs, &mut space.before, n);
        self.encoder.forward_on::<T>(encoder, &space.next, &mut space.after, n);
        for b in 0..n {
            let (before, after) = (space.before.output().block(b), space.after.output().block(b));
            place(space.forward_input.block_mut(b), 0, before);
            place(space.forward_input.block_mut(b), self.features, space.action.block(b));
            place(space.inverse_input.block_mut(b), 0, before);
            place(space.inverse_input.block_mut(b), self.features, after);
        }
        self.forward.forward_on::<T>(forward, &space.forward_input, &mut space.forward, n);
        self.inverse.forward_on::<T>(inverse, &space.inverse_input, &mut space.inverse, n);
        let (guess, delta) = space.forward.output_and_delta();
        T::enter(Distance::<T> {
            guess,
            truth: space.after.output(),
            weight: FORWARD,
            delta,
            half: &mut space.half,
            blocks: n,
            lanes: PhantomData,
        });
        let (guess, delta) = space.inverse.output_and_delta();
        T::enter(Distance::<T> {
            guess,
            truth: &space.action,
            weight: 2.0 * INVERSE,
            delta,
            half: &mut space.inverse_half,
            blocks: n,
            lanes: PhantomData,
        });
    }

    /// The prediction error after [`Curiosity::losses`].
    pub fn reward(&self, space: &CuriositySpace<f32>, blocks: usize, out: &mut [f32]) {
        out[..blocks * BLOCK].copy_from_slice(&space.half[..blocks * BLOCK]);
    }

    /// Gradient of the summed loss after [`Curiosity::losses`].
    pub fn gradient<T: Real>(
        &self,
        params: &[T::Scalar],
        blocks: usize,
        space: &mut CuriositySpace<T::Scalar>,
        gradient: &mut [T::Scalar],
    ) {
        let parts = self.parts();
        let [encoder, forward, inverse] = parts.clone().map(|part| &params[part]);
        let [of_encoder, of_forward, of_inverse] = parts;
        let s = &mut *space;
        // both predictors, down to their inputs
        let part = &mut gradient[of_forward];
        self.forward.backward_on::<T>(forward, &s.forward_input, &mut s.forward, part, blocks);
        self.forward.input_delta_on::<T>(forward, &s.forward, &mut s.forward_delta, blocks);
        let part = &mut gradient[of_inverse];
        self.inverse.backward_on::<T>(inverse, &s.inverse_input, &mut s.inverse, part, blocks);
        self.inverse.input_delta_on::<T>(inverse, &s.inverse, &mut s.inverse_delta, blocks);
        // the features before enter both predictors; the features after enter the inverse one and the prediction error
        let gather = |from: &Blocks<T::Scalar>, first: usize, factor: f64, to: &mut Blocks<T::Scalar>| {
            T::enter(Gather::<T> { from, first, factor, to, blocks, lanes: PhantomData });
        };
        let (before, after) = (s.before.output_delta(), s.after.output_delta());
        for b in 0..blocks {
            before.block_mut(b).fill(T::Scalar::default());
            after.block_mut(b).fill(T::Scalar::default());
        }
        gather(&s.forward_delta, 0, 1.0, before);
        gather(&s.inverse_delta, 0, 1.0, before);
        gather(&s.inverse_delta, self.features, 1.0, after);
        gather(s.forward.output_delta(), 0, -1.0, after);
        let part = &mut gradient[of_encoder];
        self.encoder.backward_on::<T>(encoder, &s.obs, &mut s.before, part, blocks);
        self.encoder.backward_on::<T>(encoder, &s.next, &mut s.after, &mut s.gradient, blocks);
        T::enter(Add::<T> { sum: part, x: &s.gradient });
    }

    /// The loss of one row after [`Curiosity::losses`], for tests.
    pub fn loss(&self, space: &CuriositySpace<f64>, at: usize) -> f64 {
        FORWARD * space.half[at] + 2.0 * INVERSE * space.inverse_half[at]
    }
}

/// Bounds actions to [-1, 1].
struct Bound<'a, T: Real> {
    from: &'a [T::Scalar],
    to: &'a mut [T::Scalar],
    lanes: PhantomData<T>,
}

impl<T: Real> Kernel<T> for Bound<'_, T> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        for (to, from) in self.to.chunks_exact_mut(T::LANES).zip(self.from.chunks_exact(T::LANES)) {
            T::load(from).max(T::lit(-1.0)).min(T::lit(1.0)).store(to);
        }
    }
}
