//! Policies as ONNX files, by the contract of ML-Agents, and small networks of other trainers as policies.
//!
//! [`Policy::to_onnx`] writes what ML-Agents' own exporter writes, so that Unity and everything else that plays ML-Agents'
//! models accepts it: input `obs_0` `[batch, obs]`, the raw observation; outputs `deterministic_continuous_actions` and
//! `continuous_actions` `[batch, act]`, the best action and one drawn as in training; and the constants `version_number`,
//! `memory_size` and `continuous_action_output_shape`. Normalization and bounds are inside.
//!
//! [`Policy::from_onnx`] reads multi-layer perceptrons that ML-Agents, PyTorch or Stable-Baselines3 has written. It looks at
//! what is computed, not at names: `reader` folds the graph into a chain of stages, `chain` brings the chain into the form
//! of a [`Policy`]. What does not fit is refused by name.

mod chain;
mod export;
mod graph;
mod proto;
mod reader;
mod tensor;

use crate::error::Error;
use crate::policy::Policy;
use crate::policy::PolicyMeta;
use marathon_envs::Spec;
use std::path::Path;

/// Input of the networks that are written.
const OBSERVATION: &str = "obs_0";
/// Output with the best actions.
const DETERMINISTIC: &str = "deterministic_continuous_actions";
/// Output with actions drawn as in training.
const SAMPLED: &str = "continuous_actions";
/// Output that tells the version of ML-Agents' contract.
const API_VERSION: &str = "version_number";
/// Key of Marathon's document in a model's metadata.
const KEY: &str = "marathon";

impl Policy {
    /// The bytes of an ONNX file that acts as the policy does.
    pub fn to_onnx(&self) -> Vec<u8> {
        export::encode(self)
    }

    /// The policy that acts as the network in the bytes of an ONNX file does. The path is for messages, and for the files in
    /// the same folder in which some programs put the weights. `spec` is the task that it is for; without, the one that the
    /// file names, which Marathon's do.
    ///
    /// The spread of drawn actions is known only for files that Marathon or ML-Agents has written; others get a very small
    /// one.
    ///
    /// # Errors
    /// If the bytes are no ONNX model, or not of a network that a policy can be; the text says what was found where.
    pub fn from_onnx(path: &Path, bytes: &[u8], spec: Option<&Spec>) -> Result<Self, Error> {
        reader::decode(path, bytes, spec)
    }

    /// What an ONNX file that Marathon has written says of its policy.
    pub fn meta_of_onnx(bytes: &[u8]) -> Option<PolicyMeta> {
        reader::meta(bytes)
    }
}
