//! The features of the modes. They exchange messages, and none imports another.

pub mod boxes;
pub mod course;
pub mod drag;
pub mod film;
pub mod imitation;
pub mod limp;
pub mod perturb;
pub mod remote;
pub mod replay;
pub mod testbed;
pub mod training;

use crate::app::ui::hints::KeyHints;
use bevy::prelude::*;

pub(super) fn plugin(app: &mut App) {
    app.insert_resource(key_hints()).add_plugins((
        boxes::plugin,
        course::plugin,
        drag::plugin,
        film::plugin,
        imitation::plugin,
        limp::plugin,
        perturb::plugin,
        remote::plugin,
        replay::plugin,
        testbed::plugin,
        training::plugin,
    ));
}

/// The keys of all modes.
pub fn key_hints() -> KeyHints {
    let mut hints = KeyHints::default();
    course::key_hints(&mut hints);
    imitation::key_hints(&mut hints);
    perturb::key_hints(&mut hints);
    remote::key_hints(&mut hints);
    replay::key_hints(&mut hints);
    testbed::key_hints(&mut hints);
    training::key_hints(&mut hints);
    hints
}
