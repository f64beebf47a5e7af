//! Settings that take effect: window, quality, volumes. Text and bars, and the camera, read theirs themselves.

use crate::app::input::bindings::Bindings;
use crate::app::mode::AppSet;
use crate::app::settings::values::{Display, Settings, Volumes, WindowKind};
use bevy::prelude::*;
use bevy::window::{MonitorSelection, PresentMode, PrimaryWindow, WindowMode};
use bevy_marathon::look::{ErrorPalette, Quality};

pub(super) fn plugin(app: &mut App) {
    app.init_resource::<Volumes>().init_resource::<AutomaticQuality>().add_systems(
        Update,
        (keep_bindings, (set_volumes, set_colors, set_display).run_if(resource_changed::<Settings>))
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
