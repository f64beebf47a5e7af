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

/// Volumes, from 0 to 1. The loudness of a sound is multiplied by both.
#[derive(Resource, Clone, Copy, Debug, PartialEq, Reflect)]
#[reflect(Resource, Default, Clone, Debug, PartialEq)]
pub struct Volumes {
    /// Of everything.
    pub master: f32,
    /// Of steps, landings, balls and the crowd.
    pub effects: f32,
}

impl Default for Volumes {
    fn default() -> Self {
        Volumes { master: 0.6, effects: 1.0 }
    }
}

pub(super) fn plugin(app: &mut App) {
    app.register_type::<Volumes>().init_resource::<Volumes>().add_message::<PlaySound>();
    steps::plugin(app);
}
