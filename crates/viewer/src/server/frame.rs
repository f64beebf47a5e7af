//! Messages to pages: a length of four bytes, a kind of one byte, and the content. Numbers are little-endian.

use serde_json::{Value, json};

/// JSON: title, model, agents and seconds per frame.
pub const SCENE: u8 = 1;
/// Poses of all agents.
pub const FRAME: u8 = 2;
/// JSON: progress of a run.
pub const CURVE: u8 = 3;
/// Elevations of a height field of an agent.
pub const GROUND: u8 = 4;
/// Nothing: the program is still there.
pub const ALIVE: u8 = 5;

/// Poses of all agents at one time.
pub struct Frame<'a> {
    /// Time since the start, s.
    pub time: f64,
    /// Number of the episode of each agent. Pages do not blend poses of different episodes.
    pub episodes: &'a [u32],
    /// Matrices of geoms and bodies, of as many agents.
    pub poses: &'a crate::Poses,
}

impl Frame<'_> {
    pub(super) fn encode(&self) -> Vec<u8> {
        let (geoms, bodies) = (self.poses.geoms(), self.poses.bodies());
        let mut content = Vec::with_capacity(8 + 4 * (self.episodes.len() + geoms.len() + bodies.len()));
        content.extend(self.time.to_le_bytes());
        self.episodes.iter().for_each(|episode| content.extend(episode.to_le_bytes()));
        geoms.iter().chain(bodies).for_each(|number| content.extend(number.to_le_bytes()));
        message(FRAME, &content)
    }
}

/// A message.
pub fn message(kind: u8, content: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(5 + content.len());
    bytes.extend((content.len() as u32).to_le_bytes());
    bytes.push(kind);
    bytes.extend(content);
    bytes
}

/// The message before the first frame.
pub fn scene(title: &str, model: &Value, agents: usize, dt: f64) -> Vec<u8> {
    message(SCENE, json!({ "title": title, "model": model, "agents": agents, "dt": dt }).to_string().as_bytes())
}

/// The ground of an agent.
pub fn ground(agent: usize, field: usize, elevations: &[f32]) -> Vec<u8> {
    let mut content = Vec::with_capacity(8 + 4 * elevations.len());
    content.extend((agent as u32).to_le_bytes());
    content.extend((field as u32).to_le_bytes());
    elevations.iter().for_each(|number| content.extend(number.to_le_bytes()));
    message(GROUND, &content)
}
