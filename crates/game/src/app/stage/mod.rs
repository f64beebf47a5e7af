//! The scenario, its policies and its characters.

pub mod actors;
pub mod clips;
pub mod course;
pub mod loaded;
pub mod policies;
pub mod puppets;
pub mod recording;
pub mod rods;
pub mod scenario;
pub mod selection;
pub mod skin;
pub mod spawn;

use bevy::prelude::*;

pub(super) fn plugin(app: &mut App) {
    app.add_plugins((actors::plugin, loaded::plugin, skin::plugin, spawn::plugin));
}
