//! Acting for many agents at a time.

use super::Policy;
use crate::lanes::BLOCK;
use crate::lanes::buffer::Blocks;
use crate::lanes::f32_lanes;
use crate::nets::gaussian::Gaussian;
use crate::nets::mlp::{CHUNK, Tape};
use crate::nets::normalize::Normalize;
use marathon_physics::lanes::{Isa, Real};
use std::marker::PhantomData;
use std::ops::Deref;

/// A policy, borrowed or shared, with work space to act for many blocks.
pub struct BlockPolicy<P> {
    policy: P,
    isa: Isa,
    input: Blocks<f32>,
    tape: Tape<f32>,
}

impl<P: Deref<Target = Policy>> BlockPolicy<P> {
    /// Creates the work space for a policy.
    ///
    /// # Panics
    /// At the first use, if this processor lacks the instruction set.
    pub fn new(policy: P, isa: Isa) -> Self {
        Self { isa, input: policy.net.input(), tape: policy.net.inference_tape(), policy }
    }

    /// The policy.
    pub fn policy(&self) -> &P {
        &self.policy
    }

    /// The best actions, `[block][act][16]`, for raw observations, `[block][obs][16]`.
    ///
    /// # Panics
    /// If the lengths do not fit each other.
    pub fn act(&mut self, obs: &[f32], action: &mut [f32]) {
        let policy = &*self.policy;
        let (obs_row, act_row) = (policy.meta.obs * BLOCK, policy.meta.act * BLOCK);
        assert!(
            obs.len() / obs_row * act_row == action.len() && obs.len().is_multiple_of(obs_row),
            "expected whole blocks"
        );
        for (raw, action) in obs.chunks(CHUNK * obs_row).zip(action.chunks_mut(CHUNK * act_row)) {
            forward(policy, self.isa, raw, &mut self.input, &mut self.tape);
            for (b, out) in action.chunks_exact_mut(act_row).enumerate() {
                for (i, (out, x)) in out.iter_mut().zip(self.tape.output().block(b)).enumerate() {
                    *out = policy.action(i / BLOCK, *x);
                }
            }
        }
    }

    /// The best actions, `[n][act]`, for any number of raw observations, `[n][obs]`. With `noise`, `[n][act]` standard
    /// normal numbers, the actions are sampled as in training.
    ///
    /// # Panics
    /// If the lengths do not fit each other.
    pub fn act_rows(&mut self, obs: &[f32], noise: Option<&[f32]>, action: &mut [f32]) {
        let policy = &*self.policy;
        let (n_obs, n_act) = (policy.meta.obs, policy.meta.act);
        assert!(obs.len() / n_obs * n_act == action.len() && obs.len().is_multiple_of(n_obs), "expected whole rows");
        assert!(noise.is_none_or(|noise| noise.len() == action.len()), "expected noise for every action");
        let std = Gaussian::new(&policy.log_std).std;
        let rows = CHUNK * BLOCK;
        for (chunk, (obs, action)) in obs.chunks(rows * n_obs).zip(action.chunks_mut(rows * n_act)).enumerate() {
            let mut raw = vec![0.0; (action.len() / n_act).div_ceil(BLOCK) * BLOCK * n_obs];
            for (i, row) in obs.chunks_exact(n_obs).enumerate() {
                let block = &mut raw[i / BLOCK * BLOCK * n_obs..];
                for (k, x) in row.iter().enumerate() {
                    block[k * BLOCK + i % BLOCK] = *x;
                }
            }
            forward(policy, self.isa, &raw, &mut self.input, &mut self.tape);
            for (i, row) in action.chunks_exact_mut(n_act).enumerate() {
                let mean = self.tape.output().block(i / BLOCK);
                for (k, out) in row.iter_mut().enumerate() {
                    let drawn = noise.map_or(0.0, |noise| std[k] * noise[(chunk * rows + i) * n_act + k]);
                    *out = policy.action(k, mean[k * BLOCK + i % BLOCK] + drawn);
                }
            }
        }
    }
}

/// Runs the network for at most [`CHUNK`] blocks of raw observations.
fn forward(policy: &Policy, isa: Isa, raw: &[f32], input: &mut Blocks<f32>, tape: &mut Tape<f32>) {
    f32_lanes!(isa, T => <T as Real>::enter(Normalize::<T> {
        normalizer: &policy.normalizer,
        raw,
        input: &mut *input,
        copy: None,
        sums: None,
        lanes: PhantomData,
    }));
    let blocks = raw.len() / (policy.meta.obs * BLOCK);
    policy.net.forward(isa, &policy.params, input, tape, blocks);
}
