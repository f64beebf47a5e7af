//! Actor-critic with the natural gradient and a trust region (Wu et al., "Scalable trust-region method for deep
//! reinforcement learning using Kronecker-factored approximation", 2017).
//!
//! The objective is A2C's. Only the step differs. The gradient of each layer is multiplied by the inverse of its block
//! of the Fisher matrix, which [`kfac`](crate::optim::kfac) approximates. A step that would change the action
//! distribution by more than `kl_clip` is shortened:
//!
//! ```text
//! d = F^-1 g        eta = min(lr, sqrt(2 kl_clip / d'g))        m <- momentum m + (1 - momentum) eta d        p <- p - m
//! ```
//!
//! Policy and value function are separate networks with separate step lengths. The value is treated as the mean of a
//! normal distribution of deviation 1, whose Fisher matrix is the Gauss-Newton matrix. The deviations of the actions
//! are parameters of their own. Their block of the Fisher matrix is known: 2 for each logarithm.
//!
//! OpenAI Baselines starts with updates of another optimizer. This version instead weighs the first rollouts equally in
//! the running means of the factors. The damping is split between the factors (Martens and Grosse, 2015, section 6.3).

use super::a2c;
use super::actor_critic::{self, ActionStd, ActorCritic, Layout, refuse_adaptive};
use super::loss::LossSums;
use super::on_policy::{OnPolicy, OnPolicyState, UpdateRule};
use super::schedule::{LrSchedule, Progress, Schedule};
use super::{MemoryPlan, Saved, Setup, SharedConfig, Workers, check};
use crate::error::Error;
use crate::nets::gaussian::Ratio;
use crate::optim::kfac::Kfac;
use crate::rollout::data::Experience;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Settings of ACKTR. The defaults are those of OpenAI Baselines.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Acktr {
    /// Largest step length.
    pub lr: f64,
    /// Schedule of the step length.
    pub lr_schedule: LrSchedule,
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
    /// KL divergence that a step may cause, nats. For the value network: half the mean squared change.
    pub kl_clip: f64,
    /// Decay of the momentum, a running sum of steps.
    pub momentum: f64,
    /// Damping, added to the Fisher matrix.
    pub damping: f64,
    /// Decay of the running means of the factors.
    pub stats_decay: f64,
    /// Updates between two inversions of the factors. The first `inverse_every` updates invert every time.
    pub inverse_every: u64,
}

impl Default for Acktr {
    fn default() -> Self {
        Self {
            lr: 0.25,
            lr_schedule: LrSchedule::Linear,
            gae_lambda: 1.0,
            entropy_coef: Schedule::constant(0.01),
            action_clip: 1.0,
            action_std: ActionStd::FREE,
            value_coef: 0.5,
            kl_clip: 1e-3,
            momentum: 0.9,
            damping: 0.01,
            stats_decay: 0.99,
            inverse_every: 10,
        }
    }
}

impl Acktr {
    /// Checks every field.
    ///
    /// # Errors
    /// Names the field, its value and the values that are valid.
    pub fn validate(&self, common: &SharedConfig<'_>) -> Result<(), Error> {
        check::positive(&[
            ("value_coef", self.value_coef),
            ("kl_clip", self.kl_clip),
            ("damping", self.damping),
            ("action_clip", self.action_clip),
        ])?;
        check::fraction("momentum", self.momentum)?;
        check::fraction("stats_decay", self.stats_decay)?;
        if self.inverse_every == 0 {
            return Err(Error::config("inverse_every", 0, "at least 1"));
        }
        // the factors are square matrices
        let network = common.network;
        for (field, widths) in [("network.hidden", &network.hidden[..]), ("network.critic_hidden", network.critic())] {
            if widths.iter().any(|w| *w > 2048) {
                return Err(Error::config(field, format!("{widths:?}"), "widths up to 2048 with ACKTR"));
            }
        }
        check::task_alone(common, "acktr")?;
        refuse_adaptive(self.lr_schedule, "acktr")?;
        actor_critic::validate(self.lr, self.gae_lambda, self.entropy_coef)?;
        self.action_std.validate()
    }

    /// Memory that a run needs.
    pub(super) fn memory_plan(&self, setup: &Setup<'_>) -> MemoryPlan {
        let layout = Layout::new(setup, Ratio::Joint);
        layout.memory_plan(setup.common.items(), Kfac::moments_len(&layout.actor, &layout.critic))
    }
}

/// ACKTR with the state of its optimizer.
#[derive(Clone)]
pub struct AcktrRule {
    settings: Acktr,
    /// The factors, shared by all workers.
    kfac: Arc<Kfac>,
    momentum: Vec<f32>,
}

impl AcktrRule {
    /// Creates a learner at the start of a run.
    pub fn learner(settings: Acktr, setup: &Setup<'_>) -> OnPolicy<Self> {
        let nets = ActorCritic::new(setup, Ratio::Joint, settings.action_std, settings.gae_lambda);
        let Layout { actor, critic, critic_start, .. } = &nets.layout;
        let kfac = Arc::new(Kfac::new(actor, critic, *critic_start));
        let (moments, momentum) = (Kfac::moments_len(actor, critic), vec![0.0; nets.params.len()]);
        OnPolicy::new(nets, settings.lr, moments, Self { settings, kfac, momentum })
    }

    /// Takes a step on the worker's replica.
    fn step(&mut self, on_policy: &mut OnPolicyState, progress: &Progress, scale: [f64; 2], sums: &mut LossSums) {
        let Self { settings, kfac, momentum } = self;
        let OnPolicyState { nets, lr, skipped, space: Some(space), .. } = on_policy else { return };
        let gradient = &space.gradient;
        let log_std = nets.layout.log_std.clone();
        let of_std = |i: usize| gradient[i] as f64 * scale[0] / (2.0 + settings.damping);
        let mut products = [0.0; 2];
        products[0] = log_std.clone().map(|i| of_std(i) * gradient[i] as f64 * scale[0]).sum();
        (0..kfac.count()).map(|l| kfac.layer(l)).for_each(|layer| products[layer.network] += layer.product);
        if !products.iter().all(|p| p.is_finite() && *p >= 0.0) {
            *skipped += 1;
            return;
        }
        // a product of zero means a step of zero: any length works
        let length = products.map(|p| lr.min((2.0 * settings.kl_clip / p.max(1e-300)).sqrt()));
        let mut step = |i: usize, d: f64, length: f64| {
            let m = &mut momentum[i];
            *m = (settings.momentum * *m as f64 + (1.0 - settings.momentum) * length * d) as f32;
            nets.params[i] -= *m;
        };
        log_std.for_each(|i| step(i, of_std(i), length[0]));
        for l in 0..kfac.count() {
            let layer = kfac.layer(l);
            let places = layer.weights.start..layer.biases.end;
            for (i, d) in places.zip(&layer.step) {
                step(i, *d as f64, length[layer.network]);
            }
        }
        nets.bound_std(progress);
        // the divergence follows from the step, without samples
        let kl = 0.5 * length[0] * length[0] * products[0];
        sums.kl = kl * sums.samples;
    }
}

impl UpdateRule for AcktrRule {
    fn learn(
        &mut self,
        on_policy: &mut OnPolicyState,
        workers: &mut dyn Workers,
        experience: &Experience<'_>,
        progress: &Progress,
    ) -> LossSums {
        let Self { settings, kfac, .. } = self;
        let items: Vec<u32> = (0..experience.items() as u32).collect();
        let objective = a2c::objective(progress.at(settings.entropy_coef));
        let mut sums = on_policy.gradient(workers, experience, &items, objective, Some(kfac));
        let mean = 1.0 / sums.samples;
        // the available gradient is that of (V - R)^2 / 2
        let scale = [mean, mean * 2.0 * settings.value_coef];
        let OnPolicyState { nets, space: Some(space), .. } = &mut *on_policy else { return sums };
        let gradient = &mut space.gradient;
        workers.pieces(&mut |_, range, piece| gradient[range].copy_from_slice(piece));

        // the workers share the factors, inverses and natural gradients, one layer at a time
        let count = progress.iteration;
        let refresh = count <= settings.inverse_every || count.is_multiple_of(settings.inverse_every);
        // the first rollouts weigh the same
        let decay = settings.stats_decay.min(1.0 - 1.0 / count as f64);
        workers.divide(kfac.count(), &mut |l, partials| {
            let mut layer = kfac.layer(l);
            layer.merge(partials.iter().map(|p| &p.moments[..]), sums.samples, decay);
            if refresh {
                layer.invert(settings.damping);
            }
            let scale = scale[layer.network];
            layer.natural(nets.isa, gradient, scale);
        });
        on_policy.lr = settings.lr * progress.rate(settings.lr_schedule);
        self.step(on_policy, progress, scale, &mut sums);
        workers.wait();
        sums
    }

    fn save(&self, saved: &mut Saved) {
        saved.list("momentum", &self.momentum);
        let (factors, inverses) = self.kfac.save();
        saved.list("kfac", &factors);
        saved.list("kfac_inverse", &inverses);
    }
    fn load(&mut self, saved: &Saved) -> Result<(), Error> {
        saved.copy("momentum", &mut self.momentum)?;
        let factors: &[f64] = saved.get("kfac")?;
        if !self.kfac.load(factors, saved.get("kfac_inverse")?) {
            return Err(Error::Mismatch {
                what: "checkpoint: kfac".into(),
                found: format!("{} numbers", factors.len()),
                expected: "those of the networks".into(),
            });
        }
        Ok(())
    }
}
