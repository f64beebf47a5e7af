//! Mouse, sticks and keys move the camera. A key saves a picture.

use crate::app::files::free_name;
use crate::app::input::actions::{Action, ActionPressed, FAST_KEYS, FLY_KEYS, Steering};
use crate::app::mode::AppSet;
use crate::app::mode::Mode;
use crate::app::notifications::Notifications;
use crate::app::stage::actors::Actor;
use crate::app::stage::scenario::Scenario;
use bevy::input::gamepad::{Gamepad, GamepadAxis};
use bevy::input::mouse::{AccumulatedMouseMotion, AccumulatedMouseScroll};
use bevy::prelude::*;
use bevy::render::view::screenshot::{Screenshot, save_to_disk};
use bevy_egui::PrimaryEguiContext;
use bevy_egui::input::EguiWantsInput;
use bevy_marathon::look::{CameraMode, FollowCamera};
use bevy_marathon::{Anatomy, MoveDirection};

/// Where a free camera starts, m: at the default angles and distance from the first character.
const FREE_START: Vec3 = Vec3::new(-1.5, 2.0, 3.4);
/// Radians per pixel of the mouse, and per second of a stick.
const TURN: [f32; 2] = [0.005, 2.2];
/// Speed of a free camera, m/s, and with Shift.
const FLIGHT: [f32; 2] = [3.0, 12.0];
/// Deflection of a stick that counts as none.
const DEAD_ZONE: f32 = 0.12;

/// The player's settings of the camera.
#[derive(Resource, Clone, Copy, Debug, PartialEq)]
pub struct CameraSettings {
    /// Vertical field of view, rad.
    pub field_of_view: f32,
    /// Factor of the turns by mouse and stick.
    pub sensitivity: f32,
    /// Whether mouse or stick up looks down.
    pub invert_y: bool,
    /// Whether the camera moves only as the character and the player move it.
    pub reduced_motion: bool,
}

impl Default for CameraSettings {
    fn default() -> Self {
        let FollowCamera { field_of_view, reduced_motion, .. } = FollowCamera::default();
        CameraSettings { field_of_view, sensitivity: 1.0, invert_y: false, reduced_motion }
    }
}

/// The place of the camera that the user has chosen. Without one, it is behind characters that turn, and beside others.
#[derive(Resource)]
pub struct ChosenCamera(pub Option<CameraMode>);

pub(super) fn plugin(app: &mut App) {
    app.init_resource::<CameraSettings>()
        .add_systems(Startup, spawn)
        // the same frame shows the turn: the camera is placed after the fixed loop
        .add_systems(
            RunFixedMainLoop,
            (apply_settings, look, fly).chain().in_set(RunFixedMainLoopSystems::BeforeFixedMainLoop),
        )
        .add_systems(Update, (next_place.in_set(AppSet::Input), (choose_place, save_picture).in_set(AppSet::Present)));
}

fn spawn(mut commands: Commands, chosen: Res<ChosenCamera>) {
    let mut camera = FollowCamera::default();
    camera.set_mode(chosen.0.unwrap_or_default());
    let place = Transform::from_translation(FREE_START);
    commands.spawn((camera, place, PrimaryEguiContext));
}

/// Puts the camera behind or beside new characters, unless the user has chosen a place.
fn choose_place(
    chosen: Res<ChosenCamera>,
    scenario: Res<Scenario>,
    new: Query<(&Actor, &Anatomy), Added<Anatomy>>,
    mut cameras: Query<&mut FollowCamera>,
) {
    let first = new.iter().find(|(actor, _)| actor.0 == 0).filter(|_| chosen.0.is_none());
    let Some((_, anatomy)) = first else { return };
    let steered = anatomy.spec.as_ref().is_some_and(|spec| MoveDirection::moves(&spec.command));
    let behind = steered && matches!(scenario.mode, Mode::Watch | Mode::Push);
    let mode = if behind { CameraMode::Chase } else { CameraMode::Side };
    for mut camera in &mut cameras {
        camera.set_mode(mode);
    }
}

fn next_place(
    mut actions: MessageReader<ActionPressed>,
    mut cameras: Query<&mut FollowCamera>,
    mut chosen: ResMut<ChosenCamera>,
    mut notes: ResMut<Notifications>,
) {
    for _ in actions.read().filter(|action| action.0 == Action::Camera) {
        for mut camera in &mut cameras {
            let mode = camera.mode.next();
            camera.set_mode(mode);
            chosen.0 = Some(mode);
            let keys = if mode == CameraMode::Free { ": W A S D, E and Q fly, Shift is faster" } else { "" };
            notes.say(format!("camera: {}{keys}", mode.name()));
        }
    }
}

/// Gives the cameras the player's settings.
fn apply_settings(settings: Res<CameraSettings>, mut cameras: Query<&mut FollowCamera>) {
    for mut camera in &mut cameras {
        let wanted = (settings.field_of_view, settings.reduced_motion);
        if (camera.field_of_view, camera.reduced_motion) != wanted {
            (camera.field_of_view, camera.reduced_motion) = wanted;
        }
    }
}

/// Moves the camera: right or middle mouse button, wheel, right stick, and the left stick unless it steers.
#[expect(clippy::too_many_arguments, reason = "a system names what it uses")]
fn look(
    time: Res<Time<Real>>,
    buttons: Res<ButtonInput<MouseButton>>,
    motion: Res<AccumulatedMouseMotion>,
    scroll: Res<AccumulatedMouseScroll>,
    wants: Option<Res<EguiWantsInput>>,
    pads: Query<&Gamepad>,
    (scenario, steering, settings): (Res<Scenario>, Res<Steering>, Res<CameraSettings>),
    mut cameras: Query<&mut FollowCamera>,
) {
    let over_ui = wants.is_some_and(|w| w.wants_any_pointer_input());
    let (mut yaw, mut pitch, mut zoom) = (0.0, 0.0, 1.0_f32);
    if !over_ui && buttons.any_pressed([MouseButton::Right, MouseButton::Middle]) {
        yaw -= motion.delta.x * TURN[0];
        pitch += motion.delta.y * TURN[0];
    }
    if !over_ui && !scenario.is_built() {
        zoom *= 0.9_f32.powf(scroll.delta.y.clamp(-5.0, 5.0));
    }
    for pad in &pads {
        let axis = |axis| pad.get(axis).filter(|x: &f32| x.abs() > DEAD_ZONE).unwrap_or(0.0);
        yaw -= axis(GamepadAxis::RightStickX) * TURN[1] * time.delta_secs();
        pitch -= axis(GamepadAxis::RightStickY) * TURN[1] * time.delta_secs();
        if !steering.on {
            zoom *= (-axis(GamepadAxis::LeftStickY) * time.delta_secs()).exp();
        }
    }
    if yaw == 0.0 && pitch == 0.0 && zoom == 1.0 {
        return;
    }
    yaw *= settings.sensitivity;
    pitch *= if settings.invert_y { -settings.sensitivity } else { settings.sensitivity };
    for mut camera in &mut cameras {
        if yaw != 0.0 || pitch != 0.0 {
            camera.turn(yaw, pitch);
        }
        camera.zoom(zoom);
    }
}

/// Flies a free camera by its keys.
fn fly(
    time: Res<Time<Real>>,
    keys: Res<ButtonInput<KeyCode>>,
    wants: Option<Res<EguiWantsInput>>,
    mut cameras: Query<&mut FollowCamera>,
) {
    if wants.is_some_and(|wants| wants.wants_keyboard_input()) {
        return;
    }
    let [ahead, back, left, right, up, down] = FLY_KEYS.map(|key| f32::from(u8::from(keys.pressed(key))));
    let way = Vec3::new(right - left, up - down, back - ahead).normalize_or_zero();
    let speed = FLIGHT[usize::from(keys.any_pressed(FAST_KEYS))];
    for mut camera in cameras.iter_mut().filter(|camera| camera.mode == CameraMode::Free && way != Vec3::ZERO) {
        camera.fly(speed * time.delta_secs() * way);
    }
}

/// Saves a picture of the window.
fn save_picture(mut commands: Commands, mut actions: MessageReader<ActionPressed>, mut notes: ResMut<Notifications>) {
    for _ in actions.read().filter(|action| action.0 == Action::Picture) {
        let path = free_name("marathon", "png");
        commands.spawn(Screenshot::primary_window()).observe(save_to_disk(path.clone()));
        notes.say(format!("picture: {}", path.display()));
    }
}
