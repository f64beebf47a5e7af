//! A gamepad does what keys do: raw events, as its driver sends them, become actions. No pad, no window needed.

use crate::devices::{self, key, pull};
use bevy::input::gamepad::GamepadButton;
use bevy::input::{ButtonState, InputPlugin};
use bevy::prelude::*;
use marathon_game::app::{Action, ActionPressed, Bindable, Bindings, KeysPlugin, Press};

#[derive(Resource, Default)]
struct Done(Vec<Action>);

fn app() -> (App, Entity) {
    let mut app = App::new();
    app.add_plugins((MinimalPlugins, InputPlugin, KeysPlugin)).init_resource::<Done>();
    app.add_systems(Update, |mut done: ResMut<Done>, mut actions: MessageReader<ActionPressed>| {
        done.0.extend(actions.read().map(|d| d.0));
    });
    app.update();
    // the user that runs the tests may have changed the key bindings
    app.insert_resource(Bindings::default());
    let pad = devices::pad(&mut app);
    (app, pad)
}

#[test]
fn buttons_become_actions_once_per_press() {
    let (mut app, pad) = app();
    pull(&mut app, pad, GamepadButton::South, 1.0);
    app.update();
    app.update();
    pull(&mut app, pad, GamepadButton::South, 0.0);
    pull(&mut app, pad, GamepadButton::RightTrigger2, 1.0);
    pull(&mut app, pad, GamepadButton::Start, 1.0);
    assert_eq!(app.world().resource::<Done>().0, [Action::Push, Action::Throw, Action::Menu]);
}

#[test]
fn keys_can_be_changed() {
    let (mut app, _) = app();
    app.world_mut().resource_mut::<Bindings>().bind(Bindable::Action(Action::Push), Press::Key(KeyCode::KeyO));
    key(&mut app, KeyCode::KeyO, ButtonState::Pressed);
    app.update();
    assert_eq!(app.world().resource::<Done>().0, [Action::Push]);
}
