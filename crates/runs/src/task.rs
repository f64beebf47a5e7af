//! The task of a run: one of the registry, or one that a front end has made.

use crate::error::RunError;
use marathon_envs::{ShardFactory, registry};
use marathon_physics::lanes::Isa;
use std::sync::Arc;

type Make<'a> = Box<dyn FnOnce(usize) -> Result<Arc<dyn ShardFactory>, RunError> + 'a>;

/// A task whose environments are yet to be made.
pub struct Task<'a> {
    id: String,
    make: Make<'a>,
}

impl<'a> Task<'a> {
    /// One of the registry, by any of its names.
    ///
    /// # Errors
    /// If there is none; the text names the nearest.
    pub fn named(name: &str) -> Result<Self, RunError> {
        let id = registry::agent(name)?.facts().id;
        let make = {
            let id = id.clone();
            move |_| Ok(registry::factory(&id, Isa::best())?)
        };
        Ok(Task { id, make: Box::new(make) })
    }

    /// Another one. `make` is told with how many agents the run is.
    pub fn made(id: String, make: impl FnOnce(usize) -> Result<Arc<dyn ShardFactory>, RunError> + 'a) -> Self {
        Task { id, make: Box::new(make) }
    }

    /// Its name, such as `Hopper-v0`.
    pub fn id(&self) -> &str {
        &self.id
    }

    /// Its environments, for a run with so many agents.
    ///
    /// # Errors
    /// If they cannot be made.
    pub fn factory(self, agents: usize) -> Result<Arc<dyn ShardFactory>, RunError> {
        (self.make)(agents)
    }
}
