//! The common part of the on-policy algorithms: a policy and a value function as separate networks, the networks of the
//! rewards, and the gradient of the objective with respect to all of them.

use super::loss::{Loss, LossSums, Objective};
use super::parameters::Places;
use super::schedule::{LrSchedule, Progress, Schedule};
use super::{Description, MemoryPlan, Partial, Setup, Workers, check};
use crate::error::Error;
use crate::lanes::BLOCK;
use crate::lanes::buffer::Blocks;
use crate::lanes::f32_lanes;
use crate::lanes::noise::{PARAMETERS, SplitMix};
use crate::nets::acting::{Acting, Distribution};
use crate::nets::gaussian::{Gaussian, Ratio, bound_std};
use crate::nets::mlp::{CHUNK, Mlp, Tape};
use crate::nets::normalize::Normalizer;
use crate::optim::kfac::Kfac;
use crate::optim::sum;
use crate::policy::{Policy, PolicyMeta};
use crate::rewards::{Minibatch, RewardModel, Stream};
use crate::rollout::context::{RolloutContext, Values};
use crate::rollout::data::{Experience, Samples, Shape};
use crate::rollout::statistics::Statistics;
use crate::rollout::sums::Totals;
use marathon_physics::lanes::{Isa, Real};
use serde::{Deserialize, Serialize};
use std::marker::PhantomData;
use std::ops::Range;

/// Standard deviations of the actions drawn, which do not depend on the state.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ActionStd {
    /// Logarithm of the standard deviation of the actions at the start.
    pub init_log: f64,
    /// Smallest standard deviation. It keeps a policy exploring after it has found one safe solution.
    pub min: Schedule,
    /// Largest standard deviation.
    pub max: f64,
}

impl Default for ActionStd {
    fn default() -> Self {
        Self { init_log: -0.5, min: Schedule::constant(0.05), max: 2.0 }
    }
}

impl ActionStd {
    /// Practically unbounded deviations that start at 1.
    pub const FREE: Self = Self { init_log: 0.0, min: Schedule::constant(1e-3), max: 1e3 };

    /// Checks every field.
    pub fn validate(&self) -> Result<(), Error> {
        let Schedule { from, to } = self.min;
        check::positive(&[("action_std.min", from), ("action_std.min.to", to)])?;
        let largest_min = from.max(to);
        if !(self.max.is_finite() && self.max >= largest_min) {
            let expected = format!("a number not below the smallest deviation, {largest_min}");
            return Err(Error::config("action_std.max", self.max, expected));
        }
        match self.init_log.is_finite() {
            true => Ok(()),
            false => Err(Error::config("action_std.init_log", self.init_log, "a finite number")),
        }
    }
}

/// Checks the settings that all actor-critic algorithms have.
pub fn validate(lr: f64, gae_lambda: f64, entropy_coef: Schedule) -> Result<(), Error> {
    check::positive(&[("lr", lr)])?;
    if !(0.0..=1.0).contains(&gae_lambda) {
        return Err(Error::config("gae_lambda", gae_lambda, "a number between 0 and 1"));
    }
    let Schedule { from, to } = entropy_coef;
    for (field, x) in [("entropy_coef", from), ("entropy_coef.to", to)] {
        if !(x.is_finite() && x >= 0.0) {
            return Err(Error::config(field, x, "a number not below 0"));
        }
    }
    Ok(())
}

/// Refuses the adaptive schedule, which only PPO supports.
pub fn refuse_adaptive(lr_schedule: LrSchedule, name: &str) -> Result<(), Error> {
    match lr_schedule {
        LrSchedule::Adaptive => {
            Err(Error::config("lr_schedule", "adaptive", format!("constant or linear with {name}")))
        }
        LrSchedule::Constant | LrSchedule::Linear => Ok(()),
    }
}

/// The networks without their parameters.
#[derive(Clone)]
pub struct Layout {
    /// Policy network.
    pub actor: Mlp,
    /// Value network, with one output per stream of rewards.
    pub critic: Mlp,
    /// Logarithms of the standard deviations, after the policy network's parameters.
    pub log_std: Range<usize>,
    /// First parameter of the value network.
    pub critic_start: usize,
    /// The streams of rewards.
    pub streams: Vec<Stream>,
    /// All networks: policy, value function, rewards.
    pub places: Places,
    ratio: Ratio,
    shape: Shape,
}

impl Layout {
    /// Creates the networks for a task.
    pub fn new(setup: &Setup<'_>, ratio: Ratio) -> Self {
        let (obs, act, network) = (setup.spec.obs, setup.spec.act, setup.common.network);
        let net = |hidden: &[usize], out| Mlp::new(&[&[obs], hidden, &[out]].concat(), network.activation);
        let actor = net(&network.hidden, act);
        let critic = net(network.critic(), setup.common.rewards.len());
        let mut places = Places::default();
        let of_actor = places.add(actor.len() + act);
        let critic_start = places.add(critic.len()).start;
        let streams = Stream::all(setup.common.rewards, setup.purpose(), |count| places.add(count));
        let shape = Shape {
            obs,
            act,
            log_probs: ratio.rows(act),
            streams: streams.len(),
            next_obs: streams.iter().any(|stream| stream.networks.is_some()),
            lanes: setup.common.lanes(),
        };
        Self { log_std: actor.len()..of_actor.end, actor, critic, critic_start, streams, places, ratio, shape }
    }

    /// Memory that a run needs. `items` is the length of the longest list of samples.
    pub fn memory_plan(&self, items: usize, moments: usize) -> MemoryPlan {
        MemoryPlan { parameters: self.places.total(), moments, items, shape: self.shape, replay: 0 }
    }

    /// Learning rates of all networks: policy, value function, rewards.
    pub fn rates(&self, policy: f64, value: f64) -> Vec<f64> {
        let of_rewards = self.streams.iter().filter_map(|stream| stream.networks.as_ref()).map(|nets| nets.lr);
        [policy, value].into_iter().chain(of_rewards).collect()
    }
}

/// The networks with their parameters.
#[derive(Clone)]
pub struct ActorCritic {
    /// Shapes and places of the networks.
    pub layout: Layout,
    /// The parameters.
    pub params: Vec<f32>,
    /// Instruction set.
    pub isa: Isa,
    action_clip: f64,
    action_std: ActionStd,
    lambda: f64,
}

impl ActorCritic {
    /// Creates the networks at the start of a run.
    pub fn new(setup: &Setup<'_>, ratio: Ratio, action_std: ActionStd, lambda: f64) -> Self {
        let layout = Layout::new(setup, ratio);
        let mut params = vec![0.0; layout.places.total()];
        let mut random = SplitMix::new(setup.common.seed, PARAMETERS);
        let init = setup.common.network.initialization;
        init.policy(&layout.actor, &mut params, &mut random);
        init.value(&layout.critic, &mut params[layout.critic_start..], &mut random);
        params[layout.log_std.clone()].fill(action_std.init_log as f32);
        Stream::init(&layout.streams, &mut params, setup.common.seed);
        Self { layout, params, isa: setup.isa, action_clip: setup.action_clip, action_std, lambda }
    }

    /// The policy network's parameters.
    fn actor_params(&self) -> &[f32] {
        &self.params[..self.layout.actor.len()]
    }
    /// The value network's parameters.
    fn critic_params(&self) -> &[f32] {
        &self.params[self.layout.critic_start..][..self.layout.critic.len()]
    }
    /// Current standard deviations.
    pub fn gaussian(&self) -> Gaussian<f32> {
        Gaussian::new(&self.params[self.layout.log_std.clone()])
    }
    /// Factor of the sampled actions, before they are clipped to [-1, 1].
    fn action_scale(&self) -> f32 {
        1.0 / self.action_clip as f32
    }
    /// Data that is kept per decision.
    pub fn shape(&self) -> Shape {
        self.layout.shape
    }

    /// Networks and constants for a rollout.
    pub fn collecting(&self, statistics: &Statistics) -> RolloutContext<'_> {
        RolloutContext {
            acting: Acting {
                isa: self.isa,
                net: &self.layout.actor,
                params: self.actor_params(),
                normalizer: statistics.normalizer(),
                distribution: Distribution::Gaussian(self.gaussian(), self.layout.ratio),
                action_scale: self.action_scale(),
            },
            streams: &self.layout.streams,
            params: &self.params,
            values: Some(Values { net: &self.layout.critic, params: self.critic_params(), lambda: self.lambda }),
            reward_scale: statistics.reward_scale() * self.layout.streams[0].strength,
            return_center: statistics.returns.mean[0] as f32,
        }
    }

    /// Leaves the gradient of an objective, summed over a list of items of the rollout, with the workers. Returns the
    /// sums of the objective. With `kfac`, each group also leaves sums for the factors of the Fisher matrix.
    pub fn gradient(
        &self,
        workers: &mut dyn Workers,
        experience: &Experience<'_>,
        items: &[u32],
        objective: Objective,
        (kfac, minibatch): (Option<&Kfac>, Minibatch<'_>),
        space: &mut Space,
    ) -> LossSums {
        let gaussian = self.gaussian();
        workers.share_out(items.len(), &mut |group, partial| {
            let minibatch = Minibatch { items: &items[group], ..minibatch };
            self.gradient_of_group(&gaussian, objective, experience, (kfac, minibatch), space, partial);
        })
    }

    /// Computes the gradient of the objective summed over a group of items, one chunk at a time.
    fn gradient_of_group(
        &self,
        gaussian: &Gaussian<f32>,
        objective: Objective,
        experience: &Experience<'_>,
        (kfac, minibatch): (Option<&Kfac>, Minibatch<'_>),
        space: &mut Space,
        partial: &mut Partial,
    ) {
        let (layout, isa) = (&self.layout, self.isa);
        let (actor, critic) = (self.actor_params(), self.critic_params());
        partial.sums = LossSums::default();
        for (i, chunk) in minibatch.items.chunks(CHUNK).enumerate() {
            let mut samples =
                [Samples { decided: 0, action: &[], log_prob: &[], advantage: &[], value: &[], target: &[] }; CHUNK];
            let (mut n, mut steps) = (0, Vec::new());
            for (rollout, item) in chunk.iter().map(|item| experience.item(*item)) {
                space.input.block_mut(n).copy_from_slice(rollout.obs(item));
                samples[n] = rollout.samples(item);
                n += 1;
                if layout.shape.next_obs {
                    steps.push(rollout.step(item));
                }
            }
            // the first chunk needs no sum
            let gradient = if i == 0 { &mut partial.gradient } else { &mut space.gradient };
            let networks = layout.streams.iter().filter_map(|stream| stream.networks.as_ref());
            for (networks, reward_model) in networks.zip(&mut space.reward_models) {
                let place = networks.place.clone();
                let minibatch = Minibatch { items: chunk, ..minibatch };
                reward_model.gradient(isa, &self.params[place.clone()], &steps, &minibatch, &mut gradient[place]);
            }
            let (of_actor, of_critic) = gradient.split_at_mut(layout.critic_start);
            let (of_net, of_std) = of_actor.split_at_mut(layout.actor.len());
            layout.actor.forward(isa, actor, &space.input, &mut space.actor, n);
            layout.critic.forward(isa, critic, &space.input, &mut space.critic, n);
            partial.sums += f32_lanes!(isa, T => <T as Real>::enter(Loss::<T> {
                objective,
                gaussian,
                samples: &samples[..n],
                mean: space.actor.output_and_delta(),
                value: space.critic.output_and_delta(),
                d_log_std: &mut of_std[..layout.shape.act],
                rows: &mut space.rows,
                lanes: PhantomData,
            }));
            layout.actor.backward(isa, actor, &space.input, &mut space.actor, of_net, n);
            let of_critic = &mut of_critic[..layout.critic.len()];
            layout.critic.backward(isa, critic, &space.input, &mut space.critic, of_critic, n);
            if i > 0 {
                sum::add(isa, &mut partial.gradient, &space.gradient);
            }
            if let Some(kfac) = kfac {
                let moments = if i == 0 { &mut partial.moments } else { &mut space.moments };
                let tapes = (&mut space.actor, &mut space.critic);
                let actions = samples.map(|s| s.action);
                kfac.moments(isa, (actor, critic), gaussian, &actions[..n], &space.input, tapes, moments);
                if i > 0 {
                    sum::add(isa, &mut partial.moments, &space.moments);
                }
            }
        }
    }

    /// Keeps the standard deviations of the actions within their bounds.
    pub fn bound_std(&mut self, progress: &Progress) {
        let log_std = &mut self.params[self.layout.log_std.clone()];
        bound_std(log_std, progress.at(self.action_std.min), self.action_std.max);
    }

    /// Adapts both networks to another map of observations, so that their outputs for a raw observation stay the same.
    pub fn follow(&mut self, before: &Normalizer, after: &Normalizer) {
        let (of_actor, of_critic) = self.params.split_at_mut(self.layout.critic_start);
        self.layout.actor.follow(of_actor, before, after);
        self.layout.critic.follow(of_critic, before, after);
    }

    /// Numbers for reports.
    pub fn describe(&self, totals: &Totals, lr: f64, skipped: u64) -> Description {
        let gaussian = self.gaussian();
        Description {
            lr,
            skipped,
            explained_variance: totals.explained_variance(),
            entropy: gaussian.entropy(),
            std_mean: gaussian.mean_std(),
        }
    }

    /// The current policy.
    pub fn policy(&self, meta: PolicyMeta, normalizer: Normalizer) -> Policy {
        let net = self.layout.actor.clone();
        let mut params = self.actor_params().to_vec();
        let mut log_std = self.params[self.layout.log_std.clone()].to_vec();
        let scale = self.action_scale();
        if scale != 1.0 {
            // the last layer absorbs the scale of the actions, so that every policy is bounded by 1
            let (weights, biases) = net.layers().last().expect("a network has layers");
            params[weights].iter_mut().for_each(|w| *w *= scale);
            params[biases].iter_mut().for_each(|b| *b *= scale);
            log_std.iter_mut().for_each(|l| *l += Real::ln(scale));
        }
        Policy::assemble(meta, net, params, normalizer, log_std)
    }
}

/// Work space of a worker for gradients.
pub struct Space {
    input: Blocks<f32>,
    actor: Tape<f32>,
    critic: Tape<f32>,
    reward_models: Vec<Box<dyn RewardModel>>,
    /// Gradient of all parameters.
    pub gradient: Vec<f32>,
    moments: Vec<f32>,
    rows: Vec<[f32; BLOCK]>,
}

impl Space {
    /// Creates the work space for networks and a number of moments.
    pub fn new(layout: &Layout, moments: usize) -> Self {
        let networks = layout.streams.iter().filter_map(|stream| stream.networks.as_ref());
        Self {
            input: layout.actor.input(),
            actor: layout.actor.tape(),
            critic: layout.critic.tape(),
            reward_models: networks.map(|networks| networks.reward.reward_model()).collect(),
            gradient: vec![0.0; layout.places.total()],
            moments: vec![0.0; moments],
            rows: vec![[0.0; BLOCK]; layout.shape.act],
        }
    }
}
