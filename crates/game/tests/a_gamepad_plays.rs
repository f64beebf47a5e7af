//! A gamepad does what keys do: raw events, as its driver sends them, become deeds. No pad, no window needed.
#![cfg(feature = "render")]

use bevy::input::InputPlugin;
use bevy::input::gamepad::{
    GamepadButton, GamepadConnection, GamepadConnectionEvent, RawGamepadButtonChangedEvent, RawGamepadEvent,
};
use bevy::prelude::*;
use marathon_game::app::{Bindings, Deed, Do, KeysPlugin};

#[derive(Resource, Default)]
struct Done(Vec<Deed>);

fn app() -> (App, Entity) {
    let mut app = App::new();
    app.add_plugins((MinimalPlugins, InputPlugin, KeysPlugin)).init_resource::<Done>();
    app.add_systems(Update, |mut done: ResMut<Done>, mut deeds: MessageReader<Do>| {
        done.0.extend(deeds.read().map(|d| d.0));
    });
    app.update();
    // whoever runs the tests may have keys of their own
    app.insert_resource(Bindings::default());
    let pad = app.world_mut().spawn_empty().id();
    let connection = GamepadConnection::Connected { name: "test pad".into(), vendor_id: None, product_id: None };
    // a driver tells a connection twice: one message makes the pad, the other goes to those who read raw events
    let event = GamepadConnectionEvent { gamepad: pad, connection };
    app.world_mut().write_message(event.clone());
    app.world_mut().write_message(RawGamepadEvent::Connection(event));
    app.update();
    (app, pad)
}

fn press(app: &mut App, pad: Entity, button: GamepadButton, value: f32) {
    let event = RawGamepadButtonChangedEvent { gamepad: pad, button, value };
    app.world_mut().write_message(RawGamepadEvent::Button(event));
    app.update();
}

#[test]
fn buttons_become_deeds_once_per_press() {
    let (mut app, pad) = app();
    press(&mut app, pad, GamepadButton::South, 1.0);
    app.update();
    app.update();
    press(&mut app, pad, GamepadButton::South, 0.0);
    press(&mut app, pad, GamepadButton::East, 1.0);
    press(&mut app, pad, GamepadButton::Start, 1.0);
    assert_eq!(app.world().resource::<Done>().0, [Deed::Push, Deed::Throw, Deed::Menu]);
}

#[test]
fn keys_can_be_changed() {
    let (mut app, _) = app();
    app.world_mut().resource_mut::<Bindings>().bind(Deed::Push, KeyCode::KeyO);
    // as a window sends it
    let event = bevy::input::keyboard::KeyboardInput {
        key_code: KeyCode::KeyO,
        logical_key: bevy::input::keyboard::Key::Character("o".into()),
        state: bevy::input::ButtonState::Pressed,
        text: None,
        repeat: false,
        window: Entity::PLACEHOLDER,
    };
    app.world_mut().write_message(event);
    app.update();
    app.update();
    assert_eq!(app.world().resource::<Done>().0, [Deed::Push]);
}
