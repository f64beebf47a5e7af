//! What the agents of a lane group are given from outside besides their actions.
//!
//! Commands are kept here. Ground, variations and pushes are kept by the physics, whose kernels read them.

use marathon_physics::Variation;
use marathon_physics::lanes::Real;
use marathon_physics::model::HField;

use super::group::LaneGroup;
use super::task::Task;
use crate::agent::CommandRange;
use crate::episode_rng::EpisodeId;
use crate::error::EnvError;
use crate::shard::AgentContext;

/// The commands of `T::LANES` agents.
pub(crate) struct Commands<T: Real> {
    /// What the agents have observed, and are rewarded for.
    pub present: Vec<T>,
    /// What they observe at the end of the present decision.
    pub next: Vec<T>,
    /// By lane.
    told: Vec<Told>,
}

/// Who tells an agent what.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Told {
    /// What the agent's schedule says.
    scheduled: Vec<f64>,
    /// Number of the observation for which the schedule is asked again.
    due: u64,
    /// What a caller says in its place.
    given: Option<Vec<f64>>,
}

/// The command of an agent in a snapshot.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct SavedCommand {
    present: Vec<f64>,
    told: Told,
}

impl<T: Real> Commands<T> {
    pub fn new(task: &Task<T>) -> Self {
        let n = task.spec.command.len();
        let told = Told { scheduled: idle(&task.spec.command), due: 0, given: None };
        Commands { present: vec![T::zero(); n], next: vec![T::zero(); n], told: vec![told; T::LANES] }
    }

    /// Finds out what an agent is told in its observation number `step` of an episode, 0 at the start.
    pub fn tell(&mut self, task: &Task<T>, lane: usize, id: EpisodeId, step: u64) {
        let ranges = &task.spec.command;
        if ranges.is_empty() {
            return;
        }
        let told = &mut self.told[lane];
        if step == 0 {
            (told.scheduled, told.due) = (idle(ranges), 0);
        }
        if step >= told.due {
            let holds = task.draw_command(id, step, &mut told.scheduled);
            told.due = step.saturating_add(holds.max(1) as u64);
        }
        let command = told.given.as_ref().unwrap_or(&told.scheduled);
        for (next, x) in self.next.iter_mut().zip(command) {
            next.set(lane, T::scalar(*x));
        }
    }

    /// Makes what an agent is told next its present command: an episode begins.
    pub fn begin(&mut self, lane: usize) {
        for (present, next) in self.present.iter_mut().zip(&self.next) {
            present.set(lane, next.get(lane));
        }
    }

    /// A decision has been made and its state observed.
    pub fn advance(&mut self) {
        self.present.copy_from_slice(&self.next);
    }

    pub fn save(&self, lane: usize) -> SavedCommand {
        SavedCommand {
            present: self.present.iter().map(|x| T::widen(x.get(lane))).collect(),
            told: self.told[lane].clone(),
        }
    }

    /// Restores the command of a snapshot.
    pub fn load(&mut self, lane: usize, saved: &SavedCommand) {
        self.told[lane] = saved.told.clone();
        for (present, x) in self.present.iter_mut().zip(&saved.present) {
            present.set(lane, T::scalar(*x));
        }
    }
}

/// The command before any schedule.
pub fn idle(ranges: &[CommandRange]) -> Vec<f64> {
    ranges.iter().map(CommandRange::rest).collect()
}

impl SavedCommand {
    /// Appends its bytes, none for an agent without commands.
    pub fn write_to(&self, bytes: &mut Vec<u8>) {
        if self.present.is_empty() {
            return;
        }
        let Told { scheduled, due, given } = &self.told;
        bytes.push(u8::from(given.is_some()));
        bytes.extend(due.to_le_bytes());
        let numbers = self.present.iter().chain(scheduled).chain(given.iter().flatten());
        bytes.extend(numbers.flat_map(|x| x.to_le_bytes()));
    }

    /// Reads a command of `n` numbers.
    pub fn read_from(n: usize, bytes: &mut &[u8]) -> Option<Self> {
        if n == 0 {
            return Some(SavedCommand { present: Vec::new(), told: Told::default() });
        }
        let (&[flag], rest) = bytes.split_first_chunk()?;
        let (due, rest) = rest.split_first_chunk()?;
        *bytes = rest;
        let mut numbers = || super::saved::numbers(bytes, n);
        let (present, scheduled) = (numbers()?, numbers()?);
        let given = match flag {
            0 => None,
            1 => Some(numbers()?),
            _ => return None,
        };
        Some(SavedCommand { present, told: Told { scheduled, due: u64::from_le_bytes(*due), given } })
    }
}

/// One agent's circumstances.
pub(crate) struct LaneContext<'a, T: Real> {
    pub task: &'a Task<T>,
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
        self.group.commands.told[self.lane].given = given;
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
        let Variation { mass, friction, strength, gravity } = variation;
        let model = &self.task.blueprint.model;
        check_length("mass [bodies]", mass.len(), model.bodies.len())?;
        check_length("strength [actuators]", strength.len(), model.nu)?;
        if let Some(x) = mass.iter().find(|x| !(x.is_finite() && **x > 0.0)) {
            return refuse("mass", x, "a factor above 0");
        }
        if !(friction.is_finite() && *friction >= 0.0) {
            return refuse("friction", friction, "a factor of 0 or more");
        }
        if let Some(x) = strength.iter().find(|x| !x.is_finite()) {
            return refuse("strength", x, "a finite factor");
        }
        if let Some(x) = gravity.iter().find(|x| !x.is_finite()) {
            return refuse("gravity", x, "finite numbers");
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
}
