//! Deployable policies: one safetensors file with everything that is needed to act.
//!
//! The header's metadata hold one JSON document, [`PolicyMeta`]; the tensors are `obs_mean`, `obs_std`, `log_std`, and
//! `layer.<i>.weight` (`[output, input]`) and `layer.<i>.bias` for each layer. The action for an observation is
//!
//! ```text
//! x = clamp((obs - obs_mean) * (1 / obs_std), -observation_clip, observation_clip)
//! nominal = clamp(mlp(x), -action_clip, action_clip)        with `squash`: clamp(tanh(mlp(x)), ...)
//! action = (low + high) / 2 + nominal (high - low) / 2
//! ```
//!
//! with `[low, high]` from `action_range`. The action is in the units of the environment ([`Spec::action_low`]), so that
//! the policy plays in the original of a task as it does here. A file without `action_range` means [-1, 1].

mod onnx;

use crate::algorithms::parameters::Learner;
use crate::error::Error;
use crate::files::{TensorReader, TensorWriter, write_atomic};
use crate::lanes::BLOCK;
use crate::lanes::buffer::Blocks;
use crate::lanes::f32_lanes;
use crate::nets::activation::Activation;
use crate::nets::gaussian::Gaussian;
use crate::nets::mlp::{CHUNK, Mlp, Tape};
use crate::nets::normalize::{Normalize, Normalizer};
use crate::trainer::Run;
use crate::trainer::config::PpoConfig;
use crate::trainer::evaluate::Evaluation;
use marathon_envs::Spec;
use marathon_envs::shard::scale_action;
use marathon_physics::lanes::{Isa, Real};
use serde::{Deserialize, Serialize};
use std::marker::PhantomData;
use std::path::Path;

const FORMAT: &str = "marathon-policy";
const VERSION: u32 = 1;

/// What a policy is for, and where it comes from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PolicyMeta {
    /// Kind of file: `marathon-policy`.
    pub format: String,
    /// Version of the format.
    pub version: u32,
    /// Name of the agent and its task, such as `Hopper-v0`.
    pub agent: String,
    /// Observation length.
    pub obs: usize,
    /// Action length.
    pub act: usize,
    /// Seconds between decisions.
    pub control_dt: f64,
    /// Physics steps per decision.
    pub frame_skip: usize,
    /// Seconds per physics step.
    pub physics_dt: f64,
    /// Widths of the hidden layers.
    pub hidden: Vec<usize>,
    /// Activation of the hidden layers.
    pub activation: Activation,
    /// Bound of the normalized observations.
    pub observation_clip: f32,
    /// Bound of the network's output.
    pub action_clip: f32,
    /// Whether the network's output goes through the hyperbolic tangent before all else.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub squash: bool,
    /// What an output of -1 and 1 means to the environment, per actuator; empty: just that.
    #[serde(default)]
    pub action_range: Vec<[f32; 2]>,
    /// How the policy was trained, if by Marathon.
    pub training: Option<Training>,
    /// How it did when it was last evaluated.
    pub evaluation: Option<Evaluation>,
}

impl PolicyMeta {
    /// Of a policy for a task, with nothing known about its training; actions of the network in [-1, 1].
    pub fn of(spec: &Spec, hidden: Vec<usize>, activation: Activation) -> Self {
        PolicyMeta {
            format: FORMAT.into(),
            version: VERSION,
            agent: spec.id.clone(),
            obs: spec.obs,
            act: spec.act,
            control_dt: spec.dt,
            frame_skip: spec.frame_skip,
            physics_dt: spec.dt / spec.frame_skip as f64,
            hidden,
            activation,
            observation_clip: 10.0,
            action_clip: 1.0,
            squash: false,
            action_range: (0..spec.act).map(|i| spec.action_range(i)).collect(),
            training: None,
            evaluation: None,
        }
    }
}

/// Summary of a policy's training: nothing that would tell equal policies apart, so without the time that it took.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Training {
    /// Configuration, without the number of threads, which is 0.
    pub config: PpoConfig,
    /// Agent-steps.
    pub steps: u64,
    /// Rollouts.
    pub iterations: u64,
}

/// A policy that can act.
#[derive(Clone, Debug, PartialEq)]
pub struct Policy {
    meta: PolicyMeta,
    net: Mlp,
    params: Vec<f32>,
    normalizer: Normalizer,
    log_std: Vec<f32>,
}

impl Policy {
    pub(crate) fn of(run: &Run<'_>, learner: &Learner) -> Self {
        let (spec, config, layout) = (&run.spec, run.config, &run.layout);
        let training = Training {
            config: PpoConfig { threads: 0, ..config.clone() },
            steps: learner.steps,
            iterations: learner.iteration,
        };
        let mut meta = PolicyMeta::of(spec, config.actor_hidden.clone(), config.activation);
        if layout.twin.is_some() {
            return Self::squashed(run, learner, PolicyMeta { training: Some(training), squash: true, ..meta });
        }
        meta.observation_clip = config.observation_clip as f32;
        meta.training = Some(training);
        let (net, mut params) = (layout.actor.clone(), layout.actor_params(&learner.params).to_vec());
        let mut log_std = learner.params[layout.log_std.clone()].to_vec();
        let scale = config.action_scale();
        if scale != 1.0 {
            // the last layer takes in the scale of the actions, so that every policy is bounded by 1
            let (weights, biases) = net.layers().last().expect("a network has layers");
            params[weights].iter_mut().for_each(|w| *w *= scale);
            params[biases].iter_mut().for_each(|b| *b *= scale);
            log_std.iter_mut().for_each(|l| *l += Real::ln(scale));
        }
        Self { meta, net, params, normalizer: learner.normalizer(config), log_std }
    }

    /// The means of SAC's policy; its deviations depend on the state and are left out.
    fn squashed(run: &Run<'_>, learner: &Learner, mut meta: PolicyMeta) -> Self {
        let (spec, layout) = (&run.spec, &run.layout);
        meta.observation_clip = run.config.observation_clip as f32;
        let sizes = [&[spec.obs], &meta.hidden[..], &[spec.act]].concat();
        let net = Mlp::new(&sizes, meta.activation);
        let all = layout.actor_params(&learner.params);
        let mut params = Vec::with_capacity(net.len());
        for ((weights, biases), (own_weights, own_biases)) in layout.actor.layers().zip(net.layers()) {
            params.extend_from_slice(&all[weights][..own_weights.len()]);
            params.extend_from_slice(&all[biases][..own_biases.len()]);
        }
        let log_std = learner.params[layout.log_std.clone()].to_vec();
        Self { meta, net, params, normalizer: learner.normalizer(run.config), log_std }
    }

    /// A policy from its parts: parameters of the network in the order of [`Mlp`], means and deviations of observations,
    /// logarithms of the standard deviations of actions.
    ///
    /// # Errors
    /// If a length does not fit the widths in `meta`.
    pub fn from_parts(
        meta: PolicyMeta,
        params: Vec<f32>,
        (obs_mean, obs_std): (Vec<f32>, Vec<f32>),
        log_std: Vec<f32>,
    ) -> Result<Self, Error> {
        let sizes = [&[meta.obs], &meta.hidden[..], &[meta.act]].concat();
        let count: u64 = sizes.windows(2).map(|p| (p[0] as u64 + 1).saturating_mul(p[1] as u64)).sum();
        let mismatch =
            |what: &str, found: String, expected: String| Error::Mismatch { what: what.into(), found, expected };
        if sizes.iter().any(|s| !(1..=1 << 16).contains(s)) || sizes.len() > 66 || count > 1 << 28 {
            return Err(mismatch("network", format!("widths {sizes:?}"), "positive widths of a practical size".into()));
        }
        let lengths = [
            ("parameters", params.len(), count as usize),
            ("obs_mean", obs_mean.len(), meta.obs),
            ("obs_std", obs_std.len(), meta.obs),
            ("log_std", log_std.len(), meta.act),
        ];
        for (what, found, expected) in lengths {
            if found != expected {
                return Err(mismatch(what, format!("{found} numbers"), format!("{expected} numbers")));
            }
        }
        let normalizer = Normalizer::new(obs_mean, obs_std, meta.observation_clip);
        Ok(Self { net: Mlp::new(&sizes, meta.activation), meta, params, normalizer, log_std })
    }

    /// What the policy is for, and where it comes from.
    pub fn meta(&self) -> &PolicyMeta {
        &self.meta
    }
    /// Notes how the policy did.
    pub fn set_evaluation(&mut self, evaluation: Evaluation) {
        self.meta.evaluation = Some(evaluation);
    }
    /// The network.
    pub fn net(&self) -> &Mlp {
        &self.net
    }
    /// The network's parameters.
    pub fn params(&self) -> &[f32] {
        &self.params
    }
    /// The map of observations.
    pub fn normalizer(&self) -> &Normalizer {
        &self.normalizer
    }
    /// Logarithms of the standard deviations that the actions had in training.
    pub fn log_std(&self) -> &[f32] {
        &self.log_std
    }

    /// The best action for one observation, one number at a time, with the bits of [`BlockPolicy::act`].
    ///
    /// # Panics
    /// If the observation does not have `meta().obs` numbers.
    pub fn act(&self, obs: &[f32]) -> Vec<f32> {
        assert_eq!(obs.len(), self.meta.obs, "length of the observation");
        let mut action = self.net.forward_row(&self.params, &self.normalizer.row(obs));
        action.iter_mut().enumerate().for_each(|(i, a)| *a = self.action(i, *a));
        action
    }

    /// The action for output `i` of the network.
    #[inline(always)]
    fn action(&self, i: usize, output: f32) -> f32 {
        let clip = self.meta.action_clip;
        let output = if self.meta.squash { Real::tanh(output) } else { output };
        let nominal = Real::min(Real::max(output, -clip), clip);
        self.meta.action_range.get(i).map_or(nominal, |range| scale_action(*range, nominal))
    }

    /// Writes the policy to a file.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn save(&self, path: &Path) -> Result<(), Error> {
        write_atomic(path, &self.to_bytes())
    }

    /// The bytes of a file with the policy; [`Policy::from_bytes`] is the way back.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut file = TensorWriter::default();
        file.list("obs_mean", self.normalizer.mean());
        file.list("obs_std", self.normalizer.std());
        file.list("log_std", &self.log_std);
        for (l, (weights, biases)) in self.net.layers().enumerate() {
            let shape = [self.net.sizes()[l + 1], self.net.sizes()[l]];
            file.add(format!("layer.{l}.weight"), &shape, self.params[weights].iter().copied());
            file.list(&format!("layer.{l}.bias"), &self.params[biases]);
        }
        file.bytes(&self.meta)
    }

    /// Reads a policy.
    ///
    /// # Errors
    /// If the file cannot be read or is not a whole and finite policy.
    pub fn load(path: &Path) -> Result<Self, Error> {
        Self::from_bytes(path, &std::fs::read(path).map_err(Error::io(path, "read"))?)
    }

    /// Reads a policy from the bytes of a file. `path` stands for it in messages.
    ///
    /// # Errors
    /// If the bytes are not a whole and finite policy.
    pub fn from_bytes(path: &Path, bytes: &[u8]) -> Result<Self, Error> {
        let file = TensorReader::new(path, bytes)?;
        let meta: PolicyMeta = file.document(FORMAT, VERSION)?;
        let positive = |x: f32| x.is_finite() && x > 0.0;
        if !positive(meta.observation_clip) || !positive(meta.action_clip) {
            let found = format!("{} and {}", meta.observation_clip, meta.action_clip);
            return Err(Error::file(path, "observation_clip and action_clip", found, "positive numbers"));
        }
        let sound = |[low, high]: &[f32; 2]| low.is_finite() && high.is_finite() && low < high;
        if !(meta.action_range.is_empty() || meta.action_range.len() == meta.act)
            || !meta.action_range.iter().all(sound)
        {
            let found = format!("{:?}", meta.action_range);
            return Err(Error::file(path, "action_range", found, "a low and a higher number per action, or nothing"));
        }
        let mean = file.finite("obs_mean", &[meta.obs])?;
        let std = file.finite("obs_std", &[meta.obs])?;
        if let Some(i) = std.iter().position(|s| !positive(*s)) {
            return Err(Error::file(path, format!("tensor 'obs_std', number {i}"), std[i], "a positive number"));
        }
        let log_std = file.finite("log_std", &[meta.act])?;
        let sizes = [&[meta.obs], &meta.hidden[..], &[meta.act]].concat();
        let mut params = Vec::new();
        for (l, pair) in sizes.windows(2).enumerate() {
            params.extend(file.finite(&format!("layer.{l}.weight"), &[pair[1], pair[0]])?);
            params.extend(file.finite(&format!("layer.{l}.bias"), &[pair[1]])?);
        }
        Self::from_parts(meta, params, (mean, std), log_std)
            .map_err(|e| Error::file(path, "network", e, "tensors that fit the widths"))
    }

    /// Reads a policy for a given task.
    ///
    /// # Errors
    /// As [`Policy::load`], or if the policy is for another agent.
    pub fn load_for(path: &Path, spec: &Spec) -> Result<Self, Error> {
        let policy = Self::load(path)?;
        policy.check(spec).map_err(|e| match e {
            Error::Mismatch { what, found, expected } => Error::file(path, what, found, expected),
            other => other,
        })?;
        Ok(policy)
    }

    /// Whether the policy fits a task.
    ///
    /// # Errors
    /// Names what differs.
    pub fn check(&self, spec: &Spec) -> Result<(), Error> {
        let meta = &self.meta;
        let pairs = [
            ("agent", meta.agent.clone(), spec.id.clone()),
            ("observation length", meta.obs.to_string(), spec.obs.to_string()),
            ("action length", meta.act.to_string(), spec.act.to_string()),
            ("seconds between decisions", meta.control_dt.to_string(), spec.dt.to_string()),
            ("frame_skip", meta.frame_skip.to_string(), spec.frame_skip.to_string()),
        ];
        for (what, found, expected) in pairs {
            if found != expected {
                return Err(Error::Mismatch { what: what.into(), found, expected });
            }
        }
        Ok(())
    }
}

/// A policy with work space to act for many blocks.
pub struct BlockPolicy<'a> {
    policy: &'a Policy,
    isa: Isa,
    input: Blocks<f32>,
    tape: Tape<f32>,
}

impl<'a> BlockPolicy<'a> {
    /// Work space for a policy.
    ///
    /// # Panics
    /// If this processor lacks the instruction set, at the first use.
    pub fn new(policy: &'a Policy, isa: Isa) -> Self {
        Self { policy, isa, input: policy.net.input(), tape: policy.net.inference_tape() }
    }

    /// The best actions, `[block][act][16]`, for raw observations, `[block][obs][16]`.
    ///
    /// # Panics
    /// If the lengths do not fit each other.
    pub fn act(&mut self, obs: &[f32], action: &mut [f32]) {
        let policy = self.policy;
        let (obs_row, act_row) = (policy.meta.obs * BLOCK, policy.meta.act * BLOCK);
        assert!(obs.len() / obs_row * act_row == action.len() && obs.len().is_multiple_of(obs_row), "whole blocks");
        for (raw, action) in obs.chunks(CHUNK * obs_row).zip(action.chunks_mut(CHUNK * act_row)) {
            self.forward(raw);
            for (b, out) in action.chunks_exact_mut(act_row).enumerate() {
                for (i, (out, x)) in out.iter_mut().zip(self.tape.output().block(b)).enumerate() {
                    *out = policy.action(i / BLOCK, *x);
                }
            }
        }
    }

    /// The best actions, `[n][act]`, for any number of raw observations, `[n][obs]`. With `noise`, `[n][act]` standard
    /// normal numbers, the actions are drawn as in training.
    ///
    /// # Panics
    /// If the lengths do not fit each other.
    pub fn act_rows(&mut self, obs: &[f32], noise: Option<&[f32]>, action: &mut [f32]) {
        let policy = self.policy;
        let (n_obs, n_act) = (policy.meta.obs, policy.meta.act);
        assert!(obs.len() / n_obs * n_act == action.len() && obs.len().is_multiple_of(n_obs), "whole rows");
        assert!(noise.is_none_or(|noise| noise.len() == action.len()), "noise for every action");
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
            self.forward(&raw);
            for (i, row) in action.chunks_exact_mut(n_act).enumerate() {
                let mean = self.tape.output().block(i / BLOCK);
                for (k, out) in row.iter_mut().enumerate() {
                    let drawn = noise.map_or(0.0, |noise| std[k] * noise[(chunk * rows + i) * n_act + k]);
                    *out = policy.action(k, mean[k * BLOCK + i % BLOCK] + drawn);
                }
            }
        }
    }

    /// Runs the network for at most [`CHUNK`] blocks of raw observations.
    fn forward(&mut self, raw: &[f32]) {
        let policy = self.policy;
        f32_lanes!(self.isa, T => <T as Real>::enter(Normalize::<T> {
            normalizer: &policy.normalizer,
            raw,
            input: &mut self.input,
            copy: None,
            sums: None,
            lanes: PhantomData,
        }));
        let blocks = raw.len() / (policy.meta.obs * BLOCK);
        policy.net.forward(self.isa, &policy.params, &self.input, &mut self.tape, blocks);
    }
}
