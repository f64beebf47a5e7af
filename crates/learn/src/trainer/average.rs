//! The mean of a run's last policies. Steps of learning are noisy to the end; the mean of where they lead is less so.
//!
//! After `t` steps in all, the policy of the last `n` of them enters with the weight `n / (f t)`, and the mean of before
//! keeps the rest. So the weight of the policy after `s` steps falls as `(s / t)^(1/f - 1)` (polynomial-decay averaging,
//! Shamir and Zhang, 2013): at every moment the mean is that of about the latest part `f` of the run.

use super::{Replica, Shared};

/// Takes the policy of each role into its mean, if the run averages them, after `taken` more steps.
pub fn absorb(shared: &Shared, replica: &mut Replica, taken: f64) {
    let part = shared.config.run.policy_average;
    if part == 0.0 {
        return;
    }
    let weight = (taken / (part * replica.progress.steps as f64)).min(1.0);
    for (parts, role) in shared.roles.iter().zip(&mut replica.roles) {
        let policy = parts.last_policy(role);
        let mean = role.average.get_or_insert_with(|| policy.numbers().collect());
        mean.iter_mut().zip(policy.numbers()).for_each(|(mean, x)| *mean += weight * (x - *mean));
    }
}
