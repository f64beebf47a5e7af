//! The task of a run: one of the registry, or one that a front end has made.

use crate::error::RunError;
use crate::setting::{Setting, TaskOptions};
use marathon_envs::ShardFactory;
use std::sync::Arc;

type Make<'a> = Box<dyn FnOnce(usize) -> Result<Arc<dyn ShardFactory>, RunError> + 'a>;

/// A task whose environments are yet to be made.
pub struct Task<'a> {
    setting: Setting,
    /// Of a task that a front end makes.
    make: Option<Make<'a>>,
}

impl<'a> Task<'a> {
    /// One of the registry, by any of its names.
    ///
    /// # Errors
    /// If there is none; the text names the nearest.
    pub fn named(name: &str) -> Result<Self, RunError> {
        Ok(Self::set(Setting::named(name)?))
    }

    /// One of the registry with its arguments.
    pub fn set(setting: Setting) -> Self {
        Task { setting, make: None }
    }

    /// Another one. `make` is told with how many agents the run is.
    pub fn made(id: String, make: impl FnOnce(usize) -> Result<Arc<dyn ShardFactory>, RunError> + 'a) -> Self {
        Task { setting: Setting { agent: id, ..Setting::default() }, make: Some(Box::new(make)) }
    }

    /// Whether a front end creates the task.
    pub fn is_made(&self) -> bool {
        self.make.is_some()
    }

    /// Its name, such as `Hopper-v0`.
    pub fn id(&self) -> &str {
        &self.setting.agent
    }

    /// The task with more arguments.
    ///
    /// # Errors
    /// If it does not take them, or a file that they name cannot be read.
    pub fn with(self, options: &TaskOptions) -> Result<Self, RunError> {
        match self.make {
            _ if options.given.is_empty() => Ok(self),
            None => Ok(Self::set(self.setting.with(options)?)),
            Some(_) => {
                let problem = format!("is for tasks of the registry; {} takes its arguments itself", self.id());
                Err(RunError::option("option", problem))
            }
        }
    }

    /// Its environments, for a run with so many agents, and all that makes them again.
    ///
    /// # Errors
    /// If they cannot be made.
    pub fn factory(self, agents: usize) -> Result<(Arc<dyn ShardFactory>, Setting), RunError> {
        let Task { mut setting, make } = self;
        let factory = match make {
            Some(make) => make(agents)?,
            None => {
                let factory = setting.factory()?;
                setting.options = factory.spec().options.clone();
                factory
            }
        };
        Ok((factory, setting))
    }
}
