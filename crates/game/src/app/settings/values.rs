//! The values of the settings, their defaults and their ranges.

use crate::app::input::bindings::Bindings;
use crate::app::input::device::PadShapes;
use bevy::prelude::*;
use bevy_marathon::look::Quality;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::ops::RangeInclusive;

/// Ranges of the numbers.
pub const SCALE: RangeInclusive<f32> = 0.25..=1.0;
/// Vertical field of view, degrees.
pub const FIELD: RangeInclusive<f32> = 30.0..=100.0;
/// Volumes.
pub const VOLUME: RangeInclusive<f32> = 0.0..=1.0;
/// Factors of the turn of the camera.
pub const SENSITIVITY: RangeInclusive<f32> = 0.1..=5.0;
/// Factors of the size of text.
pub const TEXT_SIZE: RangeInclusive<f32> = 0.75..=2.0;

/// All settings. The settings file has the same names.
#[derive(Resource, Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Settings {
    /// Window and picture.
    pub display: Display,
    /// Volumes.
    pub sound: Volumes,
    /// Camera.
    pub camera: CameraSection,
    /// Text and bars.
    pub interface: Interface,
    /// The skin of the characters.
    pub skin: SkinSetting,
    /// Keys and buttons.
    pub bindings: Bindings,
}

/// Window and picture.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Display {
    /// How the window takes its place on the screen.
    pub window: WindowKind,
    /// Size of the picture relative to the window, per side, within [`SCALE`].
    pub resolution_scale: f32,
    /// How much a frame may cost.
    pub quality: QualityChoice,
    /// Frames wait for the screen.
    pub vsync: bool,
}

impl Default for Display {
    fn default() -> Self {
        Display { window: WindowKind::Windowed, resolution_scale: 1.0, quality: QualityChoice::Automatic, vsync: true }
    }
}

/// How the window takes its place on the screen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum WindowKind {
    /// A window with a frame.
    #[default]
    Windowed,
    /// All of the screen.
    FullScreen,
}

/// The quality that the player has chosen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum QualityChoice {
    /// Medium, or low if a processor draws.
    #[default]
    Automatic,
    /// [`Quality::Low`].
    Low,
    /// [`Quality::Medium`].
    Medium,
    /// [`Quality::High`].
    High,
}

impl QualityChoice {
    /// The quality, if the player has chosen one.
    pub fn quality(self) -> Option<Quality> {
        match self {
            QualityChoice::Automatic => None,
            QualityChoice::Low => Some(Quality::Low),
            QualityChoice::Medium => Some(Quality::Medium),
            QualityChoice::High => Some(Quality::High),
        }
    }
}

/// Volumes as factors of the amplitude, 0 to 1.
#[derive(Resource, Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Volumes {
    /// Factor of all sounds.
    pub master: f32,
    /// Factor of steps, impacts and the like.
    pub effects: f32,
}

impl Default for Volumes {
    fn default() -> Self {
        Volumes { master: 0.6, effects: 1.0 }
    }
}

/// How the camera moves.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct CameraSection {
    /// Vertical field of view, degrees, within [`FIELD`].
    pub field_of_view: f32,
    /// Factor of the turn by mouse and stick, within [`SENSITIVITY`].
    pub sensitivity: f32,
    /// A stick or mouse that moves up looks down.
    pub invert_y: bool,
    /// The camera moves only as far as it must.
    pub reduced_motion: bool,
}

impl Default for CameraSection {
    fn default() -> Self {
        CameraSection { field_of_view: 60.0, sensitivity: 1.0, invert_y: false, reduced_motion: false }
    }
}

/// Text and bars.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Interface {
    /// Factor of the size of text, within [`TEXT_SIZE`].
    pub text_size: f32,
    /// Colors that differ for people with color blindness, too.
    pub safe_colors: bool,
    /// How much text and bars show.
    pub detail: Detail,
    /// The screen says which control to use next.
    pub prompts: bool,
    /// Drawings of the buttons of a gamepad.
    pub pad_shapes: PadShapes,
}

impl Default for Interface {
    fn default() -> Self {
        Interface {
            text_size: 1.0,
            safe_colors: false,
            detail: Detail::Play,
            prompts: true,
            pad_shapes: PadShapes::Letters,
        }
    }
}

/// How much text and bars show.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Detail {
    /// Goal and speed.
    Play,
    /// The numbers of task, policy and reward, too, and a line of keys.
    #[default]
    Full,
    /// Nothing.
    Nothing,
}

/// The skin of the characters.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SkinSetting {
    /// The skin that comes with the character.
    #[default]
    Automatic,
    /// The shapes of the physics.
    Shapes,
    /// A skin that is generated from the shapes.
    Generated,
    /// A .glb file.
    File(std::path::PathBuf),
}

/// A number outside its range.
#[derive(Clone, Debug, PartialEq)]
pub struct OutOfRange {
    name: &'static str,
    found: f32,
    range: RangeInclusive<f32>,
}

impl fmt::Display for OutOfRange {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} is {}, expected a number from {} to {}",
            self.name,
            self.found,
            self.range.start(),
            self.range.end()
        )
    }
}

impl Settings {
    /// Checks the ranges of all numbers.
    ///
    /// # Errors
    /// Names the first number that is outside its range.
    pub fn check(&self) -> Result<(), OutOfRange> {
        let numbers = [
            ("display.resolution_scale", self.display.resolution_scale, SCALE),
            ("sound.master", self.sound.master, VOLUME),
            ("sound.effects", self.sound.effects, VOLUME),
            ("camera.field_of_view", self.camera.field_of_view, FIELD),
            ("camera.sensitivity", self.camera.sensitivity, SENSITIVITY),
            ("interface.text_size", self.interface.text_size, TEXT_SIZE),
        ];
        match numbers.into_iter().find(|(_, x, range)| !range.contains(x)) {
            Some((name, found, range)) => Err(OutOfRange { name, found, range }),
            None => Ok(()),
        }
    }
}
