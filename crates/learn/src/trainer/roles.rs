//! The roles of a run: what each learns with.

use super::config::{RunConfig, TrainConfig};
use super::stats::Learned;
use crate::algorithms::loss::LossSums;
use crate::algorithms::schedule::Progress;
use crate::algorithms::{Algorithm, Learner, Setup};
use crate::error::Error;
use crate::lanes::noise::seed_of_role;
use crate::policy::{Policy, PolicyMeta, Training};
use crate::rollout::role_rollout::RoleSetup;
use crate::rollout::statistics::Statistics;
use crate::rollout::sums::Totals;
use marathon_envs::{Demonstrations, Role, ShardFactory, Spec};
use marathon_physics::lanes::Isa;

/// A role with its settings.
pub struct RoleParts {
    /// The role.
    pub role: Role,
    /// The task as the role knows it.
    pub spec: Spec,
    /// Its settings, with a seed of its own.
    pub config: TrainConfig,
    /// Demonstrations to imitate, if it has an imitation reward.
    demonstrations: Option<Demonstrations>,
}

/// Refuses rewards for imitation without demonstrations, and demonstrations that do not fit a task.
///
/// # Errors
/// Names the setting, what was found and what is valid.
pub fn check_demonstrations(config: &TrainConfig, task: &dyn ShardFactory) -> Result<(), Error> {
    RoleParts::all(config, task.spec())?.iter_mut().try_for_each(|role| role.learn_from(task))
}

impl RoleParts {
    /// All roles of a task.
    ///
    /// # Errors
    /// If the configuration speaks of another role, or does not suit a role's way of deciding.
    pub fn all(config: &TrainConfig, spec: &Spec) -> Result<Vec<Self>, Error> {
        let roles = spec.deciders();
        config.check_roles(spec)?;
        let parts = |(i, role): (usize, Role)| {
            let config = config.of_role(&role.name).with(|own| own.run.seed = seed_of_role(config.run.seed, i));
            let suits = matches!(config.algorithm, Algorithm::Ppo(_) | Algorithm::A2c(_)) && config.rewards.len() == 1;
            if role.intermittent && !suits {
                let found =
                    format!("{} with {} rewards for {}", config.algorithm.name(), config.rewards.len(), role.name);
                let expected = "ppo or a2c with the task's reward alone: the role does not decide every time";
                return Err(Error::config("algorithm", found, expected));
            }
            Ok(Self { spec: spec.of_role(&role), config, role, demonstrations: None })
        };
        roles.into_iter().enumerate().map(parts).collect()
    }

    /// Gets what is to be imitated from a task.
    ///
    /// # Errors
    /// If a reward asks for what is not there, or does not fit.
    pub fn learn_from(&mut self, task: &dyn ShardFactory) -> Result<(), Error> {
        let mut imitations = self.config.rewards.iter().filter_map(|reward| reward.kind.imitation()).peekable();
        if imitations.peek().is_none() {
            return Ok(());
        }
        self.demonstrations = task.demonstrations().map(|all| all.of_role(&self.role, task.spec()));
        imitations.try_for_each(|imitation| imitation.check(&self.spec, self.demonstrations.as_ref()))
    }

    /// Setup of its algorithm.
    pub fn setup(&self, isa: Isa) -> Setup<'_> {
        self.config.setup(&self.spec, isa, self.demonstrations.as_ref())
    }

    /// The policy that a run of this configuration hands out for it.
    pub fn policy(&self, replica: &RoleReplica, progress: &Progress, config: &TrainConfig) -> Policy {
        let mut meta = self.meta();
        let run = RunConfig { threads: 0, ..config.run.clone() };
        let config = TrainConfig { run, ..config.clone() };
        meta.training = Some(Training {
            config: serde_json::to_value(config).expect("a configuration is plain data"),
            steps: progress.steps,
            iterations: progress.iteration,
        });
        let last = replica.learner.policy(meta, replica.statistics.normalizer());
        match &replica.average {
            Some(average) => last.with_numbers(average),
            None => last,
        }
    }

    /// Its last policy, which does not tell of the run.
    pub fn last_policy(&self, replica: &RoleReplica) -> Policy {
        replica.learner.policy(self.meta(), replica.statistics.normalizer())
    }

    fn meta(&self) -> PolicyMeta {
        let network = &self.config.network;
        let mut meta = PolicyMeta::of(&self.spec, network.hidden.clone(), network.activation);
        meta.observation_clip = self.config.statistics.observation_clip as f32;
        meta
    }

    /// Its learning statistics of an iteration, for reports.
    pub fn learned(&self, learner: &dyn Learner, totals: &Totals, updates: &LossSums) -> Learned {
        let sums = &totals.sums;
        let per_sample = |x: f64| if updates.samples > 0.0 { x / updates.samples } else { 0.0 };
        let names = self.config.rewards.iter().skip(1).map(|reward| reward.kind.name().to_string());
        let of_rewards = names.zip(&sums.rewards).map(|(name, x)| (name, x / totals.samples));
        let about = learner.describe(totals, updates);
        Learned {
            return_mean: (sums.episodes > 0.0).then(|| sums.returns / sums.episodes),
            reward_terms: sums.terms.iter().map(|x| x / totals.samples).collect(),
            kl: per_sample(updates.kl),
            clip_fraction: per_sample(updates.clipped),
            policy_loss: per_sample(updates.policy),
            value_loss: per_sample(updates.value),
            explained_variance: about.explained_variance,
            entropy: about.entropy,
            std_mean: about.std_mean,
            lr: about.lr,
            skipped_minibatches: about.skipped,
            signal_rewards: of_rewards.collect(),
        }
    }
}

/// State of a role that learning changes; every worker has an equal copy.
pub struct RoleReplica {
    /// The role's learner.
    pub learner: Box<dyn Learner>,
    /// Statistics of its observations.
    pub statistics: Statistics,
    /// The first worker's: the mean of the numbers of its last policies, if the run averages them.
    pub average: Option<Vec<f64>>,
}

impl RoleReplica {
    /// At the start of a run, for workers that have so many blocks each.
    pub fn new(role: &RoleParts, isa: Isa, blocks: &[usize]) -> Self {
        Self {
            learner: role.config.algorithm.learner(&role.setup(isa), blocks),
            statistics: Statistics::new(role.spec.obs, role.config.statistics),
            average: None,
        }
    }

    /// Another worker's.
    pub fn copy(&self) -> Self {
        Self { learner: self.learner.replica(), statistics: self.statistics.clone(), average: None }
    }

    /// Setup for its rollouts.
    pub fn role_setup(&self, role: &RoleParts) -> RoleSetup<'_> {
        let (seed, lanes) = (role.config.run.seed, self.learner.shape().lanes);
        let metrics = role.spec.own_metrics().cloned().collect();
        RoleSetup { role: role.role.clone(), seed, lanes, metrics, with: self.learner.collecting(&self.statistics) }
    }

    /// Takes in the statistics of a rollout.
    pub fn absorb(&mut self, totals: &Totals) {
        if let Some([before, after]) = self.statistics.absorb(totals) {
            self.learner.follow(&before, &after);
        }
    }
}
