//! Mouse, sticks and keys move the camera. A key saves a picture.

use crate::app::files::free_name;
use crate::app::input::actions::{Action, ActionPressed, Steering};
use crate::app::input::steering::turns;
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
use bevy_marathon::Anatomy;
use bevy_marathon::look::{CameraMode, FollowCamera};

/// Radians per pixel of the mouse, and per second of a stick.
const TURN: [f32; 2] = [0.005, 2.2];

/// The place of the camera that the user has chosen. Without one, it is behind characters that turn, and beside others.
#[derive(Resource)]
pub struct ChosenCamera(pub Option<CameraMode>);

pub(super) fn plugin(app: &mut App) {
    app.add_systems(Startup, spawn).add_systems(
        Update,
        (next_place.in_set(AppSet::Input), (choose_place, look, save_picture).in_set(AppSet::Present)),
    );
}

fn spawn(mut commands: Commands, chosen: Res<ChosenCamera>) {
    let mut camera = FollowCamera::default();
    camera.set_mode(chosen.0.unwrap_or_default());
    commands.spawn((camera, PrimaryEguiContext));
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
    let steered = anatomy.spec.as_ref().is_some_and(|spec| turns(&spec.command));
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
            notes.say(format!("camera: {}", mode.name()));
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
    (scenario, steering): (Res<Scenario>, Res<Steering>),
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
        let axis = |axis| pad.get(axis).filter(|x: &f32| x.abs() > 0.12).unwrap_or(0.0);
        yaw -= axis(GamepadAxis::RightStickX) * TURN[1] * time.delta_secs();
        pitch += axis(GamepadAxis::RightStickY) * TURN[1] * time.delta_secs();
        if !steering.on {
            zoom *= (-axis(GamepadAxis::LeftStickY) * time.delta_secs()).exp();
        }
    }
    if yaw == 0.0 && pitch == 0.0 && zoom == 1.0 {
        return;
    }
    for mut camera in &mut cameras {
        if yaw != 0.0 || pitch != 0.0 {
            camera.turn(yaw, pitch);
        }
        camera.zoom(zoom);
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
