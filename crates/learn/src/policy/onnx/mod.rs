//! Policies as ONNX files that follow ML-Agents' contract, and small networks of other trainers as policies.
//!
//! [`Policy::to_onnx`] writes the same format as ML-Agents' own exporter. Unity and other players of ML-Agents' models
//! accept it. The input `obs_0` `[batch, obs]` is the raw observation. The outputs `deterministic_continuous_actions`
//! and `continuous_actions` `[batch, act]` are the best action and one sampled as in training. Further outputs are the
//! constants `version_number`, `memory_size` and `continuous_action_output_shape`. Normalization and bounds are part of
//! the model.
//!
//! [`Policy::from_onnx`] reads multi-layer perceptrons written by ML-Agents, PyTorch or Stable-Baselines3. It analyzes
//! the computation, not the names: `reader` folds the graph into a chain of stages, and `chain` converts the chain to a
//! [`Policy`]. Anything that does not fit is refused by name.

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

/// Input of exported networks.
const OBSERVATION: &str = "obs_0";
/// Output with the best actions.
const DETERMINISTIC: &str = "deterministic_continuous_actions";
/// Output with sampled actions, as in training.
const SAMPLED: &str = "continuous_actions";
/// Output with the version of ML-Agents' contract.
const API_VERSION: &str = "version_number";
/// Key of Marathon's document in a model's metadata.
const KEY: &str = "marathon";

impl Policy {
    /// The bytes of an ONNX file with the same actions as the policy.
    pub fn to_onnx(&self) -> Vec<u8> {
        export::encode(self)
    }

    /// Converts the network in the bytes of an ONNX file to a policy. The path is for messages, and to find weights
    /// that some programs store in other files of the same folder. `spec` is the policy's task. Without it, the file
    /// must name its task, as Marathon's files do.
    ///
    /// The spread of sampled actions is known only for files by Marathon or ML-Agents. Other policies get a very small
    /// one.
    ///
    /// # Errors
    /// If the bytes are not an ONNX model, or the network cannot be a policy. The text says what was found where.
    pub fn from_onnx(path: &Path, bytes: &[u8], spec: Option<&Spec>) -> Result<Self, Error> {
        reader::decode(path, bytes, spec)
    }

    /// The description of the policy in an ONNX file that Marathon has written.
    pub fn meta_of_onnx(bytes: &[u8]) -> Option<PolicyMeta> {
        reader::meta(bytes)
    }
}
