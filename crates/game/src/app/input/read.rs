//! Keys and buttons request actions.

use crate::app::input::actions::{ActionRequested, KeysFor, Steering};
use crate::app::input::bindings::{Bindable, Bindings, Press};
use crate::app::input::rebind::{RebindSet, Rebinding};
use bevy::input::InputSystems;
use bevy::input::gamepad::Gamepad;
use bevy::prelude::*;
use bevy_egui::input::EguiWantsInput;

/// The system that turns keys and buttons into actions.
#[derive(SystemSet, Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ReadSet;

pub(super) fn plugin(app: &mut App) {
    app.add_systems(PreUpdate, read.in_set(ReadSet).after(InputSystems).before(RebindSet));
}

/// Turns keys and buttons into actions.
fn read(
    keys: Res<ButtonInput<KeyCode>>,
    pads: Query<&Gamepad>,
    (bindings, rebinding, keys_for): (Res<Bindings>, Res<Rebinding>, Res<KeysFor>),
    wants: Option<Res<EguiWantsInput>>,
    steering: Option<Res<Steering>>,
    mut pressed: MessageWriter<ActionRequested>,
) {
    // the next key is to be bound
    if rebinding.is_busy() {
        return;
    }
    // a text field has the keyboard; in a menu, any item may have it
    let typing = *keys_for == KeysFor::Game && wants.is_some_and(|w| w.wants_keyboard_input());
    let steering = steering.map_or_else(Steering::default, |steering| *steering);
    for row in bindings.rows() {
        let Bindable::Action(action) = row.what else { continue };
        let free = |press: Press| *keys_for != KeysFor::Game || !bindings.steers(steering, press);
        let flies = *keys_for == KeysFor::Game && steering.flies(row.key);
        let key = !typing && !flies && keys.just_pressed(row.key) && free(Press::Key(row.key));
        let own = row.button.filter(|button| free(Press::Button(*button)));
        let button = own.is_some_and(|button| pads.iter().any(|pad| pad.just_pressed(button)));
        // the same key again answers a question, and buttons are for its items
        let key = key && (*keys_for == KeysFor::Question || keys_for.allows(action));
        if key || button && keys_for.allows(action) {
            pressed.write(ActionRequested(action));
        }
    }
}
