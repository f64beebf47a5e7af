//! A recorded run: states, ground and decisions of each frame.
//!
//! Coordinates have the precision of the simulation, and the ground is recorded as it changes: a replay shows the run to the bit.

mod file;
pub mod tape;

use bevy::prelude::*;
use bevy_marathon::{Anatomy, Episode, Ground, PoseSample, pose};
use marathon_physics::Model;
use marathon_runs::TaskConfig;
use std::path::PathBuf;
use std::sync::Arc;

/// Numbers per agent and frame besides the configuration: distance, speed, reward, return, and whether an episode begins.
pub const NUMBERS: usize = 5;

/// Shows the recording of a file.
#[derive(Message, Clone, Debug, PartialEq, Eq)]
pub struct PlayRecording(pub PathBuf);

/// A recorded run.
#[derive(Clone, Debug, PartialEq)]
pub struct Recording {
    /// The task.
    pub task_config: TaskConfig,
    /// The ground.
    pub ground: Ground,
    /// Seconds between frames.
    pub dt: f64,
    /// Number of agents.
    pub agents: usize,
    /// Origins of their tracks, `[agents][3]`.
    pub places: Vec<f32>,
    /// Configurations, `[frames][agents][nq]`.
    qpos: Vec<f64>,
    /// See [`NUMBERS`], `[frames][agents][5]`.
    numbers: Vec<f32>,
    /// Terms of the reward, `[frames][agents][terms]`.
    terms: Vec<f32>,
    /// Actions of the decisions that led to the frames, `[frames][agents][act]`.
    actions: Vec<f32>,
    /// Commands, `[frames][agents][numbers]`.
    commands: Vec<f64>,
    /// 1 in episodes without a time limit, `[frames][agents]`.
    untimed: Vec<f32>,
    /// Grounds, in the order of their frames.
    grounds: Vec<Lie>,
}

/// The ground of an agent from a frame on.
#[derive(Clone, Debug, PartialEq)]
struct Lie {
    frame: usize,
    agent: usize,
    fields: Arc<Vec<Vec<f32>>>,
}

/// An agent in a frame.
pub struct Row<'a> {
    /// Configuration.
    pub qpos: &'a [f64],
    /// Distance, m, speed, m/s, reward, return, and 1 where an episode begins.
    pub numbers: [f32; NUMBERS],
    /// Terms of the reward.
    pub terms: &'a [f32],
    /// Action of the decision that led here.
    pub action: &'a [f32],
    /// Its command.
    pub command: &'a [f64],
    /// Elevations of its height fields.
    pub grounds: &'a Arc<Vec<Vec<f32>>>,
    /// Whether the episode has no time limit, as when a player steers.
    pub untimed: bool,
}

impl Recording {
    /// A recording without frames.
    pub fn new(task_config: TaskConfig, ground: Ground, dt: f64, places: Vec<f32>) -> Self {
        let agents = places.len() / 3;
        let (numbers, terms, actions, grounds) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        let (qpos, commands, untimed) = (Vec::new(), Vec::new(), Vec::new());
        Recording { task_config, ground, dt, agents, places, qpos, numbers, terms, actions, commands, untimed, grounds }
    }

    /// Number of frames.
    pub fn frames(&self) -> usize {
        self.numbers.len() / (NUMBERS * self.agents.max(1))
    }

    /// Length, s.
    pub fn seconds(&self) -> f64 {
        self.frames().saturating_sub(1) as f64 * self.dt
    }

    /// Appends the next agent of a frame: all agents of one, then those of the next.
    pub fn push(&mut self, row: &Row<'_>) {
        let rows = self.numbers.len() / NUMBERS;
        let (frame, agent) = (rows / self.agents.max(1), rows % self.agents.max(1));
        self.qpos.extend(row.qpos);
        self.numbers.extend(row.numbers);
        self.terms.extend(row.terms);
        self.actions.extend(row.action);
        self.commands.extend(row.command);
        self.untimed.push(f32::from(u8::from(row.untimed)));
        let known = self.grounds.iter().rev().find(|lie| lie.agent == agent);
        if known.map_or(!row.grounds.is_empty(), |lie| !Arc::ptr_eq(&lie.fields, row.grounds)) {
            self.grounds.push(Lie { frame, agent, fields: row.grounds.clone() });
        }
    }

    /// Removes frames from the start.
    pub fn drop_front(&mut self, frames: usize) {
        let all = self.frames();
        let frames = frames.min(all);
        if frames == 0 {
            return;
        }
        fn cut<T>(rows: &mut Vec<T>, frames: usize, all: usize) {
            rows.drain(..rows.len() / all * frames);
        }
        for rows in [&mut self.numbers, &mut self.terms, &mut self.actions, &mut self.untimed] {
            cut(rows, frames, all);
        }
        for rows in [&mut self.qpos, &mut self.commands] {
            cut(rows, frames, all);
        }
        // the ground that an agent stands on at the new start
        let standing = (0..self.agents)
            .filter_map(|agent| self.grounds.iter().rfind(|lie| lie.agent == agent && lie.frame <= frames))
            .map(|lie| Lie { frame: 0, ..lie.clone() });
        let later = self.grounds.iter().filter(|lie| lie.frame > frames);
        let later = later.map(|lie| Lie { frame: lie.frame - frames, ..lie.clone() });
        self.grounds = standing.chain(later).collect();
    }

    /// Appends a state of the next agent. All rows of a recording have the same width, but an episode has no terms of the
    /// reward before its first decision.
    pub(crate) fn push_state(&mut self, sample: &PoseSample, episode: &Episode, anatomy: &Anatomy) {
        let mut terms = episode.terms.clone();
        terms.resize(anatomy.spec.as_ref().map_or(0, |spec| spec.reward_terms.len()), 0.0);
        let fresh = if sample.fresh { 1.0 } else { 0.0 };
        self.push(&Row {
            qpos: &sample.qpos,
            numbers: [episode.distance as f32, episode.speed, episode.reward, episode.total as f32, fresh],
            terms: &terms,
            action: &sample.action,
            command: &sample.command,
            grounds: &sample.grounds,
            untimed: episode.untimed,
        });
    }

    fn row<'a, T>(&self, rows: &'a [T], frame: usize, agent: usize) -> &'a [T] {
        let columns = rows.len() / (self.frames() * self.agents).max(1);
        let first = (frame * self.agents + agent) * columns;
        &rows[first..first + columns]
    }

    /// Configuration of an agent in a frame.
    pub fn qpos(&self, frame: usize, agent: usize) -> &[f64] {
        self.row(&self.qpos, frame, agent)
    }

    /// Distance, m, speed, m/s, reward, return, and 1 where an episode begins.
    pub fn numbers(&self, frame: usize, agent: usize) -> &[f32] {
        self.row(&self.numbers, frame, agent)
    }

    /// Terms of the reward.
    pub fn terms(&self, frame: usize, agent: usize) -> &[f32] {
        self.row(&self.terms, frame, agent)
    }

    /// Action of the decision that led to a frame.
    pub fn action(&self, frame: usize, agent: usize) -> &[f32] {
        self.row(&self.actions, frame, agent)
    }

    /// Command of an agent; empty if it takes no commands.
    pub fn command(&self, frame: usize, agent: usize) -> &[f64] {
        self.row(&self.commands, frame, agent)
    }

    /// Whether an agent's episode in a frame has no time limit.
    pub fn untimed(&self, frame: usize, agent: usize) -> bool {
        self.row(&self.untimed, frame, agent)[0] > 0.5
    }

    /// Memory of the recording without its grounds, bytes.
    pub fn bytes(&self) -> usize {
        let singles = self.numbers.len() + self.terms.len() + self.actions.len() + self.untimed.len();
        4 * singles + 8 * (self.qpos.len() + self.commands.len())
    }

    /// Elevations of an agent's height fields in a frame, m above their zero; none if its model has no height fields.
    pub fn grounds(&self, frame: usize, agent: usize) -> Option<&Arc<Vec<Vec<f32>>>> {
        let lie = self.grounds.iter().rfind(|lie| lie.agent == agent && lie.frame <= frame);
        lie.map(|lie| &lie.fields)
    }

    /// The configuration of an agent at a time.
    pub fn pose(&self, model: &Model, agent: usize, seconds: f64) -> Vec<f64> {
        let (a, b, share) = self.between(seconds);
        let fresh = self.numbers(b, agent)[4] > 0.5;
        if a == b || fresh {
            self.qpos(if share < 1.0 { a } else { b }, agent).to_vec()
        } else {
            pose::mix(model, self.qpos(a, agent), self.qpos(b, agent), share)
        }
    }

    /// The frames before and after a time, and the share of the later one.
    pub fn between(&self, seconds: f64) -> (usize, usize, f64) {
        let last = self.frames().saturating_sub(1);
        let at = (seconds / self.dt).clamp(0.0, last as f64);
        let a = at.floor() as usize;
        (a, (a + 1).min(last), at - a as f64)
    }
}
