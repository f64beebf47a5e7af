//! Inputs of the agents of a lane group other than actions.
//!
//! The group stores commands. The physics stores ground, variations and pushes, because its kernels read them.

use marathon_physics::lanes::Real;
use marathon_physics::model::HField;
use marathon_physics::{Obstacle, Variation};

use super::group::LaneGroup;
use super::task::TaskData;
use crate::agent::CommandRange;
use crate::error::EnvError;
use crate::shard::AgentContext;

/// Access to the inputs of one agent.
pub(crate) struct LaneContext<'a, T: Real> {
    pub task: &'a TaskData<T>,
    pub group: &'a mut LaneGroup<T>,
    pub lane: usize,
}

impl<T: Real> LaneContext<'_, T> {
    /// A height field of the model.
    fn grid(&self, field: usize) -> Result<&HField, EnvError> {
        let fields = &self.task.blueprint.model.hfields;
        let none = || refuse("field", field, "less than the number of the model's height fields");
        fields.get(field).map_or_else(none, Ok)
    }
}

fn refuse<X>(option: &'static str, found: impl ToString, expected: &'static str) -> Result<X, EnvError> {
    Err(EnvError::Option { option, found: found.to_string(), expected })
}

fn check_length(what: &str, found: usize, expected: usize) -> Result<(), EnvError> {
    if found == expected { Ok(()) } else { Err(EnvError::Shape { what: what.into(), found, expected }) }
}

impl<T: Real> AgentContext for LaneContext<'_, T> {
    fn command(&self) -> Vec<f64> {
        self.group.commands.present.iter().map(|x| T::widen(x.get(self.lane))).collect()
    }

    fn set_command(&mut self, command: Option<&[f64]>) -> Result<(), EnvError> {
        let spec = &self.task.spec;
        let fit = |(x, range): (&f64, &CommandRange)| {
            range.fit(*x).ok_or_else(|| {
                let CommandRange { name, low, high, unit } = range.clone();
                EnvError::Command { id: spec.id.clone(), name, found: *x, low, high, unit }
            })
        };
        let given = match command {
            Some(command) => {
                check_length("command", command.len(), spec.command.len())?;
                Some(command.iter().zip(&spec.command).map(fit).collect::<Result<_, _>>()?)
            }
            None => None,
        };
        self.group.commands.set(self.lane, given);
        Ok(())
    }

    fn push(&mut self, body: usize, force: [f64; 3], torque: [f64; 3]) -> Result<(), EnvError> {
        if body >= self.task.blueprint.model.bodies.len() {
            return refuse("body", body, "less than the number of the model's bodies");
        }
        if let Some(x) = force.iter().chain(&torque).find(|x| !x.is_finite()) {
            return refuse("push", x, "finite numbers");
        }
        self.group.physics.push(&self.task.sim, self.lane, body, force, torque);
        Ok(())
    }

    fn vary(&mut self, variation: &Variation) -> Result<(), EnvError> {
        let model = &self.task.blueprint.model;
        check_length("mass [bodies]", variation.mass.len(), model.bodies.len())?;
        check_length("strength [actuators]", variation.strength.len(), model.nu)?;
        if let Some((name, found, expected)) = variation.out_of_range() {
            return refuse(name, found, expected);
        }
        self.group.physics.vary(&self.task.sim, self.lane, variation);
        Ok(())
    }

    fn ground(&self, field: usize) -> Result<Vec<f32>, EnvError> {
        self.grid(field)?;
        Ok(self.group.physics.elevations(&self.task.sim, self.lane, field))
    }

    fn set_ground(&mut self, field: usize, elevations: &[f32]) -> Result<(), EnvError> {
        let grid = self.grid(field)?;
        check_length("elevations [nrow][ncol]", elevations.len(), grid.nrow * grid.ncol)?;
        if let Some(x) = elevations.iter().find(|x| !x.is_finite()) {
            return refuse("elevations", x, "finite numbers");
        }
        self.group.physics.set_ground(&self.task.sim, self.lane, field, elevations);
        Ok(())
    }

    fn obstacles(&self) -> Vec<Obstacle> {
        self.group.physics.obstacles(self.lane)
    }

    fn set_obstacles(&mut self, obstacles: &[Obstacle]) -> Result<(), EnvError> {
        if self.task.blueprint.model.obstacles.is_none() && !obstacles.is_empty() {
            return refuse("obstacles", obstacles.len(), "none: the model has no geom for obstacles");
        }
        if obstacles.len() > Obstacle::MOST {
            return refuse("obstacles", obstacles.len(), "no more than 256");
        }
        if let Some((name, found, expected)) = obstacles.iter().find_map(Obstacle::out_of_range) {
            return refuse(name, found, expected);
        }
        self.group.physics.set_obstacles(&self.task.sim, self.lane, obstacles);
        Ok(())
    }
}
