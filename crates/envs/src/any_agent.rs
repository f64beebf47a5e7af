//! Agents as trait objects, as the registry stores them.
//!
//! [`AnyAgent`] is the object-safe interface of an agent. A blanket implementation covers every [`Agent`], so the
//! [`Registry`](crate::Registry) can hold agents of any crate.

use std::sync::Arc;

use marathon_physics::Model;
use marathon_physics::hint::nearest;
use marathon_physics::lanes::Isa;

use crate::agent::bindings::Blueprint;
use crate::agent::options::Value;
use crate::agent::{Agent, Clips, Facts, ModelSource, OptionInfo, Options};
use crate::error::EnvError;
use crate::lanes::AgentFactory;
use crate::shard::AgentShards;

/// An [`Agent`] as a trait object. It is implemented for every agent; do not implement it by hand.
pub trait AnyAgent: Send + Sync {
    /// Registry name, as in the facts.
    fn id(&self) -> String {
        self.facts().id
    }
    /// Constant facts.
    fn facts(&self) -> Facts;
    /// The compiled model.
    ///
    /// # Errors
    /// If the model is not valid MJCF.
    fn model(&self) -> Result<Model, EnvError>;
    /// The named arguments with their values.
    fn options(&self) -> Vec<OptionInfo>;
    /// Facts that the agent has derived from its model, as lines of a table, for agents that take any model.
    fn findings(&self) -> Option<String> {
        None
    }
    /// Whether there is an argument with this name.
    fn has_option(&self, name: &str) -> bool {
        self.options().iter().any(|known| known.name == name)
    }
    /// Whether there is an argument with this name that takes motion clips.
    fn takes_clips(&self, name: &str) -> bool {
        self.options().iter().any(|known| known.name == name && known.takes(&Value::Clips(Clips::default())))
    }
    /// The agent with other values of some arguments.
    ///
    /// # Errors
    /// If it has no such argument, or the value is invalid.
    fn with_options(self: Arc<Self>, options: &Options) -> Result<Arc<dyn AnyAgent>, EnvError>;
    /// Checks the agent against its model and prepares it for stepping with an instruction set.
    ///
    /// # Errors
    /// If names or lengths of the facts do not match the model, the model cannot be simulated, or the processor lacks
    /// the instruction set.
    fn shards(self: Arc<Self>, isa: Isa) -> Result<Arc<dyn AgentShards>, EnvError> {
        let facts = self.facts();
        self.shards_as(facts, isa)
    }
    /// The same with another number of physics steps per decision. Episodes keep their duration in seconds.
    ///
    /// # Errors
    /// As [`AnyAgent::shards`].
    fn shards_every(self: Arc<Self>, frame_skip: usize, isa: Isa) -> Result<Arc<dyn AgentShards>, EnvError> {
        let mut facts = self.facts();
        if frame_skip != facts.frame_skip {
            facts.max_episode_steps = (facts.max_episode_steps * facts.frame_skip).div_ceil(frame_skip.max(1));
            facts.frame_skip = frame_skip;
        }
        self.shards_as(facts, isa)
    }
    /// The same with other facts, such as another model; see [`WithModel`].
    ///
    /// # Errors
    /// As [`AnyAgent::shards`].
    fn shards_as(self: Arc<Self>, facts: Facts, isa: Isa) -> Result<Arc<dyn AgentShards>, EnvError>;
}

/// An agent with another model: the same body and task on other ground.
pub struct WithModel {
    agent: Arc<dyn AnyAgent>,
    model: ModelSource,
}

impl WithModel {
    /// Replaces an agent's model.
    pub fn new(agent: Arc<dyn AnyAgent>, model: ModelSource) -> Self {
        WithModel { agent, model }
    }
}

impl AnyAgent for WithModel {
    fn facts(&self) -> Facts {
        Facts { model: self.model.clone(), ..self.agent.facts() }
    }

    fn model(&self) -> Result<Model, EnvError> {
        Blueprint::model(&self.facts())
    }

    fn options(&self) -> Vec<OptionInfo> {
        self.agent.options()
    }

    fn with_options(self: Arc<Self>, options: &Options) -> Result<Arc<dyn AnyAgent>, EnvError> {
        let agent = self.agent.clone().with_options(options)?;
        Ok(Arc::new(WithModel { agent, model: self.model.clone() }))
    }

    fn findings(&self) -> Option<String> {
        self.agent.findings()
    }

    fn shards_as(self: Arc<Self>, facts: Facts, isa: Isa) -> Result<Arc<dyn AgentShards>, EnvError> {
        self.agent.clone().shards_as(facts, isa)
    }
}

impl<A: Agent> AnyAgent for A {
    fn facts(&self) -> Facts {
        Agent::facts(self)
    }

    fn model(&self) -> Result<Model, EnvError> {
        let facts = Agent::facts(self);
        Blueprint::model(&facts)
    }

    fn options(&self) -> Vec<OptionInfo> {
        Agent::options(self)
    }

    fn with_options(self: Arc<Self>, options: &Options) -> Result<Arc<dyn AnyAgent>, EnvError> {
        if options.is_empty() {
            return Ok(self);
        }
        check(&Agent::facts(&*self).id, &Agent::options(&*self), options)?;
        Ok(match Agent::with_options(&*self, options) {
            Some(agent) => Arc::new(agent),
            None => self,
        })
    }

    fn shards_as(self: Arc<Self>, facts: Facts, isa: Isa) -> Result<Arc<dyn AgentShards>, EnvError> {
        if let Some(obstacle) = obstacle(isa) {
            return Err(EnvError::Isa { isa: isa.name(), obstacle, best: Isa::best().name() });
        }
        let options = Agent::options(&*self).into_iter().map(|o| (o.name.to_string(), o.value)).collect();
        #[cfg(all(feature = "double", not(test)))]
        if isa == Isa::F64 {
            return Ok(Arc::new(AgentFactory::<f64>::new(facts, options, self)?));
        }
        // unit tests make no environments, and compile in a quarter of the time without these kernels
        #[cfg(test)]
        return Ok(Arc::new(AgentFactory::<f32>::new(facts, options, self)?));
        #[cfg(not(test))]
        marathon_physics::with_single_lanes!(isa, T => Ok(Arc::new(AgentFactory::<T>::new(facts, options, self)?)))
    }
}

/// Whether an agent with these arguments takes the options.
pub(crate) fn check(id: &str, known: &[OptionInfo], options: &Options) -> Result<(), EnvError> {
    for (name, value) in options.iter() {
        let id = id.to_string();
        let Some(info) = known.iter().find(|info| info.name == name) else {
            let names = || known.iter().map(|info| info.name);
            let nearest = nearest(name, names()).map(Into::into);
            let known = names().collect::<Vec<_>>().join(", ");
            return Err(EnvError::UnknownOption { id, name: name.into(), nearest, known });
        };
        if !info.takes(value) {
            let (option, found) = (name.to_string(), value.to_string());
            return Err(EnvError::OptionValue { id, option, found, expected: info.expected });
        }
    }
    Ok(())
}

/// The reason why tasks cannot run in these lanes; `None` if they can. Double precision needs the feature `double`: it adds a sixth to
/// the time that a program takes to compile, and only comparisons with other engines use it.
pub fn obstacle(isa: Isa) -> Option<&'static str> {
    match isa {
        Isa::F64 if !cfg!(feature = "double") => Some("this program was built without the feature `double`"),
        isa => isa.obstacle(),
    }
}
