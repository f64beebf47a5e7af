//! Actions, and the controls that steer instead of having an action.

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
    /// Put a pile of boxes in front of the character in focus.
    Boxes,
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

/// Keys that fly a free camera: ahead and back, to the left and right, up and down.
pub const FLY_KEYS: [KeyCode; 6] =
    [KeyCode::KeyW, KeyCode::KeyS, KeyCode::KeyA, KeyCode::KeyD, KeyCode::KeyE, KeyCode::KeyQ];
/// Keys that make it fast.
pub const FAST_KEYS: [KeyCode; 2] = [KeyCode::ShiftLeft, KeyCode::ShiftRight];

/// A control of the character that is held, for characters that take commands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, ValueEnum)]
pub enum Steer {
    /// Away from the camera.
    MoveAhead,
    /// Toward the camera.
    MoveBack,
    /// To the left of the picture; a step aside if the stick is the character's.
    MoveLeft,
    /// To the right of the picture; a step aside if the stick is the character's.
    MoveRight,
    /// Another key for away from the camera; ahead if the stick is the character's.
    SteerAhead,
    /// Another key for toward the camera; back if the stick is the character's.
    SteerBack,
    /// Another key for the left of the picture; a turn if the stick is the character's.
    SteerLeft,
    /// Another key for the right of the picture; a turn if the stick is the character's.
    SteerRight,
    /// Run, while it is held.
    Run,
    /// The first button of a command, such as a jump.
    Jump,
    /// The second button of a command, such as a backflip.
    Flip,
}

/// The purpose of keys and buttons.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum KeysFor {
    /// The characters and the picture.
    #[default]
    Game,
    /// A menu over the picture: only the actions [`KeysFor::allows`] work.
    Menu,
    /// A question over the picture: keys answer it.
    Question,
}

impl KeysFor {
    /// Whether an action works.
    pub fn allows(self, action: Action) -> bool {
        self == KeysFor::Game || matches!(action, Action::Menu | Action::Quit | Action::Picture)
    }
}

/// The controls that steer the character in focus.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Steering {
    /// The left stick and the keys that steer.
    pub on: bool,
    /// [`Steer::Jump`] and [`Steer::Flip`].
    pub buttons: bool,
    /// A stick points to a direction of the picture.
    pub by_camera: bool,
    /// The `FLY_KEYS`: they fly the camera, and no key steers.
    pub flying: bool,
}

impl Steering {
    /// Whether a key flies the camera, and has no other action.
    pub fn flies(&self, key: KeyCode) -> bool {
        self.flying && FLY_KEYS.contains(&key)
    }

    /// Whether a control has an effect. Its key and its button have no other action then.
    pub fn takes(&self, steer: Steer) -> bool {
        match steer {
            Steer::MoveAhead | Steer::MoveBack | Steer::Run => self.by_camera,
            Steer::Jump | Steer::Flip => self.buttons,
            _ => self.on,
        }
    }
}

pub(super) fn plugin(app: &mut App) {
    app.init_resource::<Steering>()
        .init_resource::<KeysFor>()
        .add_message::<ActionRequested>()
        .add_message::<ActionPressed>();
}
