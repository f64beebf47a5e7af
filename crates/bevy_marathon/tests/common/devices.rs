//! Gamepads and keys that a test moves.
#![allow(dead_code, reason = "a test may do without some")]

use bevy::input::ButtonState;
use bevy::input::gamepad::{
    GamepadAxis, GamepadButton, GamepadConnection, GamepadConnectionEvent, RawGamepadAxisChangedEvent,
    RawGamepadButtonChangedEvent, RawGamepadEvent,
};
use bevy::input::keyboard::{Key, KeyboardInput};
use bevy::prelude::*;

/// A gamepad, as its driver tells of it.
pub fn pad(app: &mut App) -> Entity {
    let pad = app.world_mut().spawn_empty().id();
    let connection = GamepadConnection::Connected { name: "test pad".into(), vendor_id: None, product_id: None };
    let event = GamepadConnectionEvent { gamepad: pad, connection };
    // it tells a connection twice: one message makes the pad, the other goes to those who read raw events
    app.world_mut().write_message(event.clone());
    app.world_mut().write_message(RawGamepadEvent::Connection(event));
    app.update();
    pad
}

/// Moves a stick, and lets a frame go by.
pub fn push(app: &mut App, pad: Entity, axis: GamepadAxis, value: f32) {
    let event = RawGamepadAxisChangedEvent { gamepad: pad, axis, value };
    app.world_mut().write_message(RawGamepadEvent::Axis(event));
    app.update();
}

/// Presses a button or trigger as far as said, and lets a frame go by.
pub fn pull(app: &mut App, pad: Entity, button: GamepadButton, value: f32) {
    let event = RawGamepadButtonChangedEvent { gamepad: pad, button, value };
    app.world_mut().write_message(RawGamepadEvent::Button(event));
    app.update();
}

/// Presses a button for a frame, and releases it for another.
pub fn press(app: &mut App, pad: Entity, button: GamepadButton) {
    for value in [1.0, 0.0] {
        pull(app, pad, button, value);
    }
}

/// Presses or releases a key, and lets a frame go by.
pub fn key(app: &mut App, key_code: KeyCode, state: ButtonState) {
    let (logical_key, window) = (Key::Character("key".into()), Entity::PLACEHOLDER);
    app.world_mut().write_message(KeyboardInput { key_code, logical_key, state, text: None, repeat: false, window });
    app.update();
}
