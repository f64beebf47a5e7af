//! The rates of frames and ticks.

use bevy::prelude::*;
use std::time::{Duration, Instant};

/// Ticks of the simulation per second: most tasks decide at a divisor of it.
pub const TICKS: f64 = 100.0;

/// Shortest frame.
#[derive(Resource)]
pub struct FramePace(pub Duration);

/// Settings of the command line, which other programs must not change.
#[derive(Resource, Clone, Copy, Debug, Default)]
pub struct FixedSettings {
    /// The quality.
    pub quality: bool,
    /// The size of the window.
    pub size: bool,
    /// The most frames per second.
    pub rate: bool,
}

/// The app draws a video: its time does not depend on how fast frames are drawn.
#[derive(Resource)]
pub struct IsVideo;

pub(super) fn plugin(app: &mut App) {
    app.insert_resource(Time::<Fixed>::from_hz(TICKS)).add_systems(Last, wait.run_if(resource_exists::<FramePace>));
}

fn wait(pace: Res<FramePace>, mut last: Local<Option<Instant>>) {
    if let Some(left) = last.and_then(|last| pace.0.checked_sub(last.elapsed())) {
        std::thread::sleep(left);
    }
    *last = Some(Instant::now());
}
