//! Deployable policies: one safetensors file with everything that acting needs.
//!
//! The metadata of the header hold one JSON document, [`PolicyMeta`] and a checksum. The tensors are `obs_mean`,
//! `obs_std`, `log_std`, and `layer.<i>.weight` (`[output, input]`) and `layer.<i>.bias` for each layer. The action for
//! an observation is
//!
//! ```text
//! x = clamp((obs - obs_mean) * (1 / obs_std), -observation_clip, observation_clip)
//! nominal = clamp(mlp(x), -action_clip, action_clip)        with `squash`: clamp(tanh(mlp(x)), ...)
//! action = (low + high) / 2 + nominal (high - low) / 2
//! ```
//!
//! with `[low, high]` from `action_range`. The action has the units of the environment ([`Spec::action_low`]), so the
//! policy also plays in the original of a task. A file without `action_range` means [-1, 1].
//!
//! The last key of the document, `checksum`, is the FNV-1a hash of all bytes of the file, computed with sixteen zeros
//! in its place.

mod block;
mod cast;
pub mod evaluation;
mod file;
mod mean;
mod onnx;
pub mod options;

pub use block::BlockPolicy;
pub use cast::Cast;

use crate::error::Error;
use crate::nets::activation::Activation;
use crate::nets::mlp::Mlp;
use crate::nets::normalize::Normalizer;
use evaluation::Evaluation;
use marathon_envs::shard::{scale_action, task_of_role};
use marathon_envs::{Options, Spec};
use marathon_physics::lanes::Real;
use serde::{Deserialize, Serialize};
use serde_json::Value;

const FORMAT: &str = "marathon-policy";
const VERSION: u32 = 1;

/// Limits: width of a layer, number of hidden layers, and number of parameters.
const MOST_WIDTH: usize = 1 << 16;
const MOST_HIDDEN: usize = 64;
const MOST_PARAMETERS: u64 = 1 << 28;

/// Description of a policy: its task and its origin.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PolicyMeta {
    /// Kind of file: `marathon-policy`.
    pub format: String,
    /// Version of the format.
    pub version: u32,
    /// Name of the agent with its task, such as `Hopper-v0`.
    pub agent: String,
    /// Options of the task, with the values that the policy was trained for. Empty for a task without options. The file stores
    /// motion clips in a second entry, `clips`: names, and texts of `.motion` files.
    #[serde(flatten, with = "options::beside")]
    pub options: Options,
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
    /// Whether the network's output first goes through the hyperbolic tangent.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub squash: bool,
    /// Actions of the environment for outputs of -1 and 1, per actuator. Empty: the outputs themselves.
    #[serde(default)]
    pub action_range: Vec<[f32; 2]>,
    /// Summary of the training, if Marathon trained the policy.
    pub training: Option<Training>,
    /// Results of the last evaluation.
    pub evaluation: Option<Evaluation>,
    /// The stages of the recipe that made the policy, in their order.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub lineage: Vec<Ancestor>,
}

impl PolicyMeta {
    /// Describes a policy for a task, without training. Actions of the network are in [-1, 1].
    pub fn of(spec: &Spec, hidden: Vec<usize>, activation: Activation) -> Self {
        PolicyMeta {
            format: FORMAT.into(),
            version: VERSION,
            agent: spec.id.clone(),
            options: spec.options.clone(),
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
            lineage: Vec::new(),
        }
    }
}

/// Summary of a policy's training. Equal policies have equal summaries, so it has no times.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Training {
    /// Configuration, with 0 for the number of threads. It is for people: no program depends on its keys.
    pub config: Value,
    /// Agent-steps.
    pub steps: u64,
    /// Rollouts.
    pub iterations: u64,
}

/// A stage of the recipe that made a policy. Like [`Training`], it has no times.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ancestor {
    /// Name of the stage.
    pub stage: String,
    /// How the stage made its policy: `train`, `distill` or `average`.
    pub kind: String,
    /// Name of its agent with its task.
    pub agent: String,
    /// Seed of its run.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub seed: Option<u64>,
    /// Agent-steps of its run.
    pub steps: u64,
    /// Stages and files that it used.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub from: Vec<String>,
    /// Checksum of the settings and files that its policy depends on.
    pub hash: String,
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
    /// Creates a policy from parts that fit.
    pub(crate) fn assemble(
        meta: PolicyMeta,
        net: Mlp,
        params: Vec<f32>,
        normalizer: Normalizer,
        log_std: Vec<f32>,
    ) -> Self {
        Self { meta, net, params, normalizer, log_std }
    }

    /// Creates a policy from its parts: parameters of the network in the order of [`Mlp`], means and deviations of
    /// observations, logarithms of the standard deviations of actions.
    ///
    /// # Errors
    /// If a length does not fit the widths in `meta`.
    pub fn from_parts(
        meta: PolicyMeta,
        params: Vec<f32>,
        (obs_mean, obs_std): (Vec<f32>, Vec<f32>),
        log_std: Vec<f32>,
    ) -> Result<Self, Error> {
        let count = check_widths(&meta)?;
        let sizes = [&[meta.obs], &meta.hidden[..], &[meta.act]].concat();
        let mismatch =
            |what: &str, found: String, expected: String| Error::Mismatch { what: what.into(), found, expected };
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

    /// Description of the policy.
    pub fn meta(&self) -> &PolicyMeta {
        &self.meta
    }
    /// Stores the results of an evaluation.
    pub fn set_evaluation(&mut self, evaluation: Evaluation) {
        self.meta.evaluation = Some(evaluation);
    }
    /// Stores the stages that made the policy.
    pub fn set_lineage(&mut self, lineage: Vec<Ancestor>) {
        self.meta.lineage = lineage;
    }
    /// Stores the options of the policy's task.
    pub fn set_options(&mut self, options: Options) {
        self.meta.options = options;
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
    /// Logarithms of the standard deviations of the actions in training.
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

    /// Checks that the policy fits a task: its own, or, for the policy of a role, the single-role task of the same
    /// name.
    ///
    /// # Errors
    /// Names the difference.
    pub fn check(&self, spec: &Spec) -> Result<(), Error> {
        let meta = &self.meta;
        let agent = if spec.roles.is_empty() && task_of_role(&meta.agent) == spec.id { &spec.id } else { &meta.agent };
        let pairs = [
            ("agent", agent.clone(), spec.id.clone()),
            ("observation length", meta.obs.to_string(), spec.obs.to_string()),
            ("action length", meta.act.to_string(), spec.act.to_string()),
            ("seconds between decisions", meta.control_dt.to_string(), spec.dt.to_string()),
            ("frame_skip", meta.frame_skip.to_string(), spec.frame_skip.to_string()),
        ];
        agree(pairs)
    }
}

/// Number of parameters of a policy's network.
///
/// # Errors
/// If a width is not allowed for a policy.
pub(crate) fn check_widths(meta: &PolicyMeta) -> Result<u64, Error> {
    let sizes = [&[meta.obs], &meta.hidden[..], &[meta.act]].concat();
    let pairs = sizes.windows(2).map(|p| (p[0] as u64).saturating_add(1).saturating_mul(p[1] as u64));
    let count = pairs.fold(0, u64::saturating_add);
    if sizes.iter().any(|s| !(1..=MOST_WIDTH).contains(s)) || meta.hidden.len() > MOST_HIDDEN || count > MOST_PARAMETERS
    {
        let (found, most) = (format!("widths {sizes:?}"), format!("{MOST_HIDDEN} hidden layers"));
        let expected = format!("1 to {MOST_WIDTH}, at most {most} and {MOST_PARAMETERS} parameters");
        return Err(Error::Mismatch { what: "network".into(), found, expected });
    }
    Ok(count)
}

/// Checks that each found value equals the expected one of the same name.
fn agree(pairs: impl IntoIterator<Item = (&'static str, String, String)>) -> Result<(), Error> {
    match pairs.into_iter().find(|(_, found, expected)| found != expected) {
        Some((what, found, expected)) => Err(Error::Mismatch { what: what.into(), found, expected }),
        None => Ok(()),
    }
}
