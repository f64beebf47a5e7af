//! Proximal policy optimization (Schulman et al., 2017): how it learns from a rollout, from top to bottom.
//!
//! In each of `epochs` epochs, the rollout of all workers is shuffled and split into minibatches. Each minibatch gives
//! one step of Adam on the clipped objective of [`loss`](super::loss).

use super::actor_critic::{self, ActionStd, ActorCritic, Layout};
use super::loss::{LossSums, Objective};
use super::on_policy::{OnPolicy, OnPolicyState, UpdateRule};
use super::schedule::{LrSchedule, Progress, Schedule};
use super::{MemoryPlan, Saved, Setup, SharedConfig, Workers, check, load_adam, save_adam, share};
use crate::error::Error;
use crate::lanes::noise::{SHUFFLES, SplitMix};
use crate::nets::gaussian::Ratio;
use crate::optim::adam::Adam;
use crate::rollout::data::Experience;
use serde::{Deserialize, Serialize};

/// Settings of PPO. The defaults solve the small tasks.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Ppo {
    /// Minibatches per epoch. Minibatches with fewer than 256 samples per thread leave threads idle.
    pub minibatches: usize,
    /// Passes over each rollout.
    pub epochs: usize,
    /// Learning rate of the policy. The adaptive schedule starts with it.
    pub lr: f64,
    /// Learning rate of the value function.
    pub value_lr: f64,
    /// Number of first rollouts that train only the value function. Without it, the advantages of an untrained value
    /// function would spoil a policy that starts from another one.
    pub value_warmup: u64,
    /// Schedule of the policy's learning rate.
    pub lr_schedule: LrSchedule,
    /// KL divergence per update that the adaptive schedule aims at, nats. Small values at the end refine a gait.
    pub target_kl: Schedule,
    /// Bounds of the adaptive schedule.
    pub lr_range: [f64; 2],
    /// Constant that Adam adds to the root of the second moment: the smallest gradients that still count.
    pub adam_epsilon: f64,
    /// Bound of the gradient norm, for each network separately.
    pub max_grad_norm: f64,
    /// Decay of generalized advantage estimation.
    pub gae_lambda: f64,
    /// Whether the probability ratio is clipped for all actions together or for each one.
    pub ratio: Ratio,
    /// Clip range of the probability ratio.
    pub clip: Schedule,
    /// Clip range of the value's change (in units of the scaled return) at the start; it shrinks as that of the ratio does.
    /// None by default.
    pub value_clip: Option<f64>,
    /// Weight of the entropy bonus.
    pub entropy_coef: Schedule,
    /// Bound of the actions drawn, which are then divided by it. ML-Agents has 3: with a larger number the same step of the
    /// optimizer moves the actions less.
    pub action_clip: f64,
    /// Standard deviations of the actions drawn.
    pub action_std: ActionStd,
}

impl Default for Ppo {
    fn default() -> Self {
        Self {
            minibatches: 8,
            epochs: 4,
            lr: 1e-3,
            value_lr: 1e-3,
            value_warmup: 0,
            lr_schedule: LrSchedule::Adaptive,
            target_kl: Schedule::constant(0.015),
            lr_range: [1e-5, 3e-3],
            adam_epsilon: 1e-5,
            max_grad_norm: 1.0,
            gae_lambda: 0.95,
            ratio: Ratio::Joint,
            clip: Schedule::constant(0.2),
            value_clip: None,
            entropy_coef: Schedule::constant(0.002),
            action_clip: 1.0,
            action_std: ActionStd::default(),
        }
    }
}

impl Ppo {
    /// Checks every field.
    ///
    /// # Errors
    /// Names the field, its value and the values that are valid.
    pub fn validate(&self, common: &SharedConfig<'_>) -> Result<(), Error> {
        for (field, n) in [("minibatches", self.minibatches), ("epochs", self.epochs)] {
            if n == 0 {
                return Err(Error::config(field, n, "at least 1"));
            }
        }
        let items = common.items();
        if self.minibatches > items {
            let most = format!("at most {items}, one for every 16 of the rollout's {} samples", items * 16);
            return Err(Error::config("minibatches", self.minibatches, most));
        }
        check::positive(&[
            ("lr", self.lr),
            ("value_lr", self.value_lr),
            ("target_kl", self.target_kl.from),
            ("target_kl.to", self.target_kl.to),
            ("adam_epsilon", self.adam_epsilon),
            ("max_grad_norm", self.max_grad_norm),
            ("clip", self.clip.from),
            ("clip.to", self.clip.to),
            ("value_clip", self.value_clip.unwrap_or(1.0)),
            ("action_clip", self.action_clip),
        ])?;
        actor_critic::validate(self.lr, self.gae_lambda, self.entropy_coef)?;
        self.action_std.validate()?;
        let [low, high] = self.lr_range;
        if !(low > 0.0 && low <= high && high.is_finite()) {
            let found = format!("[{low}, {high}]");
            return Err(Error::config("lr_range", found, "two positive numbers in ascending order"));
        }
        Ok(())
    }

    /// Memory that a run needs.
    pub(super) fn memory_plan(&self, setup: &Setup<'_>) -> MemoryPlan {
        Layout::new(setup, self.ratio).memory_plan(setup.common.items().div_ceil(self.minibatches), 0)
    }
}

/// PPO with the state of its optimizer.
#[derive(Clone)]
pub struct PpoRule {
    settings: Ppo,
    seed: u64,
    adam: Adam,
}

impl PpoRule {
    /// Creates a learner at the start of a run.
    pub fn learner(settings: Ppo, setup: &Setup<'_>) -> OnPolicy<Self> {
        let nets = ActorCritic::new(setup, settings.ratio, settings.action_std, settings.gae_lambda);
        let adam = Adam::new(nets.params.len(), settings.adam_epsilon);
        OnPolicy::new(nets, settings.lr, 0, Self { settings, seed: setup.common.seed, adam })
    }

    /// The objective with the current settings. Advantages are normalized over the rollout.
    fn objective(&self, experience: &Experience<'_>, progress: &Progress) -> Objective {
        let settings = &self.settings;
        let (mean, var) = experience.totals.advantage();
        let clip = progress.at(settings.clip);
        Objective {
            ratio: settings.ratio,
            clip,
            value_clip: settings.value_clip.map(|range| range * (clip / settings.clip.from)),
            entropy_coef: progress.at(settings.entropy_coef),
            advantage_mean: mean,
            advantage_scale: 1.0 / var.max(1e-12).sqrt(),
        }
    }

    /// Takes one step of Adam on the worker's replica. The gradient of each network is bounded separately.
    fn step(&mut self, on_policy: &mut OnPolicyState, workers: &dyn Workers, progress: &Progress, sums: &LossSums) {
        let (Self { settings, adam, .. }, OnPolicyState { nets, lr, skipped, .. }) = (self, on_policy);
        // no agent acted in this batch
        if sums.samples == 0.0 {
            return;
        }
        let squares = workers.squares();
        if !squares.iter().all(|s| s.is_finite()) {
            *skipped += 1;
            return;
        }
        let mean = 1.0 / sums.samples;
        let bound = |s: &f64| mean * (settings.max_grad_norm / (s.sqrt() * mean)).min(1.0);
        let scale: Vec<f64> = squares.iter().map(bound).collect();

        adam.advance();
        let part = if settings.lr_schedule == LrSchedule::Linear { *lr / settings.lr } else { 1.0 };
        // the first rollout only fills the statistics
        let warms_up = progress.iteration <= settings.value_warmup && settings.value_warmup > 0;
        let rates = nets.layout.rates(if warms_up { 0.0 } else { *lr }, part * settings.value_lr);
        workers.pieces(&mut |net, range, gradient| {
            adam.update(nets.isa, &mut nets.params, range, gradient, scale[net], rates[net]);
        });
        nets.bound_std(progress);

        if settings.lr_schedule == LrSchedule::Adaptive && !warms_up {
            let kl = sums.kl * mean;
            let target = progress.at(settings.target_kl);
            if kl > 2.0 * target {
                *lr = (*lr / 1.5).max(settings.lr_range[0]);
            } else if kl < 0.5 * target {
                *lr = (*lr * 1.2).min(settings.lr_range[1]);
            }
        }
    }
}

impl UpdateRule for PpoRule {
    fn learn(
        &mut self,
        on_policy: &mut OnPolicyState,
        workers: &mut dyn Workers,
        experience: &Experience<'_>,
        progress: &Progress,
    ) -> LossSums {
        let Ppo { epochs, minibatches, lr_schedule, lr, .. } = self.settings;
        let objective = self.objective(experience, progress);
        let mut items: Vec<u32> = (0..experience.items() as u32).collect();
        if lr_schedule == LrSchedule::Linear {
            on_policy.lr = lr * progress.rate(LrSchedule::Linear);
        }
        let mut all = LossSums::default();
        for epoch in 0..epochs {
            let draw = progress.iteration * epochs as u64 + epoch as u64;
            SplitMix::new(self.seed, draw | SHUFFLES).shuffle(&mut items);
            for m in 0..minibatches {
                let batch = &items[share(items.len(), minibatches, m)];
                let sums = on_policy.gradient(workers, experience, batch, objective, None);
                all += sums;
                self.step(on_policy, workers, progress, &sums);
            }
        }
        all
    }

    fn save(&self, saved: &mut Saved) {
        save_adam(&self.adam, saved);
    }
    fn load(&mut self, saved: &Saved) -> Result<(), Error> {
        load_adam(&mut self.adam, saved)
    }
}
