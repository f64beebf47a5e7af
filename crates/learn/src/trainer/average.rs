//! The mean of a run's last policies. Steps of learning are noisy to the end; the mean of where they lead is less so.
//!
//! After `t` steps in all, the policy of the last `n` of them enters with the weight `n / (f t)`, and the mean of before
//! keeps the rest. So the weight of the policy after `s` steps falls as `(s / t)^(1/f - 1)` (polynomial-decay averaging,
//! Shamir and Zhang, 2013): at every moment the mean is that of about the latest part `f` of the run.

use crate::policy::Policy;

/// Takes the policy of the last `taken` of `steps` steps into the mean of the latest part of the run.
pub fn absorb(mean: &mut Option<Vec<f64>>, policy: &Policy, part: f64, taken: u64, steps: u64) {
    let mean = mean.get_or_insert_with(|| policy.numbers().collect());
    let weight = (taken as f64 / (part * steps as f64)).min(1.0);
    mean.iter_mut().zip(policy.numbers()).for_each(|(mean, x)| *mean += weight * (x - *mean));
}
