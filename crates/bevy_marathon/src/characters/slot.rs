//! A ragdoll in its lane: its policies, its episode, and the states that frames are drawn from.

use super::detector::Progress;
use super::event::Event;
use super::lane_state::LaneState;
use super::playing::Playing;
use crate::limbs::Limbs;
use crate::lod::Lod;
use crate::mode::RagdollMode;
use crate::ragdoll::{Controls, Episode, Held, Restart};
use crate::reactions::{Blows, HitReactions};
use crate::strength::LimbStrength;
use bevy::prelude::*;
use marathon_learn::Policy;
use marathon_physics::Variation;
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Duration;

/// A ragdoll in its lane. A snapshot has all of it, but for what the components of the ragdoll say at every tick.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Slot {
    /// Number of the ragdolls that have entered the simulation before it, of its kind.
    pub entered: u64,
    pub seed: u64,
    pub number: u64,
    /// The policies of the task's first and second role.
    #[serde(skip)]
    pub policies: [Option<Arc<Policy>>; 2],
    #[serde(skip)]
    pub controls: Option<Controls>,
    #[serde(skip)]
    pub held: Option<Held>,
    #[serde(skip)]
    pub lod: Lod,
    /// Its state while it sleeps.
    pub asleep: Option<LaneState>,
    /// The command that replaces its own schedule.
    pub command: Option<Vec<f64>>,
    #[serde(skip)]
    pub restart: Restart,
    pub episode: Episode,
    /// Elevations of its model's height fields. The bytes of a snapshot have them in the state of the physics.
    #[serde(skip)]
    pub grounds: Arc<Vec<Vec<f32>>>,
    /// States that frames are drawn from, oldest first.
    pub history: VecDeque<PoseSample>,
    /// Events since the last report.
    pub events: Vec<Event>,
    /// Constants of its own, and whether the physics lacks them.
    #[serde(skip)]
    pub physique: Option<Variation>,
    #[serde(skip)]
    pub physique_changed: bool,
    #[serde(skip)]
    pub strength: LimbStrength,
    #[serde(skip)]
    pub reactions: Option<HitReactions>,
    /// The mode that its component had when the plugin last read or wrote it.
    #[serde(skip)]
    pub shown_mode: RagdollMode,
    /// The clip that moves it in place of the physics.
    pub playing: Option<Playing>,
    pub(super) pushes: Vec<Shove>,
    pub(super) blows: Blows,
    /// Factors of its actuators' forces in the physics.
    pub(super) factors: Vec<f64>,
    pub(super) progress: Progress,
    /// Whether the app lets it lie without strength.
    pub(super) limp: bool,
    /// Whether it has its strength again since the last decision.
    pub(super) revived: bool,
    /// Decisions for which it still lies without action; `None` if it is up.
    pub(super) lying: Option<u64>,
    pub(super) begin_now: bool,
}

/// A state of a ragdoll at a time, see [`Marathon::history`](crate::Marathon::history).
#[derive(Clone, Debug, Serialize, Deserialize)]
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
    /// Elevations of each height field, m above the field's zero, by rows. The bytes of a snapshot have only the newest.
    #[serde(skip)]
    pub grounds: Arc<Vec<Vec<f32>>>,
}

/// A push in the axes of the physics.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(crate) struct Shove {
    pub body: usize,
    pub force: [f64; 3],
    pub torque: [f64; 3],
    /// Its duration in decisions.
    pub decisions: u64,
    /// Impulse of all decisions, N s.
    pub impulse: [f64; 3],
}

impl Slot {
    pub fn new((seed, number): (u64, u64), restart: Restart) -> Self {
        Slot {
            entered: 0,
            seed,
            number,
            restart,
            policies: [None, None],
            controls: None,
            held: None,
            lod: Lod::Full,
            asleep: None,
            command: None,
            episode: Episode::default(),
            grounds: Arc::default(),
            history: VecDeque::new(),
            events: Vec::new(),
            physique: None,
            physique_changed: false,
            strength: LimbStrength::default(),
            reactions: None,
            shown_mode: RagdollMode::default(),
            playing: None,
            pushes: Vec::new(),
            blows: Blows::default(),
            factors: Vec::new(),
            progress: Progress::default(),
            limp: false,
            revived: false,
            lying: None,
            begin_now: false,
        }
    }

    /// The same with the inputs of the ragdoll as it is now, which its components set.
    pub fn with_inputs_of(mut self, present: Slot) -> Self {
        self.entered = present.entered;
        (self.physique, self.physique_changed) = (present.physique, true);
        (self.strength, self.reactions) = (present.strength, present.reactions);
        self.shown_mode = present.shown_mode;
        self
    }

    /// Pushes it at the coming decisions.
    pub fn push(&mut self, shove: Shove, limbs: &Limbs, dt: f64) {
        let Shove { body, impulse, decisions, .. } = shove;
        let strength = impulse.iter().map(|x| x * x).sum::<f64>().sqrt();
        let stands = self.mode() == RagdollMode::Powered && self.episode.feet != 0;
        let blow = (body, strength, decisions);
        if self.blows.strike(blow, self.reactions.as_ref(), limbs, (stands, dt)) {
            self.events.push(Event::Hit { body, impulse });
        }
        self.pushes.push(shove);
    }

    /// Use that it makes of its actuators.
    pub fn mode(&self) -> RagdollMode {
        match () {
            () if self.is_limp() => RagdollMode::Limp,
            () if self.playing.is_some() => RagdollMode::Animated,
            () if self.progress.rising => RagdollMode::GettingUp,
            () => RagdollMode::Powered,
        }
    }

    /// Whether it has no strength.
    pub fn is_limp(&self) -> bool {
        self.limp || self.lying.is_some()
    }

    /// Factors of the forces of its actuators.
    pub(super) fn wanted_factors(&self, limbs: &Limbs, dt: f64, out: &mut [f64]) {
        for (actuator, factor) in out.iter_mut().enumerate() {
            *factor = if self.is_limp() { 0.0 } else { self.strength.factor(actuator) };
            if let Some(reactions) = self.reactions.as_ref().filter(|_| !self.blows.is_empty()) {
                *factor *= self.blows.factor(actuator, reactions, limbs, dt);
            }
        }
    }

    /// Ends its episode at the next decision.
    pub fn begin_now(&mut self) {
        self.begin_now = true;
    }

    /// Whether it keeps its last action, at half the rate of its task.
    pub(super) fn holds(&self) -> bool {
        self.asleep.is_some() || self.lod == Lod::HalfRate && self.episode.decisions % 2 == 1
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

    /// Moves its states in time, so that the newest is that of `time`.
    pub(super) fn retime(&mut self, time: Duration) {
        let newest = self.history.back().map_or(time, |sample| sample.time);
        for sample in &mut self.history {
            sample.time = time.saturating_sub(newest.saturating_sub(sample.time));
        }
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
        (self.limp, self.revived, self.begin_now) = (false, false, false);
        self.pushes.clear();
        self.blows.clear();
        std::mem::take(&mut self.progress).turn_to(None, &mut self.events);
        self.events.push(Event::Began(self.episode.number));
    }
}
