//! Sounds: what is to be heard, and how loud. The output to the sound card is a plugin of its own, which videos and tests lack.

#[cfg(feature = "sound")]
mod output;
mod steps;
mod synth;

#[cfg(feature = "sound")]
pub use output::output;
pub use synth::{RATE, Sound};

use bevy::prelude::*;

/// Plays a sound.
#[derive(Message, Clone, Copy, Debug, PartialEq)]
pub struct PlaySound {
    /// Which one.
    pub sound: Sound,
    /// Where it is, in the world's axes; `None`: everywhere.
    pub at: Option<Vec3>,
    /// Loudness at the source, from 0 to 1.
    pub loudness: f32,
}

pub(super) fn plugin(app: &mut App) {
    app.add_message::<PlaySound>();
    steps::plugin(app);
}
