//! A ragdoll in its lane: its policies, its episode, and the states that frames are drawn from.

use crate::ragdoll::{Controls, End, Episode, Held, Restart};
use bevy::prelude::*;
use marathon_learn::Policy;
use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Duration;

/// A ragdoll in its lane.
#[derive(Debug)]
pub(crate) struct Slot {
    pub seed: u64,
    pub number: u64,
    /// The policies of the task's first and second role.
    pub policies: [Option<Arc<Policy>>; 2],
    pub controls: Option<Controls>,
    pub held: Option<Held>,
    /// The command that replaces its own schedule.
    pub command: Option<Vec<f64>>,
    pub restart: Restart,
    pub episode: Episode,
    /// Elevations of its model's height fields.
    pub grounds: Arc<Vec<Vec<f32>>>,
    /// States that frames are drawn from, oldest first.
    pub history: VecDeque<PoseSample>,
    /// Events since the last report.
    pub events: Vec<Event>,
    pub(super) pushes: Vec<Shove>,
    /// Decisions for which it still lies without action; `None` if it is up.
    pub(super) lying: Option<u64>,
    pub(super) begin_now: bool,
}

/// A state of a ragdoll at a time, see [`Marathon::history`](crate::Marathon::history).
#[derive(Clone, Debug)]
pub struct PoseSample {
    /// Time of the fixed clock.
    pub time: Duration,
    /// Configuration, in the order of the model.
    pub qpos: Vec<f64>,
    /// Velocity, in the order of the model.
    pub qvel: Vec<f64>,
    /// The pose of its clip, if it follows one.
    pub reference: Option<Vec<f64>>,
    /// Whether it comes from a reset, and not from the state before.
    pub fresh: bool,
    /// Action of the decision that led here; zeros after a reset.
    pub action: Vec<f32>,
    /// Command that the agent observes, in the order of [`Spec::command`](marathon_envs::Spec::command).
    pub command: Vec<f64>,
    /// Elevations of each height field, m above the field's zero, by rows.
    pub grounds: Arc<Vec<Vec<f32>>>,
}

/// A push in the axes of the physics.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shove {
    pub body: usize,
    pub force: [f64; 3],
    pub torque: [f64; 3],
    /// Its duration in decisions.
    pub decisions: u64,
}

/// An event of a ragdoll.
#[derive(Clone, Debug)]
pub(crate) enum Event {
    Foot { foot: usize, down: bool },
    Ended(End, Episode),
    Began(u64),
}

impl Slot {
    pub fn new((seed, number): (u64, u64), restart: Restart) -> Self {
        Slot {
            seed,
            number,
            restart,
            policies: [None, None],
            controls: None,
            held: None,
            command: None,
            episode: Episode::default(),
            grounds: Arc::default(),
            history: VecDeque::new(),
            events: Vec::new(),
            pushes: Vec::new(),
            lying: None,
            begin_now: false,
        }
    }

    /// Pushes it at the coming decisions.
    pub fn push(&mut self, shove: Shove) {
        self.pushes.push(shove);
    }

    /// Ends its episode at the next decision.
    pub fn begin_now(&mut self) {
        self.begin_now = true;
    }

    /// Its state at a time: the states before and after, and the share of the later one.
    pub fn between(&self, time: Duration) -> Option<(&PoseSample, &PoseSample, f64)> {
        let later = self.history.iter().position(|s| s.time >= time).unwrap_or(self.history.len().saturating_sub(1));
        let b = self.history.get(later)?;
        let a = if b.fresh { b } else { self.history.get(later.wrapping_sub(1)).unwrap_or(b) };
        let span = b.time.saturating_sub(a.time).as_secs_f64();
        let share = if span > 0.0 { (time.saturating_sub(a.time).as_secs_f64() / span).min(1.0) } else { 1.0 };
        Some((a, b, share))
    }

    /// Removes states that no frame from this time on needs.
    pub fn forget(&mut self, before: Duration) {
        while self.history.len() > 2 && self.history[1].time <= before {
            self.history.pop_front();
        }
    }

    /// Begins its next episode.
    pub(super) fn begin(&mut self) {
        self.episode = Episode { number: self.episode.number + 1, ..default() };
        self.lying = None;
        self.begin_now = false;
        self.pushes.clear();
        self.events.push(Event::Began(self.episode.number));
    }
}
