//! The settings of the player: their [values], the [file](file) that keeps them, and how they [take effect](apply).

pub mod apply;
pub mod file;
pub mod resolution;
pub mod values;

use bevy::prelude::*;
use values::Settings;

pub(super) fn plugin(app: &mut App) {
    app.init_resource::<Settings>().add_plugins((apply::plugin, file::plugin, resolution::plugin));
}
