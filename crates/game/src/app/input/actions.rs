//! Actions, and the keys that steer instead of having an action.

use bevy::input::gamepad::GamepadButton;
use bevy::prelude::*;
use clap::ValueEnum;

/// An action of a key or button.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, ValueEnum)]
pub enum Action {
    /// Open or close the menu.
    Menu,
    /// Pause or continue.
    Pause,
    /// Run one frame, while paused.
    Step,
    /// Speed time up.
    Faster,
    /// Slow time down.
    Slower,
    /// Restart all characters.
    Restart,
    /// Focus on the next character.
    NextFocus,
    /// Switch to the next agent.
    NextAgent,
    /// Move the camera to its next place.
    Camera,
    /// Push the character in focus.
    Push,
    /// Throw a ball at the character in focus.
    Throw,
    /// Take the strength of the character in focus away, or give it back.
    Limp,
    /// Keep the last ten seconds as a film.
    Film,
    /// Show contacts and forces.
    Contacts,
    /// Show joints and limits.
    Joints,
    /// Show the ghost of the clip: inside the character, beside it, or not at all.
    Ghost,
    /// Color the character's parts by their distance from the clip.
    Errors,
    /// Show text and bars.
    Hud,
    /// Show the keys.
    Help,
    /// Train from random weights, or go back to watching.
    Learn,
    /// Save the trained policy.
    Save,
    /// Start or end a recording.
    Record,
    /// Go half a second back in a replay.
    Back,
    /// Go half a second ahead in a replay.
    Ahead,
    /// Give the steered character back to its own schedule.
    Release,
    /// Build the next meter of the course a step higher.
    Higher,
    /// Build it a step lower.
    Lower,
    /// Build it level.
    Even,
    /// Show the longest runs.
    Runs,
    /// Save a picture of the screen.
    Picture,
    /// Quit the game.
    Quit,
}

/// An action requested with a key or button. It becomes an [`ActionPressed`], after a question if something would be lost.
#[derive(Message, Clone, Copy, Debug, PartialEq, Eq)]
pub struct ActionRequested(pub Action);

/// An action to run in this frame.
#[derive(Message, Clone, Copy, Debug, PartialEq, Eq)]
pub struct ActionPressed(pub Action);

/// Keys that steer while the character takes commands: ahead and back, to the left and right, and, if the stick is the
/// character's, a step aside to the left and right.
pub const STEERING_KEYS: [KeyCode; 6] =
    [KeyCode::ArrowUp, KeyCode::ArrowDown, KeyCode::ArrowLeft, KeyCode::ArrowRight, KeyCode::KeyA, KeyCode::KeyD];
/// Keys that steer besides the arrows if the stick is the camera's: ahead and back, to the left and right.
pub const MOVE_KEYS: [KeyCode; 4] = [KeyCode::KeyW, KeyCode::KeyS, KeyCode::KeyA, KeyCode::KeyD];
/// Keys that make a character run while they are held, if the stick is the camera's.
pub const RUN_KEYS: [KeyCode; 2] = [KeyCode::ShiftLeft, KeyCode::ShiftRight];
/// Keys for the first and the second button of a command, such as a jump, for characters that turn.
pub const COMMAND_KEYS: [KeyCode; 2] = [KeyCode::Space, KeyCode::KeyV];
/// Keys that fly a free camera: ahead and back, to the left and right, up and down.
pub const FLY_KEYS: [KeyCode; 6] =
    [KeyCode::KeyW, KeyCode::KeyS, KeyCode::KeyA, KeyCode::KeyD, KeyCode::KeyE, KeyCode::KeyQ];
/// Gamepad buttons for the same as [`COMMAND_KEYS`].
pub const COMMAND_BUTTONS: [GamepadButton; 2] = [GamepadButton::South, GamepadButton::East];

/// The devices that steer the character in focus.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Steering {
    /// The left stick and the `STEERING_KEYS`.
    pub on: bool,
    /// The `COMMAND_KEYS` and `COMMAND_BUTTONS`.
    pub buttons: bool,
    /// The `MOVE_KEYS`: a stick points to a direction of the picture.
    pub by_camera: bool,
    /// The `FLY_KEYS`: they fly the camera, and no key steers.
    pub flying: bool,
}

impl Steering {
    /// Whether a key steers and has no other action.
    pub fn takes_key(&self, key: KeyCode) -> bool {
        self.on && STEERING_KEYS.contains(&key)
            || self.buttons && COMMAND_KEYS.contains(&key)
            || self.by_camera && MOVE_KEYS.contains(&key)
            || self.flying && FLY_KEYS.contains(&key)
    }

    /// Whether a gamepad button steers and has no other action.
    pub fn takes_button(&self, button: GamepadButton) -> bool {
        self.buttons && COMMAND_BUTTONS.contains(&button)
    }
}

pub(super) fn plugin(app: &mut App) {
    app.init_resource::<Steering>().add_message::<ActionRequested>().add_message::<ActionPressed>();
}
