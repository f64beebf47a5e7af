//! A ragdoll in its lane: who decides for it, its episode, and the states that frames are drawn from.

use crate::ragdoll::{Controls, End, Episode, Held, Restart};
use bevy::prelude::*;
use marathon_learn::Policy;
use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Duration;

/// A ragdoll in its lane.
#[derive(Debug)]
pub(crate) struct Resident {
    pub seed: u64,
    pub number: u64,
    /// Of the task's first role, and of its second.
    pub policies: [Option<Arc<Policy>>; 2],
    pub controls: Option<Controls>,
    pub held: Option<Held>,
    /// What it is told in place of its own schedule.
    pub command: Option<Vec<f64>>,
    pub restart: Restart,
    pub episode: Episode,
    /// Elevations of its model's height fields.
    pub grounds: Arc<Vec<Vec<f32>>>,
    /// States that frames are drawn from, oldest first.
    pub trail: VecDeque<Still>,
    /// What has happened since it was last asked.
    pub events: Vec<Event>,
    pub(super) pushes: Vec<Shove>,
    /// Decisions that it still lies limp; `None` if it is up.
    pub(super) lying: Option<u64>,
    pub(super) begin_now: bool,
}

/// A state at a time.
#[derive(Clone, Debug)]
pub(crate) struct Still {
    pub time: Duration,
    pub qpos: Vec<f64>,
    pub qvel: Vec<f64>,
    /// Where the clip is that it follows, if it does.
    pub reference: Option<Vec<f64>>,
    /// It did not come out of the one before, but of a reset.
    pub fresh: bool,
    /// Action and command of the decision that has led here; a fresh one has the command alone.
    #[cfg_attr(not(feature = "render"), expect(dead_code, reason = "the app's recordings have it"))]
    pub action: Vec<f32>,
    #[cfg_attr(not(feature = "render"), expect(dead_code, reason = "the app's recordings have it"))]
    pub command: Vec<f64>,
    /// Elevations of the height fields.
    pub grounds: Arc<Vec<Vec<f32>>>,
}

/// A push in the axes of the physics.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shove {
    pub body: usize,
    pub force: [f64; 3],
    pub torque: [f64; 3],
    /// Decisions that it lasts.
    pub decisions: u64,
}

/// What happens to a ragdoll.
#[derive(Clone, Debug)]
pub(crate) enum Event {
    Foot { foot: usize, down: bool },
    Ended(End, Episode),
    Began(u64),
}

impl Resident {
    pub fn new((seed, number): (u64, u64), restart: Restart) -> Self {
        Resident {
            seed,
            number,
            restart,
            policies: [None, None],
            controls: None,
            held: None,
            command: None,
            episode: Episode::default(),
            grounds: Arc::default(),
            trail: VecDeque::new(),
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

    /// Its state at a time: the two between which it lies, and the share of the later one.
    pub fn between(&self, time: Duration) -> Option<(&Still, &Still, f64)> {
        let later = self.trail.iter().position(|s| s.time >= time).unwrap_or(self.trail.len().saturating_sub(1));
        let b = self.trail.get(later)?;
        let a = if b.fresh { b } else { self.trail.get(later.wrapping_sub(1)).unwrap_or(b) };
        let span = b.time.saturating_sub(a.time).as_secs_f64();
        let share = if span > 0.0 { (time.saturating_sub(a.time).as_secs_f64() / span).min(1.0) } else { 1.0 };
        Some((a, b, share))
    }

    /// Forgets what no frame from this time on needs.
    pub fn forget(&mut self, before: Duration) {
        while self.trail.len() > 2 && self.trail[1].time <= before {
            self.trail.pop_front();
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
