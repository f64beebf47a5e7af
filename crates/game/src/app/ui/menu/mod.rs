//! The menus: their [state](state), their screens, and how gamepads move through them.

mod choice;
mod courses;
mod draw;
mod home;
mod keys;
mod options;
mod pad;
mod pictures;
mod replays;
mod setup;
pub mod state;
mod window;

use bevy::prelude::*;

pub(super) fn plugin(app: &mut App) {
    app.add_plugins((state::plugin, draw::plugin, pad::plugin, pictures::plugin));
}
