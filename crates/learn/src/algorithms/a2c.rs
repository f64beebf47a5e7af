//! Advantage actor-critic (Mnih et al., "Asynchronous methods for deep reinforcement learning", 2016), synchronous, as
//! in the paper's comparison. Each short rollout gives one step of RMSProp.
//!
//! The loss per sample, with `A` the advantage (not normalized) and `R` the return:
//!
//! ```text
//! -A log pi(a|s) - entropy_coef H + value_coef (V - R)^2
//! ```
//!
//! The rollout comes from the policy that is updated, so the gradient of the clipped ratio at ratio 1 is that of `A log
//! pi`. A2C therefore shares PPO's gradient code. The gradient norm is bounded for both networks together.

use super::actor_critic::{self, ActionStd, ActorCritic, Layout, refuse_adaptive};
use super::loss::{LossSums, Objective};
use super::on_policy::{OnPolicy, OnPolicyState, UpdateRule};
use super::schedule::{LrSchedule, Progress, Schedule};
use super::{MemoryPlan, Saved, Setup, SharedConfig, Workers, check};
use crate::error::Error;
use crate::nets::gaussian::Ratio;
use crate::optim::rmsprop::RmsProp;
use crate::rollout::data::Experience;
use serde::{Deserialize, Serialize};

/// Far beyond the rounding errors of a ratio of a policy to itself.
const NO_CLIP: f64 = 1e9;

/// Settings of A2C. The defaults are those of the paper's comparison: OpenAI Baselines with the authors' learning rate
/// and weight of the value loss.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct A2c {
    /// Learning rate of both networks.
    pub lr: f64,
    /// Schedule of the learning rate.
    pub lr_schedule: LrSchedule,
    /// Bound of the gradient's norm, for both networks together.
    pub max_grad_norm: f64,
    /// Decay of generalized advantage estimation.
    pub gae_lambda: f64,
    /// Weight of the entropy bonus.
    pub entropy_coef: Schedule,
    /// Bound of the actions drawn, which are then divided by it. ML-Agents has 3: with a larger number the same step of the
    /// optimizer moves the actions less.
    pub action_clip: f64,
    /// Standard deviations of the actions.
    pub action_std: ActionStd,
    /// Weight of the value function's squared error.
    pub value_coef: f64,
    /// Decay of RMSProp's mean square.
    pub rms_decay: f64,
    /// Constant that RMSProp adds to the mean square under the root.
    pub rms_epsilon: f64,
}

impl Default for A2c {
    fn default() -> Self {
        Self {
            lr: 3e-4,
            lr_schedule: LrSchedule::Linear,
            max_grad_norm: 0.5,
            gae_lambda: 1.0,
            entropy_coef: Schedule::constant(0.01),
            action_clip: 1.0,
            action_std: ActionStd::FREE,
            value_coef: 0.25,
            rms_decay: 0.99,
            rms_epsilon: 1e-5,
        }
    }
}

impl A2c {
    /// Checks every field.
    ///
    /// # Errors
    /// Names the field, its value and the values that are valid.
    pub fn validate(&self, _: &SharedConfig<'_>) -> Result<(), Error> {
        check::positive(&[
            ("value_coef", self.value_coef),
            ("rms_epsilon", self.rms_epsilon),
            ("max_grad_norm", self.max_grad_norm),
            ("action_clip", self.action_clip),
        ])?;
        check::fraction("rms_decay", self.rms_decay)?;
        refuse_adaptive(self.lr_schedule, "a2c")?;
        actor_critic::validate(self.lr, self.gae_lambda, self.entropy_coef)?;
        self.action_std.validate()
    }

    /// Memory that a run needs.
    pub(super) fn memory_plan(&self, setup: &Setup<'_>) -> MemoryPlan {
        Layout::new(setup, Ratio::Joint).memory_plan(setup.common.items(), 0)
    }
}

/// The actor-critic objective without a bound of the ratio.
pub fn objective(entropy_coef: f64) -> Objective {
    Objective {
        ratio: Ratio::Joint,
        clip: NO_CLIP,
        value_clip: None,
        entropy_coef,
        advantage_mean: 0.0,
        advantage_scale: 1.0,
    }
}

/// A2C with the state of its optimizer.
#[derive(Clone)]
pub struct A2cRule {
    settings: A2c,
    rms: RmsProp,
}

impl A2cRule {
    /// Creates a learner at the start of a run.
    pub fn learner(settings: A2c, setup: &Setup<'_>) -> OnPolicy<Self> {
        let nets = ActorCritic::new(setup, Ratio::Joint, settings.action_std, settings.gae_lambda);
        let rms = RmsProp::new(nets.params.len(), settings.rms_decay, settings.rms_epsilon);
        OnPolicy::new(nets, settings.lr, 0, Self { settings, rms })
    }

    fn step(&mut self, on_policy: &mut OnPolicyState, workers: &dyn Workers, progress: &Progress, sums: &LossSums) {
        let (Self { settings, rms }, OnPolicyState { nets, lr, skipped, .. }) = (self, on_policy);
        // no agent acted in this batch
        if sums.samples == 0.0 {
            return;
        }
        // the available gradient is that of (V - R)^2 / 2
        let weight = [1.0, 2.0 * settings.value_coef];
        let squares = workers.squares();
        let norm = (squares[0] + weight[1] * weight[1] * squares[1]).sqrt() / sums.samples;
        if !norm.is_finite() {
            *skipped += 1;
            return;
        }
        let bound = (settings.max_grad_norm / norm).min(1.0) / sums.samples;
        // the networks of each reward have their own rate, and their gradient is not bounded
        let rates = nets.layout.rates(*lr, *lr);
        workers.pieces(&mut |net, range, gradient| {
            let scale = weight.get(net).map_or(1.0 / sums.samples, |weight| bound * weight);
            rms.update(nets.isa, &mut nets.params, range, gradient, scale, rates[net]);
        });
        nets.bound_std(progress);
    }
}

impl UpdateRule for A2cRule {
    fn learn(
        &mut self,
        on_policy: &mut OnPolicyState,
        workers: &mut dyn Workers,
        experience: &Experience<'_>,
        progress: &Progress,
    ) -> LossSums {
        let items: Vec<u32> = (0..experience.items() as u32).collect();
        let objective = objective(progress.at(self.settings.entropy_coef));
        let sums = on_policy.gradient(workers, experience, &items, objective, None);
        on_policy.lr = self.settings.lr * progress.rate(self.settings.lr_schedule);
        self.step(on_policy, workers, progress, &sums);
        sums
    }

    fn save(&self, saved: &mut Saved) {
        saved.list("mean_square", &self.rms.mean_square);
    }
    fn load(&mut self, saved: &Saved) -> Result<(), Error> {
        saved.copy("mean_square", &mut self.rms.mean_square)
    }
}
