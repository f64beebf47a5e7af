//! Recordings of runs, and their replays.

pub mod play;
pub mod record;

use crate::app::input::actions::Action;
use crate::app::mode::Mode;
use crate::app::ui::hints::{KeyHints, ModeKeys};
use bevy::prelude::*;

pub(super) fn plugin(app: &mut App) {
    app.add_plugins((play::plugin, record::plugin));
}

pub(super) fn key_hints(hints: &mut KeyHints) {
    const KEYS: ModeKeys = ModeKeys {
        useful: &[Action::Menu, Action::Pause, Action::Back, Action::Ahead, Action::Slower, Action::Camera],
        own: &[Action::Back, Action::Ahead],
        without: &[Action::Push, Action::Throw, Action::Restart, Action::NextAgent, Action::Record],
        ..ModeKeys::COMMON
    };
    hints.add(|scenario| scenario.mode == Mode::Replay, &KEYS);
}
