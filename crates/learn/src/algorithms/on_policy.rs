//! The common part of all on-policy learners.

use super::actor_critic::{ActorCritic, Space};
use super::loss::{LossSums, Objective};
use super::parameters::Places;
use super::schedule::Progress;
use super::{Description, Learner, Now, Saved, Workers};
use crate::error::Error;
use crate::nets::normalize::Normalizer;
use crate::optim::kfac::Kfac;
use crate::policy::{Policy, PolicyMeta};
use crate::rewards::Minibatch;
use crate::rollout::context::RolloutContext;
use crate::rollout::data::{Experience, Shape};
use crate::rollout::statistics::Statistics;
use crate::rollout::sums::Totals;

/// Networks and the progress of their training.
pub struct OnPolicyState {
    /// The networks.
    pub nets: ActorCritic,
    /// Learning rate of the policy.
    pub lr: f64,
    /// Steps that were skipped because their gradient was not finite.
    pub skipped: u64,
    /// Numbers that a group of samples contributes besides the gradient.
    moments: usize,
    /// Work space for gradients, allocated at the first one.
    pub space: Option<Box<Space>>,
    /// Map that normalized the observations of the current rollout.
    normalizer: Normalizer,
    /// Number of computed gradients.
    batches: u64,
}

impl OnPolicyState {
    /// Leaves the gradient of an objective on a list of items with the workers, see [`ActorCritic::gradient`].
    pub fn gradient(
        &mut self,
        workers: &mut dyn Workers,
        experience: &Experience<'_>,
        items: &[u32],
        objective: Objective,
        kfac: Option<&Kfac>,
    ) -> LossSums {
        let Self { nets, moments, space, normalizer, batches, .. } = self;
        let space = space.get_or_insert_with(|| Box::new(Space::new(&nets.layout, *moments)));
        let minibatch = Minibatch { normalizer, batch: *batches, items };
        *batches += 1;
        nets.gradient(workers, experience, items, objective, (kfac, minibatch), space)
    }
}

/// An update rule: an algorithm with its settings and the state of its optimizer.
pub trait UpdateRule: Clone + Send + 'static {
    /// Learns from a rollout together with all other workers. Returns the sums of the objective.
    fn learn(
        &mut self,
        on_policy: &mut OnPolicyState,
        workers: &mut dyn Workers,
        experience: &Experience<'_>,
        progress: &Progress,
    ) -> LossSums;
    /// Adds the state of its optimizer.
    fn save(&self, saved: &mut Saved);
    /// Restores that state.
    fn load(&mut self, saved: &Saved) -> Result<(), Error>;
}

/// An on-policy [`Learner`].
pub struct OnPolicy<R> {
    on_policy: OnPolicyState,
    rule: R,
}

impl<R: UpdateRule> OnPolicy<R> {
    /// Creates a learner at the start of a run. Each group of samples contributes `moments` numbers besides its
    /// gradient.
    pub fn new(nets: ActorCritic, lr: f64, moments: usize, rule: R) -> Self {
        let normalizer = Normalizer::identity(0, 1.0);
        Self { on_policy: OnPolicyState { nets, lr, skipped: 0, moments, space: None, normalizer, batches: 0 }, rule }
    }
}

impl<R: UpdateRule> Learner for OnPolicy<R> {
    fn update(&mut self, workers: &mut dyn Workers, experience: &Experience<'_>, now: Now<'_>, sums: &mut LossSums) {
        // the first rollout only fills the statistics
        if now.progress.iteration > 0 {
            // counting from the rollout's number makes a resumed run draw the same numbers
            self.on_policy.batches = now.progress.iteration << 32;
            self.on_policy.normalizer = now.statistics.normalizer();
            *sums += self.rule.learn(&mut self.on_policy, workers, experience, now.progress);
        }
    }
    fn replica(&self) -> Box<dyn Learner> {
        let OnPolicyState { nets, lr, skipped, moments, normalizer, batches, .. } = &self.on_policy;
        let (nets, normalizer) = (nets.clone(), normalizer.clone());
        let (lr, skipped, moments, batches) = (*lr, *skipped, *moments, *batches);
        let on_policy = OnPolicyState { nets, lr, skipped, moments, space: None, normalizer, batches };
        Box::new(Self { on_policy, rule: self.rule.clone() })
    }
    fn places(&self) -> &Places {
        &self.on_policy.nets.layout.places
    }
    fn params(&self) -> &[f32] {
        &self.on_policy.nets.params
    }
    fn params_mut(&mut self) -> &mut Vec<f32> {
        &mut self.on_policy.nets.params
    }
    fn shape(&self) -> Shape {
        self.on_policy.nets.shape()
    }
    fn collecting(&self, statistics: &Statistics) -> RolloutContext<'_> {
        self.on_policy.nets.collecting(statistics)
    }
    fn follow(&mut self, before: &Normalizer, after: &Normalizer) {
        self.on_policy.nets.follow(before, after);
    }
    fn describe(&self, totals: &Totals, _: &LossSums) -> Description {
        let OnPolicyState { nets, lr, skipped, .. } = &self.on_policy;
        nets.describe(totals, *lr, *skipped)
    }
    fn policy(&self, meta: PolicyMeta, normalizer: Normalizer) -> Policy {
        self.on_policy.nets.policy(meta, normalizer)
    }
    fn save(&self) -> Saved {
        let (mut saved, OnPolicyState { nets, lr, skipped, .. }) = (Saved::default(), &self.on_policy);
        saved.list("params", &nets.params);
        self.rule.save(&mut saved);
        saved.scalar("lr", *lr);
        saved.scalar("skipped", *skipped as f64);
        saved
    }
    fn load(&mut self, saved: &Saved) -> Result<(), Error> {
        saved.copy("params", &mut self.on_policy.nets.params)?;
        self.rule.load(saved)?;
        (self.on_policy.lr, self.on_policy.skipped) = (saved.number("lr")?, saved.number("skipped")? as u64);
        Ok(())
    }
}
