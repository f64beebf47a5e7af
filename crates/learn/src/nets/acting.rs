//! The acting network: the policy's network with its input statistics and its action distribution.

use crate::lanes::BLOCK;
use crate::lanes::buffer::Blocks;
use crate::lanes::f32_lanes;
use crate::lanes::noise::Noise;
use crate::nets::gaussian::{Gaussian, Ratio, Sample};
use crate::nets::mlp::{CHUNK, Mlp, Tape};
use crate::nets::normalize::{Normalize, Normalizer};
use crate::nets::squash::{Draw, Normals};
use marathon_physics::lanes::{Isa, Real};
use std::marker::PhantomData;

/// The distribution of sampled actions.
pub enum Distribution {
    /// Normal, with deviations that do not depend on the state.
    Gaussian(Gaussian<f32>, Ratio),
    /// Normal numbers through the hyperbolic tangent, with deviations from the network.
    Squashed,
}

/// The network that all workers' agents act with.
pub struct Acting<'a> {
    /// Instruction set.
    pub isa: Isa,
    /// Network.
    pub net: &'a Mlp,
    /// Parameters of the network.
    pub params: &'a [f32],
    /// Map of raw observations to network inputs.
    pub normalizer: Normalizer,
    /// Meaning of the network's outputs.
    pub distribution: Distribution,
    /// Factor of the sampled actions, before they are clipped.
    pub action_scale: f32,
}

/// Work space for a chunk of blocks.
pub struct ActingSpace {
    /// Normalized observations.
    pub input: Blocks<f32>,
    tape: Tape<f32>,
    eps: Vec<[f32; BLOCK]>,
    z: Vec<f32>,
}

impl Acting<'_> {
    /// Creates the work space.
    pub fn space(&self, actions: usize) -> ActingSpace {
        ActingSpace {
            input: self.net.input(),
            tape: self.net.inference_tape(),
            eps: vec![[0.0; BLOCK]; actions],
            z: vec![0.0; CHUNK * actions * BLOCK],
        }
    }

    /// Normalizes raw observations, `[block][obs][16]`, into `input` and, if given, a copy and sums of deviations and squares.
    pub fn normalize(
        &self,
        raw: &[f32],
        input: &mut Blocks<f32>,
        copy: Option<&mut [f32]>,
        sums: Option<(&mut [f32], &mut [f32])>,
    ) {
        let normalizer = &self.normalizer;
        f32_lanes!(self.isa, T => <T as Real>::enter(Normalize::<T> {
            normalizer, raw, input, copy, sums, lanes: PhantomData,
        }));
    }

    /// Draws actions for the first blocks of `space.input`, one block per stream of noise: `[block][action][16]`, with
    /// their log-probabilities, `[block][16]` or one row per action.
    pub fn draw(&self, noise: &mut [Noise], space: &mut ActingSpace, action: &mut [f32], log_prob: &mut [f32]) {
        let ActingSpace { input, tape, eps, z } = space;
        let blocks = noise.len();
        self.net.forward(self.isa, self.params, input, tape, blocks);
        let output = tape.output();
        match &self.distribution {
            Distribution::Gaussian(gaussian, ratio) => {
                f32_lanes!(self.isa, T => <T as Real>::enter(Sample::<T> {
                    gaussian, mean: output, noise, action, log_prob, ratio: *ratio, eps, lanes: PhantomData,
                }));
            }
            Distribution::Squashed => {
                let act = eps.len();
                let z = &mut z[..blocks * act * BLOCK];
                f32_lanes!(self.isa, T => {
                    <T as Real>::enter(Normals::<T> { noise, z: &mut *z, act, lanes: PhantomData });
                    <T as Real>::enter(Draw::<T> { output, z, act, action, log_prob, blocks, lanes: PhantomData });
                });
            }
        }
    }
}
