//! Commands by name: what a character is to do.

use crate::error::CommandError;
use bevy::prelude::*;
use marathon_envs::CommandRange;
use std::sync::Arc;

/// The command of a [`Ragdoll`](crate::Ragdoll) whose agent takes commands, such as a speed and a turn. Added by the plugin when the
/// ragdoll enters the simulation.
///
/// [`ranges`](Self::ranges) has the names, limits and units, those of [`Spec::command`](marathon_envs::Spec::command). Until
/// a number is [set](Self::set), the agent follows its own schedule. The agent observes a command at the end of its next
/// decision, or at the start of its next episode.
///
/// ```
/// # use bevy_marathon::AgentCommand;
/// # use marathon_envs::CommandRange;
/// let mut command = AgentCommand::new(&[
///     CommandRange::new("speed", -1.0..=3.0, "m/s"),
///     CommandRange::new("turn", -2.0..=2.0, "rad/s"),
/// ]);
/// command.set("speed", 2.0)?;
/// assert_eq!(command.values(), Some(&[2.0, 0.0][..]));
/// let error = command.set("sped", 2.0).unwrap_err();
/// assert_eq!(error.to_string(), "no command 'sped'; did you mean 'speed'? known: speed, turn");
/// command.release();
/// assert_eq!(command.values(), None);
/// # Ok::<(), bevy_marathon::CommandError>(())
/// ```
#[derive(Component, Clone, Debug, Default, PartialEq, Reflect)]
#[reflect(Component, Default, Clone, Debug, PartialEq)]
pub struct AgentCommand {
    /// A value for each range; `None`: the agent's own schedule.
    values: Option<Vec<f64>>,
    #[reflect(ignore)]
    ranges: Arc<[CommandRange]>,
}

impl AgentCommand {
    /// The command of a task that takes these numbers, without values: the agent follows its own schedule. Spawn it with a ragdoll to
    /// command the ragdoll from its first decision on.
    pub fn new(ranges: &[CommandRange]) -> Self {
        AgentCommand { values: None, ranges: ranges.into() }
    }

    /// Sets a number by its name, in its unit. The first one that is set takes the character over from its schedule: the other
    /// numbers are then at rest, see [`CommandRange::rest`].
    ///
    /// # Errors
    /// If the task has no number of this name, or the value is not in its range. The command does not change then.
    pub fn set(&mut self, name: &str, value: f64) -> Result<(), CommandError> {
        let index = self.index(name)?;
        let range = &self.ranges[index];
        let value = range.fit(value).ok_or_else(|| CommandError::OutOfRange { range: range.clone(), value })?;
        self.put(index, value);
        Ok(())
    }

    /// Sets a number by its name to the value of its range that is nearest to this one: a larger speed than the largest is the
    /// largest. Returns the value that was set. Use it for sticks and navigation, which ask for what the character
    /// may not be able to do.
    ///
    /// # Errors
    /// If the task has no number of this name, or the value is not a number. The command does not change then.
    pub fn set_clamped(&mut self, name: &str, value: f64) -> Result<f64, CommandError> {
        let index = self.index(name)?;
        let range = &self.ranges[index];
        if value.is_nan() {
            return Err(CommandError::OutOfRange { range: range.clone(), value });
        }
        let value = value.max(range.low).min(range.high);
        self.put(index, value);
        Ok(value)
    }

    /// Place of a number in the ranges.
    fn index(&self, name: &str) -> Result<usize, CommandError> {
        self.ranges.iter().position(|range| range.name == name).ok_or_else(|| {
            let known: Vec<String> = self.ranges.iter().map(|range| range.name.clone()).collect();
            let name = name.to_string();
            if known.is_empty() { CommandError::NoCommands { name } } else { CommandError::Unknown { name, known } }
        })
    }

    fn put(&mut self, index: usize, value: f64) {
        // reflection can set any number of values
        if self.values.as_ref().is_none_or(|values| values.len() != self.ranges.len()) {
            self.rest();
        }
        self.values.iter_mut().for_each(|values| values[index] = value);
    }

    /// Sets every number to its rest: 0, or the end of the range that is nearest to 0. Most characters then stand.
    pub fn rest(&mut self) {
        self.values = Some(self.ranges.iter().map(CommandRange::rest).collect());
    }

    /// Gives the character back to its own schedule.
    pub fn release(&mut self) {
        self.values = None;
    }

    /// A number by its name. `None` if the agent follows its own schedule, or the task has no such number.
    pub fn get(&self, name: &str) -> Option<f64> {
        let index = self.ranges.iter().position(|range| range.name == name)?;
        self.values.as_ref()?.get(index).copied()
    }

    /// The numbers in the order of [`ranges`](Self::ranges). `None` if the agent follows its own schedule.
    pub fn values(&self) -> Option<&[f64]> {
        self.values.as_deref()
    }

    /// Names, limits and units of the numbers.
    pub fn ranges(&self) -> &[CommandRange] {
        &self.ranges
    }

    /// The same, to keep while the numbers are set.
    pub(crate) fn shared_ranges(&self) -> Arc<[CommandRange]> {
        self.ranges.clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn command() -> AgentCommand {
        AgentCommand::new(&[CommandRange::new("speed", -1.0..=3.0, "m/s"), CommandRange::new("height", 0.5..=1.0, "m")])
    }

    #[test]
    fn the_first_number_that_is_set_puts_the_others_at_rest() -> Result<(), CommandError> {
        let mut command = command();
        assert_eq!((command.values(), command.get("speed")), (None, None));
        command.set("speed", 2.0)?;
        assert_eq!((command.values(), command.get("height")), (Some(&[2.0, 0.5][..]), Some(0.5)));
        command.set("height", 0.75)?;
        assert_eq!(command.values(), Some(&[2.0, 0.75][..]));
        command.rest();
        assert_eq!(command.values(), Some(&[0.0, 0.5][..]));
        command.release();
        assert_eq!(command.values(), None);
        Ok(())
    }

    #[test]
    fn errors_name_what_there_is_and_change_nothing() {
        let mut command = command();
        for (name, value, expected) in [
            ("sped", 1.0, "no command 'sped'; did you mean 'speed'? known: speed, height"),
            ("speed", 4.0, "command 'speed' is 4, expected -1 to 3 m/s"),
            ("height", f64::NAN, "command 'height' is NaN, expected 0.5 to 1 m"),
        ] {
            assert_eq!(command.set(name, value).map_err(|error| error.to_string()), Err(expected.into()));
        }
        assert_eq!(command.values(), None);
        let none = AgentCommand::default().set("speed", 1.0);
        assert!(none.is_err_and(|error| error.to_string().contains("takes no commands")));
    }

    #[test]
    fn a_clamped_number_is_the_nearest_of_its_range() -> Result<(), CommandError> {
        let mut command = command();
        for (value, expected) in [(4.0, 3.0), (-2.0, -1.0), (f64::INFINITY, 3.0), (0.5, 0.5)] {
            assert_eq!(command.set_clamped("speed", value)?, expected);
            assert_eq!(command.values(), Some(&[expected, 0.5][..]));
        }
        for (name, value, expected) in [
            ("sped", 1.0, "no command 'sped'; did you mean 'speed'? known: speed, height"),
            ("speed", f64::NAN, "command 'speed' is NaN, expected -1 to 3 m/s"),
        ] {
            assert_eq!(command.set_clamped(name, value).map_err(|error| error.to_string()), Err(expected.into()));
        }
        assert_eq!(command.get("speed"), Some(0.5));
        Ok(())
    }

    #[test]
    fn values_of_a_wrong_length_are_replaced() -> Result<(), CommandError> {
        let mut command = AgentCommand { values: Some(vec![1.0; 7]), ..command() };
        command.set("height", 1.0)?;
        assert_eq!(command.values(), Some(&[0.0, 1.0][..]));
        Ok(())
    }
}
