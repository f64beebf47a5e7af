//! Keys, mouse, gamepads and scripted input: what they do to time, the camera and the scenario.

pub mod actions;
pub mod bindings;
pub mod camera;
pub mod control;
pub mod controls;
pub mod device;
pub mod key_names;
pub mod pointer;
pub mod read;
pub mod rebind;
pub mod response;
pub mod scripted;
pub mod steering;

use bevy::prelude::*;

/// Adds the actions and their [bindings].
pub(super) fn keys_plugin(app: &mut App) {
    app.add_plugins((actions::plugin, bindings::plugin, read::plugin, rebind::plugin));
}

/// Adds what actions, mouse and gamepads do.
pub(super) fn plugin(app: &mut App) {
    app.add_plugins((
        camera::plugin,
        control::plugin,
        device::plugin,
        pointer::plugin,
        scripted::plugin,
        steering::plugin,
    ));
}
