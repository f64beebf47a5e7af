//! Gamepads in menus: the D-pad and the left stick move the focus, one button activates an item, another goes back.

use crate::app::input::actions::{Action, ActionRequested, KeysFor};
use crate::app::input::read::ReadSet;
use crate::app::input::rebind::{RebindSet, Rebinding};
use bevy::input::gamepad::{Gamepad, GamepadButton};
use bevy::prelude::*;
use bevy_egui::{EguiContext, EguiInput, EguiPreUpdateSet, PrimaryEguiContext, egui};
use egui::Key;

/// Deflection of the stick that moves the focus.
const STICK: f32 = 0.6;
/// Seconds before a held direction repeats, and between its repetitions.
const REPEAT: [f32; 2] = [0.4, 0.14];

pub(super) fn plugin(app: &mut App) {
    app.add_systems(PreUpdate, go_back.before(ReadSet).before(RebindSet).run_if(in_a_menu)).add_systems(
        PreUpdate,
        navigate.after(EguiPreUpdateSet::ProcessInput).before(EguiPreUpdateSet::BeginPass).before(RebindSet),
    );
}

/// Whether a menu has the gamepad, and no button is about to be bound.
fn in_a_menu(keys_for: Res<KeysFor>, rebinding: Res<Rebinding>) -> bool {
    *keys_for != KeysFor::Game && !rebinding.is_busy()
}

/// The east button goes back, as the menu key does.
fn go_back(pads: Query<&Gamepad>, mut requests: MessageWriter<ActionRequested>) {
    if pads.iter().any(|pad| pad.just_pressed(GamepadButton::East)) {
        requests.write(ActionRequested(Action::Menu));
    }
}

/// A direction that is held.
#[derive(Default)]
struct Held {
    key: Option<Key>,
    /// Seconds until it repeats.
    left: f32,
}

impl Held {
    /// The key of this frame: at once, and again while the direction is held.
    fn update(&mut self, key: Option<Key>, dt: f32) -> Option<Key> {
        if self.key != key {
            *self = Held { key, left: REPEAT[0] };
            return key;
        }
        self.left -= dt;
        if self.left > 0.0 {
            return None;
        }
        self.left = REPEAT[1];
        key
    }
}

/// The key of the direction that a gamepad points to.
fn direction(pad: &Gamepad) -> Option<Key> {
    let stick = pad.left_stick();
    let across = stick.x.abs() > stick.y.abs();
    let keys = [
        (GamepadButton::DPadUp, !across && stick.y > STICK, Key::ArrowUp),
        (GamepadButton::DPadDown, !across && stick.y < -STICK, Key::ArrowDown),
        (GamepadButton::DPadLeft, across && stick.x < -STICK, Key::ArrowLeft),
        (GamepadButton::DPadRight, across && stick.x > STICK, Key::ArrowRight),
    ];
    keys.into_iter().find(|(button, stick, _)| *stick || pad.pressed(*button)).map(|(.., key)| key)
}

/// Sends the keys that egui moves its focus by. Outside of menus, nothing has the focus.
fn navigate(
    time: Res<Time<Real>>,
    pads: Query<&Gamepad>,
    (keys_for, rebinding): (Res<KeysFor>, Res<Rebinding>),
    mut contexts: Query<(&mut EguiContext, &mut EguiInput), With<PrimaryEguiContext>>,
    mut held: Local<Held>,
) {
    let open = in_a_menu(keys_for, rebinding);
    let key = pads.iter().find_map(direction).filter(|_| open);
    let key = held.update(key, time.delta_secs());
    let activates = open && pads.iter().any(|pad| pad.just_pressed(GamepadButton::South));
    for (mut context, mut input) in &mut contexts {
        let ctx = context.get_mut();
        let focused = ctx.memory(|memory| memory.focused());
        if !open {
            if let Some(focused) = focused.filter(|_| !ctx.text_edit_focused()) {
                ctx.memory_mut(|memory| memory.surrender_focus(focused));
            }
            continue;
        }
        // without a focus, there is no direction to move it
        let key = if focused.is_some() { key } else { key.map(|_| Key::Tab) };
        for key in key.into_iter().chain(activates.then_some(Key::Enter)) {
            for pressed in [true, false] {
                let modifiers = egui::Modifiers::NONE;
                input.events.push(egui::Event::Key { key, physical_key: None, pressed, repeat: false, modifiers });
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_held_direction_repeats_after_a_while() {
        let mut held = Held::default();
        let mut moved = 0;
        for _ in 0..60 {
            moved += i32::from(held.update(Some(Key::ArrowDown), 0.016).is_some());
        }
        assert!((4..7).contains(&moved), "{moved} times in a second");
        assert_eq!(held.update(None, 0.016), None);
        assert_eq!(held.update(Some(Key::ArrowUp), 0.016), Some(Key::ArrowUp));
    }
}
