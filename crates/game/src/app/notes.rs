//! Short messages on the screen.

use bevy::prelude::*;

/// Seconds that a message stays.
const STAY: f32 = 4.0;
/// The same of an error.
const STAY_ERROR: f32 = 10.0;

/// What is said at the moment.
#[derive(Resource, Default)]
pub struct Notes(pub Vec<Note>);

/// A message.
pub struct Note {
    /// What it says.
    pub text: String,
    /// Something is wrong.
    pub error: bool,
    /// Seconds that it still stays.
    pub left: f32,
}

impl Notes {
    /// Says something.
    pub fn say(&mut self, text: impl Into<String>) {
        self.add(text.into(), false, STAY);
    }

    /// Says that something is wrong.
    pub fn error(&mut self, text: impl Into<String>) {
        self.add(text.into(), true, STAY_ERROR);
    }

    fn add(&mut self, text: String, error: bool, left: f32) {
        if error {
            error!("{text}");
        } else {
            info!("{text}");
        }
        self.0.retain(|note| note.text != text);
        self.0.push(Note { text, error, left });
    }
}

/// Takes away what has been there long enough.
pub fn fade(time: Res<Time<Real>>, mut notes: ResMut<Notes>) {
    if notes.0.is_empty() {
        return;
    }
    notes.0.iter_mut().for_each(|note| note.left -= time.delta_secs());
    notes.0.retain(|note| note.left > 0.0);
}
