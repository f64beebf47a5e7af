//! What every learner from its own rollouts does alike, whatever its optimizer.

use super::actor_critic::ActorCritic;
use super::loss::LossSums;
use super::parameters::Places;
use super::schedule::Progress;
use super::{Description, Learner, Now, Saved, Workers};
use crate::error::Error;
use crate::nets::normalize::Normalizer;
use crate::policy::{Policy, PolicyMeta};
use crate::rollout::collect::Collecting;
use crate::rollout::data::{Experience, Shape};
use crate::rollout::statistics::Statistics;
use crate::rollout::sums::Totals;

/// How far the optimizer's settings have come.
#[derive(Clone, Copy)]
pub struct Course {
    /// Learning rate of the policy.
    pub lr: f64,
    /// Steps left out because their gradient was not finite.
    pub skipped: u64,
}

/// An algorithm that learns from its own rollouts; it is a [`Learner`].
pub trait OnPolicy: Send + Sized + 'static {
    /// Its networks.
    fn nets(&self) -> &ActorCritic;
    /// Its networks.
    fn nets_mut(&mut self) -> &mut ActorCritic;
    /// How far it has come.
    fn course(&self) -> Course;
    /// How far it has come.
    fn course_mut(&mut self) -> &mut Course;
    /// Another worker's.
    fn copy(&self) -> Self;
    /// Learns from a rollout together with all other workers.
    fn learn(
        &mut self,
        workers: &mut dyn Workers,
        experience: &Experience<'_>,
        progress: &Progress,
        all: &mut LossSums,
    );
    /// Adds what its optimizer remembers.
    fn save_optimizer(&self, saved: &mut Saved);
    /// Takes that back.
    fn load_optimizer(&mut self, saved: &Saved) -> Result<(), Error>;
}

impl<A: OnPolicy> Learner for A {
    fn update(&mut self, workers: &mut dyn Workers, experience: &Experience<'_>, now: Now<'_>, sums: &mut LossSums) {
        // the first rollout only fills the statistics
        if now.progress.iteration > 0 {
            self.learn(workers, experience, now.progress, sums);
        }
    }
    fn replica(&self) -> Box<dyn Learner> {
        Box::new(self.copy())
    }
    fn places(&self) -> &Places {
        &self.nets().layout.places
    }
    fn params(&self) -> &[f32] {
        &self.nets().params
    }
    fn params_mut(&mut self) -> &mut Vec<f32> {
        &mut self.nets_mut().params
    }
    fn shape(&self) -> Shape {
        self.nets().shape()
    }
    fn collecting(&self, statistics: &Statistics) -> Collecting<'_> {
        self.nets().collecting(statistics)
    }
    fn follow(&mut self, before: &Normalizer, after: &Normalizer) {
        self.nets_mut().follow(before, after);
    }
    fn describe(&self, totals: &Totals, _: &LossSums) -> Description {
        let Course { lr, skipped } = self.course();
        self.nets().describe(totals, lr, skipped)
    }
    fn policy(&self, meta: PolicyMeta, normalizer: Normalizer) -> Policy {
        self.nets().policy(meta, normalizer)
    }
    fn save(&self) -> Saved {
        let (mut saved, Course { lr, skipped }) = (Saved::default(), self.course());
        saved.list("params", &self.nets().params);
        self.save_optimizer(&mut saved);
        saved.scalar("lr", lr);
        saved.scalar("skipped", skipped as f64);
        saved
    }
    fn load(&mut self, saved: &Saved) -> Result<(), Error> {
        saved.copy("params", &mut self.nets_mut().params)?;
        self.load_optimizer(saved)?;
        *self.course_mut() = Course { lr: saved.number("lr")?, skipped: saved.number("skipped")? as u64 };
        Ok(())
    }
}
