//! The trainer's configuration.

use crate::algorithms::a2c::A2c;
use crate::algorithms::acktr::Acktr;
use crate::algorithms::ppo::Ppo;
use crate::algorithms::sac::Sac;
use crate::algorithms::{Algorithm, Setup, SharedConfig, check};
use crate::error::Error;
use crate::lanes::BLOCK;
use crate::nets::NetworkConfig;
use crate::nets::activation::Activation;
use crate::rewards::{RewardConfig, RewardKind, document};
use crate::rollout::statistics::StatisticsConfig;
use marathon_envs::{Demonstrations, Spec};
use marathon_physics::hint::{did_you_mean, nearest};
use marathon_physics::lanes::Isa;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

/// Most steps of a run: as many as double precision can count.
pub(crate) const MAX_STEPS: u64 = 1 << 53;
/// Most agent-steps of a rollout.
const MOST_SAMPLES: usize = 1 << 31;

/// Settings of training. Every field has a default, so a file names only what it changes. In files, the settings of the
/// algorithm stand under its name, and those of each reward under its.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Document", into = "Document")]
pub struct TrainConfig {
    /// Size and length of the run.
    pub run: RunConfig,
    /// Networks of policy and values.
    pub network: NetworkConfig,
    /// How observations and rewards are normalized.
    pub statistics: StatisticsConfig,
    /// The rewards, the task's own first; the others' kinds differ.
    pub rewards: Vec<RewardConfig>,
    /// Algorithm that learns from the rollouts.
    pub algorithm: Algorithm,
    /// Settings that differ for roles of the task, by role name; other roles use the settings above.
    pub roles: BTreeMap<String, RoleConfig>,
}

/// Settings of a role of its own.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "RoleDocument", into = "RoleDocument")]
pub struct RoleConfig {
    /// Networks of policy and values.
    pub network: NetworkConfig,
    /// How observations and rewards are normalized.
    pub statistics: StatisticsConfig,
    /// The rewards, the task's own first; the others' kinds differ.
    pub rewards: Vec<RewardConfig>,
    /// Algorithm that learns from the rollouts.
    pub algorithm: Algorithm,
}

impl Default for RoleConfig {
    fn default() -> Self {
        Self::from(TrainConfig::default())
    }
}

impl From<TrainConfig> for RoleConfig {
    /// Without what is the run's.
    fn from(config: TrainConfig) -> Self {
        let TrainConfig { network, statistics, rewards, algorithm, .. } = config;
        Self { network, statistics, rewards, algorithm }
    }
}

impl Default for TrainConfig {
    /// A setting that solves the small tasks.
    fn default() -> Self {
        Self {
            run: RunConfig::default(),
            network: NetworkConfig::default(),
            statistics: StatisticsConfig::default(),
            rewards: vec![RewardConfig::new(RewardKind::Task)],
            algorithm: Algorithm::default(),
            roles: BTreeMap::new(),
        }
    }
}

/// A configuration in files.
#[derive(Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct Document {
    run: RunConfig,
    network: NetworkConfig,
    statistics: StatisticsConfig,
    #[serde(with = "document")]
    rewards: Vec<RewardConfig>,
    #[serde(skip_serializing_if = "Option::is_none")]
    ppo: Option<Ppo>,
    #[serde(skip_serializing_if = "Option::is_none")]
    a2c: Option<A2c>,
    #[serde(skip_serializing_if = "Option::is_none")]
    acktr: Option<Acktr>,
    #[serde(skip_serializing_if = "Option::is_none")]
    sac: Option<Sac>,
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    roles: BTreeMap<String, RoleConfig>,
}

/// The settings of a role in files.
#[derive(Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct RoleDocument {
    network: NetworkConfig,
    statistics: StatisticsConfig,
    #[serde(with = "document")]
    rewards: Vec<RewardConfig>,
    #[serde(skip_serializing_if = "Option::is_none")]
    ppo: Option<Ppo>,
    #[serde(skip_serializing_if = "Option::is_none")]
    a2c: Option<A2c>,
    #[serde(skip_serializing_if = "Option::is_none")]
    acktr: Option<Acktr>,
    #[serde(skip_serializing_if = "Option::is_none")]
    sac: Option<Sac>,
}

impl From<RoleConfig> for RoleDocument {
    fn from(RoleConfig { network, statistics, rewards, algorithm }: RoleConfig) -> Self {
        let mut document = Self { network, statistics, rewards, ..Self::default() };
        match algorithm {
            Algorithm::Ppo(settings) => document.ppo = Some(settings),
            Algorithm::A2c(settings) => document.a2c = Some(settings),
            Algorithm::Acktr(settings) => document.acktr = Some(settings),
            Algorithm::Sac(settings) => document.sac = Some(settings),
        }
        document
    }
}

impl TryFrom<RoleDocument> for RoleConfig {
    type Error = String;

    fn try_from(document: RoleDocument) -> Result<Self, String> {
        let RoleDocument { network, statistics, mut rewards, ppo, a2c, acktr, sac } = document;
        let all =
            [ppo.map(Algorithm::Ppo), a2c.map(Algorithm::A2c), acktr.map(Algorithm::Acktr), sac.map(Algorithm::Sac)];
        let algorithm = match all.into_iter().flatten().collect::<Vec<_>>()[..] {
            [] => Algorithm::default(),
            [algorithm] => algorithm,
            [a, b, ..] => {
                return Err(format!("found {} and {}, expected the settings of one algorithm", a.name(), b.name()));
            }
        };
        if rewards.is_empty() {
            rewards.push(RewardConfig::new(RewardKind::Task));
        }
        Ok(Self { network, statistics, rewards, algorithm })
    }
}

impl From<TrainConfig> for Document {
    fn from(mut config: TrainConfig) -> Self {
        let (run, roles) = (config.run.clone(), std::mem::take(&mut config.roles));
        let RoleDocument { network, statistics, rewards, ppo, a2c, acktr, sac } = RoleConfig::from(config).into();
        Self { run, network, statistics, rewards, ppo, a2c, acktr, sac, roles }
    }
}

impl TryFrom<Document> for TrainConfig {
    type Error = String;

    fn try_from(document: Document) -> Result<Self, String> {
        let Document { run, network, statistics, rewards, ppo, a2c, acktr, sac, roles } = document;
        let of_role = RoleDocument { network, statistics, rewards, ppo, a2c, acktr, sac };
        let RoleConfig { network, statistics, rewards, algorithm } = of_role.try_into()?;
        Ok(Self { run, network, statistics, rewards, algorithm, roles })
    }
}

/// Size and length of a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RunConfig {
    /// Agents that act side by side: a multiple of 16, or 1, 2, 4 or 8, which cost as much as 16.
    pub agents: usize,
    /// Decisions of each agent per rollout.
    pub horizon: usize,
    /// Rollouts of one iteration, each learned from by itself: what is reported and saved together.
    pub rollouts: usize,
    /// Agent-steps of the whole run; training ends with the first rollout that reaches them.
    pub total_steps: u64,
    /// Latest part of the run so far whose policies are averaged for the one that the run hands out, as a share of its steps,
    /// from 0 to below 1; 0: the last policy alone.
    pub policy_average: f64,
    /// Seed of everything random.
    pub seed: u64,
    /// Threads; 0 means one per processor. The result does not depend on it.
    pub threads: usize,
}

impl Default for RunConfig {
    fn default() -> Self {
        Self {
            agents: 256,
            horizon: 64,
            rollouts: 1,
            total_steps: 10_000_000,
            policy_average: 0.0,
            seed: 1,
            threads: 0,
        }
    }
}

impl TrainConfig {
    /// A2C with the settings of the paper's comparison: OpenAI Baselines' with the rate that its authors chose, sixteen
    /// agents, two networks of 64 and 64 units.
    pub fn a2c() -> Self {
        let run = RunConfig { agents: 16, horizon: 5, rollouts: 50, total_steps: 1_000_000, ..Default::default() };
        Self { run, algorithm: Algorithm::A2c(A2c::default()), ..Default::default() }
    }

    /// ACKTR with the settings of OpenAI Baselines, sixteen agents, two networks of 64 and 64 units.
    pub fn acktr() -> Self {
        let run = RunConfig { agents: 16, horizon: 20, rollouts: 10, total_steps: 1_000_000, ..Default::default() };
        Self { run, algorithm: Algorithm::Acktr(Acktr::default()), ..Default::default() }
    }

    /// SAC for many agents: sixty-four, and an update with 256 samples for every eighth of their steps.
    pub fn sac() -> Self {
        Self {
            run: RunConfig { agents: 64, horizon: 4, rollouts: 16, total_steps: 1_000_000, ..Default::default() },
            network: NetworkConfig { activation: Activation::Relu, ..Default::default() },
            statistics: StatisticsConfig { scale_rewards: false, ..Default::default() },
            algorithm: Algorithm::Sac(Sac::default()),
            ..Default::default()
        }
    }

    /// The settings that an algorithm starts from, by its name.
    pub fn of(algorithm: &str) -> Option<Self> {
        match algorithm {
            "ppo" => Some(Self::default()),
            "a2c" => Some(Self::a2c()),
            "acktr" => Some(Self::acktr()),
            "sac" => Some(Self::sac()),
            _ => None,
        }
    }

    /// The same with a change.
    pub fn with(mut self, change: impl FnOnce(&mut Self)) -> Self {
        change(&mut self);
        self
    }

    /// The settings of a role.
    pub fn of_role(&self, name: &str) -> Self {
        match self.roles.get(name).cloned() {
            Some(RoleConfig { network, statistics, rewards, algorithm }) => {
                Self { run: self.run.clone(), network, statistics, rewards, algorithm, roles: BTreeMap::new() }
            }
            None => Self { roles: BTreeMap::new(), ..self.clone() },
        }
    }

    /// Properties of the task's own reward.
    pub fn task_reward(&self) -> &RewardConfig {
        &self.rewards[0]
    }
}

impl RunConfig {
    /// Whether so many agents fill their lanes evenly: a multiple of sixteen, or a divisor of it.
    pub fn fills_lanes(agents: usize) -> bool {
        agents.is_multiple_of(BLOCK) || agents < BLOCK && agents.is_power_of_two()
    }
    /// Number of blocks of sixteen agents.
    pub fn blocks(&self) -> usize {
        self.agents.div_ceil(BLOCK)
    }
    /// Agent-steps per rollout.
    pub fn rollout_steps(&self) -> u64 {
        (self.agents * self.horizon) as u64
    }
    /// Threads that a run uses: the configured or available number, at most one per block.
    pub fn worker_count(&self) -> usize {
        marathon_physics::threads(self.threads).min(self.blocks()).max(1)
    }
}

impl RunConfig {
    /// Checks every field.
    ///
    /// # Errors
    /// Names the field, its value and the values that are valid.
    pub fn validate(&self) -> Result<(), Error> {
        if self.agents == 0 || !Self::fills_lanes(self.agents) {
            let nearest = (self.agents as f64 / BLOCK as f64).round().max(1.0) as usize * BLOCK;
            let expected = format!("a multiple of {BLOCK}, such as {nearest}, or 1, 2, 4 or 8");
            return Err(Error::config("agents", self.agents, expected));
        }
        let samples = self.blocks().saturating_mul(self.horizon).saturating_mul(BLOCK);
        if samples > MOST_SAMPLES {
            let lanes = self.blocks().saturating_mul(BLOCK);
            if lanes > MOST_SAMPLES {
                return Err(Error::config("agents", self.agents, format!("at most {MOST_SAMPLES}")));
            }
            let expected = format!("at most {} with {} agents", MOST_SAMPLES / lanes, self.agents);
            return Err(Error::config("horizon", self.horizon, expected));
        }
        if self.total_steps > MAX_STEPS {
            return Err(Error::config("total_steps", self.total_steps, format!("at most {MAX_STEPS}")));
        }
        for (field, n) in [("horizon", self.horizon), ("rollouts", self.rollouts)] {
            if n == 0 {
                return Err(Error::config(field, n, "at least 1"));
            }
        }
        check::fraction("policy_average", self.policy_average)
    }
}

impl TrainConfig {
    /// Facts of a run on a task for the algorithm.
    pub(crate) fn setup<'a>(
        &'a self,
        spec: &'a Spec,
        isa: Isa,
        demonstrations: Option<&'a Demonstrations>,
    ) -> Setup<'a> {
        Setup { spec, isa, common: self.common(), action_clip: self.algorithm.action_clip(), demonstrations }
    }

    fn common(&self) -> SharedConfig<'_> {
        SharedConfig {
            network: &self.network,
            rewards: &self.rewards,
            statistics: &self.statistics,
            agents: self.run.agents,
            horizon: self.run.horizon,
            seed: self.run.seed,
        }
    }

    /// Checks every field.
    ///
    /// # Errors
    /// Names the field with its sections, its value and the values that are valid.
    pub fn validate(&self) -> Result<(), Error> {
        self.run.validate().map_err(|error| error.within("run"))?;
        self.network.validate().map_err(|error| error.within("network"))?;
        self.statistics.validate().map_err(|error| error.within("statistics"))?;
        let rank = |reward: &RewardConfig| RewardKind::NAMES.iter().position(|name| *name == reward.kind.name());
        for (i, reward) in self.rewards.iter().enumerate() {
            let name = reward.kind.name();
            if let Some(other) = self.rewards[..i].iter().find(|other| rank(other) >= rank(reward)) {
                let found = format!("{name} after {}", other.kind.name());
                let expected = format!("each kind once, in the order {}", RewardKind::NAMES.join(", "));
                return Err(Error::config("rewards", found, expected));
            }
            reward.validate().map_err(|error| error.within("rewards"))?;
        }
        let first = self.rewards.first().map(|reward| &reward.kind);
        if first != Some(&RewardKind::Task) {
            let found = first.map_or("nothing", RewardKind::name);
            return Err(Error::config("rewards", found, "the task's own in the first place"));
        }
        self.algorithm.validate(&self.common()).map_err(|error| self.of_algorithm(error))?;
        self.roles
            .keys()
            .try_for_each(|name| self.of_role(name).validate().map_err(|error| error.within(&format!("roles.{name}"))))
    }

    /// An error of the algorithm, which demands something of other sections, too.
    fn of_algorithm(&self, error: Error) -> Error {
        let other =
            |field: &str| ["run.", "network.", "statistics.", "rewards"].iter().any(|start| field.starts_with(start));
        match &error {
            Error::Config { field, .. } if other(field) => error,
            _ => error.within(self.algorithm.name()),
        }
    }

    /// Refuses settings of a role that a task lacks.
    ///
    /// # Errors
    /// Names the role and those that there are.
    pub fn check_roles(&self, spec: &Spec) -> Result<(), Error> {
        self.check_role_names(&spec.roles.iter().map(|role| role.name.as_str()).collect::<Vec<_>>())
    }

    /// The same with the names of the task's roles; a task with one role has none.
    ///
    /// # Errors
    /// The same.
    pub fn check_role_names(&self, names: &[&str]) -> Result<(), Error> {
        let mut unknown = self.roles.keys().filter(|name| !names.contains(&name.as_str()));
        let Some(name) = unknown.next() else { return Ok(()) };
        let expected = if names.is_empty() { "none: the task has one role".into() } else { names.join(", ") };
        let near = did_you_mean(nearest(name, names.iter().copied()));
        Err(Error::config("roles", name, format!("{expected}{near}")))
    }

    /// The same as [`Self::validate`] for a configuration in a file, under `key`.
    ///
    /// # Errors
    /// Names the file, the setting's place in it, its value and the values that are valid.
    pub fn validate_in(&self, path: &Path, key: &str) -> Result<(), Error> {
        self.validate().map_err(|error| error.in_file(path, key))
    }
}
