//! The commands of the agents of a lane group: from their schedules, or from a caller.

use marathon_physics::lanes::Real;

use crate::agent::CommandRange;

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
    /// At rest, for commands of these ranges.
    pub fn new(ranges: &[CommandRange]) -> Self {
        let n = ranges.len();
        let told = Told { scheduled: idle(ranges), due: 0, given: None };
        Commands { present: vec![T::zero(); n], next: vec![T::zero(); n], told: vec![told; T::LANES] }
    }

    /// Finds the command of an agent for its observation number `step` of an episode, 0 at the start. `draw` asks the
    /// agent's schedule, and returns for how many decisions the command holds.
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

    /// Sets the command of an agent in place of its schedule's; `None` returns to the schedule.
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
        let mut next = || numbers(bytes, n);
        let (present, scheduled) = (next()?, next()?);
        let given = match flag {
            0 => None,
            1 => Some(next()?),
            _ => return None,
        };
        Some(SavedCommand { present, told: Told { scheduled, due: u64::from_le_bytes(*due), given } })
    }
}

/// The next numbers.
pub(crate) fn numbers(bytes: &mut &[u8], count: usize) -> Option<Vec<f64>> {
    let (mine, rest) = bytes.split_at_checked(count * 8)?;
    *bytes = rest;
    Some(mine.as_chunks::<8>().0.iter().map(|word| f64::from_le_bytes(*word)).collect())
}
