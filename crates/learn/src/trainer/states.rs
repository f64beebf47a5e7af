//! States of agents in files.

use crate::error::Error;
use crate::files::{TensorReader, TensorWriter};
use crate::rollout::states::{AgentStates, SeatStates};

/// Names of the lists of all agents, and of each role's.
const OF_AGENTS: [&str; 3] = ["action", "env", "env_ends"];
const OF_SEATS: [&str; 4] = ["noise", "obs", "tallies", "decides"];

/// Prefix of the names of a role's lists. The first role has none, so that the file of a task with one role names no
/// role.
pub fn prefix(number: usize, role: &str) -> String {
    if number == 0 { String::new() } else { format!("{role}/") }
}

/// Whether a list, without its role's prefix, belongs to the states.
pub fn has(name: &str) -> bool {
    OF_AGENTS.contains(&name) || OF_SEATS.contains(&name)
}

/// Adds states to a file; the roles have those prefixes.
pub fn write(states: &AgentStates, prefixes: &[String], file: &mut TensorWriter) {
    for (seat, prefix) in states.seats.iter().zip(prefixes) {
        let name = |i: usize| format!("{prefix}{}", OF_SEATS[i]);
        file.list(&name(0), &seat.noise);
        file.list(&name(1), &seat.obs);
        file.list(&name(2), &seat.tallies);
        if !seat.decides.is_empty() {
            file.list(&name(3), &seat.decides);
        }
    }
    if !states.action.is_empty() {
        file.list(OF_AGENTS[0], &states.action);
    }
    file.list(OF_AGENTS[1], &states.env);
    file.list(OF_AGENTS[2], &states.env_ends);
}

/// The inverse of [`write()`].
pub fn read(file: &TensorReader<'_>, prefixes: &[String]) -> Result<AgentStates, Error> {
    let several = prefixes.len() > 1;
    let seat = |prefix: &String| {
        let name = |i: usize| format!("{prefix}{}", OF_SEATS[i]);
        Ok(SeatStates {
            noise: file.list(&name(0))?,
            obs: file.list(&name(1))?,
            tallies: file.list(&name(2))?,
            decides: if several { file.list(&name(3))? } else { Vec::new() },
        })
    };
    Ok(AgentStates {
        seats: prefixes.iter().map(seat).collect::<Result<_, Error>>()?,
        action: if several { file.list(OF_AGENTS[0])? } else { Vec::new() },
        env: file.list(OF_AGENTS[1])?,
        env_ends: file.list(OF_AGENTS[2])?,
    })
}
