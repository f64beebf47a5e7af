//! The keys and buttons of the actions: their defaults, how the user changes them, and the file that keeps them.

use crate::app::input::actions::{Action, ActionRequested, Steering};
use crate::app::input::key_names::{KEYS, button_name, key_name};
use bevy::input::InputSystems;
use bevy::input::gamepad::{Gamepad, GamepadButton};
use bevy::prelude::*;
use bevy_egui::input::EguiWantsInput;
use marathon_physics::budget;
use serde_json::{Map, Value};
use std::path::PathBuf;

/// An action, its name on the screen, its key and its button.
type Row = (Action, &'static str, KeyCode, Option<GamepadButton>);

const DEFAULTS: [Row; 31] = [
    (Action::Menu, "menu", KeyCode::Escape, Some(GamepadButton::Start)),
    (Action::Pause, "pause", KeyCode::Enter, Some(GamepadButton::Select)),
    (Action::Step, "one step", KeyCode::Period, None),
    (Action::Faster, "faster", KeyCode::ArrowUp, Some(GamepadButton::DPadUp)),
    (Action::Slower, "slower", KeyCode::ArrowDown, Some(GamepadButton::DPadDown)),
    (Action::Restart, "start anew", KeyCode::KeyX, Some(GamepadButton::West)),
    (Action::NextFocus, "next character", KeyCode::Tab, Some(GamepadButton::RightTrigger)),
    (Action::NextAgent, "next agent", KeyCode::KeyN, Some(GamepadButton::North)),
    (Action::Camera, "camera", KeyCode::KeyC, Some(GamepadButton::LeftTrigger)),
    (Action::Push, "push", KeyCode::KeyP, Some(GamepadButton::South)),
    (Action::Throw, "throw a ball", KeyCode::KeyB, Some(GamepadButton::East)),
    (Action::Limp, "limp", KeyCode::KeyZ, None),
    (Action::Film, "film of the last 10 s", KeyCode::F9, None),
    (Action::Contacts, "contacts", KeyCode::KeyF, None),
    (Action::Joints, "joints", KeyCode::KeyJ, None),
    (Action::Ghost, "ghost of the clip", KeyCode::KeyK, None),
    (Action::Errors, "errors in color", KeyCode::KeyE, None),
    (Action::Hud, "text and bars", KeyCode::KeyH, None),
    (Action::Help, "keys", KeyCode::F1, None),
    (Action::Learn, "learn live", KeyCode::KeyL, None),
    (Action::Save, "save policy", KeyCode::KeyS, None),
    (Action::Record, "record", KeyCode::KeyR, Some(GamepadButton::RightThumb)),
    (Action::Back, "back", KeyCode::ArrowLeft, Some(GamepadButton::DPadLeft)),
    (Action::Ahead, "ahead", KeyCode::ArrowRight, Some(GamepadButton::DPadRight)),
    (Action::Release, "let go", KeyCode::KeyG, Some(GamepadButton::LeftThumb)),
    (Action::Higher, "build higher", KeyCode::PageUp, None),
    (Action::Lower, "build lower", KeyCode::PageDown, None),
    (Action::Even, "build level", KeyCode::Home, None),
    (Action::Runs, "longest runs", KeyCode::KeyT, None),
    (Action::Picture, "picture", KeyCode::F12, None),
    (Action::Quit, "quit", KeyCode::KeyQ, None),
];

/// The keys and buttons of all actions.
#[derive(Resource, Clone, Debug, PartialEq)]
pub struct Bindings {
    rows: Vec<Row>,
}

impl Default for Bindings {
    fn default() -> Self {
        Bindings { rows: DEFAULTS.to_vec() }
    }
}

/// The action that the next pressed key is bound to.
#[derive(Resource, Default)]
pub struct Rebinding(pub Option<Action>);

pub(super) fn plugin(app: &mut App) {
    app.init_resource::<Bindings>()
        .init_resource::<Rebinding>()
        .add_systems(Startup, load)
        .add_systems(PreUpdate, (read, rebind).chain().after(InputSystems));
}

impl Bindings {
    /// All actions in the order of the help: name, key, button.
    pub fn rows(&self) -> impl Iterator<Item = (Action, &'static str, &'static str, Option<&'static str>)> {
        self.rows.iter().map(|(action, name, key, button)| (*action, *name, key_name(*key), button.map(button_name)))
    }

    /// Like [`Bindings::rows`], but without the names of keys and buttons that steer.
    pub fn free_rows(
        &self,
        steering: Steering,
    ) -> impl Iterator<Item = (Action, &'static str, Option<&'static str>, Option<&'static str>)> {
        self.rows.iter().map(move |(action, name, key, button)| {
            let key = Some(*key).filter(|key| !steering.takes_key(*key)).map(key_name);
            let button = button.filter(|button| !steering.takes_button(*button)).map(button_name);
            (*action, *name, key, button)
        })
    }

    /// Name of the key of an action.
    pub fn key(&self, action: Action) -> &'static str {
        self.rows.iter().find(|row| row.0 == action).map_or("", |row| key_name(row.2))
    }

    /// Binds a key. An action that had it gets the former key, so that every action has one.
    pub fn bind(&mut self, action: Action, key: KeyCode) {
        let Some(old) = self.rows.iter().find(|row| row.0 == action).map(|row| row.2) else { return };
        for row in &mut self.rows {
            if row.0 == action {
                row.2 = key;
            } else if row.2 == key {
                row.2 = old;
            }
        }
    }

    /// Path of the file, in the user's folder for configurations, if there is one.
    pub fn path() -> Option<PathBuf> {
        let own = std::env::var_os("XDG_CONFIG_HOME").map(PathBuf::from);
        let home = std::env::var_os("HOME").map(|home| PathBuf::from(home).join(".config"));
        let roaming = std::env::var_os("APPDATA").map(PathBuf::from);
        own.or(home).or(roaming).map(|folder| folder.join("marathon/keys.json"))
    }

    /// Reads the text of the file. Actions that it does not name have their default keys.
    pub fn load(text: &str) -> Self {
        let mut bindings = Bindings::default();
        let Ok(Value::Object(map)) = serde_json::from_str(text) else { return bindings };
        for (name, key) in &map {
            let action = DEFAULTS.iter().find(|row| row.1 == name).map(|row| row.0);
            let key = KEYS.iter().find(|(_, label)| Some(*label) == key.as_str()).map(|(key, _)| *key);
            if let (Some(action), Some(key)) = (action, key) {
                bindings.bind(action, key);
            }
        }
        bindings
    }

    /// The text of the file.
    pub fn text(&self) -> String {
        let map: Map<String, Value> = self.rows().map(|(_, name, key, _)| (name.into(), key.into())).collect();
        format!("{:#}\n", Value::Object(map))
    }
}

/// Turns keys and buttons into actions.
pub fn read(
    keys: Res<ButtonInput<KeyCode>>,
    pads: Query<&Gamepad>,
    bindings: Res<Bindings>,
    rebinding: Res<Rebinding>,
    wants: Option<Res<EguiWantsInput>>,
    steering: Option<Res<Steering>>,
    mut pressed: MessageWriter<ActionRequested>,
) {
    // a text field has the keyboard, or the next key is to be bound
    let typing = wants.is_some_and(|w| w.wants_keyboard_input()) || rebinding.0.is_some();
    let steering = steering.map_or_else(Steering::default, |steering| *steering);
    for (action, _, key, button) in &bindings.rows {
        let taken = typing || steering.takes_key(*key);
        let key = !taken && keys.just_pressed(*key);
        let own = button.filter(|button| !steering.takes_button(*button));
        let button = own.is_some_and(|button| pads.iter().any(|pad| pad.just_pressed(button)));
        if key || button {
            pressed.write(ActionRequested(*action));
        }
    }
}

/// Binds the next pressed key if a binding was requested, and saves the bindings. Esc cancels.
pub fn rebind(keys: Res<ButtonInput<KeyCode>>, mut bindings: ResMut<Bindings>, mut rebinding: ResMut<Rebinding>) {
    let Some(action) = rebinding.0 else { return };
    if keys.just_pressed(KeyCode::Escape) {
        rebinding.0 = None;
        return;
    }
    let Some(key) = keys.get_just_pressed().find(|key| KEYS.iter().any(|(known, _)| known == *key)) else { return };
    bindings.bind(action, *key);
    rebinding.0 = None;
    keep(&bindings);
}

/// Saves the bindings for later games.
pub fn keep(bindings: &Bindings) {
    if let Some(path) = Bindings::path() {
        let kept = path.parent().map_or(Ok(()), std::fs::create_dir_all).map_err(|e| e.to_string());
        let kept = kept.and_then(|()| {
            let text = bindings.text();
            marathon_learn::write_atomic(&path, text.as_bytes()).map_err(|e| e.to_string())
        });
        if let Err(error) = kept {
            warn!("the keys cannot be saved for later games: {error}");
        }
    }
}

/// Reads the bindings of earlier games.
fn load(mut bindings: ResMut<Bindings>) {
    let Some(path) = Bindings::path().filter(|path| path.exists()) else { return };
    match budget::read_to_string(&path, &budget::CONFIG_FILE) {
        Ok(text) => *bindings = Bindings::load(&text),
        Err(error) => warn!("{}: {error}; all keys have their defaults", path.display()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_key_does_one_thing_and_has_a_name() {
        let bindings = Bindings::default();
        let mut keys: Vec<_> = bindings.rows().map(|(_, _, key, _)| key).collect();
        assert!(!keys.contains(&"?") && bindings.rows().all(|(.., button)| button != Some("?")));
        keys.sort_unstable();
        keys.dedup();
        assert_eq!(keys.len(), DEFAULTS.len());
    }

    #[test]
    fn a_key_that_is_taken_changes_places() {
        let mut bindings = Bindings::default();
        bindings.bind(Action::Push, KeyCode::KeyB);
        assert_eq!((bindings.key(Action::Push), bindings.key(Action::Throw)), ("B", "P"));
        assert_eq!(Bindings::load(&bindings.text()), bindings);
        for broken in ["", "[1]", "{\"push\": 7}", "{\"push\": \"no such key\"}"] {
            assert_eq!(Bindings::load(broken), Bindings::default());
        }
    }
}
