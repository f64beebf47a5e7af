//! Keys and gamepads that are held at given times, as if somebody had them in hand: films of somebody who plays, that anyone can
//! make again.
//!
//! A hold becomes what a device's driver would send, so that it takes the same way as a player's: through Bevy's input, the
//! bindings and the mappings.

use crate::app::keys;
use bevy::input::ButtonState;
use bevy::input::gamepad::{
    GamepadAxis, GamepadConnection, GamepadConnectionEvent, RawGamepadAxisChangedEvent, RawGamepadButtonChangedEvent,
    RawGamepadEvent,
};
use bevy::input::keyboard::{Key, KeyboardInput};
use bevy::prelude::*;
use marathon_physics::hint::among;
use std::str::FromStr;

/// Axes of a gamepad, and triggers, which move like axes, from 0 on.
const AXES: [(&str, Control); 6] = [
    ("left-x", Control::Axis(GamepadAxis::LeftStickX)),
    ("left-y", Control::Axis(GamepadAxis::LeftStickY)),
    ("right-x", Control::Axis(GamepadAxis::RightStickX)),
    ("right-y", Control::Axis(GamepadAxis::RightStickY)),
    ("left-trigger", Control::Button(GamepadButton::LeftTrigger2)),
    ("right-trigger", Control::Button(GamepadButton::RightTrigger2)),
];
/// Most gamepads.
const PADS: usize = 4;
const EXPECTED: &str = "expected times and what is held, such as 1-2.5:key:up, 1-3:pad:left-y=0.5 or 2-2.2:pad2:a";

/// What is held.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Control {
    Key(KeyCode),
    Button(GamepadButton),
    Axis(GamepadAxis),
}

/// Something held for a while: `1-2.5:key:up` on the command line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hold {
    /// Seconds since the start at which it begins and ends, of the picture's time.
    from: f32,
    to: f32,
    control: Control,
    /// Gamepad, counted from 0.
    pad: usize,
    /// How far it is pushed: 1 for keys and buttons.
    amount: f32,
}

impl FromStr for Hold {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (times, held) = text.split_once(':').ok_or(EXPECTED)?;
        let (device, name) = held.split_once(':').ok_or(EXPECTED)?;
        let second = |text: &str| text.parse().ok().filter(|s: &f32| s.is_finite() && *s >= 0.0);
        let times = times.split_once('-').and_then(|(from, to)| Some((second(from)?, second(to)?)));
        let Some((from, to)) = times.filter(|(from, to)| from < to) else {
            return Err(format!("'{text}' does not begin with two times, the later one last, such as 1-2.5"));
        };
        let (name, amount) = name.split_once('=').map_or((name, None), |(name, amount)| (name, Some(amount)));
        let number = device.strip_prefix("pad").map(|n| if n.is_empty() { Ok(1) } else { n.parse::<usize>() });
        let axis = AXES.iter().find(|(known, _)| *known == name).map(|(_, control)| *control);
        let (control, pad) = match number {
            None if device == "key" => (keys::key_named(name).map(Control::Key), 0),
            Some(Ok(pad @ 1..=PADS)) => (axis.or(keys::button_named(name).map(Control::Button)), pad - 1),
            _ => return Err(format!("there is no device '{device}', expected key, or pad to pad{PADS}")),
        };
        let Some(control) = control else {
            let of_pad = || AXES.iter().map(|(name, _)| name.to_string()).chain(keys::button_names()).collect();
            let names: Vec<String> = if number.is_some() { of_pad() } else { keys::key_names().collect() };
            return Err(format!("a {device} has no '{name}'{}", among(name, &names)));
        };
        let amount = match amount {
            None => 1.0,
            Some(_) if axis.is_none() => return Err(format!("'{name}' is held or not, without a number")),
            Some(text) => {
                let least = if matches!(control, Control::Axis(_)) { -1.0 } else { 0.0 };
                let amount = text.parse().ok().filter(|x| (least..=1.0).contains(x));
                amount.ok_or_else(|| format!("'{text}' is not how far '{name}' is pushed, expected {least} to 1"))?
            }
        };
        Ok(Hold { from, to, control, pad, amount })
    }
}

/// What is held, and the gamepads that are.
#[derive(Resource)]
pub struct Hands {
    /// What is to be held, with whether it is now.
    holds: Vec<(Hold, bool)>,
    pads: [Option<Entity>; PADS],
}

impl Hands {
    /// Hands that hold this.
    pub fn new(holds: &[Hold]) -> Self {
        Hands { holds: holds.iter().map(|hold| (*hold, false)).collect(), pads: [None; PADS] }
    }
}

/// Takes hold of gamepads that are needed.
pub fn connect(
    mut commands: Commands,
    mut hands: ResMut<Hands>,
    mut connections: MessageWriter<GamepadConnectionEvent>,
    mut raw: MessageWriter<RawGamepadEvent>,
) {
    let of_pad = |hold: &Hold| !matches!(hold.control, Control::Key(_));
    let last = hands.holds.iter().filter(|(hold, _)| of_pad(hold)).map(|(hold, _)| hold.pad + 1).max();
    // a second gamepad has a first one before it
    for pad in &mut hands.pads[..last.unwrap_or(0)] {
        let gamepad = commands.spawn_empty().id();
        let name = "gamepad of --hold".into();
        let connection = GamepadConnection::Connected { name, vendor_id: None, product_id: None };
        let event = GamepadConnectionEvent { gamepad, connection };
        // one message makes the gamepad, the other goes to those who read raw events
        connections.write(event.clone());
        raw.write(RawGamepadEvent::Connection(event));
        *pad = Some(gamepad);
    }
}

/// Presses and releases what is due.
pub fn play(
    time: Res<Time<Real>>,
    mut hands: ResMut<Hands>,
    mut keys: MessageWriter<KeyboardInput>,
    mut raw: MessageWriter<RawGamepadEvent>,
) {
    let (now, pads) = (time.elapsed_secs(), hands.pads);
    let changed = |(hold, held): &&mut (Hold, bool)| (hold.from..hold.to).contains(&now) != *held;
    let mut due: Vec<_> = hands.holds.iter_mut().filter(changed).collect();
    // who lets go of a stick and pushes it at once pushes it
    due.sort_by_key(|(_, held)| !*held);
    for (hold, held) in due {
        *held = !*held;
        let value = if *held { hold.amount } else { 0.0 };
        match (hold.control, pads[hold.pad]) {
            (Control::Key(key_code), _) => {
                let state = if *held { ButtonState::Pressed } else { ButtonState::Released };
                let (logical_key, window) =
                    (Key::Unidentified(bevy::input::keyboard::NativeKey::Unidentified), Entity::PLACEHOLDER);
                keys.write(KeyboardInput { key_code, logical_key, state, text: None, repeat: false, window });
            }
            (Control::Button(button), Some(gamepad)) => {
                raw.write(RawGamepadEvent::Button(RawGamepadButtonChangedEvent { gamepad, button, value }));
            }
            (Control::Axis(axis), Some(gamepad)) => {
                raw.write(RawGamepadEvent::Axis(RawGamepadAxisChangedEvent { gamepad, axis, value }));
            }
            (_, None) => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn holds_are_read() {
        let hold = |control, pad, amount| Ok(Hold { from: 1.0, to: 2.5, control, pad, amount });
        assert_eq!("1-2.5:key:up".parse(), hold(Control::Key(KeyCode::ArrowUp), 0, 1.0));
        assert_eq!("1-2.5:key:Page-up".parse(), hold(Control::Key(KeyCode::PageUp), 0, 1.0));
        assert_eq!("1-2.5:pad:a".parse(), hold(Control::Button(GamepadButton::South), 0, 1.0));
        assert_eq!("1-2.5:pad2:left-y=-0.5".parse(), hold(Control::Axis(GamepadAxis::LeftStickY), 1, -0.5));
        let trigger = Control::Button(GamepadButton::LeftTrigger2);
        assert_eq!("1-2.5:pad:left-trigger=0.5".parse(), hold(trigger, 0, 0.5));
        for (text, part) in [
            ("up", "such as 1-2.5:key:up"),
            ("1-2:up", "such as 1-2.5:key:up"),
            ("2-1:key:up", "the later one last"),
            ("2:key:up", "the later one last"),
            ("-1-1:key:up", "the later one last"),
            ("1-2:keys:up", "there is no device 'keys'"),
            ("1-2:pad5:a", "there is no device 'pad5'"),
            ("1-2:pad0:a", "there is no device 'pad0'"),
            ("1-2:key:upp", "did you mean 'up'"),
            ("1-2:pad:left-z", "did you mean 'left-x'"),
            ("1-2:key:up=0.5", "is held or not"),
            ("1-2:pad:left-x=2", "expected -1 to 1"),
            ("1-2:pad:left-trigger=-0.1", "expected 0 to 1"),
        ] {
            let error = text.parse::<Hold>().expect_err(text);
            assert!(error.contains(part), "{text}: {error}");
        }
    }
}
