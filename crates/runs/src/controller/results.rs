//! Results of a measurement of commands.

use super::{Player, Response};
use serde::Serialize;

/// How well a policy tracks commands.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CommandTracking {
    /// The task.
    pub task: String,
    /// Agents of each trial.
    pub agents: u64,
    /// Seconds between decisions.
    pub dt: f64,
    /// A minute of random commands for each agent.
    pub minutes: Minutes,
    /// Players whose commands are hard to follow.
    pub players: Vec<Player>,
    /// Responses to speed steps.
    pub responses: Vec<Response>,
    /// The sharpest turns at each speed. Empty for planar characters.
    pub turns: Vec<Turn>,
    /// Standing on command.
    pub stand: Stand,
    /// Jumps from a stand, and at half and at full speed. Empty for tasks without such a button.
    pub jumps: Vec<Jump>,
    /// A backflip from a stand. `None` for tasks without such a button.
    pub backflip: Option<Flip>,
    /// Pushes at half of the highest speed.
    pub pushes: Vec<Push>,
    /// Getting up after a push. `None` for tasks in which a fall ends the episode.
    pub rise: Option<Rise>,
}

/// Minutes of commands by the task's own schedule.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Minutes {
    /// Minutes without a fall.
    pub without_fall: u64,
    /// Falls within 2 s of the start, including those that no policy can avoid.
    pub early_falls: u64,
    /// Falls per minute of simulated time.
    pub falls_per_minute: f64,
    /// Mean distance between actual and commanded velocity, m/s: the task's metric `velocity_error`, or else the error
    /// of the forward speed.
    pub velocity_error: f64,
    /// The same error from 1.5 s after a change of command on.
    pub settled_error: f64,
    /// Mean distance that a part of a sole slides per ground contact, m.
    pub slide: f64,
}

/// A turn that is held for seconds.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Turn {
    /// Commanded speed, m/s.
    pub speed: f64,
    /// Commanded turn to either side, rad/s.
    pub turn: f64,
    /// Mean speed from 1.5 s on, m/s.
    pub reached_speed: f64,
    /// Mean turn from 1.5 s on, rad/s; positive to the commanded side.
    pub reached_turn: f64,
    /// Agents that turned.
    pub agents: u64,
    /// Number of agents that fell.
    pub falls: u64,
}

/// Ten seconds of standing.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Stand {
    /// Agents that stayed within 0.1 m and whose parts moved by less than 0.05 m/s in the mean.
    pub still: u64,
    /// Number of agents that fell, including while stopping.
    pub falls: u64,
    /// Median of the largest distance of the center of mass from its start, m. `None` if all fell.
    pub drift: Option<f64>,
    /// Median of the mean speed of the bodies, m/s.
    pub speed: Option<f64>,
}

/// A button that is held for a second, then released.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Jump {
    /// Commanded speed, m/s.
    pub speed: f64,
    /// Agents that had not fallen before.
    pub agents: u64,
    /// Number of agents that were off the ground within 0.35 s.
    pub prompt: u64,
    /// Number of agents whose center of mass then also rose within 0.35 s as fast as such a time in the air requires.
    /// Drawing up the legs leaves the ground, too, but then the character falls.
    pub thrown: u64,
    /// Number of agents that fell within 4 s.
    pub falls: u64,
    /// Median time until no foot has touched the ground for 0.1 s, s. `None` if fewer than half of the agents jumped.
    pub latency: Option<f64>,
    /// Median time until the condition of `thrown` holds, s.
    pub thrown_latency: Option<f64>,
    /// Median rise of the center of mass, m. `None` if all agents fell.
    pub height: Option<f64>,
}

/// A backflip.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Flip {
    /// Agents that had not fallen before.
    pub agents: u64,
    /// Number of agents that turned over, landed on their feet, and stayed up for a second.
    pub landed: u64,
}

/// Getting up after a fall.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Rise {
    /// Agents that were pushed over.
    pub agents: u64,
    /// Number of agents that stood again within 4 s.
    pub prompt: u64,
    /// Median time until standing, s. `None` if fewer than half of the agents got up.
    pub time: Option<f64>,
}

/// A push from any side.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Push {
    /// Impulse per mass of the character, m/s.
    pub velocity: f64,
    /// Agents that were pushed.
    pub agents: u64,
    /// Number of agents that fell.
    pub falls: u64,
    /// Median time until the mean speed over 0.25 s is within 0.3 m/s of the earlier one, s. `None` if fewer than half
    /// of the agents recovered.
    pub recovery: Option<f64>,
}
