//! Assault courses: a policy runs, the player steers a runner, or the player builds the ground ahead of a policy. Runs that have
//! ended enter the [table](leaderboard) of the longest.

mod builder;
mod gates;
pub mod leaderboard;
mod runs;
mod ui;

pub use builder::{MOST_STEPS, Site, Step};
pub use runs::{Runs, check as check_table};
pub use ui::List;

use crate::app::input::actions::Action;
use crate::app::mode::Mode;
use crate::app::ui::hints::{KeyHints, ModeKeys};
use bevy::prelude::*;

pub(super) fn plugin(app: &mut App) {
    app.add_plugins((builder::plugin, gates::plugin, runs::plugin, ui::plugin));
}

pub(super) fn key_hints(hints: &mut KeyHints) {
    const NAMES: &[(Action, &str)] = &[(Action::Restart, "give up")];
    const WITHOUT: &[Action] = &[Action::Push, Action::Throw, Action::Release];
    const BUILD: ModeKeys = ModeKeys {
        useful: &[Action::Menu, Action::Higher, Action::Lower, Action::Restart, Action::Runs],
        own: &[Action::Higher, Action::Lower, Action::Even],
        without: WITHOUT,
        names: NAMES,
        mouse: Some(["build", "left mouse button: drag the end of the next meter   wheel: a step higher or lower"]),
    };
    const RUN: ModeKeys = ModeKeys {
        useful: &[Action::Menu, Action::Pause, Action::Restart, Action::Runs, Action::Slower, Action::Camera],
        own: &[],
        without: WITHOUT,
        names: NAMES,
        mouse: None,
    };
    hints.add(|scenario| scenario.is_built(), &BUILD);
    hints.add(|scenario| scenario.mode == Mode::Course, &RUN);
}
