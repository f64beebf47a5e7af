//! The choices of a player on a screen.

use crate::app::input::actions::Action;
use crate::app::stage::scenario::Scenario;
use crate::app::ui::menu::state::Screen;
use std::path::PathBuf;

/// The player's choice on a screen.
pub enum Choice {
    /// Nothing yet.
    Stay,
    /// Another screen over this one.
    Show(Screen),
    /// The screen below.
    Back,
    /// The game.
    Close,
    /// A scenario.
    Start(Scenario),
    /// A recording.
    Replay(PathBuf),
    /// An action, in the game.
    Do(Action),
    /// The end of the game.
    Quit,
}
