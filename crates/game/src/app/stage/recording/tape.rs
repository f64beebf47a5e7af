//! The decisions of running characters, as a recording that grows.

use super::Recording;
use crate::app::stage::loaded::LoadedPolicy;
use bevy::prelude::*;
use bevy_marathon::{Anatomy, Episode, Marathon, RagdollState};
use std::time::Duration;

/// A recording of running characters.
pub struct Tape {
    /// The recorded decisions.
    pub recording: Recording,
    /// Time of the newest frame.
    until: Duration,
}

impl Tape {
    /// Begins with no decision of characters whose tracks begin at these places. `dt` is the time between two decisions, s.
    pub fn new(loaded: &LoadedPolicy, dt: f64, tracks: impl Iterator<Item = Transform>) -> Self {
        let places = tracks.flat_map(|track| track.translation.to_array()).collect();
        let recording = Recording::new(loaded.task_config.clone(), loaded.ground, dt, places);
        Tape { recording, until: Duration::ZERO }
    }

    /// Appends the decisions since the last tick, of all characters in their order. Nothing is appended while some are missing.
    pub fn append(&mut self, marathon: &Marathon, all: &[(&RagdollState, &Episode, &Anatomy)]) {
        if all.len() != self.recording.agents {
            return;
        }
        let histories: Vec<_> = all.iter().filter_map(|(state, ..)| marathon.history(state)).collect();
        let Some(first) = histories.first() else { return };
        let times: Vec<Duration> = first.iter().map(|s| s.time).filter(|t| *t > self.until).collect();
        for time in times {
            let samples: Option<Vec<_>> = histories.iter().map(|t| t.iter().rfind(|s| s.time == time)).collect();
            let Some(samples) = samples else { continue };
            self.until = time;
            for (sample, (_, episode, anatomy)) in samples.iter().zip(all) {
                self.recording.push_state(sample, episode, anatomy);
            }
        }
    }
}
