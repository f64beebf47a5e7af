//! Short messages on the screen.

use crate::app::mode::AppSet;
use bevy::prelude::*;

/// Seconds that a message stays.
const STAY: f32 = 4.0;
/// Seconds that an error stays.
const STAY_ERROR: f32 = 10.0;

/// The messages on the screen.
#[derive(Resource, Default)]
pub struct Notifications(pub Vec<Notification>);

/// A message.
pub struct Notification {
    /// Its text.
    pub text: String,
    /// Whether it is an error.
    pub error: bool,
    /// Seconds that remain.
    pub left: f32,
}

pub(super) fn plugin(app: &mut App) {
    app.init_resource::<Notifications>().add_systems(Update, fade.in_set(AppSet::Present));
}

impl Notifications {
    /// Shows a message.
    pub fn say(&mut self, text: impl Into<String>) {
        self.add(text.into(), false, STAY);
    }

    /// Shows an error.
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
        self.0.push(Notification { text, error, left });
    }
}

/// Removes messages whose time is over.
fn fade(time: Res<Time<Real>>, mut notes: ResMut<Notifications>) {
    if notes.0.is_empty() {
        return;
    }
    notes.0.iter_mut().for_each(|note| note.left -= time.delta_secs());
    notes.0.retain(|note| note.left > 0.0);
}
