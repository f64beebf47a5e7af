//! Settings that take effect: window, quality, volumes, camera, skin. Text and bars read theirs themselves.

use crate::app::error::GameError;
use crate::app::input::bindings::Bindings;
use crate::app::input::camera::CameraSettings;
use crate::app::mode::AppSet;
use crate::app::notifications::Notifications;
use crate::app::settings::values::{CameraSection, Display, Settings, SkinSetting, Volumes, WindowKind};
use crate::app::stage::skin::{SkinChoice, SkinFile};
use bevy::prelude::*;
use bevy::window::{MonitorSelection, PresentMode, PrimaryWindow, WindowMode};
use bevy_marathon::look::{ErrorPalette, Quality};

pub(super) fn plugin(app: &mut App) {
    app.init_resource::<Volumes>().init_resource::<AutomaticQuality>().add_systems(
        Update,
        (
            keep_bindings,
            (set_volumes, set_colors, set_display, set_skin, set_camera).run_if(resource_changed::<Settings>),
        )
            .chain()
            .in_set(AppSet::Present),
    );
}

/// The quality that fits the computer.
#[derive(Resource, Clone, Copy, Debug, Default)]
pub struct AutomaticQuality(pub Quality);

/// How frames wait for the screen.
pub fn present_mode(vsync: bool) -> PresentMode {
    if vsync { PresentMode::AutoVsync } else { PresentMode::AutoNoVsync }
}

/// How the window takes its place on the screen.
pub fn window_mode(kind: WindowKind) -> WindowMode {
    match kind {
        WindowKind::Windowed => WindowMode::Windowed,
        WindowKind::FullScreen => WindowMode::BorderlessFullscreen(MonitorSelection::Current),
    }
}

/// The settings keep the keys that the player binds.
fn keep_bindings(bindings: Res<Bindings>, mut settings: ResMut<Settings>) {
    if bindings.is_changed() && settings.bindings != *bindings {
        settings.bindings = bindings.clone();
    }
}

fn set_volumes(settings: Res<Settings>, mut volumes: ResMut<Volumes>) {
    volumes.set_if_neq(settings.sound);
}

/// The camera of a section.
pub fn camera(section: &CameraSection) -> CameraSettings {
    CameraSettings {
        field_of_view: section.field_of_view.to_radians(),
        sensitivity: section.sensitivity,
        invert_y: section.invert_y,
        reduced_motion: section.reduced_motion,
    }
}

/// Applies a change of the camera. The values of the start stay: the command line may have set them.
fn set_camera(settings: Res<Settings>, mut chosen: ResMut<CameraSettings>, mut before: Local<Option<CameraSection>>) {
    let last = before.replace(settings.camera);
    if last.is_some_and(|last| last != settings.camera) {
        *chosen = camera(&settings.camera);
    }
}

/// The skins of a setting.
///
/// # Errors
/// If its file cannot be worn.
pub fn skin(setting: &SkinSetting) -> Result<SkinChoice, GameError> {
    Ok(match setting {
        SkinSetting::Automatic => SkinChoice::Fitting,
        SkinSetting::Shapes => SkinChoice::Bare,
        SkinSetting::Generated => SkinChoice::Generated,
        SkinSetting::File(path) => SkinChoice::File(SkinFile::read(path, None)?),
    })
}

/// Applies a change of the skin. That of the start stays: the command line may have set it.
fn set_skin(
    settings: Res<Settings>,
    mut choice: ResMut<SkinChoice>,
    mut notes: ResMut<Notifications>,
    mut before: Local<Option<SkinSetting>>,
) {
    let last = before.replace(settings.skin.clone());
    if last.is_none_or(|last| last == settings.skin) {
        return;
    }
    match skin(&settings.skin) {
        Ok(chosen) => *choice = chosen,
        Err(error) => notes.error(error.to_string()),
    }
}

fn set_colors(settings: Res<Settings>, mut palette: ResMut<ErrorPalette>) {
    let safe = settings.interface.safe_colors;
    palette.set_if_neq(if safe { ErrorPalette::BlueToOrange } else { ErrorPalette::GreenToRed });
}

/// Applies changes of window and quality. The values of the start stay: the command line may have set them.
fn set_display(
    (settings, automatic): (Res<Settings>, Res<AutomaticQuality>),
    mut windows: Query<&mut Window, With<PrimaryWindow>>,
    mut quality: ResMut<Quality>,
    mut before: Local<Option<Display>>,
) {
    let now = settings.display;
    let last = before.replace(now).unwrap_or(now);
    if now.quality != last.quality {
        quality.set_if_neq(now.quality.quality().unwrap_or(automatic.0));
    }
    for mut window in &mut windows {
        if now.vsync != last.vsync {
            window.present_mode = present_mode(now.vsync);
        }
        if now.window != last.window {
            window.mode = window_mode(now.window);
        }
    }
}
