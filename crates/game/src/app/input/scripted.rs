//! Scripted input: actions and held controls at given times, for videos that can be made again.
//!
//! A held control sends what the driver of a device would send, so that it passes Bevy's input, the bindings and the mappings.

use crate::app::input::actions::{Action, ActionRequested};
use crate::app::input::key_names::{button_named, button_names, key_named, key_names};
use bevy::input::gamepad::{
    GamepadAxis, GamepadConnection, GamepadConnectionEvent, RawGamepadAxisChangedEvent, RawGamepadButtonChangedEvent,
    RawGamepadEvent,
};
use bevy::input::keyboard::{Key, KeyboardInput};
use bevy::input::{ButtonState, InputSystems};
use bevy::prelude::*;
use clap::ValueEnum;
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
const EXPECTED: &str = "expected times and a control, such as 1-2.5:key:up, 1-3:pad:left-y=0.5 or 2-2.2:pad2:a";

pub(super) fn plugin(app: &mut App) {
    app.init_resource::<ScriptedActions>()
        .init_resource::<ScriptedInputs>()
        .add_systems(Startup, connect)
        .add_systems(PreUpdate, (send_inputs.before(InputSystems), request_actions));
}

/// An action at a time: `2.5:throw` on the command line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScriptedAction {
    /// Seconds since the start, in real time: pauses and speeds do not change it.
    pub seconds: f32,
    /// The action.
    pub action: Action,
}

impl FromStr for ScriptedAction {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (seconds, name) = text.split_once(':').ok_or("expected seconds and an action, such as 2.5:throw")?;
        let number = seconds.parse().ok().filter(|s: &f32| s.is_finite() && *s >= 0.0);
        let seconds =
            number.ok_or_else(|| format!("'{seconds}' is no number of seconds, expected a number such as 2.5"))?;
        if let Ok(action) = Action::from_str(name, true) {
            return Ok(ScriptedAction { seconds, action });
        }
        let values = Action::value_variants().iter().filter_map(Action::to_possible_value);
        let names: Vec<String> = values.map(|value| value.get_name().to_string()).collect();
        Err(format!("there is no '{name}'{}", among(name, &names)))
    }
}

/// The scripted actions that are still to come, the last one first.
#[derive(Resource, Default)]
pub struct ScriptedActions(Vec<ScriptedAction>);

impl ScriptedActions {
    /// Takes actions in any order.
    pub fn new(mut actions: Vec<ScriptedAction>) -> Self {
        // a stable sort of the reversed list keeps the order of actions at the same time
        actions.reverse();
        actions.sort_by(|a, b| b.seconds.total_cmp(&a.seconds));
        ScriptedActions(actions)
    }
}

/// Requests the actions that are due.
pub fn request_actions(
    time: Res<Time<Real>>,
    mut actions: ResMut<ScriptedActions>,
    mut requests: MessageWriter<ActionRequested>,
) {
    while let Some(next) = actions.0.pop_if(|next| next.seconds <= time.elapsed_secs()) {
        requests.write(ActionRequested(next.action));
    }
}

/// A control of a device.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Control {
    Key(KeyCode),
    Button(GamepadButton),
    Axis(GamepadAxis),
}

/// A control that is held for a while: `1-2.5:key:up` on the command line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScriptedInput {
    /// Seconds since the start, in real time, at which it begins and ends.
    from: f32,
    to: f32,
    control: Control,
    /// Gamepad, counted from 0.
    pad: usize,
    /// Deflection of the control: 1 for keys and buttons.
    amount: f32,
}

impl FromStr for ScriptedInput {
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
            None if device == "key" => (key_named(name).map(Control::Key), 0),
            Some(Ok(pad @ 1..=PADS)) => (axis.or(button_named(name).map(Control::Button)), pad - 1),
            _ => return Err(format!("there is no device '{device}', expected key, or pad to pad{PADS}")),
        };
        let Some(control) = control else {
            let of_pad = || AXES.iter().map(|(name, _)| name.to_string()).chain(button_names()).collect();
            let names: Vec<String> = if number.is_some() { of_pad() } else { key_names().collect() };
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
        Ok(ScriptedInput { from, to, control, pad, amount })
    }
}

/// The scripted inputs, and their gamepads.
#[derive(Resource, Default)]
pub struct ScriptedInputs {
    /// The inputs, and whether each is held now.
    inputs: Vec<(ScriptedInput, bool)>,
    pads: [Option<Entity>; PADS],
}

impl ScriptedInputs {
    /// Takes inputs in any order.
    pub fn new(inputs: &[ScriptedInput]) -> Self {
        ScriptedInputs { inputs: inputs.iter().map(|input| (*input, false)).collect(), pads: [None; PADS] }
    }
}

/// Connects the gamepads that the inputs need.
fn connect(
    mut commands: Commands,
    mut scripted: ResMut<ScriptedInputs>,
    mut connections: MessageWriter<GamepadConnectionEvent>,
    mut raw: MessageWriter<RawGamepadEvent>,
) {
    let of_pad = |input: &ScriptedInput| !matches!(input.control, Control::Key(_));
    let last = scripted.inputs.iter().filter(|(input, _)| of_pad(input)).map(|(input, _)| input.pad + 1).max();
    // a second gamepad has a first one before it
    for pad in &mut scripted.pads[..last.unwrap_or(0)] {
        let gamepad = commands.spawn_empty().id();
        let name = "gamepad of --input".into();
        let connection = GamepadConnection::Connected { name, vendor_id: None, product_id: None };
        let event = GamepadConnectionEvent { gamepad, connection };
        // one message makes the gamepad, the other is for readers of raw events
        connections.write(event.clone());
        raw.write(RawGamepadEvent::Connection(event));
        *pad = Some(gamepad);
    }
}

/// Presses and releases the inputs that are due.
fn send_inputs(
    time: Res<Time<Real>>,
    mut scripted: ResMut<ScriptedInputs>,
    mut keys: MessageWriter<KeyboardInput>,
    mut raw: MessageWriter<RawGamepadEvent>,
) {
    let (now, pads) = (time.elapsed_secs(), scripted.pads);
    let changed = |(input, held): &&mut (ScriptedInput, bool)| (input.from..input.to).contains(&now) != *held;
    let mut due: Vec<_> = scripted.inputs.iter_mut().filter(changed).collect();
    // apply releases before presses, so that a release and a press in one frame end pressed
    due.sort_by_key(|(_, held)| !*held);
    for (input, held) in due {
        *held = !*held;
        let value = if *held { input.amount } else { 0.0 };
        match (input.control, pads[input.pad]) {
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
    fn actions_are_read() {
        let at = |seconds, action| ScriptedAction { seconds, action };
        assert_eq!("2.5:throw".parse(), Ok(at(2.5, Action::Throw)));
        assert_eq!("0:next-agent".parse(), Ok(at(0.0, Action::NextAgent)));
        for (text, part) in [
            ("throw", "2.5:throw"),
            ("x:throw", "'x' is no number"),
            ("-1:throw", "'-1' is no number"),
            ("1:thorw", "did you mean 'throw'"),
        ] {
            let error = text.parse::<ScriptedAction>().expect_err(text);
            assert!(error.contains(part), "{error}");
        }
    }

    #[test]
    fn each_comes_once_in_its_order() {
        let at = |seconds, action| ScriptedAction { seconds, action };
        let mut app = App::new();
        app.init_resource::<Time<Real>>().add_message::<ActionRequested>().add_systems(Update, request_actions);
        let script = vec![at(2.0, Action::Quit), at(1.0, Action::Push), at(1.0, Action::Throw)];
        app.insert_resource(ScriptedActions::new(script));
        let mut done = Vec::new();
        for _ in 0..5 {
            app.world_mut().resource_mut::<Time<Real>>().advance_by(std::time::Duration::from_millis(500));
            app.update();
            done.push(
                app.world_mut().resource_mut::<Messages<ActionRequested>>().drain().map(|d| d.0).collect::<Vec<_>>(),
            );
        }
        assert_eq!(done, [vec![], vec![Action::Push, Action::Throw], vec![], vec![Action::Quit], vec![]]);
    }

    #[test]
    fn inputs_are_read() {
        let input = |control, pad, amount| Ok(ScriptedInput { from: 1.0, to: 2.5, control, pad, amount });
        assert_eq!("1-2.5:key:up".parse(), input(Control::Key(KeyCode::ArrowUp), 0, 1.0));
        assert_eq!("1-2.5:key:Page-up".parse(), input(Control::Key(KeyCode::PageUp), 0, 1.0));
        assert_eq!("1-2.5:pad:a".parse(), input(Control::Button(GamepadButton::South), 0, 1.0));
        assert_eq!("1-2.5:pad2:left-y=-0.5".parse(), input(Control::Axis(GamepadAxis::LeftStickY), 1, -0.5));
        let trigger = Control::Button(GamepadButton::LeftTrigger2);
        assert_eq!("1-2.5:pad:left-trigger=0.5".parse(), input(trigger, 0, 0.5));
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
            let error = text.parse::<ScriptedInput>().expect_err(text);
            assert!(error.contains(part), "{text}: {error}");
        }
    }
}
