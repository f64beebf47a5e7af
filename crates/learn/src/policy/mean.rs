//! The mean of policies, number by number.

use super::{Policy, agree};
use crate::error::Error;
use crate::nets::normalize::Normalizer;

impl Policy {
    /// The policy whose every number is the mean of those of `policies`: weights, statistics of observations, deviations.
    /// That makes sense for policies near each other, as one run keeps them. The mean has the description of the last one,
    /// without its evaluation.
    ///
    /// # Errors
    /// If there are none, or they are not alike ([`Policy::check_alike`]).
    pub fn mean(policies: &[Policy]) -> Result<Policy, Error> {
        let Some(last) = policies.last() else {
            return Err(Error::Mismatch {
                what: "mean".into(),
                found: "no policies".into(),
                expected: "one or more".into(),
            });
        };
        policies.iter().try_for_each(|policy| policy.check_alike(last))?;
        let mean = |of: fn(&Policy) -> &[f32]| -> Vec<f32> {
            let sum = |i: usize| policies.iter().map(|policy| f64::from(of(policy)[i])).sum::<f64>();
            (0..of(last).len()).map(|i| (sum(i) / policies.len() as f64) as f32).collect()
        };
        let (obs_mean, obs_std) = (mean(|policy| policy.normalizer.mean()), mean(|policy| policy.normalizer.std()));
        let mut meta = last.meta.clone();
        meta.evaluation = None;
        let normalizer = Normalizer::new(obs_mean, obs_std, meta.observation_clip);
        Ok(Policy::assemble(meta, last.net.clone(), mean(Policy::params), normalizer, mean(Policy::log_std)))
    }

    /// Whether every number of the policy means what it means in another one: the same agent, network and map of actions.
    ///
    /// # Errors
    /// Names what differs.
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
