//! Agents by name.
//!
//! The global registry starts with the crate's own agents, and [`register`] adds others. Create a [`Registry`] to avoid
//! global state.

use std::path::Path;
use std::sync::{Arc, LazyLock, PoisonError, RwLock};

use marathon_physics::hint::{nearest, similar};
use marathon_physics::lanes::Isa;

use crate::agent::Options;
use crate::agents::{self, robot};
use crate::any_agent::AnyAgent;
use crate::error::EnvError;
use crate::shard::{AgentShards, ShardFactory};

/// Number of similar names in an error.
const SIMILAR: usize = 5;
/// Number of characters that similar names have in common.
const ALIKE: usize = 3;

/// The arguments that the path of an MJCF file stands for. `None` for other names.
pub fn robot_options(name: &str) -> Option<Options> {
    let is_file = Path::new(name).extension().is_some_and(|ending| ending.eq_ignore_ascii_case("xml"));
    is_file.then(|| Options::new().with(robot::MODEL, name))
}

/// The error of a name that is the path of something else than a model.
fn not_a_model(name: &str) -> Option<EnvError> {
    let path = Path::new(name);
    let ending = path.extension().unwrap_or_default();
    let found = match (path.is_dir(), path.exists()) {
        (true, _) => "a folder",
        (_, true) => "a file",
        _ if ["urdf", "mjcf"].iter().any(|known| ending.eq_ignore_ascii_case(known)) => "a file that does not exist",
        _ => return None,
    };
    let hint = if ending.eq_ignore_ascii_case("urdf") { "; MuJoCo converts URDF" } else { "" };
    Some(EnvError::NotAModel { path: name.into(), found, hint })
}

/// Whether a name may mean another one: they begin alike, or one is a part of the other.
fn is_like(name: &str, id: &str) -> bool {
    let [name, id] = [name, id].map(str::to_lowercase);
    let common = name.chars().zip(id.chars()).take_while(|(a, b)| a == b).count();
    common >= ALIKE || (name.chars().count() >= ALIKE && id.contains(&name))
}

/// Agents by name.
#[derive(Clone)]
pub struct Registry {
    agents: Vec<(String, Arc<dyn AnyAgent>)>,
    aliases: Vec<(String, String)>,
}

impl Default for Registry {
    /// The agents of [`agents::all`].
    fn default() -> Self {
        let mut registry = Registry::empty();
        for agent in agents::all() {
            registry.agents.push((agent.id(), agent));
        }
        for (alias, id) in agents::aliases() {
            registry.aliases.push((alias.into(), id.into()));
        }
        registry
    }
}

impl Registry {
    /// A registry without agents.
    pub fn empty() -> Self {
        Registry { agents: Vec::new(), aliases: Vec::new() }
    }

    /// All names, in the order of registration.
    pub fn ids(&self) -> Vec<String> {
        self.agents.iter().map(|(id, _)| id.clone()).collect()
    }

    /// Adds an agent under the id of its facts.
    ///
    /// # Errors
    /// If the id is taken, or the agent does not fit its model.
    pub fn register(&mut self, agent: Arc<dyn AnyAgent>) -> Result<(), EnvError> {
        let id = agent.id();
        if self.find(&id).is_some() {
            let base = id.rsplit_once("-v").map_or(id.as_str(), |(base, _)| base);
            let free = (0..).map(|v| format!("{base}-v{v}")).find(|name| self.find(name).is_none());
            return Err(EnvError::DuplicateAgent { suggestion: free.unwrap_or_default(), id });
        }
        // reject an agent that contradicts its model now, not at its first use
        agent.clone().shards(Isa::best())?;
        self.agents.push((id, agent));
        Ok(())
    }

    /// The agent with a name: an id, an alias, or an id without version (which selects the lowest version). Case does
    /// not matter. The path of an MJCF file, `robot.xml`, is a name of the [robot] in it.
    ///
    /// # Errors
    /// If there is none. The message contains the closest name.
    pub fn agent(&self, name: &str) -> Result<Arc<dyn AnyAgent>, EnvError> {
        if let (Some(robot), Some(options)) = (self.find(robot::rig::ID), robot_options(name)) {
            return robot.clone().with_options(&options);
        }
        self.find(name).cloned().ok_or_else(|| {
            let ids: Vec<_> = self.agents.iter().map(|(id, _)| id.as_str()).collect();
            let bases: Vec<_> = ids.iter().map(|id| id.rsplit_once("-v").map_or(*id, |(base, _)| base)).collect();
            let near = nearest(name, ids.iter().copied()).or_else(|| {
                let base = nearest(name, bases.iter().copied())?;
                bases.iter().position(|b| *b == base).map(|i| ids[i])
            });
            if near.is_none()
                && let Some(error) = not_a_model(name)
            {
                return error;
            }
            let like = near.is_some() || ids.iter().any(|id| is_like(name, id));
            let similar = if like { similar(name, ids.iter().copied(), SIMILAR).join(", ") } else { String::new() };
            EnvError::UnknownAgent { name: name.into(), nearest: near.map(Into::into), similar, count: ids.len() }
        })
    }

    /// The agent with a name, with other values of some arguments.
    ///
    /// # Errors
    /// If there is no such agent or argument, or a value is invalid. The message contains the closest name.
    pub fn agent_with(&self, name: &str, options: &Options) -> Result<Arc<dyn AnyAgent>, EnvError> {
        self.agent(name)?.with_options(options)
    }

    /// The blocks of an agent for an instruction set.
    ///
    /// # Errors
    /// If there is no such agent, or it cannot be simulated.
    pub fn shards(&self, name: &str, isa: Isa) -> Result<Arc<dyn AgentShards>, EnvError> {
        self.agent(name)?.shards(isa)
    }

    /// The same with other values of some arguments.
    ///
    /// # Errors
    /// As [`Registry::agent_with`] and [`Registry::shards`].
    pub fn shards_with(&self, name: &str, options: &Options, isa: Isa) -> Result<Arc<dyn AgentShards>, EnvError> {
        self.agent_with(name, options)?.shards(isa)
    }

    fn find(&self, name: &str) -> Option<&Arc<dyn AnyAgent>> {
        let by_id =
            |name: &str| self.agents.iter().find(|(id, _)| id.eq_ignore_ascii_case(name)).map(|(_, agent)| agent);
        let by_alias = || {
            let (_, id) = self.aliases.iter().find(|(alias, _)| alias.eq_ignore_ascii_case(name))?;
            by_id(id)
        };
        let by_base = || {
            let versions = self.agents.iter().filter_map(|(id, agent)| {
                let (base, version) = id.rsplit_once("-v")?;
                base.eq_ignore_ascii_case(name).then_some((version.parse::<u32>().ok()?, agent))
            });
            versions.min_by_key(|(version, _)| *version).map(|(_, agent)| agent)
        };
        by_id(name).or_else(by_alias).or_else(by_base)
    }
}

static GLOBAL: LazyLock<RwLock<Registry>> = LazyLock::new(|| RwLock::new(Registry::default()));

/// A copy of the global registry (agents are shared, not copied).
pub fn global() -> Registry {
    GLOBAL.read().unwrap_or_else(PoisonError::into_inner).clone()
}

/// Adds an agent to the global registry.
///
/// # Errors
/// As [`Registry::register`].
pub fn register(agent: Arc<dyn AnyAgent>) -> Result<(), EnvError> {
    GLOBAL.write().unwrap_or_else(PoisonError::into_inner).register(agent)
}

/// All names in the global registry.
pub fn ids() -> Vec<String> {
    global().ids()
}

/// The agent with a name in the global registry.
///
/// # Errors
/// As [`Registry::agent`].
pub fn agent(name: &str) -> Result<Arc<dyn AnyAgent>, EnvError> {
    global().agent(name)
}

/// The blocks of an agent in the global registry, for a learner.
///
/// # Errors
/// As [`Registry::shards`].
pub fn factory(name: &str, isa: Isa) -> Result<Arc<dyn ShardFactory>, EnvError> {
    Ok(global().shards(name, isa)?)
}

/// The same with other values of some arguments.
///
/// # Errors
/// As [`Registry::shards_with`].
pub fn factory_with(name: &str, options: &Options, isa: Isa) -> Result<Arc<dyn ShardFactory>, EnvError> {
    Ok(global().shards_with(name, options, isa)?)
}

/// The same with another number of physics steps per decision. Episodes keep their duration in seconds.
///
/// # Errors
/// As [`Registry::shards`].
pub fn factory_every(name: &str, frame_skip: usize, isa: Isa) -> Result<Arc<dyn ShardFactory>, EnvError> {
    Ok(agent(name)?.shards_every(frame_skip, isa)?)
}
