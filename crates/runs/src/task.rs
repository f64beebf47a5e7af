//! The task of a run: registered, or created by a front end.

use crate::error::RunError;
use crate::task_config::{TaskConfig, TaskOptions};
use marathon_envs::ShardFactory;
use std::sync::Arc;

type Make<'a> = Box<dyn FnOnce(usize) -> Result<Arc<dyn ShardFactory>, RunError> + 'a>;

/// A task whose environments do not exist yet.
pub struct Task<'a> {
    task_config: TaskConfig,
    /// The name that the user gave it.
    name: Option<String>,
    /// Factory of a task that a front end creates.
    make: Option<Make<'a>>,
}

impl<'a> Task<'a> {
    /// A registered task, by any of its names.
    ///
    /// # Errors
    /// If the task does not exist. The text names the nearest.
    pub fn named(name: &str) -> Result<Self, RunError> {
        Ok(Task { name: Some(name.into()), ..Self::set(TaskConfig::named(name)?) })
    }

    /// A registered task with its options.
    pub fn set(task_config: TaskConfig) -> Self {
        Task { task_config, name: None, make: None }
    }

    /// A task of a front end. `make` gets the number of agents of the run.
    pub fn made(id: String, make: impl FnOnce(usize) -> Result<Arc<dyn ShardFactory>, RunError> + 'a) -> Self {
        Task { task_config: TaskConfig { agent: id, ..TaskConfig::default() }, name: None, make: Some(Box::new(make)) }
    }

    /// Whether a front end creates the task.
    pub fn is_made(&self) -> bool {
        self.make.is_some()
    }

    /// Its name, such as `Hopper-v0`.
    pub fn id(&self) -> &str {
        &self.task_config.agent
    }

    /// The task with more options.
    ///
    /// # Errors
    /// If the task does not take them, or a file that they name cannot be read.
    pub fn with(self, options: &TaskOptions) -> Result<Self, RunError> {
        if let Some(name) = &self.name {
            self.task_config.check_model(name, options)?;
        }
        match self.make {
            _ if options.given.is_empty() => Ok(self),
            None => Ok(Self::set(self.task_config.with(options)?)),
            Some(_) => {
                let problem = format!("is for registered tasks; set the options of {} where you create it", self.id());
                Err(RunError::option("option", problem))
            }
        }
    }

    /// Creates its environments for a run with `agents` agents, and the setting that recreates them.
    ///
    /// # Errors
    /// If they cannot be created.
    pub fn factory(self, agents: usize) -> Result<(Arc<dyn ShardFactory>, TaskConfig), RunError> {
        let Task { mut task_config, make, .. } = self;
        let factory = match make {
            Some(make) => make(agents)?,
            None => {
                let factory = task_config.factory()?;
                task_config.options = factory.spec().options.clone();
                factory
            }
        };
        Ok((factory, task_config))
    }
}
