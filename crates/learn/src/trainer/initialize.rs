//! Runs that start from a policy in place of random weights.

use super::TrainLoop;
use super::checkpoint::Checkpoint;
use super::config::TrainConfig;
use crate::error::Error;
use crate::nets::mlp::Mlp;
use crate::nets::widen::widen;
use crate::policy::Policy;
use marathon_envs::ShardFactory;
use marathon_physics::lanes::Isa;

/// The start of a run whose policy network is another policy's: number `i` of what that observes is number `sees[i]` here, and
/// what else there is here has no influence yet. The value function starts from random weights.
///
/// # Errors
/// If the configuration is invalid, its network or its algorithm is of another kind, or the policy decides otherwise.
pub fn initialized(
    factory: &dyn ShardFactory,
    isa: Isa,
    config: &TrainConfig,
    policy: &Policy,
    sees: &[usize],
) -> Result<Checkpoint, Error> {
    let mut trainer = TrainLoop::new(factory, isa, &config.clone().with(|config| config.run.threads = 1))?;
    let role = &trainer.shared.roles[0];
    let meta = policy.meta();
    if role.config.algorithm.clone().action_std_mut().is_none() {
        let expected = "ppo, a2c or acktr, whose policies start from others";
        return Err(Error::config("algorithm", role.config.algorithm.name(), expected));
    }
    let (obs, act) = (role.spec.obs, role.spec.act);
    for (what, found, expected) in [
        ("action length", meta.act.to_string(), act.to_string()),
        ("squash", meta.squash.to_string(), false.to_string()),
    ] {
        if found != expected {
            return Err(Error::Mismatch { what: format!("{what} of the policy to start from"), found, expected });
        }
    }
    let network = &role.config.network;
    let net = Mlp::new(&[&[obs], &network.hidden[..], &[act]].concat(), network.activation);
    let learner = &mut trainer.replica.roles[0];
    // the policy network's parameters are the first ones
    let params = &mut learner.learner.params_mut()[..net.len()];
    widen(&net, params, policy.net(), policy.params(), sees)?;
    // actions drawn are divided by their bound
    let bound = role.config.algorithm.action_clip() as f32;
    if bound != 1.0 {
        let (weights, biases) = net.layers().last().expect("a network has layers");
        params[weights.start..biases.end].iter_mut().for_each(|x| *x *= bound);
    }
    if role.config.statistics.normalize_observations {
        learner.statistics.observations.assume(policy.normalizer(), sees);
    }
    Ok(trainer.checkpoint())
}
