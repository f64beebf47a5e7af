//! Keys and buttons: what they do, what they are called, and how they are changed and kept.

use crate::app::ask::{self, Question};
use crate::app::menu::Menu;
use crate::app::steer::Steering;
use bevy::input::gamepad::{Gamepad, GamepadButton};
use bevy::prelude::*;
use bevy_egui::input::EguiWantsInput;
use clap::ValueEnum;
use marathon_physics::budget;
use serde_json::{Map, Value};
use std::path::PathBuf;

/// What a key can do.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, ValueEnum)]
pub enum Deed {
    /// Open or close the menu.
    Menu,
    /// Stop the time, or let it go on.
    Pause,
    /// One decision, while paused.
    Step,
    /// Let time pass faster.
    Faster,
    /// Let time pass slower.
    Slower,
    /// Start all characters anew.
    Restart,
    /// Look at the next character.
    NextFocus,
    /// Another agent.
    NextAgent,
    /// Another place of the camera.
    Camera,
    /// Push the character in focus.
    Push,
    /// Throw a ball at it.
    Throw,
    /// Contacts and forces.
    Contacts,
    /// Joints and limits.
    Joints,
    /// Ghost of the clip: inside the character, beside it, or off.
    Ghost,
    /// Color the character's parts by how far they are from the clip.
    Errors,
    /// Text and bars.
    Hud,
    /// Keys on the screen.
    Help,
    /// Begin to learn from random weights, or go back to watching.
    Learn,
    /// Save what has been learned.
    Save,
    /// Begin or end a recording.
    Record,
    /// Half a second back in a replay.
    Back,
    /// Half a second on in a replay.
    Ahead,
    /// Give the character that one has steered back to its own schedule.
    Release,
    /// Let the next meter of a course that one builds lead a step higher.
    Higher,
    /// A step lower.
    Lower,
    /// Level.
    Even,
    /// The longest runs.
    Runs,
    /// A picture of the screen.
    Picture,
    /// Leave.
    Quit,
}

/// A deed, its name on the screen, its key and its button.
type Row = (Deed, &'static str, KeyCode, Option<GamepadButton>);

const DEFAULTS: [Row; 29] = [
    (Deed::Menu, "menu", KeyCode::Escape, Some(GamepadButton::Start)),
    (Deed::Pause, "pause", KeyCode::Space, Some(GamepadButton::Select)),
    (Deed::Step, "one step", KeyCode::Period, None),
    (Deed::Faster, "faster", KeyCode::ArrowUp, Some(GamepadButton::DPadUp)),
    (Deed::Slower, "slower", KeyCode::ArrowDown, Some(GamepadButton::DPadDown)),
    (Deed::Restart, "start anew", KeyCode::KeyX, Some(GamepadButton::West)),
    (Deed::NextFocus, "next character", KeyCode::Tab, Some(GamepadButton::RightTrigger)),
    (Deed::NextAgent, "next agent", KeyCode::KeyN, Some(GamepadButton::North)),
    (Deed::Camera, "camera", KeyCode::KeyC, Some(GamepadButton::LeftTrigger)),
    (Deed::Push, "push", KeyCode::KeyP, Some(GamepadButton::South)),
    (Deed::Throw, "throw a ball", KeyCode::KeyB, Some(GamepadButton::East)),
    (Deed::Contacts, "contacts", KeyCode::KeyF, None),
    (Deed::Joints, "joints", KeyCode::KeyJ, None),
    (Deed::Ghost, "ghost of the clip", KeyCode::KeyK, None),
    (Deed::Errors, "errors in color", KeyCode::KeyE, None),
    (Deed::Hud, "text and bars", KeyCode::KeyH, None),
    (Deed::Help, "keys", KeyCode::F1, None),
    (Deed::Learn, "learn live", KeyCode::KeyL, None),
    (Deed::Save, "save policy", KeyCode::KeyS, None),
    (Deed::Record, "record", KeyCode::KeyR, Some(GamepadButton::RightThumb)),
    (Deed::Back, "back", KeyCode::ArrowLeft, Some(GamepadButton::DPadLeft)),
    (Deed::Ahead, "ahead", KeyCode::ArrowRight, Some(GamepadButton::DPadRight)),
    (Deed::Release, "let go", KeyCode::KeyG, Some(GamepadButton::LeftThumb)),
    (Deed::Higher, "build higher", KeyCode::PageUp, None),
    (Deed::Lower, "build lower", KeyCode::PageDown, None),
    (Deed::Even, "build level", KeyCode::Home, None),
    (Deed::Runs, "longest runs", KeyCode::KeyT, None),
    (Deed::Picture, "picture", KeyCode::F12, None),
    (Deed::Quit, "quit", KeyCode::KeyQ, None),
];

/// Keys that something can be bound to, with their names on the screen.
const KEYS: [(KeyCode, &str); 64] = [
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

/// Buttons of a gamepad, and what they are called.
const BUTTON_NAMES: [(GamepadButton, &str); 14] = [
    (GamepadButton::South, "A"),
    (GamepadButton::East, "B"),
    (GamepadButton::West, "X"),
    (GamepadButton::North, "Y"),
    (GamepadButton::Start, "Start"),
    (GamepadButton::Select, "Back"),
    (GamepadButton::LeftTrigger, "LB"),
    (GamepadButton::RightTrigger, "RB"),
    (GamepadButton::LeftThumb, "L3"),
    (GamepadButton::RightThumb, "R3"),
    (GamepadButton::DPadUp, "D-pad up"),
    (GamepadButton::DPadDown, "D-pad down"),
    (GamepadButton::DPadLeft, "D-pad left"),
    (GamepadButton::DPadRight, "D-pad right"),
];

/// Which key does what.
#[derive(Resource, Clone, Debug, PartialEq)]
pub struct Bindings {
    rows: Vec<Row>,
}

impl Default for Bindings {
    fn default() -> Self {
        Bindings { rows: DEFAULTS.to_vec() }
    }
}

/// The deed whose key is to be pressed next, to bind it.
#[derive(Resource, Default)]
pub struct Rebinding(pub Option<Deed>);

/// An action requested with a key or button. It becomes a [`Do`], after a [`Question`] if something would be lost.
#[derive(Message, Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pressed(pub Deed);

/// An action to run in this frame.
#[derive(Message, Clone, Copy, Debug, PartialEq, Eq)]
pub struct Do(pub Deed);

/// Turns keys and buttons into [`Do`] messages. If something would be lost, a question comes first.
#[derive(Clone, Copy, Debug, Default)]
pub struct KeysPlugin;

impl Plugin for KeysPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<Bindings>()
            .init_resource::<Rebinding>()
            .init_resource::<Question>()
            .add_message::<Pressed>()
            .add_message::<Do>()
            .add_systems(Startup, load)
            .add_systems(PreUpdate, (read, rebind, ask::gate).chain().after(bevy::input::InputSystems));
    }
}

impl Bindings {
    /// All deeds in the order of the help: name, key, button.
    pub fn rows(&self) -> impl Iterator<Item = (Deed, &'static str, &'static str, Option<&'static str>)> {
        self.rows.iter().map(|(deed, name, key, button)| (*deed, *name, key_name(*key), button.map(button_name)))
    }

    /// Like [`Bindings::rows`], but without the names of keys and buttons that steer.
    pub fn free_rows(
        &self,
        steering: Steering,
    ) -> impl Iterator<Item = (Deed, &'static str, Option<&'static str>, Option<&'static str>)> {
        self.rows.iter().map(move |(deed, name, key, button)| {
            let key = Some(*key).filter(|key| !steering.takes_key(*key)).map(key_name);
            let button = button.filter(|button| !steering.takes_button(*button)).map(button_name);
            (*deed, *name, key, button)
        })
    }

    /// Name of the key that does something.
    pub fn key(&self, deed: Deed) -> &'static str {
        self.rows.iter().find(|row| row.0 == deed).map_or("", |row| key_name(row.2))
    }

    /// Binds a key; a deed that had it before gets the old one, so that nothing is ever without a key.
    pub fn bind(&mut self, deed: Deed, key: KeyCode) {
        let Some(old) = self.rows.iter().find(|row| row.0 == deed).map(|row| row.2) else { return };
        for row in &mut self.rows {
            if row.0 == deed {
                row.2 = key;
            } else if row.2 == key {
                row.2 = old;
            }
        }
    }

    /// Where they are kept: in the user's folder for configurations, if there is one.
    pub fn path() -> Option<PathBuf> {
        let own = std::env::var_os("XDG_CONFIG_HOME").map(PathBuf::from);
        let home = std::env::var_os("HOME").map(|home| PathBuf::from(home).join(".config"));
        let roaming = std::env::var_os("APPDATA").map(PathBuf::from);
        own.or(home).or(roaming).map(|folder| folder.join("marathon/keys.json"))
    }

    /// The kept ones; what cannot be read is as by default.
    pub fn load(text: &str) -> Self {
        let mut bindings = Bindings::default();
        let Ok(Value::Object(map)) = serde_json::from_str(text) else { return bindings };
        for (name, key) in &map {
            let deed = DEFAULTS.iter().find(|row| row.1 == name).map(|row| row.0);
            let key = KEYS.iter().find(|(_, label)| Some(*label) == key.as_str()).map(|(key, _)| *key);
            if let (Some(deed), Some(key)) = (deed, key) {
                bindings.bind(deed, key);
            }
        }
        bindings
    }

    /// As text to keep.
    pub fn text(&self) -> String {
        let map: Map<String, Value> = self.rows().map(|(_, name, key, _)| (name.into(), key.into())).collect();
        format!("{:#}\n", Value::Object(map))
    }
}

pub(super) fn key_name(key: KeyCode) -> &'static str {
    KEYS.iter().find(|(known, _)| *known == key).map_or("?", |(_, name)| name)
}

pub(super) fn button_name(button: GamepadButton) -> &'static str {
    BUTTON_NAMES.iter().find(|(known, _)| *known == button).map_or("?", |(_, name)| name)
}

/// The key of a name, such as `Up` or `page-up`.
pub(super) fn key_named(name: &str) -> Option<KeyCode> {
    KEYS.iter().find(|(_, known)| is_called(known, name)).map(|(key, _)| *key)
}

/// The button of a gamepad of a name, such as `A` or `d-pad-up`.
pub(super) fn button_named(name: &str) -> Option<GamepadButton> {
    BUTTON_NAMES.iter().find(|(_, known)| is_called(known, name)).map(|(button, _)| *button)
}

/// Names of all keys, as a command line has them.
pub(super) fn key_names() -> impl Iterator<Item = String> {
    KEYS.iter().map(|(_, name)| on_a_command_line(name))
}

/// Names of the buttons of a gamepad, as a command line has them.
pub(super) fn button_names() -> impl Iterator<Item = String> {
    BUTTON_NAMES.iter().map(|(_, name)| on_a_command_line(name))
}

fn is_called(known: &str, name: &str) -> bool {
    on_a_command_line(known) == on_a_command_line(name)
}

/// A name without capitals and spaces.
fn on_a_command_line(name: &str) -> String {
    name.to_lowercase().replace(' ', "-")
}

/// Turns keys and buttons into deeds.
pub(super) fn read(
    keys: Res<ButtonInput<KeyCode>>,
    pads: Query<&Gamepad>,
    bindings: Res<Bindings>,
    rebinding: Res<Rebinding>,
    wants: Option<Res<EguiWantsInput>>,
    steering: Option<Res<Steering>>,
    mut pressed: MessageWriter<Pressed>,
) {
    // a text field has the keyboard, or the next key is to be bound
    let typing = wants.is_some_and(|w| w.wants_keyboard_input()) || rebinding.0.is_some();
    let steering = steering.map_or_else(Steering::default, |steering| *steering);
    for (deed, _, key, button) in &bindings.rows {
        let taken = typing || steering.takes_key(*key);
        let key = !taken && keys.just_pressed(*key);
        let own = button.filter(|button| !steering.takes_button(*button));
        let button = own.is_some_and(|button| pads.iter().any(|pad| pad.just_pressed(button)));
        if key || button {
            pressed.write(Pressed(*deed));
        }
    }
}

/// Binds the next pressed key if a binding was requested, and saves the bindings. Esc or closing the menu cancels.
fn rebind(
    keys: Res<ButtonInput<KeyCode>>,
    mut bindings: ResMut<Bindings>,
    mut rebinding: ResMut<Rebinding>,
    menu: Option<Res<Menu>>,
) {
    let Some(deed) = rebinding.0 else { return };
    if keys.just_pressed(KeyCode::Escape) || menu.is_some_and(|menu| !menu.open) {
        rebinding.0 = None;
        return;
    }
    let Some(key) = keys.get_just_pressed().find(|key| KEYS.iter().any(|(known, _)| known == *key)) else { return };
    bindings.bind(deed, *key);
    rebinding.0 = None;
    keep(&bindings);
}

/// Saves the bindings for later games.
pub(super) fn keep(bindings: &Bindings) {
    if let Some(path) = Bindings::path() {
        let kept = path.parent().map_or(Ok(()), std::fs::create_dir_all).map_err(|e| e.to_string());
        let kept = kept.and_then(|()| {
            let text = bindings.text();
            marathon_learn::write_atomic(&path, text.as_bytes()).map_err(|e| e.to_string())
        });
        if let Err(error) = kept {
            warn!("the keys hold for now, but cannot be kept: {error}");
        }
    }
}

/// Takes in the kept bindings.
fn load(mut bindings: ResMut<Bindings>) {
    let Some(path) = Bindings::path().filter(|path| path.exists()) else { return };
    match budget::read_to_string(&path, &budget::CONFIG_FILE) {
        Ok(text) => *bindings = Bindings::load(&text),
        Err(error) => warn!("{}: {error}; the keys are as they come", path.display()),
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
        bindings.bind(Deed::Push, KeyCode::KeyB);
        assert_eq!((bindings.key(Deed::Push), bindings.key(Deed::Throw)), ("B", "P"));
        assert_eq!(Bindings::load(&bindings.text()), bindings);
        for broken in ["", "[1]", "{\"push\": 7}", "{\"push\": \"no such key\"}"] {
            assert_eq!(Bindings::load(broken), Bindings::default());
        }
    }
}
