//! The keys and buttons of actions and of the controls that steer, and their defaults.

use crate::app::input::actions::{Action, Steer, Steering};
use crate::app::input::key_names::{BUTTON_NAMES, KEYS, button_name, key_name};
use bevy::input::gamepad::GamepadButton;
use bevy::prelude::*;
use clap::ValueEnum;
use marathon_physics::hint::among;
use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::collections::BTreeMap;

/// Something with a key and perhaps a button.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Bindable {
    /// Happens once per press.
    Action(Action),
    /// Lasts while it is held.
    Steer(Steer),
}

/// A key or a button of a gamepad.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Press {
    /// A key.
    Key(KeyCode),
    /// A button of a gamepad.
    Button(GamepadButton),
}

/// Something with its name on the screen, its key and its button.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// The action or control.
    pub what: Bindable,
    /// Its name on the screen.
    pub name: &'static str,
    /// Its key.
    pub key: KeyCode,
    /// Its button.
    pub button: Option<GamepadButton>,
}

const fn act(action: Action, name: &'static str, key: KeyCode, button: Option<GamepadButton>) -> Row {
    Row { what: Bindable::Action(action), name, key, button }
}

const fn steer(steer: Steer, name: &'static str, key: KeyCode, button: Option<GamepadButton>) -> Row {
    Row { what: Bindable::Steer(steer), name, key, button }
}

const DEFAULTS: [Row; 43] = [
    steer(Steer::MoveAhead, "move ahead", KeyCode::KeyW, None),
    steer(Steer::MoveBack, "move back", KeyCode::KeyS, None),
    steer(Steer::MoveLeft, "move left", KeyCode::KeyA, None),
    steer(Steer::MoveRight, "move right", KeyCode::KeyD, None),
    steer(Steer::SteerAhead, "steer ahead", KeyCode::ArrowUp, None),
    steer(Steer::SteerBack, "steer back", KeyCode::ArrowDown, None),
    steer(Steer::SteerLeft, "steer left", KeyCode::ArrowLeft, None),
    steer(Steer::SteerRight, "steer right", KeyCode::ArrowRight, None),
    steer(Steer::Run, "run", KeyCode::ShiftLeft, None),
    steer(Steer::Jump, "jump", KeyCode::Space, Some(GamepadButton::South)),
    steer(Steer::Flip, "flip", KeyCode::KeyV, Some(GamepadButton::East)),
    act(Action::Menu, "menu", KeyCode::Escape, Some(GamepadButton::Start)),
    act(Action::Pause, "pause", KeyCode::Enter, Some(GamepadButton::Select)),
    act(Action::Step, "one step", KeyCode::Period, None),
    act(Action::Faster, "faster", KeyCode::ArrowUp, Some(GamepadButton::DPadUp)),
    act(Action::Slower, "slower", KeyCode::ArrowDown, Some(GamepadButton::DPadDown)),
    act(Action::Restart, "restart", KeyCode::KeyX, Some(GamepadButton::West)),
    act(Action::NextFocus, "next character", KeyCode::Tab, Some(GamepadButton::RightTrigger)),
    act(Action::NextAgent, "next agent", KeyCode::KeyN, Some(GamepadButton::North)),
    act(Action::Camera, "camera", KeyCode::KeyC, Some(GamepadButton::LeftTrigger)),
    act(Action::Push, "push", KeyCode::KeyP, Some(GamepadButton::South)),
    act(Action::Throw, "throw a ball", KeyCode::KeyB, Some(GamepadButton::RightTrigger2)),
    act(Action::Boxes, "boxes", KeyCode::KeyO, None),
    act(Action::Limp, "limp", KeyCode::KeyZ, None),
    act(Action::Film, "keep a film", KeyCode::F9, None),
    act(Action::Contacts, "contacts", KeyCode::KeyF, None),
    act(Action::Joints, "joints", KeyCode::KeyJ, None),
    act(Action::Ghost, "ghost of the clip", KeyCode::KeyK, None),
    act(Action::Errors, "errors in color", KeyCode::KeyE, None),
    act(Action::Hud, "text and bars", KeyCode::KeyH, None),
    act(Action::Help, "keys", KeyCode::F1, None),
    act(Action::Learn, "learn live", KeyCode::KeyL, None),
    act(Action::Save, "save policy", KeyCode::KeyS, None),
    act(Action::Record, "record", KeyCode::KeyR, Some(GamepadButton::RightThumb)),
    act(Action::Back, "back", KeyCode::ArrowLeft, Some(GamepadButton::DPadLeft)),
    act(Action::Ahead, "ahead", KeyCode::ArrowRight, Some(GamepadButton::DPadRight)),
    act(Action::Release, "let go", KeyCode::KeyG, Some(GamepadButton::LeftThumb)),
    act(Action::Higher, "build higher", KeyCode::PageUp, None),
    act(Action::Lower, "build lower", KeyCode::PageDown, None),
    act(Action::Even, "build level", KeyCode::Home, None),
    act(Action::Runs, "longest runs", KeyCode::KeyT, None),
    act(Action::Picture, "picture", KeyCode::F12, None),
    act(Action::Quit, "quit", KeyCode::KeyQ, None),
];

/// The keys and buttons of all actions and of all controls that steer.
#[derive(Resource, Clone, Debug, PartialEq)]
pub struct Bindings {
    rows: Vec<Row>,
}

impl Default for Bindings {
    fn default() -> Self {
        Bindings { rows: DEFAULTS.to_vec() }
    }
}

pub(super) fn plugin(app: &mut App) {
    app.init_resource::<Bindings>();
}

impl Bindable {
    /// Its name in the settings file.
    pub fn id(self) -> String {
        let value = match self {
            Bindable::Action(action) => action.to_possible_value(),
            Bindable::Steer(steer) => steer.to_possible_value(),
        };
        value.map(|value| value.get_name().to_string()).unwrap_or_default()
    }

    /// Whether both need different keys. A key that steers may have an action as well, which it has when nothing is steered.
    fn competes(self, other: Bindable) -> bool {
        matches!(self, Bindable::Action(_)) == matches!(other, Bindable::Action(_))
    }
}

impl Press {
    /// Its name on the screen.
    pub fn name(self) -> &'static str {
        match self {
            Press::Key(key) => key_name(key),
            Press::Button(button) => button_name(button),
        }
    }
}

impl Bindings {
    /// Everything that has a key, in the order of the help.
    pub fn rows(&self) -> impl Iterator<Item = &Row> {
        self.rows.iter()
    }

    /// All actions in the order of the help: name, and the names of key and button, without those that steer.
    pub fn free_rows(
        &self,
        steering: Steering,
    ) -> impl Iterator<Item = (Action, &'static str, Option<&'static str>, Option<&'static str>)> {
        self.rows.iter().filter_map(move |row| {
            let Bindable::Action(action) = row.what else { return None };
            let free = |press: &Press| !self.steers(steering, *press);
            let key = Some(Press::Key(row.key)).filter(free).map(Press::name);
            let button = row.button.map(Press::Button).filter(free).map(Press::name);
            Some((action, row.name, key, button))
        })
    }

    /// Whether a key or button steers now.
    pub fn steers(&self, steering: Steering, press: Press) -> bool {
        let trigger = [GamepadButton::LeftTrigger2, GamepadButton::RightTrigger2].map(Press::Button).contains(&press);
        trigger && steering.on && !steering.by_camera
            || self.rows.iter().any(|row| match row.what {
                Bindable::Steer(steer) => steering.takes(steer) && row.has(press),
                Bindable::Action(_) => false,
            })
    }

    /// The row of an action or control.
    pub fn row(&self, what: Bindable) -> &Row {
        // every variant has a row, which a test checks
        self.rows.iter().find(|row| row.what == what).unwrap_or(&self.rows[0])
    }

    /// Name of the key of an action.
    pub fn key(&self, action: Action) -> &'static str {
        key_name(self.row(Bindable::Action(action)).key)
    }

    /// The key of a control that steers.
    pub fn steering_key(&self, steer: Steer) -> KeyCode {
        self.row(Bindable::Steer(steer)).key
    }

    /// The button of a control that steers.
    pub fn steering_button(&self, steer: Steer) -> Option<GamepadButton> {
        self.row(Bindable::Steer(steer)).button
    }

    /// The one that has a key or button, which `what` would take away.
    pub fn taken(&self, what: Bindable, press: Press) -> Option<Bindable> {
        let competing = self.rows.iter().filter(|row| row.what != what && row.what.competes(what));
        competing.filter(|row| row.has(press)).map(|row| row.what).next()
    }

    /// Binds a key or button. The one that had it gets the former one, so that nothing loses its key.
    pub fn bind(&mut self, what: Bindable, press: Press) {
        let old = *self.row(what);
        let taken = self.taken(what, press);
        for row in &mut self.rows {
            let swapped = taken == Some(row.what);
            match press {
                Press::Key(key) if row.what == what => row.key = key,
                Press::Key(_) if swapped => row.key = old.key,
                Press::Button(button) if row.what == what => row.button = Some(button),
                Press::Button(_) if swapped => row.button = old.button,
                _ => {}
            }
        }
    }
}

impl Row {
    fn has(&self, press: Press) -> bool {
        match press {
            Press::Key(key) => self.key == key,
            Press::Button(button) => self.button == Some(button),
        }
    }
}

/// Name of no button in the settings file.
const NONE: &str = "none";

/// The bindings in the settings file: names of keys and buttons.
#[derive(Default, Serialize, Deserialize)]
#[serde(default)]
struct Written {
    keys: BTreeMap<String, String>,
    pad: BTreeMap<String, String>,
}

impl Serialize for Bindings {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let keys = self.rows.iter().map(|row| (row.what.id(), key_name(row.key).into()));
        let pad = self.rows.iter().map(|row| (row.what.id(), row.button.map_or(NONE, button_name).into()));
        Written { keys: keys.collect(), pad: pad.collect() }.serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for Bindings {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let written = Written::deserialize(deserializer)?;
        let mut bindings = Bindings::default();
        for Row { what, .. } in DEFAULTS {
            if let Some(name) = written.keys.get(&what.id()) {
                let known = KEYS.iter().find(|(_, known)| known == name);
                let names = KEYS.map(|(_, name)| name);
                let (key, _) =
                    known.ok_or_else(|| D::Error::custom(format!("no key '{name}'{}", among(name, &names))))?;
                bindings.bind(what, Press::Key(*key));
            }
            match written.pad.get(&what.id()) {
                Some(name) if name == NONE => bindings.rows.iter_mut().for_each(|row| {
                    row.button = row.button.filter(|_| row.what != what);
                }),
                Some(name) => {
                    let known = BUTTON_NAMES.iter().find(|(_, known)| known == name);
                    let names = BUTTON_NAMES.map(|(_, name)| name);
                    let button =
                        known.ok_or_else(|| D::Error::custom(format!("no button '{name}'{}", among(name, &names))))?;
                    bindings.bind(what, Press::Button(button.0));
                }
                None => {}
            }
        }
        Ok(bindings)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_key_does_one_thing_and_has_a_name() {
        let bindings = Bindings::default();
        for row in bindings.rows() {
            for press in [Some(Press::Key(row.key)), row.button.map(Press::Button)].into_iter().flatten() {
                assert_eq!(bindings.taken(row.what, press), None, "{}", row.name);
                assert_ne!(press.name(), "?", "{}", row.name);
            }
        }
        let actions = Action::value_variants().iter().map(|action| Bindable::Action(*action));
        for what in actions.chain(Steer::value_variants().iter().map(|steer| Bindable::Steer(*steer))) {
            assert_eq!(bindings.row(what).what, what);
        }
    }

    #[test]
    fn a_key_that_is_taken_changes_places() -> Result<(), serde_json::Error> {
        let mut bindings = Bindings::default();
        let [push, jump] = [Bindable::Action(Action::Push), Bindable::Steer(Steer::Jump)];
        assert_eq!(bindings.taken(push, Press::Key(KeyCode::KeyB)), Some(Bindable::Action(Action::Throw)));
        bindings.bind(push, Press::Key(KeyCode::KeyB));
        assert_eq!((bindings.key(Action::Push), bindings.key(Action::Throw)), ("B", "P"));
        // a key that steers may have an action
        assert_eq!(bindings.taken(jump, Press::Key(KeyCode::KeyP)), None);
        bindings.bind(jump, Press::Key(KeyCode::KeyP));
        assert_eq!(bindings.key(Action::Throw), "P");
        bindings.bind(jump, Press::Button(GamepadButton::East));
        assert_eq!(bindings.steering_button(Steer::Flip), Some(GamepadButton::South));
        let text = serde_json::to_string(&bindings)?;
        assert_eq!(serde_json::from_str::<Bindings>(&text)?, bindings);
        let error = serde_json::from_str::<Bindings>(r#"{"keys": {"push": "Spaec"}}"#).expect_err("no such key");
        assert!(error.to_string().contains("did you mean 'Space'"), "{error}");
        Ok(())
    }
}
