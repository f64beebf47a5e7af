//! The mean of several policies.

use super::{Policy, agree};
use crate::error::Error;
use crate::nets::normalize::Normalizer;

impl Policy {
    /// The policy whose every number is the mean over `policies`: weights, statistics of observations, deviations. This
    /// makes sense for similar policies, such as those of one run. The mean has the description of the last policy,
    /// without its evaluation.
    ///
    /// # Errors
    /// If there are none, or if they do not match ([`Policy::check_alike`]).
    pub fn mean(policies: &[Policy]) -> Result<Policy, Error> {
        let Some(last) = policies.last() else {
            return Err(Error::Mismatch {
                what: "mean".into(),
                found: "no policies".into(),
                expected: "one or more".into(),
            });
        };
        policies.iter().try_for_each(|policy| policy.check_alike(last))?;
        let mut sums = vec![0.0; last.numbers().count()];
        for policy in policies {
            sums.iter_mut().zip(policy.numbers()).for_each(|(sum, x)| *sum += x);
        }
        sums.iter_mut().for_each(|sum| *sum /= policies.len() as f64);
        let mut mean = last.with_numbers(&sums);
        mean.meta.evaluation = None;
        mean.meta.lineage = Vec::new();
        Ok(mean)
    }

    /// Every number of the policy: weights, means and deviations of observations, logarithms of deviations of actions.
    pub(crate) fn numbers(&self) -> impl Iterator<Item = f64> {
        let lists = [&self.params, self.normalizer.mean(), self.normalizer.std(), &self.log_std];
        lists.into_iter().flatten().copied().map(f64::from)
    }

    /// The same policy with other [`numbers`](Self::numbers) of the same count.
    pub(crate) fn with_numbers(&self, numbers: &[f64]) -> Policy {
        let mut rest = numbers.iter().map(|x| *x as f32);
        let mut next = |n: usize| rest.by_ref().take(n).collect::<Vec<_>>();
        let (params, obs_mean, obs_std) = (next(self.params.len()), next(self.meta.obs), next(self.meta.obs));
        let normalizer = Normalizer::new(obs_mean, obs_std, self.meta.observation_clip);
        Policy::assemble(self.meta.clone(), self.net.clone(), params, normalizer, next(self.log_std.len()))
    }

    /// Checks that every number has the same meaning in both policies: the same agent, network and map of actions.
    ///
    /// # Errors
    /// Names the difference.
    pub fn check_alike(&self, other: &Policy) -> Result<(), Error> {
        let pairs = self.form().into_iter().zip(other.form());
        agree(pairs.map(|((what, found), (_, expected))| (what, found, expected)))
    }

    fn form(&self) -> [(&'static str, String); 9] {
        let meta = &self.meta;
        [
            ("agent", meta.agent.clone()),
            ("observation length", meta.obs.to_string()),
            ("action length", meta.act.to_string()),
            ("hidden layers", format!("{:?}", meta.hidden)),
            ("activation", meta.activation.name().into()),
            ("squash", meta.squash.to_string()),
            ("observation_clip", meta.observation_clip.to_string()),
            ("action_clip", meta.action_clip.to_string()),
            ("action_range", format!("{:?}", meta.action_range)),
        ]
    }
}
