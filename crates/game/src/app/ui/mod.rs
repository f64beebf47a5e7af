//! Text, bars, the menu and questions over the picture.

pub mod glyphs;
pub mod hints;
pub mod hud;
pub mod menu;
pub mod prompts;
pub mod question;
pub mod rewards;
pub mod status;
pub mod theme;

use bevy::prelude::*;

pub(super) fn plugin(app: &mut App) {
    app.add_plugins((
        theme::plugin,
        hud::plugin,
        status::plugin,
        rewards::plugin,
        hints::plugin,
        menu::plugin,
        prompts::plugin,
        question::plugin,
    ));
}
