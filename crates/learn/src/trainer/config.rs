//! The trainer's configuration.

use crate::algorithms::a2c::A2c;
use crate::algorithms::acktr::Acktr;
use crate::algorithms::sac::Sac;
use crate::algorithms::{Algorithm, Common, Setup, check};
use crate::error::Error;
use crate::lanes::BLOCK;
use crate::nets::NetworkConfig;
use crate::nets::activation::Activation;
use crate::rewards::{RewardConfig, RewardKind};
use crate::rollout::statistics::StatisticsConfig;
use marathon_envs::{Demonstrations, Spec};
use marathon_physics::lanes::Isa;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

/// Most steps of a run: as many as double precision can count.
pub(crate) const MAX_STEPS: u64 = 1 << 53;

/// Settings of training. Every field has a default, so a file names only what it changes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TrainConfig {
    /// Size and length of the run.
    pub run: RunConfig,
    /// Networks of policy and values.
    pub network: NetworkConfig,
    /// How observations and rewards are normalized.
    pub statistics: StatisticsConfig,
    /// The rewards, the task's own first; the others' kinds differ.
    pub rewards: Vec<RewardConfig>,
    /// What learns from the rollouts.
    pub algorithm: Algorithm,
    /// What differs for roles of the task, by their names; the others have the settings above.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub roles: BTreeMap<String, RoleConfig>,
}

/// Settings of a role of its own.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RoleConfig {
    /// Networks of policy and values.
    pub network: NetworkConfig,
    /// How observations and rewards are normalized.
    pub statistics: StatisticsConfig,
    /// The rewards, the task's own first; the others' kinds differ.
    pub rewards: Vec<RewardConfig>,
    /// What learns from the rollouts.
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
    #[serde(skip_serializing_if = "is_zero")]
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

/// Whether a setting is off. Files leave it out then.
fn is_zero(x: &f64) -> bool {
    *x == 0.0
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
        let wanted = match self.threads {
            0 => std::thread::available_parallelism().map_or(1, |n| n.get()),
            n => n,
        };
        wanted.clamp(1, self.blocks().max(1))
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
        if samples > 1 << 31 {
            return Err(Error::config("agents * horizon", samples, "at most 2^31 samples"));
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
    /// What the algorithm sees of a run on a task.
    pub(crate) fn setup<'a>(
        &'a self,
        spec: &'a Spec,
        isa: Isa,
        demonstrations: Option<&'a Demonstrations>,
    ) -> Setup<'a> {
        let action_clip = self.algorithm.clone().deviations_mut().map_or(1.0, |deviations| deviations.action_clip);
        Setup { spec, isa, common: self.common(), action_clip, demonstrations }
    }

    fn common(&self) -> Common<'_> {
        Common {
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
    /// Names the field, its value and the values that are valid.
    pub fn validate(&self) -> Result<(), Error> {
        self.run.validate()?;
        self.network.validate()?;
        self.statistics.validate()?;
        for (i, reward) in self.rewards.iter().enumerate() {
            let name = reward.kind.name();
            if self.rewards[..i].iter().any(|other| other.kind.name() == name) {
                return Err(Error::config("rewards", format!("{name} twice"), "each kind once"));
            }
            reward.validate()?;
        }
        let first = self.rewards.first().map(|reward| &reward.kind);
        if first != Some(&RewardKind::Task) {
            let found = first.map_or("nothing", RewardKind::name);
            return Err(Error::config("rewards", found, "the task's own in the first place"));
        }
        self.algorithm.validate(&self.common())?;
        self.roles.keys().try_for_each(|name| match self.of_role(name).validate() {
            Err(Error::Config { field, found, expected }) => {
                let why = format!("is {found}, expected {expected}");
                Err(Error::Settings { place: format!("roles.{name}.{field}"), why })
            }
            other => other,
        })
    }

    /// The same for a configuration in a file, under `key`.
    ///
    /// # Errors
    /// Names the file, the setting's place in it, its value and the values that are valid.
    pub fn validate_in(&self, path: &Path, key: &str) -> Result<(), Error> {
        self.validate().map_err(|error| {
            let Error::Config { field, .. } = &error else { return error };
            let document = serde_json::to_value(self).unwrap_or_default();
            let algorithm = format!("algorithm/{}", self.algorithm.name());
            let sections = ["run", "network", "statistics", &algorithm];
            let has = |section: &&&str| document.pointer(&format!("/{section}/{field}")).is_some();
            let section = sections.iter().find(has).map_or(String::new(), |s| format!(".{}", s.replace('/', ".")));
            error.in_file(path, &format!("{key}{section}"))
        })
    }
}
