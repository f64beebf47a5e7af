//! Names of keys and of the buttons of a gamepad.

use bevy::input::gamepad::GamepadButton;
use bevy::prelude::*;

/// The keys that an action can be bound to, with their names on the screen.
pub const KEYS: [(KeyCode, &str); 74] = [
    (KeyCode::Escape, "Esc"),
    (KeyCode::Space, "Space"),
    (KeyCode::Enter, "Enter"),
    (KeyCode::Tab, "Tab"),
    (KeyCode::Backspace, "Backspace"),
    (KeyCode::Delete, "Delete"),
    (KeyCode::Home, "Home"),
    (KeyCode::End, "End"),
    (KeyCode::PageUp, "Page up"),
    (KeyCode::PageDown, "Page down"),
    (KeyCode::ArrowUp, "Up"),
    (KeyCode::ArrowDown, "Down"),
    (KeyCode::ArrowLeft, "Left"),
    (KeyCode::ArrowRight, "Right"),
    (KeyCode::Period, "."),
    (KeyCode::Comma, ","),
    (KeyCode::Slash, "Slash"),
    (KeyCode::Semicolon, "Semicolon"),
    (KeyCode::Quote, "Quote"),
    (KeyCode::Minus, "Minus"),
    (KeyCode::Equal, "Equal"),
    (KeyCode::ShiftLeft, "Shift"),
    (KeyCode::ShiftRight, "Right Shift"),
    (KeyCode::ControlLeft, "Ctrl"),
    (KeyCode::ControlRight, "Right Ctrl"),
    (KeyCode::AltLeft, "Alt"),
    (KeyCode::KeyA, "A"),
    (KeyCode::KeyB, "B"),
    (KeyCode::KeyC, "C"),
    (KeyCode::KeyD, "D"),
    (KeyCode::KeyE, "E"),
    (KeyCode::KeyF, "F"),
    (KeyCode::KeyG, "G"),
    (KeyCode::KeyH, "H"),
    (KeyCode::KeyI, "I"),
    (KeyCode::KeyJ, "J"),
    (KeyCode::KeyK, "K"),
    (KeyCode::KeyL, "L"),
    (KeyCode::KeyM, "M"),
    (KeyCode::KeyN, "N"),
    (KeyCode::KeyO, "O"),
    (KeyCode::KeyP, "P"),
    (KeyCode::KeyQ, "Q"),
    (KeyCode::KeyR, "R"),
    (KeyCode::KeyS, "S"),
    (KeyCode::KeyT, "T"),
    (KeyCode::KeyU, "U"),
    (KeyCode::KeyV, "V"),
    (KeyCode::KeyW, "W"),
    (KeyCode::KeyX, "X"),
    (KeyCode::KeyY, "Y"),
    (KeyCode::KeyZ, "Z"),
    (KeyCode::Digit0, "0"),
    (KeyCode::Digit1, "1"),
    (KeyCode::Digit2, "2"),
    (KeyCode::Digit3, "3"),
    (KeyCode::Digit4, "4"),
    (KeyCode::Digit5, "5"),
    (KeyCode::Digit6, "6"),
    (KeyCode::Digit7, "7"),
    (KeyCode::Digit8, "8"),
    (KeyCode::Digit9, "9"),
    (KeyCode::F1, "F1"),
    (KeyCode::F2, "F2"),
    (KeyCode::F3, "F3"),
    (KeyCode::F4, "F4"),
    (KeyCode::F5, "F5"),
    (KeyCode::F6, "F6"),
    (KeyCode::F7, "F7"),
    (KeyCode::F8, "F8"),
    (KeyCode::F9, "F9"),
    (KeyCode::F10, "F10"),
    (KeyCode::F11, "F11"),
    (KeyCode::F12, "F12"),
];

/// The buttons of a gamepad, with their names on the screen.
pub const BUTTON_NAMES: [(GamepadButton, &str); 16] = [
    (GamepadButton::South, "A"),
    (GamepadButton::East, "B"),
    (GamepadButton::West, "X"),
    (GamepadButton::North, "Y"),
    (GamepadButton::Start, "Start"),
    (GamepadButton::Select, "Back"),
    (GamepadButton::LeftTrigger, "LB"),
    (GamepadButton::RightTrigger, "RB"),
    (GamepadButton::LeftTrigger2, "LT"),
    (GamepadButton::RightTrigger2, "RT"),
    (GamepadButton::LeftThumb, "L3"),
    (GamepadButton::RightThumb, "R3"),
    (GamepadButton::DPadUp, "D-pad up"),
    (GamepadButton::DPadDown, "D-pad down"),
    (GamepadButton::DPadLeft, "D-pad left"),
    (GamepadButton::DPadRight, "D-pad right"),
];

/// The name of a key on the screen.
pub fn key_name(key: KeyCode) -> &'static str {
    KEYS.iter().find(|(known, _)| *known == key).map_or("?", |(_, name)| name)
}

/// The name of a gamepad button on the screen.
pub fn button_name(button: GamepadButton) -> &'static str {
    BUTTON_NAMES.iter().find(|(known, _)| *known == button).map_or("?", |(_, name)| name)
}

/// The key with a name, such as `Up` or `page-up`.
pub fn key_named(name: &str) -> Option<KeyCode> {
    KEYS.iter().find(|(_, known)| is_called(known, name)).map(|(key, _)| *key)
}

/// The gamepad button with a name, such as `A` or `d-pad-up`.
pub fn button_named(name: &str) -> Option<GamepadButton> {
    BUTTON_NAMES.iter().find(|(_, known)| is_called(known, name)).map(|(button, _)| *button)
}

/// The names of all keys on a command line.
pub fn key_names() -> impl Iterator<Item = String> {
    KEYS.iter().map(|(_, name)| on_a_command_line(name))
}

/// The names of all gamepad buttons on a command line.
pub fn button_names() -> impl Iterator<Item = String> {
    BUTTON_NAMES.iter().map(|(_, name)| on_a_command_line(name))
}

fn is_called(known: &str, name: &str) -> bool {
    on_a_command_line(known) == on_a_command_line(name)
}

/// A name without capitals and spaces.
fn on_a_command_line(name: &str) -> String {
    name.to_lowercase().replace(' ', "-")
}
