//! What keys, mouse and gamepad do to the time, the camera and the stage.

use crate::app::args::Mode;
use crate::app::course::{builds, suits};
use crate::app::hud::Hud;
use crate::app::imitate::next_clip;
use crate::app::keys::{Deed, Do};
use crate::app::menu::Menu;
use crate::app::notes::Notes;
use crate::app::policies::shipped_agents;
use crate::app::show::{Actor, Focus, Show, Shown, Source, free_name};
use crate::app::steer::Steering;
use crate::look::FollowCamera;
use crate::ragdoll::RestartNow;
use bevy::input::gamepad::{Gamepad, GamepadAxis};
use bevy::input::mouse::{AccumulatedMouseMotion, AccumulatedMouseScroll};
use bevy::prelude::*;
use bevy::render::view::screenshot::{Screenshot, save_to_disk};
use bevy_egui::input::EguiWantsInput;

/// Speeds of time that the keys go through.
const SPEEDS: [f32; 8] = [0.1, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0];
/// Radians per pixel of the mouse, and per second of a stick.
const TURN: [f32; 2] = [0.005, 2.2];

/// Lets time pass as fast as asked for; a step is the time of one frame.
pub fn time(
    mut deeds: MessageReader<Do>,
    mut time: ResMut<Time<Virtual>>,
    mut notes: ResMut<Notes>,
    mut stepping: Local<bool>,
) {
    // a single step ends with the frame after it
    if *stepping {
        time.pause();
        *stepping = false;
    }
    for Do(deed) in deeds.read() {
        let now = SPEEDS.iter().position(|s| *s == time.relative_speed()).unwrap_or(3);
        match deed {
            Deed::Pause if time.is_paused() => time.unpause(),
            Deed::Pause => time.pause(),
            Deed::Step if time.is_paused() => {
                time.unpause();
                *stepping = true;
            }
            Deed::Faster | Deed::Slower => {
                let next = if *deed == Deed::Faster { (now + 1).min(SPEEDS.len() - 1) } else { now.saturating_sub(1) };
                time.set_relative_speed(SPEEDS[next]);
                notes.say(format!("time x{}", SPEEDS[next]));
            }
            _ => {}
        }
    }
}

/// Changes what is on stage and what is drawn about it.
#[expect(clippy::too_many_arguments, reason = "a system names what it uses")]
pub fn stage(
    mut deeds: MessageReader<Do>,
    mut show: ResMut<Show>,
    mut focus: ResMut<Focus>,
    mut shown: ResMut<Shown>,
    mut hud: ResMut<Hud>,
    mut menu: ResMut<Menu>,
    mut cameras: Query<&mut FollowCamera>,
    actors: Query<Entity, With<Actor>>,
    mut restarts: MessageWriter<RestartNow>,
    mut notes: ResMut<Notes>,
    mut exit: MessageWriter<AppExit>,
) {
    for Do(deed) in deeds.read() {
        match deed {
            Deed::Menu => menu.toggle(),
            Deed::Quit => {
                info!("bye");
                exit.write(AppExit::Success);
            }
            Deed::NextFocus => focus.0 = (focus.0 + 1) % actors.iter().count().max(1),
            Deed::Restart if show.mode != Mode::Learn => {
                restarts.write_batch(actors.iter().map(|ragdoll| RestartNow { ragdoll }));
            }
            Deed::NextAgent if show.mode == Mode::Imitate => next_clip(&mut show, &mut notes),
            Deed::NextAgent if !matches!(show.mode, Mode::Replay | Mode::Outside) => {
                let all = shipped_agents();
                let first = all.iter().position(|a| *a == show.agent).map_or(0, |i| i + 1);
                let able = |agent: &&String| show.mode != Mode::Course || suits(&show, agent);
                let Some(next) = all.iter().cycle().skip(first).take(all.len()).find(able) else { continue };
                show.agent.clone_from(next);
                show.model = None;
                if matches!(show.source, Source::File(_)) {
                    show.source = Source::Shipped;
                }
                show.again();
            }
            Deed::Camera => {
                for mut camera in &mut cameras {
                    let mode = camera.mode.next();
                    camera.set_mode(mode);
                    notes.say(format!("camera: {}", mode.name()));
                }
            }
            Deed::Contacts => shown.contacts = !shown.contacts,
            Deed::Joints => shown.joints = !shown.joints,
            Deed::Hud => hud.on = !hud.on,
            Deed::Help => hud.help = !hud.help,
            _ => {}
        }
    }
}

/// Turns the camera: right or middle mouse button, wheel, right stick; the left one, if nobody is steered with it.
#[expect(clippy::too_many_arguments, reason = "a system names what it uses")]
pub fn look(
    time: Res<Time<Real>>,
    buttons: Res<ButtonInput<MouseButton>>,
    motion: Res<AccumulatedMouseMotion>,
    scroll: Res<AccumulatedMouseScroll>,
    wants: Option<Res<EguiWantsInput>>,
    pads: Query<&Gamepad>,
    (show, steering): (Res<Show>, Res<Steering>),
    mut cameras: Query<&mut FollowCamera>,
) {
    let over_ui = wants.is_some_and(|w| w.wants_any_pointer_input());
    let (mut yaw, mut pitch, mut zoom) = (0.0, 0.0, 1.0_f32);
    if !over_ui && buttons.any_pressed([MouseButton::Right, MouseButton::Middle]) {
        yaw -= motion.delta.x * TURN[0];
        pitch += motion.delta.y * TURN[0];
    }
    if !over_ui && !builds(&show) {
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

/// Saves what the window shows.
pub fn picture(mut commands: Commands, mut deeds: MessageReader<Do>, mut notes: ResMut<Notes>) {
    for _ in deeds.read().filter(|d| d.0 == Deed::Picture) {
        let path = free_name("marathon", "png");
        commands.spawn(Screenshot::primary_window()).observe(save_to_disk(path.clone()));
        notes.say(format!("picture: {}", path.display()));
    }
}
