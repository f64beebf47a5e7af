//! The commands of the agents of a lane group, from their schedules or from a caller.

use marathon_physics::lanes::Real;

use crate::agent::CommandRange;

/// The commands of `T::LANES` agents.
pub(crate) struct Commands<T: Real> {
    /// Commands that the agents have observed, and that the reward uses.
    pub present: Vec<T>,
    /// Commands that they observe at the end of the present decision.
    pub next: Vec<T>,
    /// Sources of the commands, by lane.
    told: Vec<CommandState>,
}

/// Sources of an agent's command.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct CommandState {
    /// The command of the agent's schedule.
    scheduled: Vec<f64>,
    /// Number of the observation for which the schedule draws the next command.
    due: u64,
    /// A caller's command. It overrides the schedule.
    given: Option<Vec<f64>>,
}

/// The command of an agent in a snapshot.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct SavedCommand {
    present: Vec<f64>,
    told: CommandState,
}

impl<T: Real> Commands<T> {
    /// Commands at rest in these ranges.
    pub fn new(ranges: &[CommandRange]) -> Self {
        let n = ranges.len();
        let told = CommandState { scheduled: idle(ranges), due: 0, given: None };
        Commands { present: vec![T::zero(); n], next: vec![T::zero(); n], told: vec![told; T::LANES] }
    }

    /// Updates an agent's next command for observation `step` of an episode, 0 at the start. `draw` draws from the
    /// agent's schedule and returns for how many decisions the command holds.
    pub fn tell(&mut self, ranges: &[CommandRange], lane: usize, step: u64, draw: impl FnOnce(&mut [f64]) -> usize) {
        if ranges.is_empty() {
            return;
        }
        let told = &mut self.told[lane];
        if step == 0 {
            (told.scheduled, told.due) = (idle(ranges), 0);
        }
        if step >= told.due {
            let holds = draw(&mut told.scheduled);
            told.due = step.saturating_add(holds.max(1) as u64);
        }
        let command = told.given.as_ref().unwrap_or(&told.scheduled);
        for (next, x) in self.next.iter_mut().zip(command) {
            next.set(lane, T::scalar(*x));
        }
    }

    /// Makes an agent's next command the present one, at the start of an episode.
    pub fn begin(&mut self, lane: usize) {
        for (present, next) in self.present.iter_mut().zip(&self.next) {
            present.set(lane, next.get(lane));
        }
    }

    /// Makes the next commands the present ones, after a decision and its observation.
    pub fn advance(&mut self) {
        self.present.copy_from_slice(&self.next);
    }

    /// Sets a caller's command for an agent. `None` returns to the schedule.
    pub fn set(&mut self, lane: usize, given: Option<Vec<f64>>) {
        self.told[lane].given = given;
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

/// The command before any is set.
pub fn idle(ranges: &[CommandRange]) -> Vec<f64> {
    ranges.iter().map(CommandRange::rest).collect()
}

impl SavedCommand {
    /// Appends the command's bytes. There are none for an agent without commands.
    pub fn write_to(&self, bytes: &mut Vec<u8>) {
        if self.present.is_empty() {
            return;
        }
        let CommandState { scheduled, due, given } = &self.told;
        bytes.push(u8::from(given.is_some()));
        bytes.extend(due.to_le_bytes());
        let numbers = self.present.iter().chain(scheduled).chain(given.iter().flatten());
        bytes.extend(numbers.flat_map(|x| x.to_le_bytes()));
    }

    /// Reads a command of `n` numbers.
    pub fn read_from(n: usize, bytes: &mut &[u8]) -> Option<Self> {
        if n == 0 {
            return Some(SavedCommand { present: Vec::new(), told: CommandState::default() });
        }
        let (&[flag], rest) = bytes.split_first_chunk()?;
        let (due, rest) = rest.split_first_chunk()?;
        *bytes = rest;
        let mut next = || numbers(bytes, n);
        let (present, scheduled) = (next()?, next()?);
        let given = match flag {
            0 => None,
            1 => Some(next()?),
            _ => return None,
        };
        Some(SavedCommand { present, told: CommandState { scheduled, due: u64::from_le_bytes(*due), given } })
    }
}

/// Reads `count` numbers.
pub(crate) fn numbers(bytes: &mut &[u8], count: usize) -> Option<Vec<f64>> {
    let (mine, rest) = bytes.split_at_checked(count * 8)?;
    *bytes = rest;
    Some(mine.as_chunks::<8>().0.iter().map(|word| f64::from_le_bytes(*word)).collect())
}
