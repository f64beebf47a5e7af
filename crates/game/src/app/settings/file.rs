//! The settings file: one readable JSON file in the folder for the user's configurations.
//!
//! A file that cannot be read is renamed, so that the next save does not overwrite what the user has written.

use crate::app::notifications::Notifications;
use crate::app::settings::values::Settings;
use bevy::prelude::*;
use etcetera::BaseStrategy;
use marathon_physics::budget;
use marathon_physics::hint::{did_you_mean, nearest};
use serde_json::Value;
use std::path::{Path, PathBuf};

/// Seconds without a change before the settings are saved: a slider that is being dragged writes no files.
const QUIET: f32 = 0.5;

/// The file of the settings. Without this resource, nothing is saved.
#[derive(Resource, Clone, Debug)]
pub struct SettingsFile(pub PathBuf);

/// The settings of a file, and warnings about it.
#[derive(Debug, Default)]
pub struct Loaded {
    /// The settings.
    pub settings: Settings,
    /// Warnings, each in a sentence.
    pub notes: Vec<String>,
}

/// Warnings about the file, which the screen shows at the start.
#[derive(Resource, Default)]
pub struct FileNotes(pub Vec<String>);

pub(super) fn plugin(app: &mut App) {
    app.init_resource::<FileNotes>()
        .add_systems(Startup, report)
        .add_systems(Last, save.run_if(resource_exists::<SettingsFile>));
}

/// The default path of the file; `None` if the system has no folder for configurations.
pub fn default_path() -> Option<PathBuf> {
    let strategy = etcetera::base_strategy::choose_native_strategy().ok()?;
    Some(strategy.config_dir().join("marathon/settings.json"))
}

/// Reads a file. Without a file, all settings have their defaults. A bad file gets the ending `.bad`.
pub fn load(path: &Path) -> Loaded {
    if !path.exists() {
        return Loaded::default();
    }
    let text = budget::read_to_string(path, &budget::CONFIG_FILE).map_err(|error| error.to_string());
    match text.and_then(|text| read(&text)) {
        Ok((settings, unknown)) => {
            Loaded { settings, notes: unknown.into_iter().map(|name| format!("{}: {name}", path.display())).collect() }
        }
        Err(problem) => {
            let bad = path.with_extension("json.bad");
            let moved = match std::fs::rename(path, &bad) {
                Ok(()) => format!("the file is now {}", bad.display()),
                Err(error) => format!("it cannot be renamed to {}: {error}", bad.display()),
            };
            let note = format!("{}: {problem}; {moved}, and all settings have their defaults", path.display());
            Loaded { settings: Settings::default(), notes: vec![note] }
        }
    }
}

/// Reads the text of a file. Returns the settings, and a sentence about each name that is not a setting.
///
/// # Errors
/// The text names the place and the reason.
pub fn read(text: &str) -> Result<(Settings, Vec<String>), String> {
    let settings: Settings = serde_json::from_str(text).map_err(|error| error.to_string())?;
    settings.check().map_err(|error| error.to_string())?;
    let found: Value = serde_json::from_str(text).map_err(|error| error.to_string())?;
    let known = serde_json::to_value(&settings).map_err(|error| error.to_string())?;
    let mut unknown = Vec::new();
    unknown_names("", &found, &known, &mut unknown);
    Ok((settings, unknown))
}

/// Adds a sentence for each name in `found` that `known` does not have.
fn unknown_names(path: &str, found: &Value, known: &Value, unknown: &mut Vec<String>) {
    let (Value::Object(found), Value::Object(known)) = (found, known) else { return };
    for (name, value) in found {
        match known.get(name) {
            Some(inner) => unknown_names(&format!("{path}{name}."), value, inner, unknown),
            None => {
                let near = nearest(name, known.keys().map(String::as_str));
                unknown.push(format!("there is no setting {path}{name}{}", did_you_mean(near)));
            }
        }
    }
}

/// Writes the settings: first to another file, which then takes the place of the old one.
///
/// # Errors
/// If the file or its folder cannot be written.
pub fn write(path: &Path, settings: &Settings) -> Result<(), String> {
    let text = serde_json::to_string_pretty(settings).map_err(|error| error.to_string())?;
    let folder = path.parent().map_or(Ok(()), std::fs::create_dir_all);
    folder.map_err(|error| format!("{}: {error}", path.display()))?;
    marathon_learn::write_atomic(path, format!("{text}\n").as_bytes()).map_err(|error| error.to_string())
}

/// Shows the warnings about the file.
fn report(mut file_notes: ResMut<FileNotes>, mut notes: ResMut<Notifications>) {
    file_notes.0.drain(..).for_each(|note| notes.error(note));
}

/// Settings that are not saved yet.
#[derive(Default)]
struct Unsaved {
    /// The settings in the file, as far as the game knows.
    kept: Option<Settings>,
    /// Seconds since the last change.
    quiet: f32,
}

/// Saves the settings soon after a change, and when the game ends.
fn save(
    file: Res<SettingsFile>,
    settings: Res<Settings>,
    time: Res<Time<Real>>,
    mut exits: MessageReader<AppExit>,
    mut notes: ResMut<Notifications>,
    mut unsaved: Local<Unsaved>,
) {
    let ends = exits.read().count() > 0;
    if unsaved.kept.is_none() {
        unsaved.kept = Some(settings.clone());
    }
    if settings.is_changed() {
        unsaved.quiet = 0.0;
    }
    unsaved.quiet += time.delta_secs();
    if !ends && unsaved.quiet < QUIET || unsaved.kept.as_ref() == Some(&*settings) {
        return;
    }
    if let Err(error) = write(&file.0, &settings) {
        notes.error(format!("the settings cannot be saved: {error}"));
    }
    // a failure is reported once per change
    unsaved.kept = Some(settings.clone());
}
